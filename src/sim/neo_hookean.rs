//! What the material does at one point under large strain: a compressible neo-Hookean solid.
//!
//! W = μ/2 (Ī₁ − 3) + κ/2 (J − 1)², Ī₁ = J^(−2/3) tr(FᵀF), J = det F > 0, with μ = E / (2 (1 + ν)) and
//! κ = E / (3 (1 − 2ν)) (spec/physics-catalogue, `finite-strain`; Bonet & Wood 2008, section 6.5). Symbols: `F`
//! deformation gradient, `P` = ∂W/∂F first Piola–Kirchhoff stress, `G` = F⁻ᵀ.

use crate::geometry::Mat3;

/// The material.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct NeoHookean {
    /// Shear modulus (Pa).
    mu: f64,
    /// Bulk modulus (Pa).
    kappa: f64,
}

/// ∂P/∂F: entry (3 i + A, 3 j + B), row by row (Pa).
pub(super) type Tangent = [[f64; 9]; 9];

impl NeoHookean {
    /// From Young's modulus (Pa) and Poisson's ratio at small strain.
    pub(super) fn new(young_modulus_pa: f64, poisson_ratio: f64) -> Self {
        Self {
            mu: young_modulus_pa / (2.0 * (1.0 + poisson_ratio)),
            kappa: young_modulus_pa / (3.0 * (1.0 - 2.0 * poisson_ratio)),
        }
    }

    /// From shear and bulk modulus (Pa).
    pub(super) fn with_moduli(mu: f64, kappa: f64) -> Self {
        Self { mu, kappa }
    }

    /// Energy per undeformed volume (J/m³); `None` when the material is turned inside out.
    pub(super) fn energy(&self, f: &Mat3) -> Option<f64> {
        let j = f.determinant();
        let shear = 0.5 * self.mu * (f.norm_squared() / j.cbrt().powi(2) - 3.0);
        (j > 0.0).then(|| shear + 0.5 * self.kappa * (j - 1.0).powi(2))
    }

    /// P = μ J^(−2/3) (F − Ī G) + κ (J − 1) J G with Ī = tr(FᵀF)/3 (Pa).
    pub(super) fn stress(&self, f: &Mat3) -> Option<Mat3> {
        let j = f.determinant();
        let g = f.try_inverse().filter(|_| j > 0.0)?.transpose();
        let shear = self.mu / j.cbrt().powi(2);
        Some(shear * (f - f.norm_squared() / 3.0 * g) + self.kappa * (j - 1.0) * j * g)
    }

    /// dP = μ J^(−2/3) [dF − ⅔ (F:dF) G − ⅔ (G:dF) (F − Ī G) + Ī G dFᵀ G]
    ///    + κ (2J − 1) J (G:dF) G − κ (J − 1) J G dFᵀ G.
    pub(super) fn tangent(&self, f: &Mat3) -> Option<Tangent> {
        let j = f.determinant();
        let g = f.try_inverse().filter(|_| j > 0.0)?.transpose();
        let shear = self.mu / j.cbrt().powi(2);
        let third = f.norm_squared() / 3.0;
        let deviator = f - third * g;
        let along = self.kappa * (2.0 * j - 1.0) * j;
        let across = shear * third - self.kappa * (j - 1.0) * j;
        Some(std::array::from_fn(|row| {
            let (i, a) = (row / 3, row % 3);
            std::array::from_fn(|column| {
                let (k, b) = (column / 3, column % 3);
                let same = if row == column { shear } else { 0.0 };
                same - 2.0 / 3.0 * shear * (f[(k, b)] * g[(i, a)] + g[(k, b)] * deviator[(i, a)])
                    + along * g[(k, b)] * g[(i, a)]
                    + across * g[(i, b)] * g[(k, a)]
            })
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const E: f64 = 1e4;
    const NU: f64 = 0.47;

    fn sample() -> Mat3 {
        Mat3::new(1.13, 0.21, -0.08, -0.05, 0.87, 0.17, 0.11, -0.13, 1.08)
    }

    /// Each is the derivative of the one before: central differences, whose error falls with the square of the
    /// step.
    #[test]
    fn stress_and_tangent_are_derivatives() {
        let (material, f) = (NeoHookean::new(E, NU), sample());
        let stress = material.stress(&f).expect("upright");
        let tangent = material.tangent(&f).expect("upright");
        let step = 1e-5;
        for column in 0..9 {
            let mut moved = [f, f];
            moved[0][(column / 3, column % 3)] += step;
            moved[1][(column / 3, column % 3)] -= step;
            let [w1, w0] = moved.map(|f| material.energy(&f).expect("upright"));
            assert!(((w1 - w0) / (2.0 * step) - stress[(column / 3, column % 3)]).abs() < 1e-6 * E);
            let [p1, p0] = moved.map(|f| material.stress(&f).expect("upright"));
            for (row, entries) in tangent.iter().enumerate() {
                let slope = (p1 - p0)[(row / 3, row % 3)] / (2.0 * step);
                assert!((slope - entries[column]).abs() < 1e-6 * E, "({row}, {column})");
                assert!((entries[column] - tangent[column][row]).abs() < 1e-10 * E, "major symmetry");
            }
        }
    }

    /// At rest the tangent is that of linear elasticity.
    #[test]
    fn small_strains_are_linear_elastic() {
        let tangent = NeoHookean::new(E, NU).tangent(&Mat3::identity()).expect("upright");
        let (lambda, mu) = (E * NU / ((1.0 + NU) * (1.0 - 2.0 * NU)), E / (2.0 * (1.0 + NU)));
        assert!((tangent[0][0] - lambda - 2.0 * mu).abs() < 1e-9 * E);
        assert!((tangent[0][4] - lambda).abs() < 1e-9 * E);
        assert!((tangent[1][1] - mu).abs() < 1e-9 * E);
        assert!((tangent[1][3] - mu).abs() < 1e-9 * E);
    }

    /// Simple shear F = 1 + γ e₁⊗e₂ keeps the volume: τ = μ γ, whatever γ.
    #[test]
    fn simple_shear_is_linear() {
        let mut f = Mat3::identity();
        f[(0, 1)] = 0.8;
        let p = NeoHookean::new(E, NU).stress(&f).expect("upright");
        assert!((p[(0, 1)] - 0.8 * E / (2.0 * (1.0 + NU))).abs() < 1e-10 * E);
    }

    #[test]
    fn rotations_carry_the_stress_along_and_mirrors_are_refused() {
        let material = NeoHookean::new(E, NU);
        let turn = nalgebra::Rotation3::from_euler_angles(0.4, -1.1, 2.0).into_inner();
        let p = material.stress(&sample()).expect("upright");
        let turned = material.stress(&(turn * sample())).expect("upright");
        assert!((turned - turn * p).norm() < 1e-11 * E);
        let mirror = Mat3::from_diagonal(&nalgebra::Vector3::new(1.0, 1.0, -1.0));
        assert!(material.energy(&mirror).is_none() && material.stress(&mirror).is_none());
    }
}
