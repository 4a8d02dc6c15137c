//! One uninterrupted stretch of a session → its pokes, the way of the stage, force and markers, in seconds from its own zero of the force.

use super::beat::put_on_beat;
use super::calibrated::{Calibrated, sensor};
use super::contacts::{Contact, Placed, Stroke, contact, inside, placed, strokes};
use super::lag::camera_lag;
use super::rows::{Means, Spans};
use super::times::{Arrivals, lateness};
use crate::calib::Lag;
use crate::clock::{DeviceClock, HostTime};
use crate::dataset::DatasetError;
use crate::device::{MarkerFrame, MarkerPosition, Mounting};
use crate::session::{Event, Session, SessionError};

/// Rows of force a second.
const ROW_RATE_HZ: f64 = 50.0;

/// What was recorded between one start of the devices and their end.
pub(super) struct Part {
    /// Its time zero: when the force sensor's zero was taken.
    pub(super) origin: HostTime,
    /// When the stage first went down to a surface, or touched one (s).
    pub(super) rest_until_s: f64,
    /// Pokes that were finished.
    pub(super) touched: Vec<(Stroke, Contact)>,
    /// Where the tip was.
    pub(super) path: Vec<Placed>,
    /// Force (N) and moment about the tip (N·m) on the phantom.
    pub(super) wrench: Vec<(f64, [f64; 6])>,
    /// Frames of the camera.
    pub(super) frames: Vec<(f64, Vec<MarkerPosition>)>,
    /// By how much pictures were late, which is taken off; none where there are none, or where nothing tells.
    pub(super) lag: Option<Lag>,
    /// What the instruments' calibration made of it.
    pub(super) calibrated: Calibrated,
}

/// Reads one stretch: a session of one file. None where no poke was finished in it. Pokes of the protocol that it began and did not
/// finish are added to `unfinished`.
///
/// `seen`: its markers as pictures show them, in place of those that were recorded.
pub(super) fn read_part(
    part: &Session,
    seen: Option<&[MarkerFrame]>,
    unfinished: &mut Vec<u32>,
    remarks: &mut Vec<String>,
) -> Result<Option<Part>, DatasetError> {
    let start = part.start();
    let missing =
        |what: &'static str| DatasetError::SessionWithout { session: part.folder().to_owned(), what };
    let document = start.mounting.as_ref().ok_or_else(|| missing("how stage and sensor are mounted"))?;
    let mounting = Mounting::new(document.origin_m, document.axes, document.tolerance_m)
        .ok_or_else(|| missing("two axes of the stage that span a plane"))?;
    let format = start.force.as_ref().ok_or_else(|| missing("a force sensor"))?.format();
    let events: Vec<Event> = part.events().collect::<Result<_, _>>()?;

    let all = strokes(events.iter().cloned());
    let Some(first) = all.iter().find_map(|s| s.pressed_ns) else {
        unfinished.extend(all.iter().map(|stroke| stroke.poke));
        return Ok(None);
    };
    let zero = zero_before(&events, first)
        .ok_or_else(|| missing("a zero of the force sensor before its first poke"))?;
    let origin = HostTime::from_nanos(zero.0);
    let seconds = |ns: u64| HostTime::from_nanos(ns).seconds_after(origin);

    let calibrated = Calibrated::of(start)?;
    let path = stage_path(part, &mounting, origin, remarks)?;
    let during = |stroke: &Stroke, end_ns: u64| -> Vec<Placed> {
        let (from, to) = (seconds(stroke.began_ns), seconds(end_ns));
        path.iter().filter(|p| (from..=to).contains(&p.0)).copied().collect()
    };
    let mut touched: Vec<(Stroke, Contact)> = Vec::new();
    let mut left_out: Vec<[f64; 2]> = Vec::new();
    for (number, stroke) in all.iter().enumerate() {
        let found = stroke.ended_ns.and_then(|end| contact(stroke, &during(stroke, end)));
        match found {
            Some(mut found) => {
                for (_, moved) in &mut found.rows {
                    *moved = calibrated.displacement(&mounting, *moved);
                }
                touched.push((stroke.clone(), found));
            }
            None => {
                unfinished.push(stroke.poke);
                let next_s = all.get(number + 1).map_or(f64::INFINITY, |next| seconds(next.began_ns));
                left_out.extend(inside(stroke, &path, seconds(stroke.began_ns), next_s));
            }
        }
    }
    let known = |t: f64| !left_out.iter().any(|[from, to]| (*from..=*to).contains(&t));
    let path: Vec<Placed> = path.into_iter().filter(|p| known(p.0)).collect();
    let Some((_, first_contact)) = touched.first() else { return Ok(None) };
    let rest_until_s = seconds(first).min(first_contact.start_s);

    let clock = force_clock(part, format.tick_hz, origin, remarks)?;
    let sensor = sensor(document);
    let last = path.last().map_or(touched[touched.len() - 1].1.end_s, |p| p.0);
    let limits: Vec<f64> = std::iter::once(0.0)
        .chain(touched.iter().flat_map(|(_, c)| [c.start_s, c.end_s]))
        .chain([last])
        .collect();
    let mut means = Means::new(Spans::new(&limits, 1.0 / ROW_RATE_HZ));
    let mut arrivals = Arrivals::new(1.0 / format.tick_hz, origin);
    for record in part.force() {
        let record = record?;
        let device = arrivals.next(record.ft_sequence, record.host);
        let time_s = clock.map_or(record.host.seconds_after(origin), |c| c.host_s(device));
        if !known(time_s) {
            continue;
        }
        let counts: [f64; 6] = std::array::from_fn(|i| f64::from(record.counts[i]) - zero.1[i]);
        let scale = format.scale();
        let (force, torque) = calibrated.on_phantom(&sensor, std::array::from_fn(|i| counts[i] / scale[i]));
        means.take(time_s, [force.x, force.y, force.z, torque.x, torque.y, torque.z]);
    }
    let mut frames: Vec<(f64, Vec<MarkerPosition>)> = Vec::new();
    let recorded: Box<dyn Iterator<Item = Result<MarkerFrame, SessionError>>> = match seen {
        Some(frames) => Box::new(frames.iter().cloned().map(Ok)),
        None => Box::new(part.markers()),
    };
    for frame in recorded {
        let frame = frame?;
        let time_s = frame.host.seconds_after(origin);
        if time_s >= 0.0 && known(time_s) && frames.last().is_none_or(|last| time_s > last.0) {
            frames.push((time_s, frame.markers));
        }
    }
    let mut lag = None;
    if seen.is_some() {
        remarks.extend(put_on_beat(&mut frames));
        match camera_lag(&touched, &frames, rest_until_s) {
            Ok(found) => {
                frames.iter_mut().for_each(|frame| frame.0 -= found.lag_s);
                frames.retain(|frame| frame.0 >= 0.0);
                lag = Some(found);
            }
            Err(error) => remarks.push(format!(
                "how late the pictures come cannot be told from them ({error}): they count from their arrival"
            )),
        }
    }
    let wrench = means.rows(format.rate_hz);
    Ok(Some(Part { origin, rest_until_s, touched, path, wrench, frames, lag, calibrated }))
}

