//! What the page's curves are drawn from: force against time and what is left of it, markers' misfit.
//!
//! Times leave here from the start of each poke (s), forces in newtons, what is left of them in millinewtons.

use crate::diagnose::{Curve, Diagnosis};
use crate::observation::Recording;
use crate::report::page::{rounded, thin};
use serde::Serialize;

/// Samples drawn for one poke at most.
const DRAWN: usize = 400;

/// Everything that is plotted.
#[derive(Serialize)]
pub(super) struct Curves {
    pokes: Vec<CurveSeries>,
    /// One standard deviation of the force along a poke (mN), the largest axis.
    force_sd_mn: f64,
    /// Whether the extended model differs from the baseline.
    extended: bool,
}

#[derive(Serialize)]
struct CurveSeries {
    number: u32,
    /// Whether the mismatch shows in it.
    shows: bool,
    t_s: Vec<f64>,
    depth_mm: Vec<f64>,
    measured_n: Vec<f64>,
    baseline_n: Vec<f64>,
    extended_n: Vec<f64>,
    /// Measured less predicted (mN).
    baseline_left_mn: Vec<f64>,
    extended_left_mn: Vec<f64>,
    marker_t_s: Vec<f64>,
    /// Root mean square of the markers' misfit over their noise.
    marker_baseline: Vec<f64>,
    marker_extended: Vec<f64>,
}

impl Curves {
    pub(super) fn new(diagnosis: &Diagnosis, recording: &Recording) -> Self {
        let shows = |curve: &Curve| diagnosis.mismatch.pokes.contains(&curve.poke);
        Self {
            pokes: diagnosis.curves.iter().map(|c| CurveSeries::new(c, shows(c))).collect(),
            force_sd_mn: 1e3 * recording.noise.force_n.iter().copied().fold(0.0, f64::max),
            extended: !diagnosis.verdict.blamed().is_empty(),
        }
    }
}

impl CurveSeries {
    fn new(curve: &Curve, shows: bool) -> Self {
        let left = |predicted: &[f64], i: usize| curve.measured_n[i] - predicted[i];
        let kept = thin(
            curve.time_s.len(),
            DRAWN,
            &[
                &|i| curve.measured_n[i],
                &|i| left(&curve.baseline_n, i),
                &|i| left(&curve.extended_n, i),
                &|i| curve.depth_m[i],
            ],
        );
        let start = curve.time_s.first().copied().unwrap_or(0.0);
        let column = |per_unit: f64, of: &dyn Fn(usize) -> f64| -> Vec<f64> {
            kept.iter().map(|&i| rounded(of(i), per_unit)).collect()
        };
        let frames = |of: fn(&(f64, f64, f64)) -> f64, offset: f64| -> Vec<f64> {
            curve.markers.iter().map(|frame| rounded(of(frame) - offset, 1e3)).collect()
        };
        Self {
            number: curve.poke,
            shows,
            t_s: column(1e3, &|i| curve.time_s[i] - start),
            depth_mm: column(1e4, &|i| 1e3 * curve.depth_m[i]),
            measured_n: column(1e5, &|i| curve.measured_n[i]),
            baseline_n: column(1e5, &|i| curve.baseline_n[i]),
            extended_n: column(1e5, &|i| curve.extended_n[i]),
            baseline_left_mn: column(1e3, &|i| 1e3 * left(&curve.baseline_n, i)),
            extended_left_mn: column(1e3, &|i| 1e3 * left(&curve.extended_n, i)),
            marker_t_s: frames(|f| f.0, start),
            marker_baseline: frames(|f| f.1, 0.0),
            marker_extended: frames(|f| f.2, 0.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_is_measured_less_predicted_and_peaks_stay() {
        let count = 3000;
        let peak = |i: usize| if i == 1700 { 0.25 } else { 0.0 };
        let curve = Curve {
            poke: 2,
            time_s: (0..count).map(|i| 5.0 + i as f64 * 1e-2).collect(),
            depth_m: vec![2e-3; count],
            measured_n: (0..count).map(|i| 0.5 + peak(i)).collect(),
            baseline_n: vec![0.4; count],
            extended_n: vec![0.5; count],
            markers: vec![(5.5, 3.0, 1.0)],
        };
        let drawn = CurveSeries::new(&curve, true);
        assert!(drawn.t_s.len() <= DRAWN);
        let at = drawn.t_s.iter().position(|&t| t == 17.0).expect("the peak");
        assert_eq!((drawn.baseline_left_mn[at], drawn.extended_left_mn[at]), (350.0, 250.0));
        assert_eq!((drawn.t_s[0], drawn.depth_mm[0]), (0.0, 2.0));
        assert_eq!((drawn.marker_t_s[0], drawn.marker_baseline[0]), (0.5, 3.0));
    }
}
