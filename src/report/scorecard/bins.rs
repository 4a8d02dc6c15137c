//! Bins of equal count: how often verdicts of a confidence are right.

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
}
