//! What a load does under itself when the whole body changes alike.
//!
//! Elements larger than a tip or a disc hold too little give under it, in the unchanged body as in the changed one. When
//! constants change everywhere, what is missed changes in about the same proportion; so the change that the elements see is
//! carried over: `ΔC → Tᵀ ΔC T`, `T = S^(−1/2) B^(1/2)`, `S` the load's own compliance on the elements and `B` the
//! baseline's, so that `Tᵀ S T = B`. A change from place to place gets no such factor: there it would be wrong.

use nalgebra::{DMatrix, Matrix3};

/// Factors `T` of all loads, three components each.
#[derive(Debug, Clone)]
pub(super) struct Own(Vec<Matrix3<f64>>);

impl Own {
    /// From what the elements say and what the baseline has.
    pub(super) fn new(elements: &DMatrix<f64>, baseline: &[DMatrix<f64>]) -> Self {
        let root = |m: Matrix3<f64>, power: f64| {
            let eigen = ((m + m.transpose()) * 0.5).symmetric_eigen();
            let values = eigen.eigenvalues.map(|x| x.max(f64::MIN_POSITIVE).powf(power));
            eigen.eigenvectors * Matrix3::from_diagonal(&values) * eigen.eigenvectors.transpose()
        };
        Self(
            baseline
                .iter()
                .enumerate()
                .map(|(i, own)| {
                    let seen = elements.fixed_view::<3, 3>(3 * i, 3 * i).into_owned();
                    root(seen, -0.5) * root(own.fixed_view::<3, 3>(0, 0).into_owned(), 0.5)
                })
                .collect(),
        )
    }

    /// What is to be added to a change of the whole body (seen × loads), or to its derivative.
    pub(super) fn missed(&self, change: &DMatrix<f64>) -> DMatrix<f64> {
        let mut all = DMatrix::zeros(change.nrows(), change.ncols());
        for (i, t) in self.0.iter().enumerate() {
            let seen = change.fixed_view::<3, 3>(3 * i, 3 * i);
            let more = t.transpose() * seen * t - seen;
            all.fixed_view_mut::<3, 3>(3 * i, 3 * i).copy_from(&more);
        }
        all
    }
}
