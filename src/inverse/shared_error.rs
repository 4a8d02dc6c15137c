//! How are readings whitened against errors that many of them share?

use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Whitening against a few directions of readings that have unit variance besides.
pub(super) struct SharedError {
    /// Orthonormal directions, in columns.
    directions: DMatrix<f64>,
    /// What is taken off along each.
    off: DVector<f64>,
}

impl SharedError {
    /// Of errors `columns` with one standard deviation each: the covariance is 1 + C Cᵀ. None where there is no error.
    pub(super) fn of(columns: &[DVector<f64>]) -> Option<Self> {
        let errors = DMatrix::from_columns(columns);
        let eigen = SymmetricEigen::new(errors.transpose() * &errors);
        let largest = eigen.eigenvalues.amax();
        let kept: Vec<usize> =
            (0..columns.len()).filter(|&i| eigen.eigenvalues[i] > NEGLIGIBLE * largest).collect();
        let variance = DVector::from_iterator(kept.len(), kept.iter().map(|&i| eigen.eigenvalues[i]));
        let mut directions = &errors * eigen.eigenvectors.select_columns(&kept);
        for (mut direction, variance) in directions.column_iter_mut().zip(variance.iter()) {
            direction /= variance.sqrt();
        }
        let off = variance.map(|v| 1.0 - (1.0 + v).sqrt().recip());
        (!kept.is_empty()).then_some(Self { directions, off })
    }

    /// (1 + C Cᵀ)^(−1/2) of readings.
    pub(super) fn take_off(&self, readings: &mut DVector<f64>) {
        let along = self.directions.tr_mul(readings).component_mul(&self.off);
        readings.gemv(-1.0, &self.directions, &along, 1.0);
    }
}

/// Share of the largest variance that is none.
const NEGLIGIBLE: f64 = 1e-12;

#[cfg(test)]
mod tests {
    use super::*;

    /// Against two directions that are not at right angles: what is taken off whitens the covariance 1 + C Cᵀ.
    #[test]
    fn what_is_taken_off_whitens() {
        let columns =
            [DVector::from_vec(vec![3.0, 4.0, 0.0, 0.0]), DVector::from_vec(vec![1.0, 0.0, 2.0, 0.0])];
        let errors = DMatrix::from_columns(&columns);
        let covariance = DMatrix::identity(4, 4) + &errors * errors.transpose();
        let common = SharedError::of(&columns).expect("two directions");
        let whitening: Vec<DVector<f64>> = (0..4)
            .map(|i| {
                let mut unit = DVector::zeros(4);
                unit[i] = 1.0;
                common.take_off(&mut unit);
                unit
            })
            .collect();
        let whitening = DMatrix::from_columns(&whitening);
        let white = &whitening * covariance * whitening.transpose();
        assert!((white - DMatrix::<f64>::identity(4, 4)).amax() < 1e-12);
        assert!(SharedError::of(&[DVector::zeros(4)]).is_none());
    }
}
