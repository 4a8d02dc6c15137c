//! Where does a force drop that should rise, so that the specimen slipped in the grips or was torn?
//!
//! A step down that no noise of the steps makes (median and median of absolute deviations, Hampel 1974, J. Am. Stat. Assoc. 69, 383), that is
//! no small share of the force there and of the greatest one, and that lasts: the middle one of three values behind it lies below that of three
//! before, so that one that stands out alone is no slip. What does not pull yet can't slip. At the very end, where the crosshead stops or turns, nothing is left to last.

use super::noise::MAD;

/// Standard deviations of the steps.
const SIGMAS: f64 = 8.0;
/// Least drop over the force at that place.
const SHARE: f64 = 0.05;
/// Least drop over the greatest force.
const OF_GREATEST: f64 = 0.02;
/// Values before and behind.
const NEAR: usize = 3;

/// Index of the first value behind a slip.
pub(super) fn slip(values: &[f64]) -> Option<usize> {
    let steps: Vec<f64> = values.windows(2).map(|w| w[1] - w[0]).collect();
    let middle = |mut list: Vec<f64>| {
        list.sort_by(f64::total_cmp);
        list.get(list.len() / 2).copied()
    };
    let median = middle(steps.clone())?;
    let sigma = MAD * middle(steps.iter().map(|s| (s - median).abs()).collect())?;
    let greatest = values.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let drops = |at: &usize| {
        let (step, before) = (steps[*at - 1], values[*at - 1]);
        let near = |from: usize, to: usize| middle(values[from..to].to_vec());
        let lasts = || near(*at, *at + NEAR) < near(at.saturating_sub(NEAR), *at);
        let least = (SHARE * before.abs()).max(OF_GREATEST * greatest);
        step < 0.0 && median - step > SIGMAS * sigma && -step > least && lasts()
    };
    (1..values.len().saturating_sub(NEAR - 1)).find(drops)
}

#[cfg(test)]
mod tests {
    use super::slip;

    #[test]
    fn a_drop_that_lasts_is_a_slip_and_a_spike_is_none() {
        let rising: Vec<f64> = (0..60).map(|k| 0.3 * f64::from(k) + 0.02 * f64::from(k % 3)).collect();
        assert_eq!(slip(&rising), None);
        let mut dropped = rising.clone();
        dropped[40..].iter_mut().for_each(|v| *v -= 4.0);
        assert_eq!(slip(&dropped), Some(40));
        let mut ended = rising.clone();
        ended[59] -= 4.0;
        assert_eq!(slip(&ended), None);
        // Slack at first, with noise, then pulled: nothing slips before it pulls.
        let slack: Vec<f64> =
            (0..60).map(|k| (0.3 * f64::from(k - 15)).max(0.0) + 0.01 * (7.0 * f64::from(k)).sin()).collect();
        assert_eq!(slip(&slack), None);
        let mut spiked = rising;
        spiked[40] += 6.0;
        assert_eq!(slip(&spiked), None);
    }
}
