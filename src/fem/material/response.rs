//! A material and what it answers: displacement gradient → energy, stress, tangent, parameter sensitivity.
//!
//! # Derivation
//! W = μ/2 h(i) + κ/2 (J − 1)², i = Ī₁ − 3. By the chain rule
//! P = ∂W/∂F = μ/2 h′ ∂Ī₁/∂F + κ (J − 1) ∂J/∂F,
//! A = ∂P/∂F = μ/2 (h″ ∂Ī₁/∂F ⊗ ∂Ī₁/∂F + h′ ∂²Ī₁/∂F²) + κ (∂J/∂F ⊗ ∂J/∂F + (J − 1) ∂²J/∂F²).
//! The derivatives of the invariants are in `kinematics`, h in the file of each law. Verified by Taylor tests,
//! objectivity and closed forms in `tests/verification/material_*.rs`.

use super::isochoric::Isochoric;
use super::kinematics::Kinematics;
use super::{MaterialError, Moduli, fung, linear, neo_hookean, yeoh};
use crate::geometry::Mat3;

/// A = ∂P/∂F (Pa); component (i, J) of either tensor at 3·i + J. Symmetric.
pub type Tangent = nalgebra::SMatrix<f64, 9, 9>;

/// Which law relates strain to energy. All have the same moduli at small strain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Law {
    /// Small strain: linear, not objective.
    Linear,
    /// W = μ/2 (Ī₁ − 3) + κ/2 (J − 1)².
    NeoHookean,
    /// W = μ/2 ((Ī₁ − 3) + c₂ (Ī₁ − 3)²) + κ/2 (J − 1)².
    Yeoh {
        /// c₂ (–); neo-Hookean at 0.
        stiffening: f64,
    },
    /// W = μ/(2b) (exp(b (Ī₁ − 3)) − 1) + κ/2 (J − 1)².
    Fung {
        /// b (–); neo-Hookean at 0.
        stiffening: f64,
    },
}

/// A parameter of a material with respect to which a stress can be differentiated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Parameter {
    /// E (Pa) at fixed ν.
    YoungModulus,
    /// ν (–) at fixed E.
    PoissonRatio,
    /// c₂ or b (–); no effect on the laws that have none.
    Stiffening,
}

/// Energy, stress and tangent at one displacement gradient.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response {
    /// W (J/m³ of undeformed volume).
    pub energy: f64,
    /// P (Pa).
    pub stress: Mat3,
    /// A (Pa).
    pub tangent: Tangent,
}

/// An isotropic elastic material.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Material {
    moduli: Moduli,
    law: Law,
}

impl Material {
    /// A material with the given small-strain moduli; the law's stiffening must be finite.
    pub fn new(moduli: Moduli, law: Law) -> Result<Self, MaterialError> {
        if let Law::Yeoh { stiffening } | Law::Fung { stiffening } = law
            && !stiffening.is_finite()
        {
            return Err(MaterialError::Stiffening { stiffening });
        }
        Ok(Self { moduli, law })
    }

    /// Its small-strain moduli.
    pub fn moduli(&self) -> Moduli {
        self.moduli
    }

    /// Its law.
    pub fn law(&self) -> Law {
        self.law
    }

    /// W (J/m³) at the displacement gradient `h`.
    pub fn energy(&self, h: &Mat3) -> Result<f64, MaterialError> {
        if self.law == Law::Linear {
            return Ok(linear::parts(&self.moduli, h).0);
        }
        let k = Kinematics::new(h)?;
        Ok(self.stored(&k, &self.isochoric(&k)?))
    }

    /// W (J/m³) and P (Pa) at the displacement gradient `h`: all that a residual needs.
    pub fn stress(&self, h: &Mat3) -> Result<(f64, Mat3), MaterialError> {
        if self.law == Law::Linear {
            let (energy, shear, bulk) = linear::parts(&self.moduli, h);
            return Ok((energy, shear + bulk));
        }
        let k = Kinematics::new(h)?;
        let iso = self.isochoric(&k)?;
        let (shear, bulk) = self.stress_parts(&k, &iso);
        Ok((self.stored(&k, &iso), shear + bulk))
    }

    /// W, P and A at the displacement gradient `h`.
    pub fn response(&self, h: &Mat3) -> Result<Response, MaterialError> {
        if self.law == Law::Linear {
            return Ok(linear::response(&self.moduli, h));
        }
        let (mu, kappa) = (self.moduli.shear(), self.moduli.bulk());
        let k = Kinematics::new(h)?;
        let iso = self.isochoric(&k)?;
        let (shear, bulk) = self.stress_parts(&k, &iso);
        let mut tangent = k.curvature(0.5 * mu * iso.slope, kappa * k.volume);
        add_square(&mut tangent, 0.5 * mu * iso.curvature, &k.shape_slope);
        add_square(&mut tangent, kappa, &k.volume_slope);
        Ok(Response { energy: self.stored(&k, &iso), stress: shear + bulk, tangent })
    }

    /// ∂P/∂(parameter) at the fixed displacement gradient `h` (Pa per unit of the parameter).
    pub fn stress_sensitivity(&self, h: &Mat3, parameter: Parameter) -> Result<Mat3, MaterialError> {
        let (shear, bulk, stiffening) = if self.law == Law::Linear {
            let (_, shear, bulk) = linear::parts(&self.moduli, h);
            (shear, bulk, Mat3::zeros())
        } else {
            let k = Kinematics::new(h)?;
            let iso = self.isochoric(&k)?;
            let (shear, bulk) = self.stress_parts(&k, &iso);
            (shear, bulk, 0.5 * self.moduli.shear() * iso.slope_growth * k.shape_slope)
        };
        Ok(match parameter {
            Parameter::YoungModulus => (shear + bulk) / self.moduli.young(),
            Parameter::PoissonRatio => {
                shear * self.moduli.shear_growth_with_poisson()
                    + bulk * self.moduli.bulk_growth_with_poisson()
            }
            Parameter::Stiffening => stiffening,
        })
    }

    fn isochoric(&self, k: &Kinematics) -> Result<Isochoric, MaterialError> {
        match self.law {
            // The callers treat the linear law before they measure a finite strain.
            Law::Linear | Law::NeoHookean => Ok(neo_hookean::isochoric(k.shape)),
            Law::Yeoh { stiffening } => Ok(yeoh::isochoric(k.shape, stiffening)),
            Law::Fung { stiffening } => fung::isochoric(k.shape, stiffening),
        }
    }

    fn stored(&self, k: &Kinematics, iso: &Isochoric) -> f64 {
        0.5 * self.moduli.shear() * iso.value + 0.5 * self.moduli.bulk() * k.volume * k.volume
    }

    /// The stresses in proportion to μ and to κ.
    fn stress_parts(&self, k: &Kinematics, iso: &Isochoric) -> (Mat3, Mat3) {
        (
            0.5 * self.moduli.shear() * iso.slope * k.shape_slope,
            self.moduli.bulk() * k.volume * k.volume_slope,
        )
    }
}

/// tangent += weight · a ⊗ a.
fn add_square(tangent: &mut Tangent, weight: f64, a: &Mat3) {
    for column in 0..9 {
        let factor = weight * a[(column / 3, column % 3)];
        for row in 0..9 {
            tangent[(row, column)] += factor * a[(row / 3, row % 3)];
        }
    }
}
