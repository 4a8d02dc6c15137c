//! Fung solid: W = μ/(2b) (exp(b (Ī₁ − 3)) − 1) + κ/2 (J − 1)².
//!
//! The exponential of Fung (1967) in the isotropic form of Demiray (1972).
//! h(i) = (e^(b i) − 1)/b = i · expm1(x)/x with x = b i, which has no cancellation and no division by zero as
//! b → 0, where it is neo-Hookean. h′ = eˣ, h″ = b eˣ, ∂h′/∂b = i eˣ.

use super::MaterialError;
use super::isochoric::Isochoric;

/// The largest exponent that is evaluated: e^600 ≈ 4e260 leaves room for moduli, squares and sums.
const LARGEST_EXPONENT: f64 = 600.0;

/// h(i) for the stiffening b (–).
pub(super) fn isochoric(i: f64, b: f64) -> Result<Isochoric, MaterialError> {
    let x = b * i;
    if x > LARGEST_EXPONENT {
        return Err(MaterialError::Overstretched { exponent: x, limit: LARGEST_EXPONENT });
    }
    let slope = x.exp();
    let value = if x == 0.0 { i } else { i * (x.exp_m1() / x) };
    Ok(Isochoric { value, slope, curvature: b * slope, slope_growth: i * slope })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Taylor: h = i + b i²/2 + b² i³/6 + …; the neo-Hookean h is i.
    #[test]
    fn becomes_neo_hookean_smoothly() {
        let i = 0.3;
        for b in [0.0, 1e-300, 1e-16, -1e-12, 1e-9, -1e-6, 1e-4] {
            let h = isochoric(i, b).expect("moderate");
            let taylor = i + b * i * i / 2.0 + b * b * i * i * i / 6.0;
            assert!((h.value - taylor).abs() <= 1e-15 + b.abs().powi(3), "b = {b}: {} {taylor}", h.value);
            assert!((h.slope - 1.0 - b * i).abs() <= 1e-15 + b * b);
            assert_eq!(h.curvature, b * h.slope);
        }
    }

    #[test]
    fn an_exponent_out_of_range_is_an_error_with_its_value() {
        assert_eq!(
            isochoric(100.0, 8.0),
            Err(MaterialError::Overstretched { exponent: 800.0, limit: LARGEST_EXPONENT })
        );
    }
}
