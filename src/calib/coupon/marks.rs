//! Marks that faults leave in a list of samples: noise, jumps, flat stretches, spikes.

/// 1.4826 · median of absolute deviations: the standard deviation of a normal distribution.
const MAD: f64 = 1.4826;

pub(super) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// The middle one; the upper one of two.
pub(super) fn middle(values: &[f64]) -> f64 {
    median(values.to_vec())
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

/// Standard deviation of the noise, from second differences, which a smooth course leaves out: their variance is 6 of it.
pub(super) fn noise(values: &[f64]) -> f64 {
    let bends = values.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs()).collect();
    MAD * median(bends) / 6_f64.sqrt()
}

/// Steps that the course around them does not make: index behind the step, and the step less the median of its neighbours.
pub(super) fn jumps(values: &[f64], sigma: f64, least: f64) -> Vec<(usize, f64)> {
    const NEAR: usize = 6;
    let step = |i: usize| values[i] - values[i - 1];
    let mut found = Vec::new();
    for i in NEAR + 1..values.len().saturating_sub(NEAR) {
        let around =
            (i - NEAR..=i + NEAR).filter(|j| *j != i && *j > 0 && *j < values.len()).map(step).collect();
        let excess = step(i) - median(around);
        // Lasting: the means before and behind differ by it, too; a spike comes back.
        let lasting = mean(&values[i..i + 3]) - mean(&values[i - 3..i]);
        if excess.abs() > (8.0 * sigma).max(least) && lasting.abs() > 0.6 * excess.abs() {
            found.push((i, excess));
        }
    }
    found
}

/// Single samples off both neighbours, which agree.
pub(super) fn spikes(values: &[f64], sigma: f64, least: f64) -> Vec<usize> {
    (2..values.len().saturating_sub(2))
        .filter(|&i| {
            let (before, behind) = (values[i - 1], values[i + 1]);
            let off = values[i] - 0.5 * (before + behind);
            off.abs() > (10.0 * sigma).max(least) && (before - behind).abs() < 0.3 * off.abs()
        })
        .collect()
}

/// The longest stretch of equal values: where it begins and how long it is.
pub(super) fn flat(values: &[f64]) -> (usize, usize) {
    let (mut best, mut start) = ((0, 1), 0);
    for i in 1..=values.len() {
        if i == values.len() || values[i] != values[start] {
            if i - start > best.1 {
                best = (start, i - start);
            }
            start = i;
        }
    }
    best
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
        assert_eq!(spikes(&values, 0.1, 1.0), [20]);
        assert_eq!(between(&[(0.0, 1.0), (2.0, 3.0)], 0.5), Some(1.5));
        assert_eq!(between(&[(0.0, 1.0), (2.0, 3.0)], 2.5), None);
        assert_eq!(flat(&[1.0, 2.0, 2.0, 2.0, 3.0]), (1, 3));
    }
}
