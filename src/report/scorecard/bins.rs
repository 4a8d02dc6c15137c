//! Bins of equal count: how often verdicts of a confidence are right.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

/// Draws of about the same confidence, or strength.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Bin {
    /// How many.
    pub count: usize,
    /// Their least and their greatest value.
    pub range: [f64; 2],
    /// Their mean value.
    pub mean: f64,
    /// Share of them that is right.
    pub right: f64,
}

/// At most `bins` bins of equal count, give or take one, by ascending value; pairs are a value and whether it was right.
/// Equal values keep their order.
pub fn reliability(pairs: &[(f64, bool)], bins: usize) -> Vec<Bin> {
    let mut sorted = pairs.to_vec();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (count, bins) = (sorted.len(), bins.min(sorted.len()));
    (0..bins)
        .map(|i| {
            let part = &sorted[i * count / bins..(i + 1) * count / bins];
            let share = |sum: f64| sum / part.len() as f64;
            Bin {
                count: part.len(),
                range: [part[0].0, part[part.len() - 1].0],
                mean: share(part.iter().map(|p| p.0).sum()),
                right: share(part.iter().filter(|p| p.1).count() as f64),
            }
        })
        .collect()
}

/// Expected calibration error (Naeini, Cooper & Hauskrecht 2015): mean distance of confidence and share right over the
/// bins, weighted by count; none without bins.
pub fn calibration_error(bins: &[Bin]) -> Option<f64> {
    let total: usize = bins.iter().map(|b| b.count).sum();
    let sum: f64 = bins.iter().map(|b| b.count as f64 * (b.mean - b.right).abs()).sum();
    (total > 0).then(|| sum / total as f64)
}

/// The expected calibration error, in the mean, of verdicts that are right exactly as often as their confidence says: chance alone makes so
/// much of it in so many bins. Seeded; none without confidences.
pub(super) fn calibration_error_by_chance(confidences: &[f64], bins: usize) -> Option<f64> {
    const TIMES: u32 = 1000;
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut drawn = || {
        let pairs: Vec<(f64, bool)> = confidences.iter().map(|&c| (c, random.random::<f64>() < c)).collect();
        calibration_error(&reliability(&pairs, bins))
    };
    (0..TIMES).map(|_| drawn()).sum::<Option<f64>>().map(|sum| sum / f64::from(TIMES))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_share_the_draws_and_their_error_is_the_weighted_distance() {
        // 23 pairs in ten bins: two or three each.
        let pairs: Vec<(f64, bool)> = (0..23).map(|i| (f64::from(22 - i) / 22.0, i % 2 == 0)).collect();
        let bins = reliability(&pairs, 10);
        assert_eq!(bins.len(), 10);
        assert!(bins.iter().all(|b| (2..=3).contains(&b.count)));
        assert_eq!(bins.iter().map(|b| b.count).sum::<usize>(), 23);
        assert!(bins.windows(2).all(|b| b[0].range[1] <= b[1].range[0]));
        // Two bins: confidence 0.9 of which half is right, 0.5 of which all is right: 0.4 and 0.5 off.
        let pairs = [(0.9, true), (0.9, false), (0.5, true), (0.5, true)];
        let error = calibration_error(&reliability(&pairs, 2)).expect("an error");
        assert!((error - 0.45).abs() < 1e-12, "{error}");
        assert_eq!(calibration_error(&reliability(&[], 10)), None);
    }

    /// Of one bin of `n` it is the mean distance of a binomial share, `√(2 p (1 − p) / π n)`; of verdicts that are sure it is nothing.
    #[test]
    fn chance_alone_makes_an_error() {
        let by_chance =
            |confidence: f64| calibration_error_by_chance(&[confidence; 400], 1).expect("an error");
        let exact = (2.0 * 0.9 * 0.1 / (std::f64::consts::PI * 400.0)).sqrt();
        assert!((by_chance(0.9) / exact - 1.0).abs() < 0.1, "{} {exact}", by_chance(0.9));
        assert_eq!(by_chance(1.0), 0.0);
        assert_eq!(calibration_error_by_chance(&[], 10), None);
    }
}
