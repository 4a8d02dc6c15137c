//! Where does the rest end, the ramp, the hold? Times (s) and deformations from the start → the phase of each row, of the first cycle.
//!
//! The ramp's middle tells its rate, the rate the end to expect, and the rows right behind that end the level of the hold: a crosshead that creeps
//! on, an encoder that is noisy, or another cycle do not move the corner. Thresholds are shares of that level, or the encoder's noise.

use super::recording::Phase;
use crate::calib::noise::{middle, noise};

/// Shares of the way between which the ramp's rate is taken.
const MIDDLE: [f64; 2] = [0.2, 0.8];
/// Rows behind the expected end that tell the level: from here to there, in durations of the ramp.
const BEHIND: [f64; 2] = [0.1, 1.1];
/// Deformation that is left from the end of the ramp on, over the whole ramp.
const RAMP_END: f64 = 0.01;
/// Deformation by which a hold may fall, over the whole ramp: below, it is the way back.
const HELD: f64 = 0.1;
/// How far a hold may yield by its end, over the whole ramp.
const CREEP: f64 = 0.001;
/// Share of the hold's time that tells its last level.
const LATE: [f64; 2] = [0.6, 0.95];
/// Rows before the way back that may belong to it: the crosshead turns before its encoder tells.
const TURNING: usize = 3;
/// Deformation below which nothing moves yet, over the whole ramp.
const REST: f64 = 0.004;
/// Standard deviations of the encoder's noise.
const SIGMAS: f64 = 3.0;
/// Shares of the way below which a cycle is over, and above which there is another one.
const CYCLE: [f64; 2] = [0.3, 0.7];

/// The phases of the first cycle; rows behind it have none.
pub(super) fn phases(time_s: &[f64], deformation: &[f64]) -> Vec<Phase> {
    let n = deformation.len();
    let smooth: Vec<f64> =
        (0..n).map(|r| middle(&deformation[r.saturating_sub(2).min(r)..(r + 3).min(n)])).collect();
    let smooth: Vec<f64> = if n < 5 { deformation.to_vec() } else { smooth };
    let most = smooth.iter().copied().fold(0.0, f64::max);
    let reach = |share: f64, of: f64| smooth.iter().position(|d| *d >= share * of).unwrap_or(0);
    let [early, late] = MIDDLE.map(|share| reach(share, most));
    let seconds = (time_s[late] - time_s[early]) / (MIDDLE[1] - MIDDLE[0]);
    let end = time_s[late] + (1.0 - MIDDLE[1]) * seconds;
    let within = |r: &usize| {
        let behind = (time_s[*r] - end) / seconds.max(f64::MIN_POSITIVE);
        (BEHIND[0]..=BEHIND[1]).contains(&behind) && smooth[*r] > (1.0 - HELD) * most
    };
    let behind: Vec<f64> = (late..n).filter(within).map(|r| deformation[r]).collect();
    let level = if behind.len() < 3 { most } else { middle(&behind) };
    let rough = first_below(&smooth, reach(1.0 - HELD, level), (1.0 - HELD) * level);
    let own = SIGMAS * noise(&deformation[late..rough.max(late + 1)]);
    let first = reach(1.0, level - (RAMP_END * level).max(own)).min(rough - 1);
    // The hold's own end: a little of the way back is still close to it.
    let held = time_s[rough - 1] - time_s[first];
    let late = |r: &usize| (LATE[0]..=LATE[1]).contains(&((time_s[*r] - time_s[first]) / held));
    let last: Vec<f64> = (first..rough).filter(late).map(|r| deformation[r]).collect();
    let last = if last.is_empty() { level } else { middle(&last) };
    let limit = last - (CREEP * level).max(own);
    let last = (first..rough).rev().find(|r| smooth[*r] >= limit).unwrap_or(rough - 1);
    let last = if last + 1 < n { last.saturating_sub(TURNING).max(first) } else { last };
    let resting = |d: &&f64| d.abs() <= (REST * level).max(own);
    let rest = smooth[..first].iter().take_while(resting).count();
    let phase = |row: usize| match row {
        r if r > last => Phase::Unloading,
        r if r >= first => Phase::Hold,
        r if r < rest => Phase::Rest,
        _ => Phase::Ramp,
    };
    (0..cycle_end(&smooth, rough, level)).map(phase).collect()
}

/// The first row behind `from` that is below; all rows where none is.
fn first_below(values: &[f64], from: usize, level: f64) -> usize {
    (from + 1..values.len()).find(|r| values[*r] < level).unwrap_or(values.len())
}

/// One behind the last row before another cycle begins.
fn cycle_end(smooth: &[f64], back: usize, level: f64) -> usize {
    let low = first_below(smooth, back.saturating_sub(1), CYCLE[0] * level);
    let Some(again) = (low..smooth.len()).find(|r| smooth[*r] >= CYCLE[1] * level) else {
        return smooth.len();
    };
    let least = smooth[low..again].iter().copied().fold(f64::INFINITY, f64::min);
    // Between two cycles nothing moves: the last row there.
    (low..again).rev().find(|r| smooth[*r] <= least + REST * level).map_or(again, |r| r + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rest of 1 s, ramp of 5 s to 1, hold to 100 s, back in 5 s, rest; at 20 rows a second, later ten a second.
    fn made(change: impl Fn(f64, f64) -> f64) -> (Vec<f64>, Vec<f64>) {
        let way = |t: f64| ((t - 1.0) / 5.0).clamp(0.0, 1.0) * (1.0 - (t - 100.0) / 5.0).clamp(0.0, 1.0);
        let times: Vec<f64> = (0..2200).map(|k| 0.05 * f64::from(k)).collect();
        let deformation = times.iter().map(|t| change(*t, way(*t))).collect();
        (times, deformation)
    }

    fn found(times: &[f64], deformation: &[f64]) -> [f64; 3] {
        let phases = phases(times, deformation);
        let first = |p: Phase| phases.iter().position(|q| *q == p).map_or(f64::NAN, |r| times[r]);
        [first(Phase::Ramp), first(Phase::Hold), first(Phase::Unloading)]
    }

    #[test]
    fn the_corners_stay_where_they_are() {
        let close = |found: [f64; 3], off: f64| {
            let right = [1.0, 6.0, 100.0];
            assert!(found.iter().zip(right).all(|(f, r)| (f - r).abs() <= off), "{found:?}");
        };
        let (times, plain) = made(|_, d| d);
        close(found(&times, &plain), 0.21);
        let (_, creeping) = made(|t, d| d * (1.0 + 0.04 * (t / 100.0).min(1.0)));
        close(found(&times, &creeping), 0.21);
        let (_, noisy) = made(|t, d| d + 0.01 * (977.0 * t).sin());
        close(found(&times, &noisy), 0.4);
    }

    #[test]
    fn the_first_of_two_cycles_counts() {
        let (times, one) = made(|_, d| d);
        let twice: Vec<f64> = one.iter().chain(&one).copied().collect();
        let long: Vec<f64> = times.iter().copied().chain(times.iter().map(|t| t + 110.0)).collect();
        let phases = phases(&long, &twice);
        assert!(phases.len() > 2100 && phases.len() < 2230, "{}", phases.len());
        assert_eq!(phases.last(), Some(&Phase::Unloading));
    }
}
