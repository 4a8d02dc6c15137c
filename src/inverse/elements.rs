//! What the elements may get wrong: of one reading of force, of the modulus, of restraint.

use super::error::InverseError;
use super::fit::Settings;
use super::outcome::{FLAT, Settled};
use super::problem::{Parameter, State};
use super::refit::where_answered;
use super::restraint::Mounted;
use crate::fem::{Order, disc_self_compliance};
use crate::geometry::Vec3;
use nalgebra::{DMatrix, DVector};

/// Share of the step from the finest discretisation to the extrapolated limit that is taken as the standard
/// deviation of the error left. Why: the extrapolation assumes that the error falls with the element size, while
/// the size is followed by an unstructured mesh only to about a quarter.
const LEFT_OF_EXTRAPOLATION: f64 = 0.25;

/// Relative standard deviation of the stiffness of all springs alike, beside the rest of [`discretisation_covariance`]: on four concealed slabs
/// for which less than one per cent would have been stated they were off by 0.1 to 2.1 % (1.5 % root mean square).
const SPRINGS: f64 = 0.015;

/// Relative standard deviation of the stiffness under a tip that elements leave.
///
/// Extrapolated: six meshes of 10, 7 and 5 mm, three of them shifted by half an element, leave 0.038 % at a site, of which 0.033 % are
/// common to three sites (root mean square, `what_the_pair_of_a_fit_leaves` in `tests/verification/linear_mesh.rs`), so that 0.02 % are
/// a site's own; a site is given half as much again, as tips come closer to edges than there. A quick fit stays on the given
/// mesh; on slabs with free glue ends its error was up to the common figure where that mesh was as fine there as the
/// first level, and it grows with the edges; where springs pull close to that end its error reached their disc's own compliance too,
/// by 0.09 of it (root mean square of the nine springs found in their places on sixteen drawn slabs). P1, offered for
/// comparison, locks.
pub(super) struct Elements {
    /// Of one reading of force, taken while patches are searched for: cautious, because what is not carried
    /// here is explained by patches.
    pub(super) search: f64,
    /// Of one reading of force, at least.
    pub(super) site: f64,
    /// Common to all sites.
    common: f64,
    /// Of a patch's own compliance, relative to the local compliance of its disc.
    patch: f64,
}

impl Elements {
    /// For these settings, on a given mesh of this [`coarseness`](crate::fem::coarseness).
    pub(super) fn of(settings: &Settings, coarseness: f64) -> Self {
        match (settings.element, settings.quick) {
            (Order::P1, _) => Self { search: 0.05, site: 0.05, common: 0.2, patch: 0.2 },
            (Order::P2, true) => {
                Self { search: 3e-3, site: 3e-3, common: 0.02 * coarseness.max(1.0), patch: 0.1 }
            }
            (Order::P2, false) => Self { search: 3e-3, site: 3e-4, common: 3.5e-4, patch: 0.0 },
        }
    }
}

/// What the elements may get wrong of what was found: one standard deviation each.
#[derive(Debug, Clone, PartialEq)]
pub struct ElementErrors {
    /// Of the modulus, relative.
    pub modulus: f64,
    /// Of the stiffness of all springs together, relative; zero where there are none.
    pub springs: f64,
    /// Of every patch.
    pub patches: Vec<PatchErrors>,
}

/// What they may get wrong of a patch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PatchErrors {
    /// Of its centre along x, y and z (m).
    pub centroid_m: Vec3,
    /// Of the stiffness of its springs, relative; zero of glue.
    pub springs: f64,
}

impl Settled<'_> {
    /// What the elements may get wrong of modulus and restraint.
    ///
    /// # Errors
    /// As for the fit.
    pub fn element_errors(&self) -> Result<ElementErrors, InverseError> {
        Ok(ElementErrors::of(&self.at.state, &self.at.parameters, &discretisation_covariance(self)?))
    }
}

impl ElementErrors {
    /// Those of a state whose parameters have this covariance.
    fn of(state: &State, parameters: &[Parameter], covariance: &DMatrix<f64>) -> Self {
        let springs = |patches: &dyn Fn(usize) -> bool| {
            let mut gradient = DVector::zeros(parameters.len());
            for (i, parameter) in parameters.iter().enumerate() {
                if let Parameter::LogSoftness(p) = parameter
                    && patches(*p)
                {
                    let stiffness = state.modulus / state.patches[*p].softness;
                    gradient[0] += stiffness;
                    gradient[i] -= stiffness;
                }
            }
            let total = gradient[0];
            if total == 0.0 { 0.0 } else { gradient.dot(&(covariance * &gradient)).max(0.0).sqrt() / total }
        };
        let of = |patch: usize| PatchErrors {
            centroid_m: centroid_sd(parameters, covariance, patch),
            springs: springs(&|other| other == patch),
        };
        Self {
            modulus: covariance[(0, 0)].sqrt(),
            springs: springs(&|_| true),
            patches: (0..state.patches.len()).map(of).collect(),
        }
    }
}

