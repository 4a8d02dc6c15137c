//! By how much pictures come later than the stage that their markers follow.
//!
//! A picture is stamped when it arrives; exposure, transfer and decoding came before. A gel follows its tip at once (waves cross it within
//! a few milliseconds), and how far its markers go depends on where the tip is, not on the force: so the stage's own path says when a
//! picture was of. Relaxation, which changes the force under a tip that stands, changes it little: the balance of gel and restraint moves by a
//! hundredth within seconds. On a way in of a third of a second that would pass for 3 ms, so that markers may follow in part slowly.
//!
//! A tip that touches later than it should, or a stage with play, makes markers late as well: but not at the end of the way in, where both
//! are used up, and a tip that stops stops its markers. So the last of the way in and the first of the hold say how late pictures are, once the
//! whole has said about when to look.

use super::contacts::{Contact, Stroke};
use crate::calib::{CalibError, Lag, Track, lag_between};
use crate::device::MarkerPosition;
use crate::geometry::Vec3;
use std::collections::BTreeMap;

/// Longest lag that is looked for (s): what waits longer is dropped by the driver.
const MOST_S: f64 = 0.25;
/// From how long before a contact to how long after it frames count (s).
const AROUND_S: f64 = 1.0;
/// Frames count for how far markers go in a poke while the tip is in by this share of the depth.
const DEEP: f64 = 0.9;

/// The end of the way in begins at this share of the depth, and the hold at this.
const LAST_OF_WAY: f64 = 0.4;
const THERE: f64 = 0.98;
/// The first of a hold lasts so long (s).
const FIRST_OF_HOLD_S: f64 = 0.6;
/// Time constant of what follows slowly (s). It stands for all from half a second on: the first of a hold knows little difference. Of what is gone
/// faster a part is taken for lateness.
const SLOWLY_S: f64 = 1.0;
/// How far the end of the way in may be from what the whole says (s).
const AROUND_WHOLE_S: f64 = 0.1;

/// Frames of markers at times (s).
pub(super) type Frames = [(f64, Vec<MarkerPosition>)];

/// How much later frames are than the contacts of the stage. Frames are stamped when they arrive. Where no contact has an end of its way in
/// that tells, it is what all frames around contacts say.
///
/// # Errors
/// [`CalibError`]: too few frames around contacts, nothing that moves, or markers that do not follow the stage.
pub(super) fn camera_lag(
    touched: &[(Stroke, Contact)],
    frames: &Frames,
    rest_until_s: f64,
) -> Result<Lag, CalibError> {
    let rest = means(frames.iter().filter(|f| f.0 < rest_until_s));
    let (mut stage, mut seen) = (Signal::default(), Signal::default());
    let mut ends = Vec::new();
    let depth = |moved: &Vec3| moved.norm();
    // The stage stands on the surface, for all that markers know, until it is in.
    let reach_s = AROUND_S + 2.0 * MOST_S;
    if let Some((_, first)) = touched.first() {
        stage.push(first.start_s - reach_s, 0.0);
    }
    for (_, contact) in touched {
        let deepest = contact.rows.iter().map(|r| depth(&r.1)).fold(0.0, f64::max);
        if deepest <= 0.0 {
            continue;
        }
        contact.rows.iter().for_each(|(t, moved)| stage.push(*t, depth(moved) / deepest));
        let within = |r: &&(f64, Vec3)| depth(&r.1) >= DEEP * deepest;
        let (Some(first), Some(last)) = (contact.rows.iter().find(within), contact.rows.iter().rfind(within))
        else {
            continue;
        };
        let full = means(frames.iter().filter(|f| (first.0..=last.0).contains(&f.0)));
        let way: BTreeMap<u32, (Vec3, Vec3)> = (full.iter())
            .filter_map(|(marker, there)| {
                let rest = rest.get(marker)?;
                Some((*marker, (*rest, there - rest)))
            })
            .collect();
        ends.extend(end_of_way_in(contact, deepest));
        let around = contact.start_s - AROUND_S..contact.end_s + AROUND_S;
        for (t, markers) in frames.iter().filter(|f| around.contains(&f.0)) {
            // The share of its way that the markers in sight have gone.
            let (mut along, mut all) = (0.0, 0.0);
            for marker in markers {
                let Some((rest, way)) = way.get(&marker.marker) else { continue };
                along += (Vec3::from(marker.position_m) - rest).dot(way);
                all += way.norm_squared();
            }
            if all > 0.0 {
                seen.push(*t, along / all);
            }
        }
    }
    if let Some((_, last)) = touched.last() {
        stage.push(last.end_s + reach_s, 0.0);
    }
    let whole = lag_between(stage.track(), &[], seen.track(), MOST_S)?;
    let slowly = stage.slowly(SLOWLY_S);
    let lags = ends.iter().filter_map(|&end| lag_at_end([&stage, &slowly], &seen, end, whole.lag_s).ok());
    let of_all = || lag_between(stage.track(), &[slowly.track()], seen.track(), MOST_S).unwrap_or(whole);
    Ok(together(&lags.collect::<Vec<_>>()).unwrap_or_else(of_all))
}

