//! Greatest eigenvalues: of a symmetric action, and of a diagonal matrix to which one vector's square is added.

use nalgebra::{DMatrix, DVector};

/// Relative accuracy of an eigenvalue.
const ACCURACY: f64 = 1e-10;

/// Greatest eigenvalue of a symmetric positive semi-definite action of size `n`, by Lanczos' iteration with full
/// orthogonalisation (Golub & Van Loan 2013, section 10.1). The greatest eigenvalue of the tridiagonal matrix is
/// off by at most the square of its residual over the gap to the next one.
pub(super) fn greatest(n: usize, apply: impl Fn(&DVector<f64>) -> DVector<f64>) -> f64 {
    /// Steps between two looks at the tridiagonal matrix.
    const LOOK: usize = 5;
    // A start without symmetry, so that it is orthogonal to no eigenvector that a symmetric body has.
    let mut next = DVector::from_fn(n, |i, _| 1.0 + 0.5 * ((i * i) as f64 * 0.7).sin()).normalize();
    let mut vectors: Vec<DVector<f64>> = Vec::new();
    let (mut diagonal, mut beside): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
    let mut value = 0.0;
    while vectors.len() < n {
        let mut image = apply(&next);
        diagonal.push(next.dot(&image));
        vectors.push(next);
        for _ in 0..2 {
            for v in &vectors {
                image.axpy(-v.dot(&image), v, 1.0);
            }
        }
        let left = image.norm();
        let m = vectors.len();
        if m.is_multiple_of(LOOK) || m == n || left == 0.0 {
            let tridiagonal = DMatrix::from_fn(m, m, |i, j| match i.abs_diff(j) {
                0 => diagonal[i],
                1 => beside[i.min(j)],
                _ => 0.0,
            });
            let eigen = tridiagonal.symmetric_eigen();
            let top = eigen.eigenvalues.imax();
            let before = std::mem::replace(&mut value, eigen.eigenvalues[top]);
            let residual = left * eigen.eigenvectors[(m - 1, top)].abs();
            if residual <= ACCURACY * value || value - before <= ACCURACY * value && residual <= 1e-4 * value
            {
                break;
            }
        }
        beside.push(left);
        next = image / left;
    }
    value
}

/// Greatest eigenvalue of `diag(d) + z zᵀ`: the greatest root of `Σ zᵢ² / (λ − dᵢ) = 1`, which lies between the
/// greatest dᵢ and that plus `‖z‖²`, and on the former when no root lies above it (Golub 1973, section 5).
pub(super) fn raised(d: &DVector<f64>, z: &DVector<f64>) -> f64 {
    let floor = d.max();
    let (mut low, mut high) = (0.0, z.norm_squared());
    // Bisection on the distance from the greatest dᵢ: every step halves it.
    while high - low > 0.1 * ACCURACY * (floor + low) {
        let middle = 0.5 * (low + high);
        let sum: f64 = d.iter().zip(z).map(|(d, z)| z * z / (floor - d + middle)).sum();
        if sum > 1.0 { low = middle } else { high = middle }
    }
    floor + high
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix(n: usize) -> DMatrix<f64> {
        let a = DMatrix::from_fn(n, n, |i, j| ((3 * i + 7 * j * j) as f64 * 0.37 + 0.5).sin());
        a.tr_mul(&a)
    }

    #[test]
    fn the_greatest_eigenvalue_is_that_of_the_whole_decomposition() {
        for n in [1, 4, 60] {
            let a = matrix(n);
            let whole = a.clone().symmetric_eigen().eigenvalues.max();
            assert!((greatest(n, |v| &a * v) / whole - 1.0).abs() < 1e-9, "{n}");
        }
        assert!((greatest(7, |v| v * 3.0) - 3.0).abs() < 1e-12, "one eigenvalue only");
    }

    #[test]
    fn a_raised_diagonal_has_the_eigenvalue_of_the_sum() {
        let d = DVector::from_fn(9, |i, _| (i as f64 * 1.3).sin().abs());
        for scale in [0.0, 1e-6, 0.3, 50.0] {
            let z = DVector::from_fn(9, |i, _| scale * (i as f64 + 0.5).cos());
            let whole = (DMatrix::from_diagonal(&d) + &z * z.transpose()).symmetric_eigen().eigenvalues.max();
            assert!((raised(&d, &z) / whole - 1.0).abs() < 1e-9, "{scale}");
        }
    }
}
