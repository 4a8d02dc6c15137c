//! The coordinates in which step one's normal equations are an arrow: all search displacements decoupled,
//! the modulus coupled to each.
//!
//! For the regulariser `R` of the search displacements and `S = T y` with `TᵀRT = I`, the singular values of
//! the Jacobian `J_S T = U Σ Vᵀ` are found once; with `S = T V z` a step costs one pass over the vectors
//! instead of a factorisation. Singular values come from the smaller Gram matrix, as the printed normal
//! equations have them; directions below its rounding are left alone, which is what a regularised step does
//! with them, and makes an unregularised one the step of least norm.

use nalgebra::{DMatrix, DVector};

/// Decoupled search displacements.
#[derive(Debug, Clone)]
pub(super) struct Basis {
    /// Observed displacement per unit coordinate, normalised (3 Nₒ × r).
    pub(super) observed: DMatrix<f64>,
    /// Search displacement per unit coordinate (3 Nₛ × r).
    pub(super) search: DMatrix<f64>,
    /// Singular values (r), descending order not implied.
    pub(super) singular: DVector<f64>,
}

impl Basis {
    /// From the whitened Jacobian `J_S T` (3 Nₒ × 3 Nₛ) and `T` as an action on a matrix.
    pub(super) fn new(jacobian: &DMatrix<f64>, unwhiten: impl Fn(DMatrix<f64>) -> DMatrix<f64>) -> Self {
        let (rows, columns) = jacobian.shape();
        let tall = rows >= columns;
        let gram = if tall { jacobian.tr_mul(jacobian) } else { jacobian * jacobian.transpose() };
        let eigen = gram.symmetric_eigen();
        let floor = eigen.eigenvalues.amax() * rows.max(columns) as f64 * f64::EPSILON;
        let kept: Vec<usize> =
            (0..eigen.eigenvalues.len()).filter(|&i| eigen.eigenvalues[i] > floor).collect();
        let singular = DVector::from_iterator(kept.len(), kept.iter().map(|&i| eigen.eigenvalues[i].sqrt()));
        let known = eigen.eigenvectors.select_columns(&kept);
        let mut other = if tall { jacobian * &known } else { jacobian.tr_mul(&known) };
        for (mut column, s) in other.column_iter_mut().zip(&singular) {
            column /= *s;
        }
        let (observed, right) = if tall { (other, known) } else { (known, other) };
        Self { observed, search: unwhiten(right), singular }
    }
}