/// From when to when the stage goes the last of its way in and stands for a while (s).
fn end_of_way_in(contact: &Contact, deepest: f64) -> Option<[f64; 2]> {
    let share = |row: &(f64, Vec3)| row.1.norm() / deepest;
    let there = contact.rows.iter().position(|r| share(r) >= THERE)?;
    let (way, hold) = contact.rows.split_at(there);
    let from = way.iter().rfind(|r| share(r) < LAST_OF_WAY)?;
    let until_s = hold[0].0 + FIRST_OF_HOLD_S;
    let last = hold.iter().take_while(|r| share(r) >= THERE && r.0 <= until_s).last()?;
    Some([from.0, last.0])
}

/// How late the frames are that show the stage in a span of time, as far as it is known (s). Offset, scale and what follows `slowly` are those
/// of that span alone.
fn lag_at_end(
    [stage, slowly]: [&Signal; 2],
    seen: &Signal,
    [from, until]: [f64; 2],
    about_s: f64,
) -> Result<Lag, CalibError> {
    let mut of_span = Signal::default();
    for (t, value) in seen.time_s.iter().zip(&seen.value) {
        if (from..=until).contains(&(t - about_s)) {
            of_span.push(t - about_s, *value);
        }
    }
    let found = lag_between(stage.track(), &[slowly.track()], of_span.track(), AROUND_WHOLE_S)?;
    Ok(Lag { lag_s: found.lag_s + about_s, ..found })
}

/// The weighted mean of lags, with a deviation that carries their scatter.
fn together(lags: &[Lag]) -> Option<Lag> {
    let weight = |lag: &Lag| lag.sd_s.powi(-2);
    let sum: f64 = lags.iter().map(weight).sum();
    let mean = |value: fn(&Lag) -> f64| lags.iter().map(|l| weight(l) * value(l)).sum::<f64>() / sum;
    let lag_s = mean(|l| l.lag_s);
    let squares: f64 = lags.iter().map(|l| weight(l) * (l.lag_s - lag_s).powi(2)).sum();
    let scatter = squares / lags.len().saturating_sub(1).max(1) as f64;
    let (explained, samples) = (mean(|l| l.explained), lags.iter().map(|l| l.samples).sum());
    lag_s.is_finite().then(|| Lag { lag_s, sd_s: (scatter.max(1.0) / sum).sqrt(), explained, samples })
}

/// Where each marker is on average.
fn means<'a>(frames: impl Iterator<Item = &'a (f64, Vec<MarkerPosition>)>) -> BTreeMap<u32, Vec3> {
    let mut sums: BTreeMap<u32, (Vec3, f64)> = BTreeMap::new();
    for marker in frames.flat_map(|f| &f.1) {
        let sum = sums.entry(marker.marker).or_insert((Vec3::zeros(), 0.0));
        *sum = (sum.0 + Vec3::from(marker.position_m), sum.1 + 1.0);
    }
    sums.into_iter().map(|(marker, (sum, count))| (marker, sum / count)).collect()
}

/// Values at times that go up: what does not come after the last is left out.
#[derive(Default)]
struct Signal {
    time_s: Vec<f64>,
    value: Vec<f64>,
}

impl Signal {
    fn push(&mut self, time_s: f64, value: f64) {
        if self.time_s.last().is_none_or(|last| time_s > *last) {
            self.time_s.push(time_s);
            self.value.push(value);
        }
    }

    /// What has come of the values where each change of them comes about with a time constant (s): of straight lines between samples.
    fn slowly(&self, time_constant_s: f64) -> Self {
        let first = self.value.first().copied();
        let (mut missing, mut value) = (0.0, Vec::from_iter(first));
        for (t, v) in self.time_s.windows(2).zip(self.value.windows(2)) {
            let step = (t[1] - t[0]) / time_constant_s;
            let decay = (-step).exp();
            missing = missing * decay + (v[1] - v[0]) * (1.0 - decay) / step;
            value.push(v[1] - missing);
        }
        Self { time_s: self.time_s.clone(), value }
    }

    fn track(&self) -> Track<'_> {
        Track { time_s: &self.time_s, value: &self.value }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DEPTH_M: f64 = 0.003;

    /// Pokes of 0.3 s in, 1 s in place, 0.15 s out, every 4 s from 3 s on.
    fn depth_m(t: f64) -> f64 {
        let u = (t - 3.0).rem_euclid(4.0);
        let share =
            if !(3.0..15.0).contains(&t) { 0.0 } else { (u / 0.3).min((1.45 - u) / 0.15).clamp(0.0, 1.0) };
        DEPTH_M * share
    }

    fn touched() -> Vec<(Stroke, Contact)> {
        let inward = -Vec3::z();
        let contact = |start_s: f64| {
            let rows = (0..=145).map(|i| {
                let t = start_s + 0.01 * f64::from(i);
                (t, inward * depth_m(t))
            });
            Contact { start_s, end_s: start_s + 1.45, rows: rows.collect() }
        };
        let stroke = Stroke {
            poke: 1,
            site: Vec3::zeros(),
            direction: inward,
            radius_m: 0.008,
            began_ns: 0,
            ended_ns: Some(1),
            pressed_ns: Some(0),
        };
        [3.0, 7.0, 11.0].map(|start_s| (stroke.clone(), contact(start_s))).to_vec()
    }