/// From when to when nothing touches the phantom at the beginning of a session: from the zero of the force sensor to the first press; from the
/// first to the last instant where there is none.
///
/// # Errors
/// [`DatasetError`]: the session cannot be read.
pub fn first_rest(session: &Session) -> Result<[HostTime; 2], DatasetError> {
    let events: Vec<Event> = session.events().collect::<Result<_, _>>()?;
    let until_ns = strokes(events.iter().cloned()).iter().find_map(|s| s.pressed_ns).unwrap_or(u64::MAX);
    let from_ns = zero_before(&events, until_ns).map_or(0, |zero| zero.0);
    Ok([from_ns, until_ns].map(HostTime::from_nanos))
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
        remarks.push(
            "the stage's clock was reset or slipped in between: its reports count from their arrival"
                .to_owned(),
        );
    }
    let mut late_s = 0.0;
    if let Some(clock) = &clock {
        let probes: Vec<_> = session.clock_probes().collect::<Result<_, _>>()?;
        let of_stage = probes.into_iter().filter(|probe| probe.device == "stage");
        match lateness(of_stage, clock, origin) {
            // Question and answer take about as long.
            Some([least, most]) if least <= most => late_s = 0.5 * (least + most),
            Some([least, most]) => remarks.push(format!(
                "the stage's answers on its clock contradict each other: its reports are late by {:.1} ms at least and by {:.1} ms at \
                 most; nothing is taken off",
                1e3 * least,
                1e3 * most
            )),
            None => {}
        }
    }
    let time = |(device, host): (Option<f64>, f64)| match (clock, device) {
        (Some(clock), Some(device)) => clock.host_s(device) - late_s,
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
            "the force sensor's clock was reset or slipped in between: its records count from their arrival"
                .to_owned(),
        );
    }
    Ok(clock)
}
