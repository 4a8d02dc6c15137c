//! How much of a list of samples is noise, and in which steps does its instrument count?

/// 1.4826 · median of absolute deviations: the standard deviation of a normal distribution.
pub(super) const MAD: f64 = 1.4826;
/// Of the differences between values that follow each other by size, the share below the one that is taken for a step.
const LOW: f64 = 0.1;
/// How far a difference may be off a multiple of the step, over the step, and how many must be that close.
const OFF: f64 = 0.05;
const MULTIPLES: f64 = 0.9;

/// The middle one; the upper one of two; zero of none.
pub(super) fn middle(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}

/// Standard deviation of the noise, from second differences, which a smooth course leaves out (their variance is 6 of it); at least that of
/// rounding to the step of [`quantum`], q/√12 (Widrow and Kollár 2008, Quantization Noise, 1.2): samples that all round alike show none.
pub(super) fn noise(values: &[f64]) -> f64 {
    let bends: Vec<f64> = values.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs()).collect();
    (MAD * middle(&bends) / 6_f64.sqrt()).max(quantum(values) / 12_f64.sqrt())
}

/// Step in which the values are counted; zero where their differences are no multiples of one.
pub(super) fn quantum(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let (Some(low), Some(high)) = (sorted.first(), sorted.last()) else { return 0.0 };
    // Printed digits and conversions make no steps of their own.
    let least = 1e-9 * (high - low);
    let mut steps: Vec<f64> = sorted.windows(2).map(|w| w[1] - w[0]).filter(|s| *s > least).collect();
    steps.sort_by(f64::total_cmp);
    let Some(step) = steps.get((LOW * steps.len() as f64) as usize).copied() else { return 0.0 };
    let fits = steps.iter().filter(|s| (*s / step - (*s / step).round()).abs() < OFF).count();
    if fits as f64 >= MULTIPLES * steps.len() as f64 { step } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounded_values_have_a_step_and_others_have_none() {
        let smooth: Vec<f64> = (0..400).map(|k| (0.37 * f64::from(k)).sin() + 1e-3 * f64::from(k)).collect();
        assert_eq!(quantum(&smooth), 0.0);
        let rounded: Vec<f64> = smooth.iter().map(|v| 0.224_809 * (v / 0.05).round() * 0.05).collect();
        assert!((quantum(&rounded) / (0.05 * 0.224_809) - 1.0).abs() < 1e-6);
        // A course so slow that most samples round alike.
        let slow: Vec<f64> = (0..400).map(|k| (1e-3 * f64::from(k) / 0.05).round() * 0.05).collect();
        assert!((noise(&slow) - 0.05 / 12_f64.sqrt()).abs() < 1e-12);
    }
}
