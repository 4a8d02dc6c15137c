//! The two invariants that the finite-strain laws use, J − 1 and Ī₁ − 3, with first and second derivatives.
//!
//! # Derivation
//! Write b = FFᵀ − I = H + Hᵀ + HHᵀ, so that nothing of order one is subtracted when H is small.
//!
//! *Volume.* J − 1 = tr H + ½((tr H)² − tr H²) + det H, the expansion of det(I + H). With G = F⁻ᵀ:
//! ∂J/∂F = J G, and ∂²J/∂F² : δF = J ((G : δF) G − G δFᵀ G).
//!
//! *Shape.* Split b into its mean s = tr b / 3 and the rest: FFᵀ = (1 + s)(I + d), tr d = 0. Then
//! J² = (1 + s)³ det(I + d), tr(FFᵀ) = 3(1 + s), and the mean cancels from Ī₁:
//! Ī₁ − 3 = 3 (det(I + d)^(−1/3) − 1), det(I + d) = 1 − ½ d : d + det d,
//! which is evaluated through log1p and expm1: at small strain it is ½ d : d, to all digits.
//!
//! ∂Ī₁/∂F = J^(−2/3) (2 F − ⅔ I₁ G) = 2 J^(−2/3) dev(FFᵀ) G, the second form without cancellation.
//! ∂²Ī₁/∂F² : δF = J^(−2/3) (2 δF − 4/3 ((G : δF) F + (F : δF) G) + 4/9 I₁ (G : δF) G + ⅔ I₁ G δFᵀ G).
//! (Holzapfel 2000, Nonlinear Solid Mechanics, section 6.4, pulled back to F.)

use super::{MaterialError, Tangent};
use crate::geometry::Mat3;

/// What the laws need to know of one displacement gradient.
#[derive(Debug, Clone)]
pub(super) struct Kinematics {
    f: Mat3,
    /// G = F⁻ᵀ.
    g: Mat3,
    j: f64,
    /// J^(−2/3).
    scale: f64,
    /// I₁ = tr(FFᵀ).
    trace: f64,
    /// J − 1.
    pub(super) volume: f64,
    /// i = Ī₁ − 3 ≥ 0.
    pub(super) shape: f64,
    /// ∂J/∂F.
    pub(super) volume_slope: Mat3,
    /// ∂Ī₁/∂F.
    pub(super) shape_slope: Mat3,
}

impl Kinematics {
    /// Measures a displacement gradient; J ≤ 0 and gradients that are not numbers are errors.
    pub(super) fn new(h: &Mat3) -> Result<Self, MaterialError> {
        let f = Mat3::identity() + h;
        let volume = volume_change(h);
        let j = 1.0 + volume;
        let inverse = f.try_inverse().filter(|_| j > 0.0 && j.is_finite());
        let Some(inverse) = inverse else {
            return Err(MaterialError::Inverted { jacobian: j });
        };
        let g = inverse.transpose();
        let b = h + h.transpose() + h * h.transpose();
        let mean = b.trace() / 3.0;
        let deviator = b - Mat3::from_diagonal_element(mean);
        let trace = 3.0 * (1.0 + mean);
        let scale = j.powf(-2.0 / 3.0);
        let d = deviator / (1.0 + mean);
        let drop = d.determinant() - 0.5 * d.norm_squared();
        // Far from the identity log1p would amplify the rounding of `drop`, and there is nothing to cancel.
        let shape = if drop > -0.5 { 3.0 * (-drop.ln_1p() / 3.0).exp_m1() } else { scale * trace - 3.0 };
        Ok(Self {
            f,
            g,
            j,
            scale,
            trace,
            volume,
            shape,
            volume_slope: j * g,
            shape_slope: 2.0 * scale * deviator * g,
        })
    }

    /// `shape_weight` · ∂²Ī₁/∂F² + `volume_weight` · ∂²J/∂F².
    pub(super) fn curvature(&self, shape_weight: f64, volume_weight: f64) -> Tangent {
        let s = shape_weight * self.scale;
        let v = volume_weight * self.j;
        let (identity, mixed) = (2.0 * s, -4.0 / 3.0 * s);
        let (straight, crossed) = (4.0 / 9.0 * s * self.trace + v, 2.0 / 3.0 * s * self.trace - v);
        let (f, g) = (&self.f, &self.g);
        Tangent::from_fn(|row, column| {
            let (i, j, k, l) = (row / 3, row % 3, column / 3, column % 3);
            mixed * (g[(k, l)] * f[(i, j)] + f[(k, l)] * g[(i, j)])
                + straight * g[(k, l)] * g[(i, j)]
                + crossed * g[(i, l)] * g[(k, j)]
                + if row == column { identity } else { 0.0 }
        })
    }
}

/// det(I + H) − 1 without cancellation.
fn volume_change(h: &Mat3) -> f64 {
    let t = h.trace();
    let minors = h[(0, 0)] * h[(1, 1)] - h[(0, 1)] * h[(1, 0)] + h[(0, 0)] * h[(2, 2)]
        - h[(0, 2)] * h[(2, 0)]
        + h[(1, 1)] * h[(2, 2)]
        - h[(1, 2)] * h[(2, 1)];
    t + minors + h.determinant()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gradient(size: f64) -> Mat3 {
        size * Mat3::new(0.3, -0.7, 0.2, 0.5, -0.4, 0.9, -0.1, 0.6, 0.8)
    }

    #[test]
    fn both_forms_of_the_shape_agree_where_both_are_accurate() {
        for size in [0.05, 0.3, 0.6] {
            let k = Kinematics::new(&gradient(size)).expect("not inverted");
            let direct = k.f.determinant().powf(-2.0 / 3.0) * (k.f.transpose() * k.f).trace() - 3.0;
            assert!((k.shape - direct).abs() < 1e-13 * (3.0 + direct), "{} {direct}", k.shape);
            assert!((k.volume - (k.f.determinant() - 1.0)).abs() < 1e-14);
        }
    }

    /// Small strain: Ī₁ − 3 → 2 dev ε : dev ε and J − 1 → tr ε, each with a relative error of order |H|.
    #[test]
    fn invariants_keep_their_digits_at_small_strain() {
        for size in [1e-3, 1e-6, 1e-9, 1e-12] {
            let h = gradient(size);
            let k = Kinematics::new(&h).expect("not inverted");
            let e = 0.5 * (h + h.transpose());
            let dev = e - Mat3::from_diagonal_element(e.trace() / 3.0);
            assert!((k.shape / (2.0 * dev.norm_squared()) - 1.0).abs() < 10.0 * size + 1e-14, "{size}");
            assert!((k.volume / e.trace() - 1.0).abs() < 10.0 * size + 1e-14, "{size}");
        }
    }

    #[test]
    fn inverted_flat_and_undefined_gradients_are_errors_with_their_value() {
        let mirror = Mat3::from_diagonal(&crate::geometry::Vec3::new(-1.5, 0.0, 0.0));
        assert_eq!(
            Kinematics::new(&mirror).expect_err("J = -0.5"),
            MaterialError::Inverted { jacobian: -0.5 }
        );
        let flat = Mat3::from_diagonal(&crate::geometry::Vec3::new(-1.0, 0.0, 0.0));
        assert_eq!(Kinematics::new(&flat).expect_err("J = 0"), MaterialError::Inverted { jacobian: 0.0 });
        let undefined = Mat3::from_element(f64::NAN);
        assert!(matches!(
            Kinematics::new(&undefined),
            Err(MaterialError::Inverted { jacobian }) if jacobian.is_nan()
        ));
    }
}
