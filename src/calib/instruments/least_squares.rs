//! Weighted linear least squares whose errors share causes.
//!
//! y = X β + e, cov e = V = s² 1 + Σ_k j_k j_kᵀ: independent noise of one unknown size s, and effects that several rows
//! have in common (a direction that is off by a little, a weight that is not what it says), each with a known standard deviation that is
//! part of j_k. β̂ = (Xᵀ V⁻¹ X)⁻¹ Xᵀ V⁻¹ y (Aitken 1935). s is the one that makes the residuals as large as they should be:
//! rᵀ V⁻¹ r = n − p, and zero where the shared causes alone explain more than that.

use nalgebra::{DMatrix, DVector};

/// Smallest noise that is looked for, over the root mean square of the residuals of ordinary least squares.
const LEAST: f64 = 1e-4;
/// Halvings of the logarithm of the noise.
const HALVINGS: usize = 30;

/// An estimate with what is known of its error.
#[derive(Debug, Clone)]
pub(super) struct Estimate {
    pub(super) beta: DVector<f64>,
    pub(super) covariance: DMatrix<f64>,
    /// Noise of a row of factor 1.
    pub(super) noise: f64,
    pub(super) residuals: DVector<f64>,
}

/// Generalised least squares. `shared`: the vectors j_k, a row for each of y. None where X has not full rank.
pub(super) fn generalised(x: &DMatrix<f64>, y: &DVector<f64>, shared: &[DVector<f64>]) -> Option<Estimate> {
    let (n, p) = x.shape();
    let ordinary = solve(x, y, &DMatrix::identity(n, n))?;
    let free = n.checked_sub(p).filter(|&free| free > 0)? as f64;
    let rms = (ordinary.residuals.norm_squared() / free).sqrt();
    let scaled = |mut found: Estimate, noise: f64, variance: f64| {
        found.noise = noise;
        found.covariance *= variance;
        found
    };
    // Residuals that are rounding errors are none.
    if shared.is_empty() || rms <= f64::EPSILON * y.norm() {
        return Some(scaled(ordinary, rms, rms * rms));
    }
    let mut common = DMatrix::zeros(n, n);
    for effect in shared {
        common.ger(1.0, effect, effect, 1.0);
    }
    let excess = |noise: f64| -> Option<(f64, Estimate)> {
        let v = &common + DMatrix::identity(n, n) * (noise * noise);
        let inverse = v.cholesky()?.inverse();
        let found = solve(x, y, &inverse)?;
        Some(((found.residuals.transpose() * &inverse * &found.residuals)[0] - free, found))
    };
    let (mut low, mut high) = ((LEAST * rms).ln(), (2.0 * rms).ln());
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if excess(middle.exp())?.0 > 0.0 { low = middle } else { high = middle }
    }
    let (_, found) = excess(high.exp())?;
    Some(scaled(found, high.exp(), 1.0))
}

/// β̂ and its covariance for the inverse of V.
pub(super) fn solve(x: &DMatrix<f64>, y: &DVector<f64>, inverse: &DMatrix<f64>) -> Option<Estimate> {
    let weighted = x.transpose() * inverse;
    let covariance = (&weighted * x).cholesky()?.inverse();
    let beta = &covariance * (&weighted * y);
    let residuals = y - x * &beta;
    beta.iter().all(|b| b.is_finite()).then_some(Estimate { beta, covariance, noise: 1.0, residuals })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A straight line by hand: y = 1 + 2x with residuals +1, −2, +1 at x = −1, 0, 1.
    #[test]
    fn a_line_and_its_deviations() {
        let x = DMatrix::from_row_slice(3, 2, &[1.0, -1.0, 1.0, 0.0, 1.0, 1.0]);
        let y = DVector::from_row_slice(&[0.0, -1.0, 4.0]);
        let found = generalised(&x, &y, &[]).expect("full rank");
        assert!((found.beta[0] - 1.0).abs() < 1e-12 && (found.beta[1] - 2.0).abs() < 1e-12);
        assert!((found.noise - 6.0_f64.sqrt()).abs() < 1e-12);
        assert!(
            (found.covariance[(1, 1)] - 3.0).abs() < 1e-12 && (found.covariance[(0, 0)] - 2.0).abs() < 1e-12
        );
        assert!(generalised(&DMatrix::from_element(3, 2, 1.0), &y, &[]).is_none());
    }

    /// What all rows share along a column cannot be seen in the residuals, and adds to the deviation.
    #[test]
    fn what_cannot_be_seen_adds_to_the_deviation() {
        let x = DMatrix::from_row_slice(4, 1, &[1.0, 2.0, 3.0, 4.0]);
        let y = DVector::from_row_slice(&[1.1, 1.9, 3.1, 3.9]);
        let alone = generalised(&x, &y, &[]).expect("full rank");
        let shared =
            generalised(&x, &y, &[DVector::from_column_slice(x.as_slice()) * 0.05]).expect("full rank");
        let expected = alone.covariance[(0, 0)] + 0.05 * 0.05;
        assert!((shared.covariance[(0, 0)] - expected).abs() < 1e-6 * expected);
        assert!((shared.beta[0] - alone.beta[0]).abs() < 1e-9 && (shared.noise - alone.noise).abs() < 1e-6);
    }
}
