//! Step two: the springs that the search displacements stand for (equations 7 to 11).
//!
//! In: the condensed body, the modulus (Pa) and search displacements (3 Nₛ, m) of step one. Out: forces on the
//! body at the search nodes (3 Nₛ, N) and one stiffness a node (N/m).

use crate::inverse::l1::{L1Problem, L1Solution, Sign, active_set, interior_point};
use crate::inverse::{Condensed, SolveError};
use nalgebra::{DVector, Vector3};

/// Forces on the body at the search nodes (3 Nₛ, N) that explain `observed` (3 Nₒ, m) beside the load, by the
/// l1 problem (10): minimise ‖A_F x − y‖² + λ‖x‖₁ with `A_F = C_OS / E`, `y = O − c_O / E` and λ from (11):
/// `error / max |O|` (`error` per component, m) of the λ above which no force is left.
///
/// # Errors
/// What the solvers report.
pub fn search_forces(
    body: &Condensed,
    young_modulus_pa: f64,
    observed: &DVector<f64>,
    error: f64,
) -> Result<L1Solution, SolveError> {
    let matrix = &body.observed_search / young_modulus_pa;
    let target = observed - &body.observed_load / young_modulus_pa;
    // (10) is twice the form of `l1`, so that λ is halved there: half of ‖2 A_Fᵀ y‖∞ is ‖A_Fᵀ y‖∞.
    let lambda = error / observed.amax() * matrix.tr_mul(&target).amax();
    let penalty = DVector::from_element(matrix.ncols(), lambda);
    let problem = L1Problem::new(&matrix, &target, &penalty, Sign::Free)?;
    let reference = interior_point(&problem)?;
    active_set(&problem, Some(&reference.x)).or(Ok(reference))
}

/// The direct method: forces on the body at the search nodes (3 Nₛ, N) as what is missing from equilibrium,
/// `Mᵀ K Û` of a displacement that carries the load elsewhere: `E C_SS⁻¹ S − C_SS⁻¹ c_S`.
///
/// # Errors
/// [`SolveError::NotPositiveDefinite`] for search nodes that are held or named twice.
pub fn reactions(
    body: &Condensed,
    young_modulus_pa: f64,
    search_m: &DVector<f64>,
) -> Result<DVector<f64>, SolveError> {
    Ok(body.search_factor()?.solve(&(search_m * young_modulus_pa - &body.search_load)))
}

/// One stiffness a search node (N/m): `−f·u / |u|²`, zero where nothing moves and nothing pulls.
pub fn equivalent_stiffness(forces: &DVector<f64>, search_m: &DVector<f64>) -> Vec<f64> {
    let vectors = |v: &DVector<f64>, j: usize| Vector3::new(v[3 * j], v[3 * j + 1], v[3 * j + 2]);
    (0..forces.len() / 3)
        .map(|j| {
            let (f, u) = (vectors(forces, j), vectors(search_m, j));
            if f.norm() == 0.0 { 0.0 } else { -f.dot(&u) / u.norm_squared() }
        })
        .collect()
}
