//! Which of many samples a plot needs: few enough to draw, none of the extremes lost.

/// Indices into `0..count`, ascending, at most `limit` of them unless fewer suffice: first, last, and for each
/// of equal stretches the least and the greatest sample of every channel. A channel says the value of a sample.
///
/// Every channel's extremes over the whole range are among them. All are kept when `count ≤ limit`. `limit` is
/// at least `2 + 2·channels`.
pub(in crate::report) fn thin(count: usize, limit: usize, channels: &[&dyn Fn(usize) -> f64]) -> Vec<usize> {
    if count <= limit {
        return (0..count).collect();
    }
    let stretches = (limit.saturating_sub(2) / (2 * channels.len()).max(1)).max(1);
    let mut kept = vec![0, count - 1];
    for stretch in 0..stretches {
        let range = stretch * count / stretches..(stretch + 1) * count / stretches;
        for channel in channels {
            let by_value = |&a: &usize, &b: &usize| channel(a).total_cmp(&channel(b));
            kept.extend(range.clone().min_by(by_value));
            kept.extend(range.clone().max_by(by_value));
        }
    }
    kept.sort_unstable();
    kept.dedup();
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extremes_stay_and_the_limit_holds() {
        let wave = |i: usize| (i as f64 * 0.01).sin();
        let spike = |i: usize| if i == 7_777 { -9.0 } else { (i as f64 * 0.37).cos() };
        let kept = thin(10_000, 600, &[&wave, &spike]);
        assert!(kept.len() <= 600 && kept.len() > 300, "{}", kept.len());
        assert!(kept.windows(2).all(|w| w[0] < w[1]));
        assert!(kept.contains(&0) && kept.contains(&9_999) && kept.contains(&7_777));
        let greatest = (0..10_000).map(wave).fold(f64::MIN, f64::max);
        assert!(kept.iter().any(|&i| wave(i) == greatest));
    }

    #[test]
    fn few_samples_are_all_kept() {
        assert_eq!(thin(5, 600, &[&|i| i as f64]), [0, 1, 2, 3, 4]);
        assert!(thin(0, 600, &[&|i| i as f64]).is_empty());
    }
}
