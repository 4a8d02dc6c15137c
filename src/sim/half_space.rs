//! A point force on the surface of an elastic half-space: displacement and traction anywhere in it.
//!
//! Frame: the force acts at the origin, the body is z ≥ 0. Boussinesq's and Cerruti's solutions in one formula
//! (Love 1927, sections 135 and 166; Johnson 1985, equations 3.18 and 3.75): with R = |x|, S = R + z, m = 1 − 2ν and
//! a, b ∈ {x, y}, the displacement along the first index for a force along the second is 1/(4πμ) times
//!
//! G_ab = δ_ab (1/R + m/S) + x_a x_b (1/R³ − m/(R S²)),
//! G_za = x_a (z/R³ + m/(R S)), G_az = x_a (z/R³ − m/(R S)), G_zz = (1 + m)/R + z²/R³.

use crate::geometry::{Mat3, Vec3};
use std::f64::consts::PI;

/// The half-space with E = 1 Pa.
#[derive(Debug, Clone, Copy)]
pub(super) struct HalfSpace {
    poisson_ratio: f64,
}

/// A function of position with its gradient.
#[derive(Clone, Copy)]
struct Term(f64, Vec3);

impl HalfSpace {
    pub(super) fn new(poisson_ratio: f64) -> Self {
        Self { poisson_ratio }
    }

    fn m(&self) -> f64 {
        1.0 - 2.0 * self.poisson_ratio
    }

    /// 1/(4πμ) at E = 1 Pa.
    pub(super) fn scale(&self) -> f64 {
        2.0 * (1.0 + self.poisson_ratio) / (4.0 * PI)
    }

    /// Displacement at `x` (m, not the origin): entry (i, j) along axis i for a unit force along axis j.
    pub(super) fn displacement(&self, x: Vec3) -> Mat3 {
        let m = self.m();
        let r = x.norm();
        let s = r + x.z;
        let (f1, f2) = (1.0 / r + m / s, 1.0 / r.powi(3) - m / (r * s * s));
        let (f3, f4) = (x.z / r.powi(3), m / (r * s));
        let mut g = Mat3::zeros();
        for a in 0..2 {
            for b in 0..2 {
                g[(a, b)] = x[a] * x[b] * f2;
            }
            g[(a, a)] += f1;
            g[(2, a)] = x[a] * (f3 + f4);
            g[(a, 2)] = x[a] * (f3 - f4);
        }
        g[(2, 2)] = (1.0 + m) / r + x.z * x.z / r.powi(3);
        g * self.scale()
    }

    /// Displacement on the surface, times the distance, of a unit force whose place is at distance 1 in the
    /// direction (c, s) from where the displacement is looked at.
    pub(super) fn on_surface(&self, c: f64, s: f64) -> Mat3 {
        self.displacement(Vec3::new(-c, -s, 0.0))
    }

