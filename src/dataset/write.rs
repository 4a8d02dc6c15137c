//! A recording → a bundle folder that reads back equal.

use super::channels::{FORCE, MARKERS, STAGE};
use super::manifest::{
    ContactWord, FORMAT, Manifest, MarkerKeys, NoiseKeys, PhantomKeys, ShapeWord, TipKeys,
};
use super::pokes::POKES;
use super::{DatasetError, write_msh};
use crate::observation::{Contact, Recording, TipShape};
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Writes `recording` into `folder`, which is made when it does not exist; files of a bundle in it are
/// overwritten.
///
/// Every number is the shortest that reads back to the same value, so that [`read_bundle`](super::read_bundle)
/// gives an equal recording when this one is fit to be read.
///
/// # Errors
/// [`DatasetError::Write`] with the file.
pub fn write_bundle(recording: &Recording, folder: &Path) -> Result<(), DatasetError> {
    std::fs::create_dir_all(folder)
        .map_err(|source| DatasetError::Write { file: folder.to_owned(), source })?;
    let write = |name: &str, content: &dyn Fn(&mut BufWriter<File>) -> io::Result<()>| {
        let file = folder.join(name);
        let wrote = File::create(&file).and_then(|f| {
            let mut to = BufWriter::new(f);
            content(&mut to)?;
            to.flush()
        });
        wrote.map_err(|source| DatasetError::Write { file, source })
    };
    write("recording.toml", &|to| {
        let text = toml::to_string(&manifest(recording)).map_err(io::Error::other)?;
        to.write_all(text.as_bytes())
    })?;
    write("mesh.msh", &|to| write_msh(&recording.mesh, to))?;
    write("pokes.csv", &|to| write_pokes(recording, to))?;
    write("force.csv", &|to| write_wrench(recording, to))?;
    write("markers.csv", &|to| write_markers(recording, to))?;
    if recording.stage.is_some() {
        write("stage.csv", &|to| write_stage(recording, to))?;
    } else {
        remove_stale(&folder.join("stage.csv"))?;
    }
    Ok(())
}

/// An old `stage.csv` would be read as part of the new bundle.
fn remove_stale(file: &Path) -> Result<(), DatasetError> {
    match std::fs::remove_file(file) {
        Err(source) if source.kind() != io::ErrorKind::NotFound => {
            Err(DatasetError::Write { file: file.to_owned(), source })
        }
        _ => Ok(()),
    }
}

fn manifest(recording: &Recording) -> Manifest {
    let Recording { phantom, tip, noise, .. } = recording;
    Manifest {
        format: FORMAT.to_owned(),
        name: recording.name.clone(),
        rest_until_s: recording.rest_until_s,
        phantom: PhantomKeys {
            poisson_ratio: phantom.poisson_ratio,
            density_kg_m3: phantom.density_kg_m3,
            modulus_range_pa: phantom.modulus_range_pa,
            gravity_m_s2: phantom.gravity.map(|g| g.acceleration_m_s2.into()),
            gravity_at_rest: phantom.gravity.map(|g| g.at_rest),
        },
        tip: TipKeys {
            contact: match tip.contact {
                Contact::Bonded => ContactWord::Bonded,
                Contact::Unilateral => ContactWord::Unilateral,
            },
            shape: match tip.shape {
                TipShape::Pad => ShapeWord::Pad,
                TipShape::Flat => ShapeWord::Flat,
                TipShape::Sphere { .. } => ShapeWord::Sphere,
            },
            sphere_radius_m: match tip.shape {
                TipShape::Sphere { radius_m } => Some(radius_m),
                TipShape::Pad | TipShape::Flat => None,
            },
        },
        noise: NoiseKeys {
            force_n: noise.force_n,
            torque_nm: noise.torque_nm,
            marker_m: noise.marker_m,
            stage_m: noise.stage_m,
        },
        markers: Some(MarkerKeys { max_standoff_m: Some(recording.max_standoff_m) }),
    }
}

fn write_pokes(recording: &Recording, to: &mut impl Write) -> io::Result<()> {
    writeln!(to, "{}", POKES.join(","))?;
    for p in &recording.pokes {
        let (s, d) = (p.site, p.direction);
        write!(to, "{},{:?},{:?},{:?},{:?},{:?},{:?}", p.number, s.x, s.y, s.z, d.x, d.y, d.z)?;
        writeln!(to, ",{:?},{:?},{:?}", p.radius_m, p.start_s, p.end_s)?;
    }
    Ok(())
}

fn write_stage(recording: &Recording, to: &mut impl Write) -> io::Result<()> {
    writeln!(to, "{}", STAGE.join(","))?;
    let Some(stage) = &recording.stage else { return Ok(()) };
    for (t, [x, y, z]) in stage.time_s.iter().zip(&stage.displacement_m) {
        writeln!(to, "{t:?},{x:?},{y:?},{z:?}")?;
    }
    Ok(())
}

fn write_wrench(recording: &Recording, to: &mut impl Write) -> io::Result<()> {
    writeln!(to, "{}", FORCE.join(","))?;
    let wrench = &recording.wrench;
    for ((t, [x, y, z]), [mx, my, mz]) in wrench.time_s.iter().zip(&wrench.force_n).zip(&wrench.torque_nm) {
        writeln!(to, "{t:?},{x:?},{y:?},{z:?},{mx:?},{my:?},{mz:?}")?;
    }
    Ok(())
}

fn write_markers(recording: &Recording, to: &mut impl Write) -> io::Result<()> {
    writeln!(to, "{}", MARKERS.join(","))?;
    let markers = &recording.markers;
    for row in &markers.rows {
        let t = markers.frame_time_s[row.frame as usize];
        let number = markers.numbers[row.marker as usize];
        let [x, y, z] = row.position_m;
        writeln!(to, "{t:?},{number},{x:?},{y:?},{z:?}")?;
    }
    Ok(())
}
