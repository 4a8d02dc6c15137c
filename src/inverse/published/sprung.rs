//! The phantom with the modulus and the springs that the two steps found, under any load.
//!
//! With `k` the springs on the components of the search nodes and `f = −k u_S` their pull,
//! `(I + C_SS k / E) E u_S = c_S` and `E u_O = c_O + C_OS f`.

use crate::inverse::Loaded;
use crate::inverse::SolveError;
use nalgebra::DMatrix;

/// Displacement and pull for every load.
pub(super) struct Sprung {
    /// Displacement of the observed points (3 Nₒ × loads, m a unit).
    pub(super) observed: DMatrix<f64>,
    /// Pull of the springs on the body (3 Nₛ × loads, N a unit).
    pub(super) forces: DMatrix<f64>,
}

/// The body of `young_modulus_pa` with springs `stiffness` (one a search node, N/m, of either sign).
///
/// # Errors
/// [`SolveError::NotPositiveDefinite`] when springs below zero undo the body.
pub(super) fn sprung(
    loaded: &Loaded,
    young_modulus_pa: f64,
    stiffness: &[f64],
) -> Result<Sprung, SolveError> {
    let kappa = |component: usize| stiffness[component / 3] / young_modulus_pa;
    let n = loaded.search_loads.nrows();
    let matrix = DMatrix::from_fn(n, n, |r, c| {
        loaded.search_search[(r, c)] * kappa(c) + if r == c { 1.0 } else { 0.0 }
    });
    let mut forces = matrix
        .lu()
        .solve(&loaded.search_loads)
        .ok_or(SolveError::NotPositiveDefinite { what: "the body with its springs", size: n })?;
    for (component, mut row) in forces.row_iter_mut().enumerate() {
        row *= -kappa(component);
    }
    let observed = (&loaded.observed_loads + &loaded.observed_search * &forces) / young_modulus_pa;
    Ok(Sprung { observed, forces })
}