    /// Traction at `x` on a plane with its normal along `axis`: entry (i, j) along axis i for a unit force along
    /// axis j. t = λ (∇·u) n + μ (∇u + ∇uᵀ) n.
    pub(super) fn traction(&self, x: Vec3, axis: usize) -> Mat3 {
        let m = self.m();
        let r = x.norm();
        let s = r + x.z;
        let (n, up) = (x / r, Vec3::z());
        let ns = n + up;
        let (r2, r3, r4) = (r * r, r * r * r, r * r * r * r);
        let f1 = Term(1.0 / r + m / s, -n / r2 - ns * (m / (s * s)));
        let f2 = Term(
            1.0 / r3 - m / (r * s * s),
            n * (m / (r2 * s * s) - 3.0 / r4) + ns * (2.0 * m / (r * s * s * s)),
        );
        let f3 = Term(x.z / r3, up / r3 - n * (3.0 * x.z / r4));
        let f4 = Term(m / (r * s), -n * (m / (r2 * s)) - ns * (m / (r * s * s)));
        let f5 = n * (-(1.0 + m) / r2 - 3.0 * x.z * x.z / r4) + up * (2.0 * x.z / r3);
        // gradient[j][(i, k)]: slope along k of the displacement along i for a force along j.
        let mut gradient = [Mat3::zeros(); 3];
        for a in 0..2 {
            for b in 0..2 {
                for k in 0..3 {
                    let mut slope = x[a] * x[b] * f2.1[k];
                    if a == b {
                        slope += f1.1[k];
                    }
                    if k == a {
                        slope += x[b] * f2.0;
                    }
                    if k == b {
                        slope += x[a] * f2.0;
                    }
                    gradient[b][(a, k)] = slope;
                }
            }
            for k in 0..3 {
                let straight = if k == a { 1.0 } else { 0.0 };
                gradient[a][(2, k)] = straight * (f3.0 + f4.0) + x[a] * (f3.1[k] + f4.1[k]);
                gradient[2][(a, k)] = straight * (f3.0 - f4.0) + x[a] * (f3.1[k] - f4.1[k]);
            }
        }
        for k in 0..3 {
            gradient[2][(2, k)] = f5[k];
        }
        let ratio = 2.0 * self.poisson_ratio / m;
        let mut traction = Mat3::zeros();
        for (j, g) in gradient.iter().enumerate() {
            for i in 0..3 {
                traction[(i, j)] = g[(i, axis)] + g[(axis, i)];
            }
            traction[(axis, j)] += ratio * g.trace();
        }
        traction / (4.0 * PI)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::legendre::gauss_legendre;

    const NU: f64 = 0.47;

    /// No traction on the surface away from the force.
    #[test]
    fn the_surface_is_free() {
        let traction = HalfSpace::new(NU).traction(Vec3::new(0.7, -0.4, 0.0), 2);
        assert!(traction.amax() < 1e-14, "{traction}");
    }

    /// Tractions are those of the displacement: t = λ (∇·u) n + μ (∇u + ∇uᵀ) n with central differences.
    #[test]
    fn tractions_belong_to_the_displacement() {
        let (space, at, step) = (HalfSpace::new(NU), Vec3::new(0.3, -0.5, 0.4), 1e-5);
        let slope = |k: usize| {
            let d = Vec3::ith(k, step);
            (space.displacement(at + d) - space.displacement(at - d)) / (2.0 * step)
        };
        let slopes = [slope(0), slope(1), slope(2)];
        let (mu, lambda) = (0.5 / (1.0 + NU), NU / ((1.0 + NU) * (1.0 - 2.0 * NU)));
        for axis in 0..3 {
            let traction = space.traction(at, axis);
            for j in 0..3 {
                let divergence: f64 = (0..3).map(|k| slopes[k][(k, j)]).sum();
                for i in 0..3 {
                    let normal = if i == axis { lambda * divergence } else { 0.0 };
                    let exact = normal + mu * (slopes[axis][(i, j)] + slopes[i][(axis, j)]);
                    assert!((traction[(i, j)] - exact).abs() < 1e-8, "{axis} {i} {j}");
                }
            }
        }
    }

    /// A hemisphere around the force carries it: ∫ σ n = −1 along the force. Hence the field is in equilibrium
    /// with the force and its size is right.
    #[test]
    fn a_hemisphere_carries_the_force() {
        let space = HalfSpace::new(NU);
        let mut carried = Mat3::zeros();
        for (z, weight) in gauss_legendre(24) {
            for i in 0..24 {
                let angle = 2.0 * PI * f64::from(i) / 24.0;
                let r = (1.0 - z * z).sqrt();
                let n = Vec3::new(r * angle.cos(), r * angle.sin(), z);
                for axis in 0..3 {
                    carried += space.traction(n, axis) * (n[axis] * weight * 2.0 * PI / 24.0);
                }
            }
        }
        assert!((carried + Mat3::identity()).amax() < 1e-9, "{carried}");
    }
}
