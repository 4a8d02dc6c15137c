//! What is left between readings and predictions, whitened: unit variance, no correlation, when the model is right
//! and the noise is as stated.
//!
//! Force: the three components of a reading share the noise that the stage's own error makes through the phantom's
//! stiffness, covariance `Σ_F + B Σ_s Bᵀ` with `Σ_s` that of the drive. Markers: the error of a marker's rest position is common to all its
//! readings, covariance `σ² (I + g gᵀ / n)` with `g` the readings' sensitivity to a shift and `n` rest rows. Where the camera sways,
//! all markers of a site have that in common besides (see `sway`). Where the force's zero wanders it adds `z² g²` to the variance of a reading of
//! force, `z` its standard deviation (see `wander`).
//!
//! The elements' own error is not noise of a row but common to all rows along one direction of the drive: the force there is
//! off by a share `ε` of its size, whichever way. That adds `τ² |y|²` to the variance of every component of that
//! reading, `τ` the standard deviation of `ε` (a model discrepancy after Kennedy and O'Hagan 2001 of the simplest form).
//! Without it a recording of a thousand rows would weigh a force to 0.01 %, far better than any elements, and what
//! these get wrong would have to be explained by restraint. Markers are weighed by their noise alone: hundreds of
//! them at 50 µm say less about any one displacement than the elements know.

use super::evidence::{DRIVE, Driven, Evidence, Reading};
use super::forward::Prediction;
use super::problem::Linearised;
use super::shared_error::SharedError;
use super::sway::swaying;
use super::wander::zero_sd_n;
use crate::geometry::{Mat3, Vec3};
use nalgebra::{DMatrix, DVector};
use std::sync::Arc;

/// Sizes of the elements' error that are tried: so many steps up from the smallest, each larger by this factor.
const SIZES: i32 = 8;
const SIZE_STEP: f64 = 1.35;

/// Whitening of a recording's readings.
#[derive(Clone)]
pub struct Whitening<'a> {
    evidence: &'a Evidence,
    /// Relative standard deviation of what the elements get wrong in one reading of force: as used, and at least.
    elements_sd: f64,
    smallest_sd: f64,
    /// For every site, what noise alone makes of the covariance of a reading of force.
    noise: Vec<Mat3>,
    /// For every site and reading of force, the inverse Cholesky factor of its covariance.
    force: Vec<Vec<Mat3>>,
    /// Where the camera sways, what that moves.
    shared: Option<Arc<SharedError>>,
}

