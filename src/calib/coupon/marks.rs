//! Marks that faults leave in a list of samples: jumps and spikes.

use crate::calib::noise::middle;
use std::ops::Range;

pub(super) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// Straight between points in order of x; none outside of them.
pub(super) fn between(points: &[(f64, f64)], x: f64) -> Option<f64> {
    let next = points.partition_point(|p| p.0 < x);
    let b = points.get(next)?;
    if b.0 == x {
        return Some(b.1);
    }
    let a = points.get(next.checked_sub(1)?)?;
    Some(a.1 + (b.1 - a.1) * (x - a.0) / (b.0 - a.0))
}

/// Steps that the course around them does not make: index behind the step, and the step less the median of its neighbours.
pub(super) fn jumps(values: &[f64], sigma: f64, least: f64) -> Vec<(usize, f64)> {
    const NEAR: usize = 6;
    let step = |i: usize| values[i] - values[i - 1];
    let mut found = Vec::new();
    for i in NEAR + 1..values.len().saturating_sub(NEAR) {
        let around: Vec<f64> =
            (i - NEAR..=i + NEAR).filter(|j| *j != i && *j > 0 && *j < values.len()).map(step).collect();
        let excess = step(i) - middle(&around);
        // Lasting: the means before and behind differ by it, too; a spike comes back.
        let lasting = mean(&values[i..i + 3]) - mean(&values[i - 3..i]);
        if excess.abs() > (8.0 * sigma).max(least) && lasting.abs() > 0.6 * excess.abs() {
            found.push((i, excess));
        }
    }
    found
}

/// Samples of a spike at most.
const LONGEST: usize = 4;
/// How far a line may be followed, over the distance of the two samples that it goes through.
const FAR: f64 = 6.0;

/// Runs of samples far off the lines through the two before and the two behind, on one side of both: a corner lies on one of them. Where several are off,
/// both lines must differ by less than that, or the course itself bends.
pub(super) fn spikes(time_s: &[f64], values: &[f64], sigma: f64, least: f64) -> Vec<Range<usize>> {
    let limit = (10.0 * sigma).max(least);
    // The value of a line through two samples at the time of a third one.
    let through = |a: usize, b: usize, at: usize| {
        let slope = (values[b] - values[a]) / (time_s[b] - time_s[a]);
        let far = (time_s[at] - time_s[b]) / (time_s[b] - time_s[a]);
        (far <= FAR).then_some(values[b] + slope * (time_s[at] - time_s[b]))
    };
    let is_spike = |run: &Range<usize>| {
        let sides: Option<Vec<[f64; 2]>> = run
            .clone()
            .map(|i| Some([through(run.start - 2, run.start - 1, i)?, through(run.end + 1, run.end, i)?]))
            .collect();
        let Some(sides) = sides else { return false };
        let off = || sides.iter().zip(&values[run.clone()]).flat_map(|(s, v)| s.map(|says| v - says));
        let apart = sides.iter().map(|[a, b]| (a - b).abs()).fold(0.0, f64::max);
        let limit = if run.len() == 1 { limit } else { limit.max(apart) };
        off().all(|o| o > limit) || off().all(|o| o < -limit)
    };
    let mut found: Vec<Range<usize>> = Vec::new();
    let mut from = 2;
    while from + 3 <= values.len() {
        let run = (1..=LONGEST).map(|n| from..from + n).filter(|r| r.end + 2 <= values.len()).find(is_spike);
        from = run.as_ref().map_or(from + 1, |r| r.end);
        found.extend(run);
    }
    found
}

/// The values, straight over each spike.
pub(super) fn without_spikes(time_s: &[f64], values: &[f64], spikes: &[Range<usize>]) -> Vec<f64> {
    let mut straight = values.to_vec();
    for run in spikes {
        let (a, b) = (run.start - 1, run.end);
        let slope = (values[b] - values[a]) / (time_s[b] - time_s[a]);
        run.clone().for_each(|i| straight[i] = values[a] + slope * (time_s[i] - time_s[a]));
    }
    straight
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_jump_lasts_and_a_spike_does_not() {
        let mut values: Vec<f64> = (0..60).map(f64::from).collect();
        values[20] += 30.0;
        values[40..].iter_mut().for_each(|v| *v -= 15.0);
        assert_eq!(jumps(&values, 0.1, 1.0).iter().map(|j| j.0).collect::<Vec<_>>(), [40]);
        let times: Vec<f64> = (0..60).map(f64::from).collect();
        values[10..13].iter_mut().for_each(|v| *v += 30.0);
        let both = spikes(&times, &values, 0.1, 1.0);
        assert_eq!(both, [10..13, 20..21]);
        let straight = without_spikes(&times, &values, &both);
        assert!((0..39).all(|k| (straight[k] - k as f64).abs() < 1e-12), "{straight:?}");
        // The corner between a ramp and a force that falls.
        let corner: Vec<f64> =
            times.iter().map(|t| if *t < 30.0 { *t } else { 30.0 - 8.0 * (t - 30.0) }).collect();
        assert!(spikes(&times, &corner, 0.1, 1.0).is_empty());
        assert_eq!(between(&[(0.0, 1.0), (2.0, 3.0)], 0.5), Some(1.5));
        assert_eq!(between(&[(0.0, 1.0), (2.0, 3.0)], 2.5), None);
    }
}
