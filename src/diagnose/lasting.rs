//! How much of a marker's error stays from frame to frame while the tip is elsewhere: what scatter at rest does not show.
//!
//! Light and shadow that the tip brings along, pixels that a dot has moved on to and the depth beside it each give a marker an error of its
//! own that lasts. Between pokes the phantom is as it was before the first: how far means over one such rest lie from those of the first
//! beyond what white noise makes of them says how large these errors are. The largest hundredth does not count, so that what moves a few
//! markers for good (a place that creeps) is not taken for an error of the camera; what all have in common is the camera's sway. What a memory moves
//! there is taken off as soon as a reading has one (`creep`).
//!
//! Under the tip they are larger: against the truth of the simulated bench's pictures, means over a piece of a poke were off by 0.5 to 1.2 µm
//! beyond white noise where those over rests were off by 0.5 µm.

use super::creep::Creep;
use super::rest::rests;
use crate::geometry::Vec3;
use crate::inverse::{Evidence, beyond_chance};
use crate::observation::Recording;
use std::collections::BTreeMap;

/// Share of the means that count, and the mean of χ² with one degree of freedom over that share of its smaller values.
const KEPT: f64 = 0.99;
const OF_KEPT: f64 = 0.924;
/// Fewer means than this say nothing.
const FEWEST: usize = 30;

/// Mean of one marker over one rest, from its first rest (m), and frames in either.
struct RestMean {
    marker: usize,
    off: Vec3,
    frames: f64,
    first_frames: f64,
}

/// Errors during a poke over those between pokes (standard deviations).
const UNDER_TIP: f64 = 1.5;

/// Variance (m²) of a marker's lasting error during a poke, along each axis.
pub(super) fn lasting(recording: &Recording, evidence: &Evidence, creep: &Creep) -> [f64; 3] {
    let mut means = Vec::new();
    for [from, until] in rests(recording) {
        means.extend(of_rest(recording, evidence, creep, [from, until]));
    }
    std::array::from_fn(|axis| UNDER_TIP.powi(2) * beyond_white(&means, axis, evidence.noise.marker_m[axis]))
}

/// The means over one rest, less the median marker's.
fn of_rest(
    recording: &Recording,
    evidence: &Evidence,
    creep: &Creep,
    [from, until]: [f64; 2],
) -> Vec<RestMean> {
    let markers = &recording.markers;
    let mut sums = vec![(Vec3::zeros(), 0.0); evidence.rest.len()];
    for row in &markers.rows {
        if (from..until).contains(&markers.frame_time_s[row.frame as usize])
            && let Some(crept) = creep.of(row.frame as usize, row.marker as usize)
        {
            let sum = &mut sums[row.marker as usize];
            *sum = (sum.0 + Vec3::from(row.position_m) - crept, sum.1 + 1.0);
        }
    }
    let mut means: Vec<RestMean> = (sums.iter().zip(&evidence.rest).enumerate())
        .filter(|(_, ((_, frames), (_, first)))| *frames > 0.0 && *first > 0)
        .map(|(marker, ((sum, frames), (rest, first)))| RestMean {
            marker,
            off: sum / *frames - rest,
            frames: *frames,
            first_frames: *first as f64,
        })
        .collect();
    for axis in 0..3 {
        let common = median(means.iter().map(|m| m.off[axis]).collect());
        means.iter_mut().for_each(|m| m.off[axis] -= common);
    }
    means
}

/// Variance of what means have beyond white noise of this standard deviation: of all but the largest.
fn beyond_white(means: &[RestMean], axis: usize, sd: f64) -> f64 {
    if means.len() < FEWEST {
        return 0.0;
    }
    let white = |m: &RestMean| sd * sd * (1.0 / m.frames + 1.0 / m.first_frames);
    let mut kept: Vec<&RestMean> = means.iter().collect();
    let over_white = |m: &RestMean| m.off[axis].powi(2) / white(m);
    kept.sort_unstable_by(|a, b| over_white(a).total_cmp(&over_white(b)));
    kept.truncate((KEPT * means.len() as f64) as usize);
    let count = kept.len() as f64;
    let mean = |of: &dyn Fn(&RestMean) -> f64| kept.iter().map(|m| of(m)).sum::<f64>() / count;
    if beyond_chance(mean(&over_white) / OF_KEPT, freedom(&kept)) <= 1.0 {
        return 0.0;
    }
    (mean(&|m| m.off[axis].powi(2)) / OF_KEPT - mean(&white)).max(0.0)
}

/// Degrees of freedom of a sum of squares of means over their white noise: all means of a marker have the error of its first rest in common, so that
/// they are fewer than the means (twice the squares of all correlations are the sum's variance).
fn freedom(means: &[&RestMean]) -> f64 {
    // Of each marker the sums of the first rest's shares of the variances, and of their squares.
    let mut shares: BTreeMap<usize, [f64; 2]> = BTreeMap::new();
    for mean in means {
        let share = mean.first_frames.recip() / (mean.first_frames.recip() + mean.frames.recip());
        let [sum, squares] = shares.entry(mean.marker).or_default();
        (*sum, *squares) = (*sum + share, *squares + share * share);
    }
    let count = means.len() as f64;
    let correlated: f64 = shares.values().map(|[sum, squares]| sum * sum - squares).sum();
    count * count / (count + correlated)
}

/// The middle value; 0 of none.
fn median(mut values: Vec<f64>) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// Means of 80 markers over five rests of 30 to 90 frames, all from their first of 60, with an error that lasts, as a share of the noise of a frame;
    /// one of 130 is `far` off.
    fn found(seed: u64, share: f64, far: f64) -> f64 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let first_frames = 60.0_f64;
        let first: Vec<f64> = (0..80).map(|_| normal() / first_frames.sqrt()).collect();
        let means: Vec<RestMean> = (0..400)
            .map(|i| {
                let (marker, frames) = (i / 5, (30 + i % 60) as f64);
                let white = normal() / frames.sqrt() - first[marker];
                let far = if i % 130 == 7 { far } else { 0.0 };
                let off = Vec3::repeat(white + share * normal() + far);
                RestMean { marker, off, frames, first_frames }
            })
            .collect();
        beyond_white(&means, 1, 1.0).sqrt()
    }

    #[test]
    fn errors_that_last_are_told_from_white_noise() {
        // Where a hundredth is far off nothing of noise's own largest is left out, and chance is taken for more than noise a little more often.
        for (far, most) in [(0.0, 8), (5.0, 25)] {
            let none = (0..500).filter(|&seed| found(seed, 0.0, far) > 0.0).count();
            assert!(none <= most, "{none} of 500 with {far}");
        }
        for seed in 0..20 {
            let lasting = found(seed, 0.3, 5.0);
            assert!((0.25..0.36).contains(&lasting), "{lasting}");
        }
    }
}
