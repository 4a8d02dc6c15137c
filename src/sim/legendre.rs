//! Gauss–Legendre points of any order on [0, 1].

use std::f64::consts::PI;

/// The `n` points with their weights (sum 1), ascending; exact for polynomials up to degree 2n − 1.
///
/// Newton's iteration on the Legendre polynomial from the estimate cos(π (i + ¾) / (n + ½)) (Abramowitz & Stegun
/// 1964, 22.16.6); weights 2 / ((1 − x²) P′ₙ(x)²) (25.4.29), halved for the shorter interval.
pub(super) fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    let count = n as f64;
    (0..n)
        .rev()
        .map(|i| {
            let mut x = (PI * (i as f64 + 0.75) / (count + 0.5)).cos();
            let mut slope = 1.0;
            // Quadratic convergence from a good estimate: a handful of steps reach rounding.
            for _ in 0..8 {
                let (mut before, mut value) = (1.0, x);
                for k in 2..=n {
                    let k = k as f64;
                    (before, value) = (value, ((2.0 * k - 1.0) * x * value - (k - 1.0) * before) / k);
                }
                slope = count * (x * value - before) / (x * x - 1.0);
                x -= value / slope;
            }
            (0.5 * (1.0 + x), 1.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_to_degree_two_n_less_one() {
        for n in [2, 5, 12, 24] {
            for degree in 0..2 * n {
                let sum: f64 = gauss_legendre(n).iter().map(|&(x, w)| w * x.powi(degree as i32)).sum();
                assert!((sum * (degree + 1) as f64 - 1.0).abs() < 1e-12, "n = {n}, degree = {degree}");
            }
        }
    }
}