impl<'a> Whitening<'a> {
    /// Without the stage's own noise. `elements_sd` is the relative standard deviation of what the elements get wrong in
    /// one reading of force, independent between readings.
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
        let diagonal = |sd: [f64; 3]| Mat3::from_diagonal(&Vec3::from(sd.map(|s| s * s)));
        let noise = (0..evidence.sites.len())
            .map(|site| {
                let b = stiffness(site);
                let mut covariance = diagonal(evidence.noise.force_n);
                if evidence.driven == Driven::ByStage {
                    covariance += &b * evidence.sites[site].drive_noise * b.transpose();
                }
                covariance
            })
            .collect();
        let bare =
            Self { evidence, elements_sd, smallest_sd: elements_sd, noise, force: Vec::new(), shared: None }
                .with_elements(elements_sd);
        let shared = bare.sway().map(Arc::new);
        Self { shared, ..bare }
    }

    /// What a camera that sways moves: at every site all markers alike along each axis.
    fn sway(&self) -> Option<SharedError> {
        let mut columns = Vec::new();
        for (axis, sd) in swaying(self.evidence) {
            columns.extend((0..self.evidence.sites.len()).map(|site| {
                self.whiten(|place, reading| match place.marker {
                    Some(_) if place.site == site => Vec3::ith(axis, sd * reading.shift),
                    _ => Vec3::zeros(),
                })
            }));
        }
        if columns.is_empty() { None } else { SharedError::of(&columns) }
    }

    /// As this one, with elements that get so much wrong.
    fn with_elements(&self, elements_sd: f64) -> Self {
        let zero = Vec3::from(zero_sd_n(self.evidence).unwrap_or_default());
        let zero = Mat3::from_diagonal(&zero.component_mul(&zero));
        let force = self
            .evidence
            .sites
            .iter()
            .zip(&self.noise)
            .map(|(site, noise)| {
                let of = |reading: &Reading| {
                    let elements = elements_sd * elements_sd * reading.value.norm_squared();
                    let covariance =
                        noise + Mat3::identity() * elements + zero * (reading.shift * reading.shift);
                    // Positive definite: a diagonal of positive variances plus squares.
                    let factor = covariance.cholesky().map_or_else(Mat3::identity, |c| c.l());
                    factor.try_inverse().unwrap_or_default()
                };
                site.force.iter().map(of).collect()
            })
            .collect();
        let (noise, shared) = (self.noise.clone(), self.shared.clone());
        Self { evidence: self.evidence, elements_sd, smallest_sd: self.smallest_sd, noise, force, shared }
    }

    /// As this one, with the elements' error of that size, from the smallest upward, which makes what is left at `at`
    /// likeliest (restricted likelihood, Patterson and Thompson 1971: what modulus and patches can absorb is not judged).
    /// `at` was whitened by this one.
    pub fn with_likeliest_elements(&self, at: &Linearised) -> Self {
        let deviance = |other: &Self| {
            let columns: Vec<_> =
                at.jacobian.column_iter().map(|c| self.turned_to(other, c.into_owned())).collect();
            let qr = DMatrix::from_columns(&columns).qr();
            let left = self.turned_to(other, at.residual.clone());
            let absorbed = qr.q().transpose() * &left;
            let spread: f64 = other.force.iter().flatten().map(|l| -2.0 * l.determinant().abs().ln()).sum();
            let known: f64 = qr.r().diagonal().iter().map(|d| d.abs().max(f64::MIN_POSITIVE).ln()).sum();
            left.norm_squared() - absorbed.norm_squared() + spread + 2.0 * known
        };
        (0..=SIZES)
            .map(|step| self.with_elements(self.smallest_sd * SIZE_STEP.powi(step)))
            .map(|whitening| (deviance(&whitening), whitening))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map_or_else(|| self.with_elements(self.elements_sd), |(_, whitening)| whitening)
    }

    /// What this one whitened, as `other` would have; they differ in the elements' error only.
    fn turned_to(&self, other: &Self, mut whitened: DVector<f64>) -> DVector<f64> {
        for (i, (own, other)) in self.force.iter().flatten().zip(other.force.iter().flatten()).enumerate() {
            let raw = own.try_inverse().unwrap_or_default() * whitened.fixed_rows::<3>(3 * i);
            whitened.fixed_rows_mut::<3>(3 * i).copy_from(&(other * raw));
        }
        whitened
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

    /// What the wrench's own noise makes of the readings: whitened columns, one for each of its components in each reading of each site,
    /// which are independent of one another. It is common to all markers, so that their number does not average it away. None
    /// when the stage drives the model.
    pub fn drive_errors(&self, prediction: &Prediction) -> Vec<DVector<f64>> {
        let noise = &self.evidence.noise;
        let sd: Vec<f64> = match self.evidence.driven {
            Driven::ByStage => Vec::new(),
            Driven::ByWrench => noise.force_n.into_iter().chain(noise.torque_nm).collect(),
        };
        let mut columns = Vec::new();
        for (at, site) in self.evidence.sites.iter().enumerate() {
            let most = site.markers.iter().map(Vec::len).max().unwrap_or(0);
            for index in 0..most {
                for (component, sd) in sd.iter().enumerate() {
                    let column = |place: Place| {
                        prediction.sites[at]
                            .markers
                            .fixed_view::<3, 1>(3 * place.marker.unwrap_or(0), component)
                            * *sd
                    };
                    columns.push(self.whiten(|place, _| match (place.site, place.index) == (at, index) {
                        true if place.marker.is_some() => column(place),
                        _ => Vec3::zeros(),
                    }));
                }
            }
        }
        columns
    }

    fn whiten(&self, value: impl Fn(Place, &Reading) -> Vec3) -> DVector<f64> {
        let mut out = Vec::with_capacity(self.readings());
        for (site, (readings, l)) in self.evidence.sites.iter().zip(&self.force).enumerate() {
            for (index, (reading, l)) in readings.force.iter().zip(l).enumerate() {
                out.extend_from_slice((l * value(Place { site, marker: None, index }, reading)).as_slice());
            }
        }
        let sd = Vec3::from(self.evidence.noise.marker_m);
        for (marker, (_, rest_rows)) in self.evidence.rest.iter().enumerate() {
            let all = || {
                self.evidence.sites.iter().enumerate().flat_map(|(site, readings)| {
                    let place = move |index| Place { site, marker: Some(marker), index };
                    readings.markers[marker].iter().enumerate().map(move |(i, reading)| (place(i), reading))
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
        let mut out = DVector::from_vec(out);
        if let Some(shared) = &self.shared {
            shared.take_off(&mut out);
        }
        out
    }
}

/// Whose reading it is.
#[derive(Debug, Clone, Copy)]
struct Place {
    site: usize,
    /// Of the force when `None`.
    marker: Option<usize>,
    /// Index among the readings of the same force or marker.
    index: usize,
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

#[cfg(test)]
mod tests {
    use super::super::evidence::{Drive, Site};
    use super::super::forward::SitePrediction;
    use super::super::lift::{DriveNoise, Lift};
    use super::*;
    use crate::observation::Noise;

    /// Under a sphere the drive is powers of the depth, not the stage's displacement: a reading of force is weighed by what their own noise makes of
    /// it through the map that is in proportion to them.
    #[test]
    fn the_noise_of_the_stage_is_carried_as_its_lift_says() {
        let value = Vec3::new(0.1, -0.2, 0.4);
        let reading = Reading { drive: Drive::zeros(), value, shift: 0.0 };
        let drive_noise = DriveNoise::from_fn(|i, j| if i == j { 0.03 } else { 0.01 });
        let site = Site {
            centre: Vec3::zeros(),
            direction: -Vec3::z(),
            radius_m: 4e-3,
            pokes: vec![0],
            force: vec![reading],
            markers: Vec::new(),
            lift: Lift::Series { inward: -Vec3::z(), deepest_m: 3e-3 },
            drive_noise,
        };
        let noise =
            Noise { force_n: [0.05; 3], torque_nm: [1.0; 3], marker_m: [1e-5; 3], stage_m: [1e-6; 3] };
        let evidence = Evidence::of_sites(vec![site], noise);
        let force = DMatrix::from_fn(3, DRIVE, |i, j| if j < 4 { 0.2 * (1 + i * j) as f64 } else { 0.0 });
        let covariance =
            DMatrix::identity(3, 3) * 0.05_f64.powi(2) + &force * drive_noise * force.transpose();
        let prediction =
            Prediction { sites: vec![SitePrediction { force, markers: DMatrix::zeros(0, DRIVE) }] };
        let whitened = Whitening::new(&evidence, 0.0).near(&prediction).residual(&prediction);
        let solved = covariance.lu().solve(&value).expect("definite");
        let expected = value.dot(&Vec3::new(solved[0], solved[1], solved[2]));
        assert!((whitened.norm_squared() / expected - 1.0).abs() < 1e-9, "{whitened} {expected}");
    }
}
