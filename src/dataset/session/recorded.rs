//! Everything of a session put together into a recording.

use super::contacts::{Contact, Placed, Stroke, contact, placed, strokes};
use super::rows::{Means, Spans};
use super::times::Arrivals;
use crate::clock::{DeviceClock, HostTime};
use crate::dataset::DatasetError;
use crate::device::{MarkerPosition, Mounting, SensorMounting};
use crate::geometry::{Mat3, Vec3};
use crate::mesh::TetMesh;
use crate::observation::{
    Contact as Touch, MarkerRow, Markers, Noise, Phantom, Poke, Recording, Stage, Tip, TipShape, Wrench,
};
use crate::session::{Event, MountingDocument, Session, StartDocument};
use std::collections::BTreeMap;

/// Rows of force a second.
const ROW_RATE_HZ: f64 = 50.0;
/// A marker this far from the surface is refused (m).
const MAX_STANDOFF_M: f64 = 0.01;
/// Digits after the decimal point of rows: 0.1 µm, 1 µN, 0.01 µN·m.
const DIGITS: [i32; 3] = [7, 6, 8];
/// The least noise that is stated, where an instrument shows none (m, N, N·m).
const LEAST: [f64; 3] = [1e-6, 1e-5, 1e-7];

/// A recording, and what of the session is not in it.
#[derive(Debug)]
pub struct FromSession {
    /// The recording.
    pub recording: Recording,
    /// What was left out or is doubtful, for people.
    pub remarks: Vec<String>,
}

/// Turns a session into a recording on a mesh, which is that of its phantom.
///
/// Time zero is the zero of the force sensor. Noise is that of the rest before the first poke.
///
/// # Errors
/// [`DatasetError`]: the session cannot be read, or says too little: no mounting, no zero of the force, no poke that was finished.
pub fn read_session(session: &Session, mesh: TetMesh) -> Result<FromSession, DatasetError> {
    let start = session.start();
    let missing =
        |what: &'static str| DatasetError::SessionWithout { session: session.folder().to_owned(), what };
    let document = start.mounting.as_ref().ok_or_else(|| missing("how stage and sensor are mounted"))?;
    let mounting = Mounting::new(document.origin_m, document.axes, document.tolerance_m)
        .ok_or_else(|| missing("two axes of the stage that span a plane"))?;
    let format = start.force.as_ref().ok_or_else(|| missing("a force sensor"))?.format();
    let events: Vec<Event> = session.events().collect::<Result<_, _>>()?;
    let mut remarks = Vec::new();

    let all = strokes(events.iter().cloned());
    let first = all.iter().find_map(|s| s.pressed_ns).ok_or_else(|| missing("a poke"))?;
    let zero = zero_before(&events, first)
        .ok_or_else(|| missing("a zero of the force sensor before its first poke"))?;
    let origin = HostTime::from_nanos(zero.0);
    let seconds = |ns: u64| HostTime::from_nanos(ns).seconds_after(origin);

    let path = stage_path(session, &mounting, origin, &mut remarks)?;
    let during = |stroke: &Stroke, end_ns: u64| -> Vec<Placed> {
        let (from, to) = (seconds(stroke.began_ns), seconds(end_ns));
        path.iter().filter(|p| (from..=to).contains(&p.0)).copied().collect()
    };
    let mut touched: Vec<(Stroke, Contact)> = Vec::new();
    for stroke in all {
        let found = stroke.ended_ns.and_then(|end| contact(&stroke, &during(&stroke, end)));
        match found {
            Some(found) => touched.push((stroke, found)),
            None => remarks.push(format!("poke {} was not finished; it is left out", stroke.poke)),
        }
    }
    if touched.is_empty() {
        return Err(missing("a poke that was finished"));
    }
    let rest_until_s = seconds(first).min(touched[0].1.start_s);

    let clock = force_clock(session, format.tick_hz, origin, &mut remarks)?;
    let sensor = sensor(document);
    let last = path.last().map_or(touched[touched.len() - 1].1.end_s, |p| p.0);
    let limits: Vec<f64> = std::iter::once(0.0)
        .chain(touched.iter().flat_map(|(_, c)| [c.start_s, c.end_s]))
        .chain([last])
        .collect();
    let mut means = Means::new(Spans::new(&limits, 1.0 / ROW_RATE_HZ));
    let mut arrivals = Arrivals::new(1.0 / format.tick_hz, origin);
    for record in session.force() {
        let record = record?;
        let device = arrivals.next(record.ft_sequence, record.host);
        let time_s = clock.map_or(record.host.seconds_after(origin), |c| c.host_s(device));
        let counts: [f64; 6] = std::array::from_fn(|i| f64::from(record.counts[i]) - zero.1[i]);
        let scale = |i: usize| if i < 3 { format.counts_per_newton } else { format.counts_per_newton_metre };
        let (force, torque) = sensor.on_phantom(std::array::from_fn(|i| counts[i] / scale(i)));
        means.take(time_s, [force.x, force.y, force.z, torque.x, torque.y, torque.z]);
    }
    let wrench = wrench(&means.rows(format.rate_hz));
    let markers = markers(session, origin)?;
    let noise = noise(&wrench, &markers, rest_until_s, start);
    let pokes = (1..).zip(&touched).map(|(number, (stroke, contact))| Poke {
        number,
        site: stroke.site,
        direction: stroke.direction,
        radius_m: stroke.radius_m,
        start_s: contact.start_s,
        end_s: contact.end_s,
    });
    let recording = Recording {
        name: start.name.clone(),
        rest_until_s,
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
        stage: Some(stage(&path, &touched)),
        wrench,
        markers,
    };
    Ok(FromSession { recording, remarks })
}