    /// Twenty markers around the tip at 30 Hz; those under the tip are hidden while it is in.
    fn frames(lag_s: f64, moves: f64) -> Vec<(f64, Vec<MarkerPosition>)> {
        frames_of(moves, |t| depth_m(t - lag_s))
    }

    fn frames_of(moves: f64, depth_m: impl Fn(f64) -> f64) -> Vec<(f64, Vec<MarkerPosition>)> {
        let noise = |i: u32, m: u32| 5e-6 * (f64::from((i * 7919 + m * 104_729) % 1000) / 500.0 - 1.0);
        (0..480_u32)
            .map(|i| {
                let t = f64::from(i) / 30.0 + 0.004;
                let depth = depth_m(t);
                let seen = (0..20).filter(|m| *m > 3 || depth < 1e-4);
                let markers = seen.map(|m| {
                    let way = Vec3::new(0.1, 0.05, -0.6) * moves / f64::from(1 + m);
                    let at = Vec3::new(f64::from(m), 0.0, 0.025) + way * depth;
                    MarkerPosition { marker: m, position_m: at.add_scalar(noise(i, m)).into() }
                });
                (t, markers.collect())
            })
            .collect()
    }

    #[test]
    fn pictures_are_as_late_as_they_were_made() {
        for lag_s in [-0.004, 0.0, 0.0213, 0.12] {
            let found = camera_lag(&touched(), &frames(lag_s, 1.0), 3.0).expect("they follow");
            assert!((found.lag_s - lag_s).abs() < 1e-3, "{found:?} for {lag_s}");
            assert!(found.sd_s < 1e-3, "{found:?}");
        }
    }

    /// 0.15 mm of play: the tip follows the stage in, and stays on its way out until the play is used up. A tip that touches 0.3 mm late.
    #[test]
    fn play_and_late_contact_are_no_lateness() {
        let (lag_s, play_m, gap_m) = (0.05, 0.15e-3, 0.3e-3);
        let out = |t: f64| (3.0..15.0).contains(&t) && (t - 3.0).rem_euclid(4.0) > 0.5;
        let tip_m = |t: f64| {
            let depth = depth_m(t);
            if out(t) { (depth + play_m).min(if depth > 0.0 { DEPTH_M } else { 0.0 }) } else { depth }
        };
        let with_play = frames_of(1.0, |t| tip_m(t - lag_s));
        let late = frames_of(1.0, |t| (depth_m(t - lag_s) - gap_m).max(0.0));
        for seen in [with_play, late] {
            let found = camera_lag(&touched(), &seen, 3.0).expect("they follow");
            assert!((found.lag_s - lag_s).abs() < 2e-3, "{found:?}");
        }
    }

    /// A gel that relaxes beside bands that do not: some of the way is gone again. Without a slow share these would be 3 to 4 ms early.
    #[test]
    fn markers_that_creep_are_not_late() {
        let way = |i: usize| depth_m(1e-3 * i as f64);
        for (time_constant_s, share, within_s) in
            [(0.2, 0.03, 2e-3), (0.5, 0.03, 1e-3), (1.5, 0.05, 1e-3), (6.0, 0.12, 1e-3)]
        {
            let decay = f64::exp(-1e-3 / time_constant_s);
            let mut missing = 0.0;
            let crept: Vec<f64> = (1..17_000)
                .map(|i| {
                    missing = missing * decay + way(i) - way(i - 1);
                    way(i) - share * (way(i) - missing)
                })
                .collect();
            let lag_s = 0.0878;
            let seen = frames_of(1.0, |t| crept[(1e3 * (t - lag_s)).max(1.0) as usize - 1]);
            let found = camera_lag(&touched(), &seen, 3.0).expect("they follow");
            assert!((found.lag_s - lag_s).abs() < within_s, "{found:?} for {time_constant_s} s");
        }
    }

    /// A ramp comes about as t − T (1 − exp(−t/T)).
    #[test]
    fn changes_come_about_slowly() {
        let mut ramp = Signal::default();
        (0..=40).for_each(|i| ramp.push(0.05 * f64::from(i), 0.1 * f64::from(i)));
        let slowly = ramp.slowly(0.7);
        for (t, value) in slowly.time_s.iter().zip(&slowly.value) {
            let expected = 2.0 * (t - 0.7 * (1.0 - (-t / 0.7).exp()));
            assert!((value - expected).abs() < 1e-12, "{t}: {value}, {expected}");
        }
        assert!(Signal::default().slowly(1.0).time_s.is_empty());
    }

    #[test]
    fn markers_that_do_not_move_tell_no_lag() {
        assert!(camera_lag(&touched(), &frames(0.0, 0.0), 3.0).is_err());
        assert!(camera_lag(&[], &frames(0.0, 1.0), 3.0).is_err());
    }
}