/// Standard deviation of a patch's centre along x, y and z (m).
pub(super) fn centroid_sd(parameters: &[Parameter], covariance: &DMatrix<f64>, patch: usize) -> Vec3 {
    let shifts: Vec<(usize, Vec3)> = parameters
        .iter()
        .enumerate()
        .filter_map(|(i, parameter)| match parameter {
            Parameter::Shift(p, tangent) if *p == patch => Some((i, *tangent)),
            _ => None,
        })
        .collect();
    Vec3::from_fn(|axis, _| {
        let mut variance = 0.0;
        for (i, s) in &shifts {
            for (j, t) in &shifts {
                variance += s[axis] * covariance[(*i, *j)] * t[axis];
            }
        }
        variance.max(0.0).sqrt()
    })
}

/// Covariance of the parameters from what discretisation leaves besides what the whitening carries: the error common to
/// all sites, which is one of the modulus, that of each patch's own compliance, one of all springs alike, and part of the
/// step from the finest discretisation to the extrapolated limit, as an error of all parameters together.
pub(super) fn discretisation_covariance(found: &Settled<'_>) -> Result<DMatrix<f64>, InverseError> {
    let (at, problem) = (found.at, found.problem);
    let n = at.parameters.len();
    let mut covariance = DMatrix::zeros(n, n);
    covariance[(0, 0)] += found.elements.common.powi(2);
    for (i, parameter) in at.parameters.iter().enumerate() {
        if let Parameter::LogSoftness(p) = parameter {
            let patch = &at.state.patches[*p];
            let [_, local] = disc_self_compliance(patch.radius_m, problem.bench.model.poisson_ratio());
            covariance[(i, i)] += (found.elements.patch * local / patch.softness).powi(2);
        }
    }
    let springs = at.parameters.iter().map(|p| f64::from(u8::from(matches!(p, Parameter::LogSoftness(_)))));
    let springs = DVector::from_iterator(n, springs) * SPRINGS;
    covariance += &springs * springs.transpose();
    if let Some(correction) = &problem.correction {
        let patches = &at.state.patches;
        let first = Mounted::new(&problem.bench, &problem.search, patches)?;
        let mut finest = first.clone();
        correction.finest.add_to(&mut finest.blocks, patches, &finest.groups);
        // A correction that was made for patches elsewhere need not leave a compliance of the finest discretisation, though it does
        // of the limit. Then the step from the first stands for it.
        let from = match where_answered(problem.residual(&finest, at.state.modulus))? {
            Some(from) => from,
            None => problem.residual(&first, at.state.modulus)?,
        };
        let step = from - &at.residual;
        let normal = (at.jacobian.transpose() * &at.jacobian).cholesky().ok_or(FLAT)?;
        let left = normal.solve(&(at.jacobian.transpose() * step)) * LEFT_OF_EXTRAPOLATION;
        covariance += &left * left.transpose();
    }
    Ok(covariance)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inverse::Restraint;

    /// Two patches of springs that err against each other: each is off by more than both together. Glue has no springs, and what is not
    /// fitted no error of its place.
    #[test]
    fn patches_err_each_by_itself() {
        let patch = |softness: f64| Restraint {
            centre: Vec3::zeros(),
            radius_m: 0.005,
            softness,
            glued: softness == 0.0,
        };
        let state = State { modulus: 1e4, patches: vec![patch(100.0), patch(300.0), patch(0.0)] };
        let along = Vec3::new(0.6, 0.8, 0.0);
        let parameters = [
            Parameter::LogModulus,
            Parameter::LogSoftness(0),
            Parameter::LogSoftness(1),
            Parameter::Shift(1, along),
        ];
        let off = DVector::from_row_slice(&[0.01, 0.03, -0.05, 2e-4]);
        let errors = ElementErrors::of(&state, &parameters, &(&off * off.transpose()));
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} for {b}");
        close(errors.modulus, 0.01);
        // Stiffnesses of 100 and 100/3 N/m, off by -2 and 6 per cent.
        // The root of what rounding leaves of a difference.
        assert!(errors.springs < 1e-6, "{}", errors.springs);
        close(errors.patches[0].springs, 0.02);
        close(errors.patches[1].springs, 0.06);
        assert_eq!(errors.patches[2], PatchErrors { centroid_m: Vec3::zeros(), springs: 0.0 });
        assert_eq!(errors.patches[0].centroid_m, Vec3::zeros());
        assert!((errors.patches[1].centroid_m - along * 2e-4).norm() < 1e-15);
    }
}
