//! What the instruments read while nothing touches the phantom: how far their errors are from white.
//!
//! The force's error may wander in time: the variance of means over half a second is compared with that of white noise. It may
//! drift: a straight line in time is then likelier than anything that wanders.
//! The camera may sway as a whole: the variance of all markers' common motion, likewise. Each marker may err in its own way for a while:
//! see `lasting`.

use super::creep::Creep;
use super::lasting::lasting;
use super::track::Frame;
use crate::geometry::Vec3;
use crate::inverse::{
    BlockMean, Evidence, FEWEST_MEANS, MARGIN_S, SETTLED_S, beyond_chance, block_means, force_at_rest,
    sway_m2, wandering,
};
use crate::observation::{MarkerRow, Recording};
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{Continuous, ContinuousCDF, Normal};

/// How far errors are from white.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Correlation {
    /// Factor by which the wandering of the force raises the variance of a mean.
    pub force: f64,
    /// Variance of that wandering over that of a row: what a mean over any number of rows still has. As it is to be expected, where chance may
    /// have made what was measured, too: over a poke's hundreds of rows what is too small to be told still counts.
    pub wander: f64,
    /// Whether more of it was measured than chance usually makes.
    pub wanders: bool,
    /// Whether the force's zero drifts in proportion to time, rather than wanders; true where too little is known of it.
    pub drifts: bool,
    /// Variance (m²) of the common motion of all markers, along each axis.
    pub sway_m2: [f64; 3],
    /// Variance (m²) of an error that each marker has for a while during a poke, along each axis.
    pub lasting_m2: [f64; 3],
}

/// Frames between pokes, one list for every poke that they follow.
pub(super) fn pauses(recording: &Recording, evidence: &Evidence) -> Vec<Vec<Frame>> {
    let markers = &recording.markers;
    let frame = |rows: &[MarkerRow]| Frame {
        time_s: markers.frame_time_s[rows[0].frame as usize],
        seen: rows
            .iter()
            .filter(|row| evidence.rest[row.marker as usize].1 > 0)
            .map(|row| {
                let marker = row.marker as usize;
                (marker, Vec3::from(row.position_m) - evidence.rest[marker].0)
            })
            .collect(),
    };
    let frames: Vec<Frame> = markers.rows.chunk_by(|a, b| a.frame == b.frame).map(frame).collect();
    let within = |[from, until]: [f64; 2]| {
        frames.iter().filter(|f| (from..until).contains(&f.time_s)).cloned().collect()
    };
    rests(recording).map(within).collect()
}

/// From when to when the tip is off after each poke (s).
pub(super) fn rests(recording: &Recording) -> impl Iterator<Item = [f64; 2]> + '_ {
    let last_s = recording.markers.frame_time_s.last().copied().unwrap_or_default();
    recording.pokes.iter().enumerate().map(move |(i, poke)| {
        let until = recording.pokes.get(i + 1).map_or(last_s, |next| next.start_s - MARGIN_S);
        [poke.end_s + SETTLED_S, until]
    })
}

/// Measures all of them. What a reading says to move between pokes is no error.
pub(super) fn correlation(recording: &Recording, evidence: &Evidence, creep: &Creep) -> Correlation {
    let sd = evidence.noise.force_n;
    let means = block_means(&force_at_rest(recording));
    let drifts = drifts(&means, sd);
    let (ratio, freedom) = wandering(&means, sd, drifts);
    let rows = means.iter().map(|m| m.rows).sum::<f64>() / means.len().max(1) as f64;
    Correlation {
        force: beyond_chance(ratio, freedom),
        wander: expected_excess(ratio, freedom) / rows.max(1.0),
        wanders: ratio > 1.0 + (2.0 / freedom).sqrt(),
        drifts,
        sway_m2: sway_m2(recording, &evidence.rest, evidence.noise.marker_m, |frame, marker| {
            creep.of(frame, marker)
        }),
        lasting_m2: lasting(recording, evidence, creep),
    }
}

/// Whether the means tell a drift in proportion to time from a zero that only wanders (an Ornstein–Uhlenbeck process, its
/// size and time the likeliest, in either case).
fn drifts(means: &[BlockMean], sd: [f64; 3]) -> bool {
    if means.len() < FEWEST_MEANS {
        return true;
    }
    let mut likeliest = [f64::NEG_INFINITY; 2];
    for size in WANDER_SIZES {
        for time_s in WANDER_TIMES_S {
            let logs: Option<Vec<[f64; 2]>> =
                (0..3).map(|axis| log_likelihoods(means, axis, sd[axis], size * sd[axis], time_s)).collect();
            for log in logs.iter() {
                for (with, best) in likeliest.iter_mut().enumerate() {
                    *best = best.max(log.iter().map(|l| l[with]).sum());
                }
            }
        }
    }
    2.0 * (likeliest[1] - likeliest[0]) > TOLD
}

