//! Everything of one or several sessions put together into a recording.

use super::contacts::{Contact, Placed, Stroke};
use super::part::{Part, read_part};
use crate::calib::Lag;
use crate::clock::HostTime;
use crate::dataset::DatasetError;
use crate::dataset::seen::Attached;
use crate::device::MarkerPosition;
use crate::geometry::Vec3;
use crate::mesh::TetMesh;
use crate::observation::{
    Contact as Touch, MarkerRow, Markers, Noise, Phantom, Poke, Recording, Stage, Tip, TipShape, Wrench,
};
use crate::session::{Session, StartDocument, utc_seconds};
use std::collections::BTreeMap;

/// A marker this far from the surface is refused (m).
const MAX_STANDOFF_M: f64 = 0.01;
/// Digits after the decimal point of rows: 0.1 µm, 1 µN, 0.01 µN·m.
const DIGITS: [i32; 3] = [7, 6, 8];
/// The least noise that is stated, where an instrument shows none (m, N, N·m).
const LEAST: [f64; 3] = [1e-6, 1e-5, 1e-7];

/// A recording, and what of the sessions is not in it.
#[derive(Debug)]
pub struct FromSession {
    /// The recording.
    pub recording: Recording,
    /// When its time is zero.
    pub zero: HostTime,
    /// By how much the pictures of each stretch came later than what they show, which is taken off; none where nothing is known of it.
    pub camera_lags: Vec<Option<Lag>>,
    /// Which calibration of the instruments was used, and what it did; empty where there is none.
    pub calibration: Vec<String>,
    /// What was left out or is doubtful, for people.
    pub remarks: Vec<String>,
}

/// Turns a session, and others that went on with it on the same rig, in order, into one recording on a mesh, which is that of their phantom.
///
/// Time zero is the first zero of the force sensor. Each time that the devices were started the zero was taken anew: what follows is
/// less that. Noise is that of the rest before the first poke.
///
/// # Errors
/// [`DatasetError`]: a session cannot be read, is of another rig than the first, or goes back in time; together they say too little: no
/// mounting, no zero of the force, no poke that was finished.
pub fn read_sessions(sessions: &[Session], mesh: TetMesh) -> Result<FromSession, DatasetError> {
    let unseen: Vec<(Session, Option<Attached>)> = sessions.iter().map(|s| (s.clone(), None)).collect();
    read_seen_sessions(&unseen, mesh)
}

/// As [`read_sessions`], but with the markers that the pictures of a session show in place of those that were recorded, where they are given.
///
/// # Errors
/// As [`read_sessions`].
pub fn read_seen_sessions(
    sessions: &[(Session, Option<Attached>)],
    mesh: TetMesh,
) -> Result<FromSession, DatasetError> {
    let (first, _) = sessions.first().ok_or(DatasetError::NoSessions)?;
    let start = first.start();
    let mut remarks = Vec::new();
    let mut whole = Whole::default();
    let mut camera_lags = Vec::new();
    let mut zero: Option<(StartDocument, Part)> = None;
    for (session, attached) in sessions {
        if session.start().rig.sha256 != start.rig.sha256 {
            return Err(DatasetError::OtherRig {
                session: session.folder().to_owned(),
                first: first.folder().to_owned(),
            });
        }
        let (mut unfinished, before) = (Vec::new(), whole.touched.len());
        for (segment, file) in session.parts().into_iter().enumerate() {
            // A stretch without pictures that could be read has no markers.
            let seen = attached.as_ref().map(|a| a.segments.get(segment).map_or(&[][..], Vec::as_slice));
            let Some(part) = read_part(&file, seen, &mut unfinished, &mut remarks)? else { continue };
            let offset_s = match &zero {
                None => 0.0,
                Some((began, origin)) => since(began, origin, file.start(), &part)
                    .filter(|&s| s > whole.end_s())
                    .ok_or_else(|| DatasetError::SessionBack { session: session.folder().to_owned() })?,
            };
            if zero.as_ref().is_some_and(|(began, _)| began.calibration != file.start().calibration) {
                remarks.push(format!(
                    "{}: another calibration set than at the beginning; each stretch is put right by its own",
                    session.folder().display()
                ));
            }
            if let Some(doubt) = part.calibrated.doubt.as_ref().filter(|doubt| !remarks.contains(doubt)) {
                remarks.push(doubt.clone());
            }
            whole.take(&part, offset_s);
            camera_lags.push(part.lag);
            zero.get_or_insert_with(|| (file.start().clone(), part));
        }
        // One that was made again when the session went on is not missed.
        unfinished.retain(|&poke| whole.touched[before..].iter().all(|(stroke, _)| stroke.poke != poke));
        unfinished.sort_unstable();
        unfinished.dedup();
        remarks.extend(unfinished.iter().map(|poke| format!("poke {poke} was not finished; it is left out")));
    }
    let Some((_, rested)) = zero else {
        let session = first.folder().to_owned();
        return Err(DatasetError::SessionWithout { session, what: "a poke that was finished" });
    };
    let wrench = wrench(&whole.wrench);
    let markers = markers(&whole.frames);
    let noise = noise(&wrench, &markers, &rested, start);
    let pokes = (1..).zip(&whole.touched).map(|(number, (stroke, contact))| Poke {
        number,
        site: stroke.site,
        direction: stroke.direction,
        radius_m: stroke.radius_m,
        start_s: contact.start_s,
        end_s: contact.end_s,
    });
    let recording = Recording {
        name: start.name.clone(),
        rest_until_s: rested.rest_until_s,
        phantom: Phantom {
            poisson_ratio: start.phantom.poisson_ratio,
            density_kg_m3: start.phantom.density_kg_m3,
            modulus_range_pa: start.phantom.modulus_range_pa,
            gravity: None,
        },
        tip: tip(start),
        noise,
        max_standoff_m: MAX_STANDOFF_M,
        mesh,
        pokes: pokes.collect(),
        stage: Some(stage(&whole.path, &whole.touched)),
        wrench,
        markers,
    };
    let calibration = rested.calibrated.words;
    Ok(FromSession { recording, zero: rested.origin, camera_lags, calibration, remarks })
}

