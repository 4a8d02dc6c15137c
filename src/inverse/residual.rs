//! What is left between readings and predictions, whitened: unit variance, no correlation, when the model is right
//! and the noise is as stated.
//!
//! Force: the three components of a reading share the noise that the stage's own error makes through the phantom's
//! stiffness, covariance `Σ_F + B Σ_s Bᵀ`. Markers: the error of a marker's rest position is common to all its
//! readings, covariance `σ² (I + g gᵀ / n)` with `g` the readings' sensitivity to a shift and `n` rest rows.
//!
//! The elements' own error is not noise of a row but common to all rows of a site, whose stiffness is off by a factor
//! `1 + ε`. That adds `τ² y yᵀ` to the covariance, `y` the site's readings of force and `τ` the standard deviation of
//! `ε` (a model discrepancy after Kennedy and O'Hagan 2001 of the simplest form). Without it a recording of a
//! thousand rows would weigh a force to 0.01 %, far better than any elements, and what these get wrong would have to
//! be explained by restraint. Markers are weighed by their noise alone: hundreds of them at 50 µm say less about any
//! one displacement than the elements know.

use super::evidence::{DRIVE, Driven, Evidence, Reading};
use super::forward::Prediction;
use super::problem::Linearised;
use crate::geometry::{Mat3, Vec3};
use nalgebra::{DMatrix, DVector};

/// Sizes of the elements' error that are tried: so many steps up from the smallest, each larger by this factor.
const SIZES: i32 = 12;
const SIZE_STEP: f64 = 1.35;

/// Whitening of a recording's readings.
pub struct Whitening<'a> {
    evidence: &'a Evidence,
    /// Relative standard deviation of what the elements get wrong at one site: as used, and at least.
    elements_sd: f64,
    smallest_sd: f64,
    /// For every site, the inverse Cholesky factor of a force reading's covariance.
    force: Vec<Mat3>,
    /// Directions `h` in which the elements' error adds `h hᵀ` to unit covariance, each for readings whitened by
    /// everything before it, with the factor `γ` of `(I + h hᵀ)^(-1/2) = I − γ h hᵀ`.
    elements: Vec<(DVector<f64>, f64)>,
}

impl<'a> Whitening<'a> {
    /// Without the stage's own noise. `elements_sd` is the relative standard deviation of what the elements get wrong at one
    /// site, independent between sites.
    pub fn new(evidence: &'a Evidence, elements_sd: f64) -> Self {
        Self::through(evidence, elements_sd, |_| DMatrix::zeros(3, DRIVE))
    }

    /// As this one, with the stage's noise carried into the force by the stiffness of `prediction`.
    pub fn near(&self, prediction: &Prediction) -> Self {
        let smallest =
            Self::through(self.evidence, self.smallest_sd, |site| prediction.sites[site].force.clone());
        smallest.with_elements(self.elements_sd)
    }

    fn through(evidence: &'a Evidence, elements_sd: f64, stiffness: impl Fn(usize) -> DMatrix<f64>) -> Self {
        let noise = &evidence.noise;
        let diagonal = |sd: [f64; 3]| Mat3::from_diagonal(&Vec3::from(sd.map(|s| s * s)));
        let force = (0..evidence.sites.len())
            .map(|site| {
                let b = stiffness(site);
                let mut covariance = diagonal(noise.force_n);
                if evidence.driven == Driven::ByStage {
                    covariance += &b * evidence.sites[site].drive_noise * b.transpose();
                }
                // Positive definite: a diagonal of positive variances plus a square.
                covariance.cholesky().map_or_else(Mat3::identity, |c| c.l()).try_inverse().unwrap_or_default()
            })
            .collect();
        Self { evidence, elements_sd, smallest_sd: elements_sd, force, elements: Vec::new() }
            .with_elements(elements_sd)
    }

    /// As this one, with elements that get so much wrong.
    fn with_elements(&self, elements_sd: f64) -> Self {
        let (evidence, force) = (self.evidence, self.force.clone());
        let mut whitening =
            Self { evidence, elements_sd, smallest_sd: self.smallest_sd, force, elements: Vec::new() };
        for site in 0..evidence.sites.len() {
            let h = whitening.whiten(|place, reading| {
                let own = place.site == site && place.marker.is_none();
                if own { reading.value * elements_sd } else { Vec3::zeros() }
            });
            let size2 = h.norm_squared();
            if size2 > 0.0 {
                whitening.elements.push((h, (1.0 - (1.0 + size2).sqrt().recip()) / size2));
            }
        }
        whitening
    }

