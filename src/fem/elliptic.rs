//! Complete elliptic integrals, in forms that lose no digits for small parameters.

use std::f64::consts::FRAC_PI_2;

/// Complete elliptic integrals of one parameter `m = k²`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Complete {
    /// `K = ∫ dφ / √(1 − m sin²φ)` over a quarter turn.
    pub k: f64,
    /// `D = (K − E) / m`.
    pub d: f64,
    /// `[(2 − m) E − 2 (1 − m) K] / m²`.
    pub c: f64,
}

/// As close to 1 as a parameter is taken: `K` and `D` have no bound there, their difference and the last are within 10⁻¹⁰ of their limits.
const NEAREST: f64 = 1.0 - 1e-12;

impl Complete {
    /// For `0 ≤ m ≤ 1`, by the arithmetic-geometric mean (Abramowitz & Stegun 1964, section 17.6): with `a₀ = 1`, `b₀ = √(1 − m)` and
    /// `cₙ = (aₙ₋₁ − bₙ₋₁)/2`, `K = π/2a` and `K − E = K Σ 2ⁿ⁻¹ cₙ²`. As `c₀² = m`, all that follow are divided by `m` before they are
    /// summed: `T = Σ₁ 2ⁿ⁻¹ (cₙ/m)²`, `D = K (½ + m T)`, and the last integral is `D − 2 K T`.
    pub(super) fn of(m: f64) -> Self {
        let m = m.min(NEAREST);
        let root = (1.0 - m).sqrt();
        // (1 − √(1 − m)) / 2 over m.
        let mut over_m = 0.5 / (1.0 + root);
        let (mut a, mut b) = (0.5 * (1.0 + root), root.sqrt());
        let (mut double, mut sum) = (1.0, 0.0);
        loop {
            let term = double * over_m * over_m;
            sum += term;
            if term * m <= f64::EPSILON * sum {
                break;
            }
            let next = 0.5 * (a + b);
            over_m = m * over_m * over_m / (4.0 * next);
            b = (a * b).sqrt();
            a = next;
            double *= 2.0;
        }
        let k = FRAC_PI_2 / a;
        let d = k * (0.5 + m * sum);
        Self { k, d, c: d - 2.0 * k * sum }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The trapezoidal rule over the period of an analytic function is exact to rounding.
    #[test]
    fn all_are_the_integrals_of_their_definitions() {
        for m in [1e-12, 1e-4, 0.1, 0.5, 0.9, 0.99] {
            let n = 256;
            let mean = |f: &dyn Fn(f64, f64) -> f64| {
                let at = |i: i32| FRAC_PI_2 * (f64::from(i) + 0.5) / f64::from(n);
                (0..n).map(|i| f(at(i).sin().powi(2), (1.0 - m * at(i).sin().powi(2)).sqrt())).sum::<f64>()
                    * FRAC_PI_2
                    / f64::from(n)
            };
            let found = Complete::of(m);
            let k = mean(&|_, root| 1.0 / root);
            let d = mean(&|square, root| square / root);
            assert!((found.k / k - 1.0).abs() < 1e-13, "K({m})");
            assert!((found.d / d - 1.0).abs() < 1e-13, "D({m})");
            // (2 − m) E − 2 (1 − m) K = 3 m² ∫ sin²φ cos²φ / √(1 − m sin²φ) dφ, by parts.
            let c = 3.0 * mean(&|square, root| square * (1.0 - square) / root);
            assert!((found.c / c - 1.0).abs() < 1e-13, "C({m})");
        }
        let one = Complete::of(1.0);
        assert!((one.k - one.d - 1.0).abs() < 1e-9 && (one.c - 1.0).abs() < 1e-9, "{one:?}");
        let none = Complete::of(0.0);
        assert_eq!([none.k, none.d], [FRAC_PI_2, 0.5 * FRAC_PI_2]);
    }
}
