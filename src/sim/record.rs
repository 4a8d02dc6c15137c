//! A draw turned into the recording that its bench session would leave.

use super::SimError;
use super::bench::{finite_paths, linear_paths};
use super::draw::{Draw, Kinematics};
use super::fit_mesh::fit_mesh;
use super::instruments::{marker_sites, markers, stage, wrench};
use super::resolution::{RemainderResolution, Resolution};
use super::timeline::Timeline;
use crate::geometry::Vec3;
use crate::observation::{Contact, Phantom, Poke, Recording, Tip, TipShape};

/// Density of a water-based gel (kg/m³). The bench has no weight: the mesh is the shape under it.
pub(super) const DENSITY_KG_M3: f64 = 1050.0;
/// Markers are accepted up to this distance from the surface (m).
pub(super) const MAX_STANDOFF_M: f64 = 0.010;

/// Runs the session on the bench.
pub fn record(draw: &Draw) -> Result<Recording, SimError> {
    let timeline = Timeline::new(&draw.pokes, draw.instruments.pause_s)?;
    let sites = marker_sites(draw);
    let paths = match draw.kinematics {
        Kinematics::SmallStrain => linear_paths(draw, &sites, &RemainderResolution::SMALL_STRAIN)?,
        Kinematics::FiniteStrain => finite_paths(draw, &sites, &Resolution::FINITE_STRAIN)?,
    };
    let pokes = (1..).zip(&timeline.pokes).map(|(number, scheduled)| Poke {
        number,
        site: Vec3::from(scheduled.plan.site_m),
        direction: Vec3::from(scheduled.plan.direction),
        radius_m: scheduled.plan.radius_m,
        start_s: scheduled.start_s,
        end_s: scheduled.end_s,
    });
    Ok(Recording {
        name: draw.name.clone(),
        rest_until_s: timeline.rest_until_s,
        phantom: Phantom {
            poisson_ratio: draw.poisson_ratio,
            density_kg_m3: DENSITY_KG_M3,
            modulus_range_pa: draw.modulus_range_pa,
            gravity: None,
        },
        tip: Tip { contact: Contact::Bonded, shape: TipShape::Pad },
        noise: draw.instruments.noise,
        max_standoff_m: MAX_STANDOFF_M,
        mesh: fit_mesh(&draw.slab, draw.fit_cell_m, draw.seed)?,
        pokes: pokes.collect(),
        stage: Some(stage(draw.seed, &draw.instruments, &timeline)),
        wrench: wrench(draw, &timeline, &paths),
        markers: markers(draw, &timeline, &paths, &sites),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::draw;
    use crate::sim::draw::PokePlan;

    /// One session, looked at from all sides.
    #[test]
    fn a_recording_holds_what_the_bundle_format_says() {
        let draw = draw(11);
        let recording = record(&draw).expect("a recording");
        assert_eq!(recording, record(&draw).expect("the same recording"), "equal draws, equal bits");
        assert_ne!(recording, record(&Draw { seed: 12, ..draw.clone() }).expect("other noise"));

        let stage = recording.stage.as_ref().expect("a stage");
        assert_eq!(stage.time_s, recording.wrench.time_s);
        let touching = |t: f64| recording.pokes.iter().find(|p| p.start_s <= t && t <= p.end_s);
        let (mut free, mut count) = (0.0, 0.0);
        for (i, &t) in stage.time_s.iter().enumerate() {
            let (u, f) = (Vec3::from(stage.displacement_m[i]), Vec3::from(recording.wrench.force_n[i]));
            match touching(t) {
                None => {
                    assert!(u.amax() < 6e-5, "stage at rest: {u}");
                    free += f.norm_squared() / 3.0;
                    count += 1.0;
                }
                Some(poke) if u.dot(&poke.direction) > 1e-3 => {
                    assert!(f.dot(&poke.direction) > 0.0, "the tip presses on the phantom");
                }
                Some(_) => {}
            }
        }
        let noise = f64::sqrt(free / count);
        assert!((noise / 6e-3 - 1.0).abs() < 6.0 / f64::sqrt(6.0 * count), "force noise {noise} N");

        let rest = recording.rest_positions();
        assert!(rest.iter().all(|(p, n)| *n > 5 && (p.z - draw.slab.size_m[2]).abs() < 3e-4));
        let rows = recording.markers.rows.len() as f64;
        let all = (recording.markers.frame_time_s.len() * recording.markers.numbers.len()) as f64;
        assert!((0.9..0.995).contains(&(rows / all)), "{rows} of {all} marker rows");
    }

    /// With no noise, force over depth is one stiffness for all pokes at a site, whatever depth and rate.
    #[test]
    fn small_strain_is_linear_in_the_depth() {
        let mut draw = draw(4);
        let poke = draw.pokes[0];
        draw.pokes =
            vec![poke, PokePlan { depth_m: 0.5 * poke.depth_m, rate_m_s: 2.0 * poke.rate_m_s, ..poke }];
        draw.instruments.noise.force_n = [0.0; 3];
        let recording = record(&draw).expect("a recording");
        let deepest = |number: usize| {
            let p = &recording.pokes[number];
            let middle = 0.5 * (p.start_s + p.end_s);
            let row = recording.wrench.time_s.partition_point(|&t| t < middle);
            Vec3::from(recording.wrench.force_n[row])
        };
        assert!((deepest(0) - 2.0 * deepest(1)).norm() < 3e-5);
        assert!(deepest(0).norm() > 0.1);
    }
}
