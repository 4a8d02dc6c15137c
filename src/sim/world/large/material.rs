//! What the material does at one point: energy, stress and tangent of a law, with or without softening.
//!
//! W = μ/2 φ(Ī₁ − 3) + κ/2 (J − 1)² with φ(x) = x (neo-Hookean), (e^(bx) − 1)/b (Fung 1967), x + c₂ x² (Yeoh 1993); or
//! λ/2 (tr ε)² + μ ε:ε at small strain. With D = J^(−2/3) (F − tr(FᵀF)/3 F⁻ᵀ) = ½ ∂Ī₁/∂F,
//!
//!   P = μ φ′ D + κ (J − 1) J F⁻ᵀ,   dP = [neo-Hookean with μ φ′] dF + 2 μ φ″ (D:dF) D.
//!
//! Softening (Ogden & Roxburgh 1999, with an exponential): P ← s P with s = 1 − r (1 − e^(−(w_max − w)/m)), w = W, so that
//! dP ← s dP + (r/m) e^(−(w_max − w)/m) (P:dF) P while w < w_max, and s = 1 on the first way in.

use crate::geometry::Mat3;
use crate::sim::neo_hookean::{NeoHookean, Tangent};

/// φ, or small strain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Isochoric {
    SmallStrain,
    NeoHookean,
    /// b.
    Fung(f64),
    /// c₂.
    Yeoh(f64),
}

/// r and m (J/m³).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Softening {
    pub(super) share: f64,
    pub(super) scale: f64,
}

/// The material.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Material {
    mu: f64,
    kappa: f64,
    isochoric: Isochoric,
    pub(super) softening: Option<Softening>,
}

/// One state of the material.
pub(super) struct Response {
    /// w without softening (J/m³).
    pub(super) energy: f64,
    /// P (Pa).
    pub(super) stress: Mat3,
    /// ∂P/∂F (Pa).
    pub(super) tangent: Tangent,
}

impl Material {
    pub(super) fn new(
        young_modulus_pa: f64,
        poisson_ratio: f64,
        isochoric: Isochoric,
        softening: Option<Softening>,
    ) -> Self {
        Self {
            mu: young_modulus_pa / (2.0 * (1.0 + poisson_ratio)),
            kappa: young_modulus_pa / (3.0 * (1.0 - 2.0 * poisson_ratio)),
            isochoric,
            softening,
        }
    }

    /// At F = 1 + `h`, where the largest energy density so far was `w_max`; `None` when turned inside out.
    pub(super) fn respond(&self, h: &Mat3, w_max: f64) -> Option<Response> {
        let mut response = match self.isochoric {
            Isochoric::SmallStrain => self.small_strain(h),
            Isochoric::NeoHookean => self.large_strain(h, |x| [x, 1.0, 0.0])?,
            Isochoric::Fung(b) => {
                self.large_strain(h, |x| [(b * x).exp_m1() / b, (b * x).exp(), b * (b * x).exp()])?
            }
            Isochoric::Yeoh(c) => self.large_strain(h, |x| [x + c * x * x, 1.0 + 2.0 * c * x, 2.0 * c])?,
        };
        if let Some(Softening { share, scale }) = self.softening.filter(|_| response.energy < w_max) {
            let decayed = ((response.energy - w_max) / scale).exp();
            let factor = 1.0 - share * (1.0 - decayed);
            let p = response.stress;
            for (row, entries) in response.tangent.iter_mut().enumerate() {
                for (column, entry) in entries.iter_mut().enumerate() {
                    let pp = p[(row / 3, row % 3)] * p[(column / 3, column % 3)];
                    *entry = factor * *entry + share / scale * decayed * pp;
                }
            }
            response.stress *= factor;
        }
        Some(response)
    }

    fn small_strain(&self, h: &Mat3) -> Response {
        let lambda = self.kappa - 2.0 / 3.0 * self.mu;
        let strain = 0.5 * (h + h.transpose());
        let trace = strain.trace();
        let tangent = std::array::from_fn(|row| {
            let (i, a) = (row / 3, row % 3);
            std::array::from_fn(|column| {
                let (j, b) = (column / 3, column % 3);
                let same = |x: usize, y: usize| if x == y { 1.0 } else { 0.0 };
                lambda * same(i, a) * same(j, b)
                    + self.mu * (same(i, j) * same(a, b) + same(i, b) * same(a, j))
            })
        });
        Response {
            energy: 0.5 * lambda * trace * trace + self.mu * strain.norm_squared(),
            stress: Mat3::identity() * (lambda * trace) + 2.0 * self.mu * strain,
            tangent,
        }
    }