/// Host time (ns) and mean counts of the last zero before a time.
fn zero_before(events: &[Event], before_ns: u64) -> Option<(u64, [f64; 6])> {
    let last = events.iter().rfind(|e| e.name == "zero" && e.host_ns < before_ns);
    last.and_then(|event| {
        let list = event.detail.get("mean_counts")?.as_array()?;
        let values: Vec<f64> = list.iter().filter_map(serde_json::Value::as_f64).collect();
        Some((event.host_ns, values.try_into().ok()?))
    })
}

fn sensor(document: &MountingDocument) -> SensorMounting {
    SensorMounting {
        to_phantom: Mat3::from_fn(|i, j| document.sensor_to_phantom[i][j]),
        tip_m: document.sensor_to_tip_m.into(),
        reads_reaction: document.reads_reaction,
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

/// All reports with the tip in the phantom frame, in order of time.
fn stage_path(
    session: &Session,
    mounting: &Mounting,
    origin: HostTime,
    remarks: &mut Vec<String>,
) -> Result<Vec<Placed>, DatasetError> {
    let mut arrivals = Arrivals::new(1e-6, origin);
    let mut path = Vec::new();
    let mut ticks = true;
    for report in session.stage() {
        let report = report?;
        let host_s = report.host.seconds_after(origin);
        let device_s = report.tick_us.map(|tick| arrivals.next(tick, report.host));
        ticks &= device_s.is_some();
        path.push((device_s, host_s, report.position_m));
    }
    let clock = if ticks { arrivals.clock() } else { None };
    if ticks && clock.is_none() && !path.is_empty() {
        remarks.push("the stage was reset in between: its reports count from their arrival".to_owned());
    }
    let time = |(device, host): (Option<f64>, f64)| match (clock, device) {
        (Some(clock), Some(device)) => clock.host_s(device),
        _ => host,
    };
    let mut placed: Vec<Placed> =
        path.into_iter().map(|(device, host, at)| placed(mounting, time((device, host)), at)).collect();
    placed.dedup_by(|b, a| b.0 <= a.0);
    Ok(placed)
}

/// The sensor's clock from all its records; none where it was restarted in between.
fn force_clock(
    session: &Session,
    tick_hz: f64,
    origin: HostTime,
    remarks: &mut Vec<String>,
) -> Result<Option<DeviceClock>, DatasetError> {
    let mut arrivals = Arrivals::new(1.0 / tick_hz, origin);
    for record in session.force() {
        let record = record?;
        arrivals.next(record.ft_sequence, record.host);
    }
    let clock = arrivals.clock();
    if clock.is_none() {
        remarks.push(
            "the force sensor was restarted in between: its records count from their arrival".to_owned(),
        );
    }
    Ok(clock)
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
    rows.extend(path.iter().filter(|p| p.0 >= 0.0 && outside(p.0)).map(|p| (p.0, Vec3::zeros())));
    rows.extend(touched.iter().flat_map(|(_, c)| c.rows.iter().copied()));
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut stage = Stage::default();
    for (time_s, moved) in rows {
        stage.time_s.push(time_s);
        stage.displacement_m.push(std::array::from_fn(|c| rounded(moved[c], DIGITS[0])));
    }
    stage
}

fn markers(session: &Session, origin: HostTime) -> Result<Markers, DatasetError> {
    let mut frames: Vec<(f64, Vec<MarkerPosition>)> = Vec::new();
    let mut numbers: BTreeMap<u32, u32> = BTreeMap::new();
    for frame in session.markers() {
        let frame = frame?;
        let time_s = frame.host.seconds_after(origin);
        let later = frames.last().is_none_or(|last| time_s > last.0);
        if time_s >= 0.0 && later {
            numbers.extend(frame.markers.iter().map(|m| (m.marker, 0)));
            frames.push((time_s, frame.markers));
        }
    }
    for (index, value) in (0..).zip(numbers.values_mut()) {
        *value = index;
    }
    let mut rows = Vec::new();
    for (frame, (_, seen)) in (0..).zip(&frames) {
        rows.extend(seen.iter().map(|m| MarkerRow {
            frame,
            marker: numbers[&m.marker],
            position_m: m.position_m.map(|x| rounded(x, DIGITS[0])),
        }));
    }
    let frame_time_s = frames.iter().map(|f| f.0).collect();
    Ok(Markers { numbers: numbers.into_keys().collect(), frame_time_s, rows })
}

/// What the instruments did while nothing touched the phantom.
fn noise(wrench: &Wrench, markers: &Markers, rest_until_s: f64, start: &StartDocument) -> Noise {
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
        stage_m: [(step / 12_f64.sqrt()).max(LEAST[0]); 3],
    }
}