/// From the zero of one stretch to that of another (s). Monotonic clocks of one boot are the same; otherwise the wall clock has to do.
fn since(began: &StartDocument, first: &Part, then: &StartDocument, part: &Part) -> Option<f64> {
    if began.boot == then.boot && !began.boot.is_empty() {
        return Some(part.origin.seconds_after(first.origin));
    }
    let wall = utc_seconds(&then.started_utc)? - utc_seconds(&began.started_utc)?;
    let after_start =
        |document: &StartDocument, part: &Part| part.origin.nanos() as f64 - document.started_host_ns as f64;
    Some(wall + 1e-9 * (after_start(then, part) - after_start(began, first)))
}

/// All stretches on one clock.
#[derive(Default)]
struct Whole {
    touched: Vec<(Stroke, Contact)>,
    path: Vec<Placed>,
    wrench: Vec<(f64, [f64; 6])>,
    frames: Vec<(f64, Vec<MarkerPosition>)>,
}

impl Whole {
    fn take(&mut self, part: &Part, offset_s: f64) {
        self.touched.extend(part.touched.iter().map(|(stroke, contact)| {
            let rows = contact.rows.iter().map(|&(t, moved)| (t + offset_s, moved)).collect();
            let (start_s, end_s) = (contact.start_s + offset_s, contact.end_s + offset_s);
            (stroke.clone(), Contact { start_s, end_s, rows })
        }));
        // Before the zero was taken, nothing is known of the force.
        let known = part.path.iter().filter(|p| p.0 >= 0.0);
        self.path.extend(known.map(|&(t, at)| (t + offset_s, at)));
        self.wrench.extend(part.wrench.iter().map(|&(t, value)| (t + offset_s, value)));
        self.frames.extend(part.frames.iter().map(|(t, seen)| (t + offset_s, seen.clone())));
    }

    /// When the last of it was (s).
    fn end_s(&self) -> f64 {
        let last =
            [self.path.last().map(|p| p.0), self.wrench.last().map(|w| w.0), self.frames.last().map(|f| f.0)];
        last.into_iter().flatten().fold(0.0, f64::max)
    }
}

fn tip(start: &StartDocument) -> Tip {
    let contact = if start.tip.contact == "unilateral" { Touch::Unilateral } else { Touch::Bonded };
    let shape = match (start.tip.shape.as_str(), start.tip.sphere_radius_m) {
        ("sphere", Some(radius_m)) => TipShape::Sphere { radius_m },
        ("flat", _) => TipShape::Flat,
        _ => TipShape::Pad,
    };
    Tip { contact, shape }
}