    /// `phi` gives φ, φ′ and φ″ at Ī₁ − 3.
    fn large_strain(&self, h: &Mat3, phi: impl Fn(f64) -> [f64; 3]) -> Option<Response> {
        let f = Mat3::identity() + h;
        let j = f.determinant();
        let inverse = f.try_inverse().filter(|_| j > 0.0)?;
        let shrink = 1.0 / j.cbrt().powi(2);
        let [value, first, second] = phi(shrink * f.norm_squared() - 3.0);
        let like = NeoHookean::with_moduli(self.mu * first, self.kappa);
        let mut tangent = like.tangent(&f)?;
        if second != 0.0 {
            let d = shrink * (f - f.norm_squared() / 3.0 * inverse.transpose());
            for (row, entries) in tangent.iter_mut().enumerate() {
                for (column, entry) in entries.iter_mut().enumerate() {
                    *entry += 2.0 * self.mu * second * d[(row / 3, row % 3)] * d[(column / 3, column % 3)];
                }
            }
        }
        Some(Response {
            energy: 0.5 * self.mu * value + 0.5 * self.kappa * (j - 1.0).powi(2),
            stress: like.stress(&f)?,
            tangent,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const E: f64 = 1e4;
    const NU: f64 = 0.47;
    const LAWS: [Isochoric; 4] =
        [Isochoric::SmallStrain, Isochoric::NeoHookean, Isochoric::Fung(2.0), Isochoric::Yeoh(0.8)];

    fn sample() -> Mat3 {
        Mat3::new(0.13, 0.21, -0.08, -0.05, -0.13, 0.17, 0.11, -0.13, 0.08)
    }

    /// Stress is the derivative of energy, the tangent that of the stress, also where softening acts: central
    /// differences.
    #[test]
    fn stress_and_tangent_are_derivatives() {
        let step = 1e-5;
        for law in LAWS {
            for softening in [None, Some(Softening { share: 0.4, scale: 300.0 })] {
                let material = Material::new(E, NU, law, softening);
                let plain = Material::new(E, NU, law, None);
                let h = sample();
                let w_max = 1.7 * plain.respond(&h, 0.0).expect("upright").energy;
                let here = material.respond(&h, w_max).expect("upright");
                for column in 0..9 {
                    let mut moved = [h, h];
                    moved[0][(column / 3, column % 3)] += step;
                    moved[1][(column / 3, column % 3)] -= step;
                    let [a, b] = moved.map(|h| material.respond(&h, w_max).expect("upright"));
                    if softening.is_none() {
                        let slope = (a.energy - b.energy) / (2.0 * step);
                        assert!((slope - here.stress[(column / 3, column % 3)]).abs() < 1e-5 * E, "{law:?}");
                    }
                    for (row, entries) in here.tangent.iter().enumerate() {
                        let slope = (a.stress - b.stress)[(row / 3, row % 3)] / (2.0 * step);
                        assert!(
                            (slope - entries[column]).abs() < 3e-5 * E,
                            "{law:?} {softening:?} {row} {column}"
                        );
                    }
                }
            }
        }
    }

    /// Uniaxial, incompressible: stretch λ, nominal stress μ φ′(I₁ − 3) (λ − λ⁻²) (Treloar 1975, chapter 4, for φ′ = 1). With
    /// κ of 10⁵ μ and the sides free up to rounding.
    #[test]
    fn uniaxial_stretch_has_its_closed_form() {
        let (b, c, stretch) = (1.4, 0.6, 1.3_f64);
        let i1 = stretch * stretch + 2.0 / stretch - 3.0;
        let nearly = 0.5 - 1e-7;
        let mu = E / (2.0 * (1.0 + nearly));
        for (law, slope) in [
            (Isochoric::NeoHookean, 1.0),
            (Isochoric::Fung(b), (b * i1).exp()),
            (Isochoric::Yeoh(c), 1.0 + 2.0 * c * i1),
        ] {
            let material = Material::new(E, nearly, law, None);
            // The sides' stretch that leaves them free, by the secant method.
            let at = |side: f64| {
                let h = Mat3::from_diagonal(&nalgebra::Vector3::new(stretch - 1.0, side - 1.0, side - 1.0));
                material.respond(&h, 0.0).expect("upright").stress
            };
            let (mut x, mut y) = (stretch.powf(-0.5), stretch.powf(-0.5) * (1.0 + 1e-8));
            for _ in 0..6 {
                let (fx, fy) = (at(x)[(1, 1)], at(y)[(1, 1)]);
                if fx != fy {
                    (x, y) = (y, y - fy * (y - x) / (fy - fx));
                }
            }
            let exact = mu * slope * (stretch - stretch.powi(-2));
            assert!((at(y)[(0, 0)] / exact - 1.0).abs() < 1e-5, "{law:?}: {}, {exact}", at(y)[(0, 0)]);
        }
    }

    /// First way in as without softening; back at half the strain, a quarter of the energy, the stress is
    /// 1 − r (1 − e^(−¾ w_max/m)) of it; in again it is the same.
    #[test]
    fn the_second_cycle_is_softer() {
        let (share, scale, e) = (0.3, 40.0, 0.1);
        let soft = Material::new(E, NU, Isochoric::SmallStrain, Some(Softening { share, scale }));
        let hard = Material::new(E, NU, Isochoric::SmallStrain, None);
        let strain = |e: f64| Mat3::from_diagonal(&nalgebra::Vector3::new(-NU * e, -NU * e, e));
        let first = soft.respond(&strain(e), 0.0).expect("upright");
        assert!((first.stress[(2, 2)] - E * e).abs() < 1e-9 * E && (first.energy - 50.0).abs() < 1e-9);
        let back = soft.respond(&strain(0.5 * e), first.energy).expect("upright").stress[(2, 2)];
        let without = hard.respond(&strain(0.5 * e), 0.0).expect("upright").stress[(2, 2)];
        let exact = 1.0 - share * (1.0 - (-0.75 * 50.0 / scale).exp());
        assert!((back / without - exact).abs() < 1e-12);
        let top = soft.respond(&strain(e), first.energy).expect("upright").stress[(2, 2)];
        assert!((top / first.stress[(2, 2)] - 1.0).abs() < 1e-12);
    }
}
