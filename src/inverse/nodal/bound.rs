//! The Cramér–Rao bound of the modulus and of the restraint's total stiffness, springs on known nodes.
//!
//! The Fisher information of independent normal errors is `JᵀJ / σ²`; the bound of a function of the unknowns
//! is `gᵀ (JᵀJ)⁻¹ g σ²` with its gradient g. Here in the unknowns (E, k), by `∂/∂k = (∂s/∂k) ∂/∂s` at fixed κ
//! and the share that E has in κ.

use super::NodalProblem;
use crate::inverse::SolveError;
use nalgebra::{DMatrix, DVector};

/// Least standard deviations of unbiased estimates.
#[derive(Debug, Clone, PartialEq)]
pub struct Bound {
    /// Of Young's modulus (Pa).
    pub young_modulus_pa: f64,
    /// Of the sum of all springs (N/m); nothing when there is none, or one is held.
    pub total_n_per_m: Option<f64>,
    /// Of each spring (N/m), in the order of the nodes given, those held left out.
    pub each_n_per_m: Vec<f64>,
}

/// The bound for a body of `young_modulus_pa` with springs `stiffness` (one for each of the nodes `support`,
/// N/m; nodes held are known to be held) and displacements observed to `sigma_m`.
///
/// # Errors
/// [`SolveError::NotPositiveDefinite`] when the observation does not determine the unknowns.
pub fn bound(
    problem: &NodalProblem,
    young_modulus_pa: f64,
    support: &[usize],
    stiffness: &[f64],
    sigma_m: f64,
) -> Result<Bound, SolveError> {
    let groups: Vec<Vec<usize>> = (0..support.len()).map(|j| vec![j]).collect();
    bound_of_groups(problem, young_modulus_pa, support, stiffness, &groups, sigma_m)
}

/// As [`bound`], when the springs of each of `groups` (indices into `support`) are known to be equal.
pub(super) fn bound_of_groups(
    problem: &NodalProblem,
    young_modulus_pa: f64,
    support: &[usize],
    stiffness: &[f64],
    groups: &[Vec<usize>],
    sigma_m: f64,
) -> Result<Bound, SolveError> {
    let s: Vec<f64> = stiffness.iter().map(|&k| problem.saturation(young_modulus_pa, k)).collect();
    let state = problem.state(support, &s)?;
    let by_s = problem.derivatives(&state) / young_modulus_pa;
    let springs: Vec<&Vec<usize>> = groups.iter().filter(|g| g.iter().all(|&j| s[j] < 1.0)).collect();
    // k = E κ₀ s / (1 − s), so that ∂s/∂k = (1 − s)² / (E κ₀) at fixed E, and ∂s/∂E = −(k / E) ∂s/∂k.
    let per_unit = problem.stiffness(young_modulus_pa, 0.5);
    let slope = |j: usize| (1.0 - s[j]).powi(2) / per_unit;
    let mut columns = vec![&state.shape * (-1.0 / young_modulus_pa.powi(2))];
    for group in &springs {
        let mut column = columns[0].clone() * 0.0;
        for &j in *group {
            column.axpy(slope(j), &by_s.column(j), 1.0);
            columns[0].axpy(-slope(j) * stiffness[j] / young_modulus_pa, &by_s.column(j), 1.0);
        }
        columns.push(column);
    }
    let jacobian = DMatrix::from_columns(&columns);
    // Unit columns before the inverse: pascals and newtons per metre differ by orders of magnitude.
    let norms = DVector::from_iterator(jacobian.ncols(), jacobian.column_iter().map(|c| c.norm()));
    let unit = DMatrix::from_fn(jacobian.nrows(), jacobian.ncols(), |r, c| jacobian[(r, c)] / norms[c]);
    let factor = unit.tr_mul(&unit).cholesky().ok_or(SolveError::NotPositiveDefinite {
        what: "the information on modulus and springs",
        size: jacobian.ncols(),
    })?;
    let deviation = |gradient: &DVector<f64>| {
        let scaled = gradient.component_div(&norms);
        sigma_m * scaled.dot(&factor.solve(&scaled)).sqrt()
    };
    let axis = |i: usize| DVector::from_fn(norms.len(), |r, _| if r == i { 1.0 } else { 0.0 });
    let total = DVector::from_fn(norms.len(), |r, _| if r == 0 { 0.0 } else { springs[r - 1].len() as f64 });
    Ok(Bound {
        young_modulus_pa: deviation(&axis(0)),
        total_n_per_m: (!springs.is_empty() && springs.len() == groups.len()).then(|| deviation(&total)),
        each_n_per_m: (1..norms.len()).map(|i| deviation(&axis(i))).collect(),
    })
}