fn rounded(value: f64, digits: i32) -> f64 {
    let scale = 10_f64.powi(digits);
    (value * scale).round() / scale + 0.0
}

fn wrench(rows: &[(f64, [f64; 6])]) -> Wrench {
    let mut wrench = Wrench::default();
    for (time_s, value) in rows {
        wrench.time_s.push(rounded(*time_s, DIGITS[0]));
        wrench.force_n.push(std::array::from_fn(|c| rounded(value[c], DIGITS[1])));
        wrench.torque_nm.push(std::array::from_fn(|c| rounded(value[3 + c], DIGITS[2])));
    }
    wrench
}

/// The displacement from the site in contacts, zero between them.
fn stage(path: &[Placed], touched: &[(Stroke, Contact)]) -> Stage {
    let mut rows: Vec<(f64, Vec3)> = Vec::with_capacity(path.len() + 2 * touched.len());
    let outside = |t: f64| touched.iter().all(|(_, c)| t < c.start_s || t > c.end_s);
    rows.extend(path.iter().filter(|p| outside(p.0)).map(|p| (p.0, Vec3::zeros())));
    rows.extend(touched.iter().flat_map(|(_, c)| c.rows.iter().copied()));
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut stage = Stage::default();
    for (time_s, moved) in rows {
        stage.time_s.push(time_s);
        stage.displacement_m.push(std::array::from_fn(|c| rounded(moved[c], DIGITS[0])));
    }
    stage
}

fn markers(frames: &[(f64, Vec<MarkerPosition>)]) -> Markers {
    let seen = frames.iter().flat_map(|(_, seen)| seen.iter().map(|m| (m.marker, 0)));
    let mut numbers: BTreeMap<u32, u32> = seen.collect();
    for (index, value) in (0..).zip(numbers.values_mut()) {
        *value = index;
    }
    let mut rows = Vec::new();
    for (frame, (_, seen)) in (0..).zip(frames) {
        rows.extend(seen.iter().map(|m| MarkerRow {
            frame,
            marker: numbers[&m.marker],
            position_m: m.position_m.map(|x| rounded(x, DIGITS[0])),
        }));
    }
    let frame_time_s = frames.iter().map(|f| f.0).collect();
    Markers { numbers: numbers.into_keys().collect(), frame_time_s, rows }
}

/// What the instruments did while nothing touched the phantom.
fn noise(wrench: &Wrench, markers: &Markers, rested: &Part, start: &StartDocument) -> Noise {
    let rest_until_s = rested.rest_until_s;
    let rest = wrench.time_s.partition_point(|&t| t < rest_until_s);
    let spread = |rows: &[[f64; 3]], c: usize, least: f64| {
        let n = rows.len() as f64;
        let mean = rows.iter().map(|r| r[c]).sum::<f64>() / n.max(1.0);
        let sum: f64 = rows.iter().map(|r| (r[c] - mean).powi(2)).sum();
        (sum / (n - 1.0).max(1.0)).sqrt().max(least)
    };
    // Of all markers together: squares about each marker's own mean.
    let mut by_marker: BTreeMap<u32, Vec<[f64; 3]>> = BTreeMap::new();
    for row in &markers.rows {
        if markers.frame_time_s[row.frame as usize] < rest_until_s {
            by_marker.entry(row.marker).or_default().push(row.position_m);
        }
    }
    let pooled = |c: usize| {
        let (mut squares, mut freedom) = (0.0, 0.0);
        for rows in by_marker.values().filter(|rows| rows.len() > 1) {
            let n = rows.len() as f64;
            squares += spread(rows, c, 0.0).powi(2) * (n - 1.0);
            freedom += n - 1.0;
        }
        (squares / f64::max(freedom, 1.0)).sqrt().max(LEAST[0])
    };
    let step = start.stage.as_ref().map_or(0.0, |s| s.step_m.into_iter().fold(0.0, f64::max));
    Noise {
        force_n: std::array::from_fn(|c| spread(&wrench.force_n[..rest], c, LEAST[1])),
        torque_nm: std::array::from_fn(|c| spread(&wrench.torque_nm[..rest], c, LEAST[2])),
        marker_m: std::array::from_fn(pooled),
        // A step's rounding is uniform.
        stage_m: [(step / 12_f64.sqrt()).hypot(rested.calibrated.place_sd_m).max(LEAST[0]); 3],
    }
}