    /// As this one, with the elements' error of that size, from this one's upward, which makes what is left at `at` likeliest
    /// (restricted likelihood, Patterson and Thompson 1971: what modulus and patches can absorb is not judged).
    pub fn with_likeliest_elements(&self, at: &Linearised) -> Self {
        let raw = |v: DVector<f64>| self.without_elements(v);
        let residual = raw(at.residual.clone());
        let columns: Vec<DVector<f64>> = at.jacobian.column_iter().map(|c| raw(c.into_owned())).collect();
        let deviance = |whitening: &Self| {
            let columns: Vec<_> = columns.iter().map(|c| whitening.and_elements(c.clone())).collect();
            let qr = DMatrix::from_columns(&columns).qr();
            let left = whitening.and_elements(residual.clone());
            let absorbed = qr.q().transpose() * &left;
            let spread: f64 = whitening.elements.iter().map(|(h, _)| h.norm_squared().ln_1p()).sum();
            let known: f64 = qr.r().diagonal().iter().map(|d| d.abs().max(f64::MIN_POSITIVE).ln()).sum();
            left.norm_squared() - absorbed.norm_squared() + spread + 2.0 * known
        };
        (0..=SIZES)
            .map(|step| self.with_elements(self.smallest_sd * SIZE_STEP.powi(step)))
            .map(|whitening| (deviance(&whitening), whitening))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map_or_else(|| self.with_elements(self.elements_sd), |(_, whitening)| whitening)
    }

    /// Relative standard deviation of what the elements get wrong at one site.
    pub fn elements_sd(&self) -> f64 {
        self.elements_sd
    }

    /// The last step of whitening: the elements' error.
    fn and_elements(&self, mut v: DVector<f64>) -> DVector<f64> {
        for (h, gamma) in &self.elements {
            let along = gamma * h.dot(&v);
            v.axpy(-along, h, 1.0);
        }
        v
    }

    /// The last step undone: `(I − γ h hᵀ)⁻¹ = I + γ / (1 − γ h²) h hᵀ`.
    fn without_elements(&self, mut v: DVector<f64>) -> DVector<f64> {
        for (h, gamma) in self.elements.iter().rev() {
            let along = gamma / (1.0 - gamma * h.norm_squared()) * h.dot(&v);
            v.axpy(along, h, 1.0);
        }
        v
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
        self.whiten(|place, reading| reading.value - place.predicted(prediction, reading))
    }

    /// Whitened change of the predictions (the residual's derivative, sign reversed).
    pub fn sensitivity(&self, derivative: &Prediction) -> DVector<f64> {
        self.whiten(|place, reading| place.predicted(derivative, reading))
    }

    fn whiten(&self, value: impl Fn(Place, &Reading) -> Vec3) -> DVector<f64> {
        let mut out = Vec::with_capacity(self.readings());
        for (site, (readings, l)) in self.evidence.sites.iter().zip(&self.force).enumerate() {
            for reading in &readings.force {
                out.extend_from_slice((l * value(Place { site, marker: None }, reading)).as_slice());
            }
        }
        let sd = Vec3::from(self.evidence.noise.marker_m);
        for (marker, (_, rest_rows)) in self.evidence.rest.iter().enumerate() {
            let all = || {
                self.evidence.sites.iter().enumerate().flat_map(|(site, readings)| {
                    let place = Place { site, marker: Some(marker) };
                    readings.markers[marker].iter().map(move |reading| (place, reading))
                })
            };
            let g2: f64 = all().map(|(_, r)| r.shift * r.shift).sum();
            // (I + g gᵀ/n)^(-1/2) = I − γ g gᵀ
            let gamma = if g2 > 0.0 {
                (1.0 - (1.0 + g2 / (*rest_rows).max(1) as f64).sqrt().recip()) / g2
            } else {
                0.0
            };
            let raw: Vec<(f64, Vec3)> =
                all().map(|(place, r)| (r.shift, value(place, r).component_div(&sd))).collect();
            let along: Vec3 = raw.iter().map(|(g, v)| v * *g).sum();
            for (g, v) in raw {
                out.extend_from_slice((v - along * (gamma * g)).as_slice());
            }
        }
        self.and_elements(DVector::from_vec(out))
    }
}

/// Whose reading it is.
#[derive(Debug, Clone, Copy)]
struct Place {
    site: usize,
    /// Of the force when `None`.
    marker: Option<usize>,
}

impl Place {
    fn predicted(self, prediction: &Prediction, reading: &Reading) -> Vec3 {
        let map = &prediction.sites[self.site];
        let rows = match self.marker {
            None => map.force.fixed_rows::<3>(0),
            Some(marker) => map.markers.fixed_rows::<3>(3 * marker),
        };
        Vec3::from_fn(|i, _| rows.row(i).iter().zip(reading.drive.iter()).map(|(a, x)| a * x).sum())
    }
}
