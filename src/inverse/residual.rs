//! What is left between readings and predictions, whitened: unit variance, no correlation, when the model is right
//! and the noise is as stated.
//!
//! Force: the three components of a reading share the noise that the stage's own error makes through the phantom's
//! stiffness, covariance `Σ_F + B Σ_s Bᵀ`. Markers: the error of a marker's rest position is common to all its
//! readings, covariance `σ² (I + g gᵀ / n)` with `g` the readings' sensitivity to a shift and `n` rest rows.

use super::evidence::{Driven, Evidence, Reading};
use super::forward::{Prediction, SitePrediction};
use crate::geometry::{Mat3, Vec3};
use nalgebra::{DMatrix, DVector};

/// Whitening of a recording's readings, for predictions near one state.
pub struct Whitening<'a> {
    evidence: &'a Evidence,
    /// For every site, the inverse Cholesky factor of a force reading's covariance.
    force: Vec<Mat3>,
}

impl<'a> Whitening<'a> {
    /// Prepares the whitening, with the stiffness of `prediction` carrying the stage's noise into the force.
    pub fn new(evidence: &'a Evidence, prediction: &Prediction) -> Self {
        let noise = &evidence.noise;
        let diagonal = |sd: [f64; 3]| Mat3::from_diagonal(&Vec3::from(sd.map(|s| s * s)));
        let force = prediction
            .sites
            .iter()
            .zip(&evidence.sites)
            .map(|(map, site)| {
                let mut covariance = diagonal(noise.force_n);
                if evidence.driven == Driven::ByStage {
                    covariance += &map.force * site.drive_noise * map.force.transpose();
                }
                // Positive definite: a diagonal of positive variances plus a square.
                covariance.cholesky().map_or_else(Mat3::identity, |c| c.l()).try_inverse().unwrap_or_default()
            })
            .collect();
        Self { evidence, force }
    }

    /// Number of whitened readings.
    pub fn readings(&self) -> usize {
        self.evidence
            .sites
            .iter()
            .map(|s| 3 * (s.force.len() + s.markers.iter().map(Vec::len).sum::<usize>()))
            .sum()
    }

    /// Whitened residual `reading − prediction`.
    pub fn residual(&self, prediction: &Prediction) -> DVector<f64> {
        self.whiten(|reading, map, row| reading.value - apply(map, row, reading), prediction)
    }

    /// Whitened change of the predictions (the residual's derivative, sign reversed).
    pub fn sensitivity(&self, derivative: &Prediction) -> DVector<f64> {
        self.whiten(|reading, map, row| apply(map, row, reading), derivative)
    }

    fn whiten(
        &self,
        value: impl Fn(&Reading, &DMatrix<f64>, usize) -> Vec3,
        prediction: &Prediction,
    ) -> DVector<f64> {
        let mut out = Vec::with_capacity(self.readings());
        for ((site, map), l) in self.evidence.sites.iter().zip(&prediction.sites).zip(&self.force) {
            for reading in &site.force {
                out.extend_from_slice((l * value(reading, &map.force, 0)).as_slice());
            }
        }
        let sd = Vec3::from(self.evidence.noise.marker_m);
        for (marker, (_, rest_rows)) in self.evidence.rest.iter().enumerate() {
            let all = || {
                self.evidence.sites.iter().zip(&prediction.sites).flat_map(
                    |(site, map): (_, &SitePrediction)| {
                        site.markers[marker].iter().map(move |reading| (reading, &map.markers))
                    },
                )
            };
            let g2: f64 = all().map(|(r, _)| r.shift * r.shift).sum();
            // (I + g gᵀ/n)^(-1/2) = I − γ g gᵀ
            let gamma = if g2 > 0.0 {
                (1.0 - (1.0 + g2 / (*rest_rows).max(1) as f64).sqrt().recip()) / g2
            } else {
                0.0
            };
            let raw: Vec<(f64, Vec3)> = all()
                .map(|(reading, map)| (reading.shift, value(reading, map, 3 * marker).component_div(&sd)))
                .collect();
            let along: Vec3 = raw.iter().map(|(g, v)| v * *g).sum();
            for (g, v) in raw {
                out.extend_from_slice((v - along * (gamma * g)).as_slice());
            }
        }
        DVector::from_vec(out)
    }
}

fn apply(map: &DMatrix<f64>, row: usize, reading: &Reading) -> Vec3 {
    let rows = map.fixed_rows::<3>(row);
    Vec3::from_fn(|i, _| rows.row(i).iter().zip(reading.drive.iter()).map(|(a, x)| a * x).sum())
}
