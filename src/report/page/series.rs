//! What the page's plots are drawn from: force against depth and time, residuals by poke.
//!
//! Lengths leave here in millimetres or micrometres, forces in newtons, force residuals in millinewtons.

use super::skin::rounded;
use super::thin::thin;
use crate::geometry::Vec3;
use crate::inverse::{Fit, PokeView, Sample};
use crate::observation::Recording;
use serde::Serialize;

/// Samples drawn for one poke at most.
const DRAWN: usize = 600;

/// Everything that is plotted.
#[derive(Serialize)]
pub(super) struct Series {
    pokes: Vec<PokeSeries>,
    /// One standard deviation of the force (mN).
    force_sd_mn: [f64; 3],
    /// Root mean square length of a marker's noise (µm).
    marker_length_sd_um: f64,
}

#[derive(Serialize)]
struct PokeSeries {
    number: u32,
    chi2_per_value: f64,
    t_s: Vec<f64>,
    /// Depth of the tip (mm); absent when no stage was recorded.
    depth_mm: Option<Vec<f64>>,
    /// Force along the poke's direction (N).
    measured_n: Vec<f64>,
    model_n: Vec<f64>,
    /// Measured less modelled along x, y, z (mN).
    residual_mn: [Vec<f64>; 3],
    marker: Vec<u32>,
    /// Length of each marker's residual (µm).
    marker_residual_um: Vec<f64>,
}

impl Series {
    pub(super) fn new(fit: &Fit, recording: &Recording) -> Self {
        let staged = recording.stage.is_some();
        Self {
            pokes: fit.pokes.iter().map(|p| PokeSeries::new(p, staged)).collect(),
            force_sd_mn: recording.noise.force_n.map(|sd| sd * 1e3),
            marker_length_sd_um: Vec3::from(recording.noise.marker_m).norm() * 1e6,
        }
    }
}

impl PokeSeries {
    fn new(poke: &PokeView, staged: bool) -> Self {
        let samples = &poke.samples;
        let along = |force: [f64; 3]| Vec3::from(force).dot(&poke.direction);
        let residual = |s: &Sample, axis: usize| s.measured_n[axis] - s.modelled_n[axis];
        let kept = thin(
            samples.len(),
            DRAWN,
            &[
                &|i| residual(&samples[i], 0),
                &|i| residual(&samples[i], 1),
                &|i| residual(&samples[i], 2),
                &|i| along(samples[i].measured_n),
                &|i| samples[i].depth_m,
            ],
        );
        let column = |per_unit: f64, of: &dyn Fn(&Sample) -> f64| -> Vec<f64> {
            kept.iter().map(|&i| rounded(of(&samples[i]), per_unit)).collect()
        };
        Self {
            number: poke.number,
            chi2_per_value: poke.chi2_per_value,
            t_s: column(1e3, &|s| s.time_s),
            depth_mm: staged.then(|| column(1e4, &|s| s.depth_m * 1e3)),
            measured_n: column(1e5, &|s| along(s.measured_n)),
            model_n: column(1e5, &|s| along(s.modelled_n)),
            residual_mn: [0, 1, 2].map(|axis| column(1e3, &|s| residual(s, axis) * 1e3)),
            marker: poke.markers.iter().map(|m| m.number).collect(),
            marker_residual_um: poke
                .markers
                .iter()
                .map(|m| rounded((m.measured_m - m.modelled_m).norm() * 1e6, 10.0))
                .collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A poke along −z: pushing down is a positive force along it, and the thinned plot keeps its peak.
    #[test]
    fn forces_are_along_the_poke_and_peaks_stay() {
        let sample = |i: u32| {
            let peak = if i == 1234 { 0.5 } else { 0.0 };
            let modelled_n = [0.0, 0.0, -0.1];
            Sample {
                time_s: f64::from(i) * 1e-3,
                depth_m: 2e-3,
                measured_n: [0.001, 0.002, -0.1 - peak],
                modelled_n,
            }
        };
        let poke = PokeView {
            number: 3,
            site_m: Vec3::zeros(),
            direction: -Vec3::z(),
            radius_m: 0.008,
            deepest_s: 0.0,
            node_displacement_m: Vec::new(),
            markers: Vec::new(),
            samples: (0..5000).map(sample).collect(),
            chi2_per_value: 1.0,
        };
        let drawn = PokeSeries::new(&poke, true);
        assert!(drawn.t_s.len() <= DRAWN && drawn.t_s.len() > 100, "{} drawn", drawn.t_s.len());
        let at = drawn.t_s.iter().position(|&t| t == 1.234).expect("the peak");
        assert_eq!((drawn.measured_n[at], drawn.model_n[at]), (0.6, 0.1));
        assert_eq!([0, 1, 2].map(|axis| drawn.residual_mn[axis][at]), [1.0, 2.0, -500.0]);
        assert_eq!(drawn.depth_mm.as_ref().map(|d| d[at]), Some(2.0));
        assert!(PokeSeries::new(&poke, false).depth_mm.is_none());
    }
}
