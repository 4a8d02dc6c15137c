//! Young's modulus and Poisson's ratio as shear and bulk modulus.

use super::MaterialError;

/// The two small-strain constants of an isotropic solid: `E` (Pa) and `ν` (–), checked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moduli {
    young: f64,
    poisson: f64,
}

impl Moduli {
    /// Checks `young` (Pa, more than 0) and `poisson` (–, between −1 and 0.5, both excluded).
    pub fn new(young: f64, poisson: f64) -> Result<Self, MaterialError> {
        if !(young > 0.0 && young.is_finite()) {
            return Err(MaterialError::YoungModulus { young_pa: young });
        }
        if !(poisson > -1.0 && poisson < 0.5) {
            return Err(MaterialError::PoissonRatio { poisson });
        }
        Ok(Self { young, poisson })
    }

    /// `E` (Pa).
    pub fn young(&self) -> f64 {
        self.young
    }

    /// `ν` (–).
    pub fn poisson(&self) -> f64 {
        self.poisson
    }

    /// Shear modulus μ = E / (2(1 + ν)) (Pa).
    pub fn shear(&self) -> f64 {
        self.young / (2.0 * (1.0 + self.poisson))
    }

    /// Bulk modulus κ = E / (3(1 − 2ν)) (Pa).
    pub fn bulk(&self) -> f64 {
        self.young / (3.0 * (1.0 - 2.0 * self.poisson))
    }

    /// (∂μ/∂ν)/μ = −1/(1 + ν) at fixed E.
    pub(super) fn shear_growth_with_poisson(&self) -> f64 {
        -1.0 / (1.0 + self.poisson)
    }

    /// (∂κ/∂ν)/κ = 2/(1 − 2ν) at fixed E.
    pub(super) fn bulk_growth_with_poisson(&self) -> f64 {
        2.0 / (1.0 - 2.0 * self.poisson)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 9κμ/(3κ + μ) = E (Landau & Lifshitz, Theory of Elasticity, §5).
    #[test]
    fn shear_and_bulk_give_back_youngs_modulus() {
        let m = Moduli::new(1.0e4, 0.47).expect("a proper solid");
        let (g, k) = (m.shear(), m.bulk());
        assert!((9.0 * k * g / (3.0 * k + g) / 1.0e4 - 1.0).abs() < 1e-14);
    }

    #[test]
    fn impossible_constants_are_refused_with_their_value() {
        assert_eq!(Moduli::new(0.0, 0.3), Err(MaterialError::YoungModulus { young_pa: 0.0 }));
        assert_eq!(Moduli::new(1.0, 0.5), Err(MaterialError::PoissonRatio { poisson: 0.5 }));
        assert!(Moduli::new(f64::NAN, 0.3).is_err() && Moduli::new(1.0, f64::NAN).is_err());
    }
}
