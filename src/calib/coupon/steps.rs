//! Where does a held force step, at once or within some samples?
//!
//! At each sample and several widths: the line before, the line behind, both at the middle of what lies between. A slow course has steps of its own
//! there; their median and scatter over the hold are what a step must stand out from. Size and place are taken from both sides.

use super::held_out::{line, rms};
use crate::calib::noise::{MAD, middle};
use std::ops::Range;

/// Samples within which a step may come about: over more it is no slip.
const WIDTHS: [usize; 6] = [1, 2, 4, 8, 16, 32];
/// How far both lines of a step may reach in the measure of time: on more the course is not straight.
const REACH: f64 = 1.0;
/// Samples of a line, and widths at least.
const SIDE: usize = 10;
const SIDE_WIDTHS: usize = 2;
/// Standard deviations, of noise and of the course's own steps.
const SIGMAS: f64 = 8.0;
/// Steps that are said.
const MOST: usize = 4;
/// How much longer than the samples before it a step may take in time: a file that pauses has no step.
const PAUSE: f64 = 3.0;
/// Share of the step that the middle sample on either side must show.
const LASTS: f64 = 0.5;

/// A step.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Step {
    /// Samples before and behind it.
    pub(super) ends: [usize; 2],
    pub(super) size: f64,
    /// Root mean square missed in every other sample behind it, without the step and with the size that the others tell.
    pub(super) missed: [f64; 2],
}

/// Steps of at least `least`, largest first. `at`: a measure of time in which the course is as straight as may be; `sigma`: noise.
pub(super) fn steps(time_s: &[f64], at: &[f64], values: &[f64], sigma: f64, least: f64) -> Vec<Step> {
    let mut all: Vec<(f64, Step)> = WIDTHS
        .iter()
        .flat_map(|width| {
            let side = SIDE.max(SIDE_WIDTHS * width);
            let found: Vec<Step> = (side..values.len())
                .filter_map(|i| across(time_s, at, values, [i - 1, *width, side]))
                .collect();
            let sizes: Vec<f64> = found.iter().map(|s| s.size).collect();
            let usual = middle(&sizes);
            let scatter = MAD * middle(&sizes.iter().map(|s| (s - usual).abs()).collect::<Vec<_>>());
            // What noise makes of two lines of n samples, each (n + w)/2 samples from its middle.
            let (n, w) = (side as f64, *width as f64);
            let own = sigma * (2.0 / n + 6.0 * (n + w).powi(2) / n.powi(3)).sqrt();
            let limit = SIGMAS * scatter.max(own);
            let beyond = move |s: &Step| (s.size - usual).abs() > limit && s.size.abs() > least;
            found
                .into_iter()
                .filter(beyond)
                .map(move |s| ((s.size - usual).abs() / limit, s))
                .collect::<Vec<_>>()
        })
        .collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut kept: Vec<Step> = Vec::new();
    for (_, step) in all {
        let apart = |k: &Step| step.ends[0] > k.ends[1] + SIDE || step.ends[1] + SIDE < k.ends[0];
        if kept.len() < MOST && kept.iter().all(apart) {
            kept.push(step);
        }
    }
    kept
}

/// The step between a sample and the one `width` behind it, by lines of `n` samples on either side; none where both lines meet near by: a corner.
fn across(time_s: &[f64], at: &[f64], values: &[f64], [from, width, n]: [usize; 3]) -> Option<Step> {
    let to = from + width;
    let behind = to..to + n;
    let before = from + 1 - n..from + 1;
    if behind.end > values.len()
        || at[behind.end - 1] - at[before.start] > REACH
        || time_s[to] - time_s[from] > PAUSE * width as f64 * (time_s[from] - time_s[from - 1])
    {
        return None;
    }
    let side = |rows: Range<usize>| line(&at[rows.clone()], &values[rows]);
    let says = |(slope, place, height): (f64, f64, f64)| move |x: f64| height + slope * (x - place);
    let lines = [side(before.clone()), side(behind.clone())];
    let [early, late] = lines.map(says);
    let centre = 0.5 * (at[from] + at[to]);
    let size = late(centre) - early(centre);
    let meet = centre - size / (lines[1].0 - lines[0].0);
    if (at[before.start]..=at[behind.end - 1]).contains(&meet) {
        return None;
    }
    // Single samples far off make no step: the middle one of each side shows it, too.
    let shows = |off: Vec<f64>| middle(&off) / size > LASTS;
    let lasts = shows(behind.clone().map(|k| values[k] - early(at[k])).collect())
        && shows(before.map(|k| late(at[k]) - values[k]).collect());
    let off: Vec<f64> = behind.map(|k| values[k] - early(at[k])).collect();
    let told = off.iter().step_by(2).sum::<f64>() / off.iter().step_by(2).count() as f64;
    let unseen: Vec<f64> = off.iter().skip(1).step_by(2).copied().collect();
    let missed = [rms(&unseen), rms(&unseen.iter().map(|v| v - told).collect::<Vec<_>>())];
    lasts.then_some(Step { ends: [from, to], size, missed })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A force that relaxes as the logarithm of time, with 2 mN of noise, of which 0.1 N are lost at 500 s within some seconds.
    fn found(seconds: f64, lost: f64) -> Vec<Step> {
        let time: Vec<f64> = (0..1500).map(|k| 8.0 + f64::from(k)).collect();
        let at: Vec<f64> = time.iter().map(|t| t.ln()).collect();
        let force: Vec<f64> = time
            .iter()
            .map(|t| {
                let gone = lost * ((t - 500.0) / seconds).clamp(0.0, 1.0);
                3.0 - 0.2 * t.ln() - gone + 0.0028 * (7919.0 * t * t).sin()
            })
            .collect();
        steps(&time, &at, &force, 0.002, 0.03)
    }

    #[test]
    fn a_slip_is_found_however_many_samples_it_takes() {
        for seconds in [0.5, 2.0, 5.0, 8.0] {
            let found = found(seconds, 0.1);
            let [step] = &found[..] else { panic!("{seconds}: {found:?}") };
            assert!((step.size + 0.1).abs() < 0.015, "{seconds}: {step:?}");
            assert!(step.ends[0] <= 493 && step.ends[1] >= 492, "{step:?}");
        }
        assert!(found(1.0, 0.0).is_empty());
        // Over minutes it is no slip.
        assert!(found(300.0, 0.1).is_empty());
    }
}