/// Standard deviations of a wandering zero that are tried, over that of a row, and its times (s).
const WANDER_SIZES: [f64; 8] = [0.0, 0.1, 0.2, 0.35, 0.6, 1.0, 1.8, 3.0];
const WANDER_TIMES_S: [f64; 6] = [0.3, 1.0, 3.0, 8.0, 20.0, 60.0];

/// Twice the logarithm of a ratio of likelihoods beyond which a drift is told from wandering: chance with three parameters once in
/// 10,000 times.
const TOLD: f64 = 21.1;

/// Logarithms of the likelihood of one axis' means without a drift and with the likeliest one, but for a constant.
fn log_likelihoods(means: &[BlockMean], axis: usize, sd: f64, wander: f64, time_s: f64) -> Option<[f64; 2]> {
    let covariance = DMatrix::from_fn(means.len(), means.len(), |i, j| {
        let apart = (means[i].time_s - means[j].time_s).abs();
        let white = if i == j { sd * sd / means[i].rows } else { 0.0 };
        white + wander * wander * (-apart / time_s).exp()
    });
    let factor = covariance.cholesky()?;
    let time = DVector::from_iterator(means.len(), means.iter().map(|m| m.time_s));
    let force = DVector::from_iterator(means.len(), means.iter().map(|m| m.force_n[axis]));
    let (time_solved, force_solved) = (factor.solve(&time), factor.solve(&force));
    let volume: f64 = factor.l_dirty().diagonal().iter().map(|l| l.ln()).sum();
    let without = -0.5 * force.dot(&force_solved) - volume;
    Some([without, without + 0.5 * time.dot(&force_solved).powi(2) / time.dot(&time_solved)])
}

/// What a ratio of variances is beyond 1, to be expected of one that was measured with so many degrees of freedom: the mean of a normal
/// distribution about it, the part below 1 put on 1.
fn expected_excess(ratio: f64, freedom: f64) -> f64 {
    let sd = (2.0 / freedom).sqrt();
    if sd == 0.0 {
        return (ratio - 1.0).max(0.0);
    }
    let (standard, above) = (Normal::standard(), (ratio - 1.0) / sd);
    sd * (above * standard.cdf(above) + standard.pdf(above))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    const SD: f64 = 0.005;

    /// Means of a sensor whose zero wanders and drifts, between eight pokes of five seconds.
    fn rest(seed: u64, wander: f64, time_s: f64, rate: f64) -> Vec<BlockMean> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let keep = (-0.02 / time_s).exp();
        let mut zero = Vec3::from_fn(|_, _| wander * normal());
        let mut rows = Vec::new();
        for i in 0..2_500 {
            let t = 0.02 * f64::from(i);
            zero = keep * zero + Vec3::from_fn(|_, _| (1.0 - keep * keep).sqrt() * wander * normal());
            if i % 300 < 50 {
                rows.push((t, zero + Vec3::from_fn(|_, _| SD * normal()) + Vec3::x() * rate * t));
            }
        }
        block_means(&rows)
    }

    #[test]
    fn a_drift_is_told_from_wandering() {
        let told = |wander: f64, time_s: f64, rate: f64| {
            (0..60).filter(|&seed| drifts(&rest(seed, wander, time_s, rate), [SD; 3])).count()
        };
        for time_s in [1.0, 5.0, 20.0] {
            assert!(told(0.004, time_s, 0.0) <= 1, "{time_s} s");
        }
        assert_eq!(told(0.0, 1.0, 0.0), 0);
        assert_eq!(told(0.0, 1.0, 2e-4), 60);
        assert!(told(0.002, 5.0, 1e-3) >= 58);
    }

    #[test]
    fn what_wanders_weighs_less() {
        let (still, freedom) = wandering(&rest(1, 0.0, 1.0, 0.0), [SD; 3], false);
        assert_eq!(beyond_chance(still, freedom), 1.0);
        let (wanders, _) = wandering(&rest(1, SD, 5.0, 0.0), [SD; 3], false);
        // Means over half a second: 25 rows, all with the same zero.
        assert!((10.0..50.0).contains(&wanders), "{wanders}");
    }

    /// Far above 1 it is what was measured; at 1, with a deviation of 0.2, the mean of the upper half, 0.2/√(2π); far below nothing.
    #[test]
    fn what_chance_may_have_made_counts_in_part() {
        assert!((expected_excess(3.0, 50.0) - 2.0).abs() < 1e-6);
        assert!((expected_excess(1.0, 50.0) - 0.2 / (2.0 * std::f64::consts::PI).sqrt()).abs() < 1e-9);
        assert!(expected_excess(0.0, 50.0) < 1e-6);
        assert_eq!(expected_excess(1.0, f64::INFINITY), 0.0);
    }
}
