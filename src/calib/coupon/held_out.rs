//! Does a fault's model predict rows that its fit did not see? A name is only given where it does.
//!
//! All numbers are root mean squares over the peak: what is missed without the fault in the model, and with it.

use super::marks::mean;

/// Share of what is missed without the fault that may be missed with it.
const GAIN: f64 = 0.7;
/// Share of the peak below which what is missed does not matter.
const MATTERS: f64 = 0.001;

/// Whether the model with the fault is better by enough, and what is missed without it matters.
pub(super) fn helps([without, with]: [f64; 2]) -> bool {
    without > MATTERS && with < GAIN * without
}

/// Root mean square.
pub(super) fn rms(left: &[f64]) -> f64 {
    (left.iter().map(|v| v * v).sum::<f64>() / left.len().max(1) as f64).sqrt()
}

/// A level: the mean of every other value, against `known`, on the values between.
pub(super) fn level(values: &[f64], known: f64, peak: f64) -> [f64; 2] {
    let found = mean(&every_other(values, 0));
    let unseen = every_other(values, 1);
    let left = |from: f64| rms(&unseen.iter().map(|v| v - from).collect::<Vec<_>>()) / peak;
    [left(known), left(found)]
}

/// A trend: the line through every other value, against their mean, on the values between.
pub(super) fn trend(at: &[f64], values: &[f64], peak: f64) -> [f64; 2] {
    let (x, y) = (every_other(at, 0), every_other(values, 0));
    let (slope, place, height) = line(&x, &y);
    let unseen: Vec<(f64, f64)> = every_other(at, 1).into_iter().zip(every_other(values, 1)).collect();
    let left = |slope: f64| {
        rms(&unseen.iter().map(|(x, y)| y - height - slope * (x - place)).collect::<Vec<_>>()) / peak
    };
    [left(0.0), left(slope)]
}

/// A step behind row `at`: its size from the first rows behind it, against the course before going on, on the rows after those.
pub(super) fn step(time: &[f64], values: &[f64], at: usize, peak: f64) -> Option<[f64; 2]> {
    const BEFORE: usize = 10;
    const SIZE: usize = 4;
    const UNSEEN: usize = 10;
    let (from, to) = (at.saturating_sub(BEFORE), (at + SIZE + UNSEEN).min(values.len()));
    if at < from + 4 || to < at + SIZE + 3 {
        return None;
    }
    let (slope, place, height) = line(&time[from..at], &values[from..at]);
    let left: Vec<f64> = (at..to).map(|k| values[k] - height - slope * (time[k] - place)).collect();
    let size = mean(&left[..SIZE]);
    let behind: Vec<f64> = left[SIZE..].iter().map(|v| v - size).collect();
    Some([rms(&left[SIZE..]) / peak, rms(&behind) / peak])
}

/// Slope of the line of least squares, the mean place and the mean value.
pub(super) fn line(x: &[f64], y: &[f64]) -> (f64, f64, f64) {
    let (place, height) = (mean(x), mean(y));
    let across: f64 = x.iter().map(|v| (v - place).powi(2)).sum();
    let both: f64 = x.iter().zip(y).map(|(a, b)| (a - place) * (b - height)).sum();
    (if across > 0.0 { both / across } else { 0.0 }, place, height)
}

fn every_other(values: &[f64], from: usize) -> Vec<f64> {
    values.iter().copied().skip(from).step_by(2).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A step of 2 on a slope of 1 in 50: with it the unseen rows are met exactly, without it missed by 2.
    #[test]
    fn a_step_is_predicted_and_a_slope_has_none() {
        let time: Vec<f64> = (0..40).map(f64::from).collect();
        let with = |size: f64| -> Vec<f64> {
            time.iter().map(|t| t + if *t >= 20.0 { size } else { 0.0 }).collect()
        };
        let found = step(&time, &with(2.0), 20, 50.0).expect("enough rows");
        assert!((found[0] - 0.04).abs() < 1e-12 && found[1] < 1e-12 && helps(found), "{found:?}");
        assert!(!helps(step(&time, &with(0.0), 20, 50.0).expect("enough rows")));
        let found = trend(&time, &with(0.0), 50.0);
        assert!(found[1] < 1e-12 && helps(found), "{found:?}");
        assert!(!helps(level(&[1.0, 1.0, 1.0, 1.0], 1.0, 5.0)) && helps(level(&[1.0; 4], 0.0, 5.0)));
    }
}
