//! What a Gaussian blur makes of a straight edge, and of two that cross.

/// Gauss's and Legendre's places from 0 to 1, and weights.
const GAUSS: [[f64; 2]; 5] = [
    [0.046_910_077_030_668, 0.118_463_442_528_095],
    [0.230_765_344_947_158, 0.239_314_335_249_683],
    [0.5, 0.284_444_444_444_444],
    [0.769_234_655_052_842, 0.239_314_335_249_683],
    [0.953_089_922_969_332, 0.118_463_442_528_095],
];

/// erf(t/√2) to 1.5·10⁻⁷ (Abramowitz & Stegun 1964, equation 7.1.26).
pub(super) fn edge(t: f64) -> f64 {
    let x = t.abs() * std::f64::consts::FRAC_1_SQRT_2;
    let k = 1.0 / (1.0 + 0.327_591_1 * x);
    let series = [1.061_405_429, -1.453_152_027, 1.421_413_741, -0.284_496_736, 0.254_829_592];
    let sum = series.iter().fold(0.0, |sum, a| (sum + a) * k);
    (1.0 - sum * (-x * x).exp()).copysign(t)
}

/// Mean of the product of the signs of two normal numbers with means t and u, variances 1 and correlation ρ, and its derivative by ρ,
/// which is 4 times their joint density at 0. It is E(t) E(u) and the integral of that from 0 to ρ, with ρ = sin θ
///
/// ```text
/// (2/π) ∫ exp(−(t² + u² − 2tu sin θ)/(2cos² θ)) dθ
/// ```
///
/// (Plackett 1954, Biometrika 41, 351) by five points of Gauss and Legendre.
pub(super) fn both(t: f64, u: f64, skew: f64) -> (f64, f64) {
    let density = |sine: f64| (-0.5 * (t * t + u * u - 2.0 * t * u * sine) / (1.0 - sine * sine)).exp();
    let whole = skew.asin();
    let sum: f64 = GAUSS.iter().map(|[place, weight]| weight * density((whole * place).sin())).sum();
    let twice_over_pi = 2.0 / std::f64::consts::PI;
    let share = edge(t) * edge(u) + twice_over_pi * whole * sum;
    (share, twice_over_pi * density(skew) / (1.0 - skew * skew).sqrt())
}

/// The derivative of [`edge`], √(2/π) exp(−t²/2).
pub(super) fn edge_slope(t: f64) -> f64 {
    (2.0 / std::f64::consts::PI).sqrt() * (-0.5 * t * t).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_those_of_tables() {
        // erf(1/√2) and erf(2/√2): the shares of normal errors within one and two standard deviations.
        for (t, share) in [(0.0, 0.0), (1.0, 0.682_689_492), (2.0, 0.954_499_736)] {
            assert!((edge(t) - share).abs() < 2e-7 && (edge(-t) + share).abs() < 2e-7);
        }
        // Over the crossing itself the mean is (2/π) asin ρ (Sheppard 1899).
        for skew in [-0.9_f64, -0.4, 0.0, 0.3, 0.8] {
            let (share, by_skew) = both(0.0, 0.0, skew);
            assert!((share - skew.asin() * std::f64::consts::FRAC_2_PI).abs() < 2e-7);
            let slope = (both(0.7, -0.4, skew + 1e-4).0 - both(0.7, -0.4, skew - 1e-4).0) / 2e-4;
            assert!((both(0.7, -0.4, skew).1 - slope).abs() < 1e-3, "{slope}");
            assert!((by_skew - std::f64::consts::FRAC_2_PI / (1.0 - skew * skew).sqrt()).abs() < 1e-12);
        }
        // Far from both edges nothing of the blur is left.
        assert!((both(6.0, -6.0, 0.5).0 + 1.0).abs() < 1e-6 && (both(6.0, 7.0, -0.5).0 - 1.0).abs() < 1e-6);
    }
}
