//! The surface of the half-space under a uniform traction over a disc, in closed form: place → displacement and its slopes along the
//! surface.
//!
//! With `θ` the direction from a source to the point, against that from the disc's centre, the surface displacement is made of three
//! integrals over the disc: `I₀ = ∫ 1/ρ dA`, `I₂ = ∫ cos 2θ / ρ dA` and `V = ∫ cos θ / ρ dA`. The first is Johnson's (1985, equations 3.29
//! and 3.30: the displacement under a uniform pressure, by elliptic integrals), the second follows likewise, and `V` is the attraction of a
//! disc in the plane, `πs` inside and `πa²/s` outside.
//!
//! Local frame and units as in [`super::half_space`]: unit modulus, unit force.

use super::elliptic::Complete;
use crate::geometry::{Mat3, Vec3};
use std::f64::consts::{PI, TAU};

/// Nearer to the centre than this share of the radius, slopes are those at that distance.
const CENTRE: f64 = 1e-9;

/// The integrals at one distance from the centre, and their slopes along it.
struct Integrals {
    /// `I₀`, `I₂`, `V` (m).
    value: [f64; 3],
    /// Their derivatives by the distance.
    slope: [f64; 3],
}

impl Integrals {
    /// At `s` from the centre of a disc of radius `a` (m).
    fn at(a: f64, s: f64) -> Self {
        let inside = s <= a;
        let k = if inside { s / a } else { a / s };
        let m = k * k;
        let Complete { k: first, d, c } = Complete::of(m);
        if inside {
            Self {
                value: [4.0 * a * (first - m * d), 4.0 / 3.0 * a * m * c, PI * s],
                slope: [-4.0 * k * d, 4.0 * k * (d - 2.0 / 3.0 * c), PI],
            }
        } else {
            let all = 4.0 * s * m * (first - d);
            Self {
                value: [all, all - 8.0 / 3.0 * s * m * m * c, PI * a * k],
                slope: [-4.0 * m * d, -4.0 * m * d + 8.0 * m * m * (d - c / 3.0), -PI * m],
            }
        }
    }
}

/// Displacement along the radius, around it and along the normal under a force in the same direction, and the coupling between radius and
/// normal: of the integrals or of their slopes.
fn parts([all, double, odd]: [f64; 3], radius: f64, nu: f64) -> [f64; 4] {
    let scale = (1.0 + nu) / (TAU * PI * radius * radius);
    [
        (2.0 - nu) * all + nu * double,
        (2.0 - nu) * all - nu * double,
        2.0 * (1.0 - nu) * all,
        (1.0 - 2.0 * nu) * odd,
    ]
    .map(|part| part * scale)
}

/// Distance from the centre and the direction from there, any at the centre.
fn polar(r: &Vec3) -> (f64, [f64; 2]) {
    let s = (r.x * r.x + r.y * r.y).sqrt();
    (s, if s > 0.0 { [r.x / s, r.y / s] } else { [1.0, 0.0] })
}

/// Displacement at the point `r` of the surface; entry `[i, j]` in direction `i` for a force in direction `j`.
pub(super) fn surface_displacement(radius: f64, nu: f64, r: &Vec3) -> Mat3 {
    let (s, e) = polar(r);
    let [along, around, normal, odd] = parts(Integrals::at(radius, s).value, radius, nu);
    let mut u = Mat3::zeros();
    for i in 0..2 {
        for j in 0..2 {
            u[(i, j)] = (along - around) * e[i] * e[j];
        }
        u[(i, i)] += around;
        u[(i, 2)] = -odd * e[i];
        u[(2, i)] = odd * e[i];
    }
    u[(2, 2)] = normal;
    u
}

/// Derivatives of [`surface_displacement`] along the two axes of the surface. At the rim the slope along the radius has no bound; it is
/// taken next to it.
pub(super) fn surface_gradient(radius: f64, nu: f64, r: &Vec3) -> [Mat3; 2] {
    let (s, e) = polar(r);
    let s = s.max(CENTRE * radius);
    let integrals = Integrals::at(radius, s);
    let [along, around, _, odd] = parts(integrals.value, radius, nu);
    let [along_slope, around_slope, normal_slope, odd_slope] = parts(integrals.slope, radius, nu);
    let unit = |i: usize, j: usize| f64::from(u8::from(i == j));
    std::array::from_fn(|k| {
        // The direction turns as the point moves: ∂ₖ eᵢ.
        let turn = |i: usize| (unit(i, k) - e[i] * e[k]) / s;
        let mut g = Mat3::zeros();
        for i in 0..2 {
            for j in 0..2 {
                g[(i, j)] = around_slope * e[k] * unit(i, j)
                    + (along_slope - around_slope) * e[k] * e[i] * e[j]
                    + (along - around) * (turn(i) * e[j] + e[i] * turn(j));
            }
            let odd = odd_slope * e[k] * e[i] + odd * turn(i);
            g[(i, 2)] = -odd;
            g[(2, i)] = odd;
        }
        g[(2, 2)] = normal_slope * e[k];
        g
    })
}

#[cfg(test)]
mod tests {
    use super::super::half_space::point_displacement;
    use super::*;

    const NU: f64 = 0.31;

    /// Displacement at `r`, by integrating the chords of the disc over their directions: the point load's `1/ρ` cancels against `ρ dρ`.
    fn by_chords(radius: f64, r: &Vec3) -> Mat3 {
        let s = r.x.hypot(r.y);
        let towards = (-r.y).atan2(-r.x);
        let mut sum = Mat3::zeros();
        let mut add = |angle: f64, chord: f64, weight: f64| {
            let (sin, cos) = (towards + angle).sin_cos();
            sum += point_displacement(&Vec3::new(-cos, -sin, 0.0), NU) * (chord * weight);
        };
        // The midpoint rule on a period of a smooth function.
        let n = 1000;
        for i in 0..n {
            let turn = PI * ((f64::from(i) + 0.5) / f64::from(n) - 0.5);
            if s > radius {
                // sin(angle) = (a/s) sin φ turns the chord's square-root ends into a smooth function of φ.
                let sin = radius / s * turn.sin();
                let wide = PI / f64::from(n) * radius / s * turn.cos() / (1.0 - sin * sin).sqrt();
                add(sin.asin(), 2.0 * radius * turn.cos(), wide);
            } else {
                for angle in [turn, turn + PI] {
                    let chord = s * angle.cos() + (radius.powi(2) - (s * angle.sin()).powi(2)).sqrt();
                    add(angle, chord, PI / f64::from(n));
                }
            }
        }
        sum / (PI * radius * radius)
    }

    #[test]
    fn the_displacement_is_the_integral_of_point_loads() {
        let a = 0.005;
        for share in [0.0, 1e-3, 0.2, 0.6, 0.9, 1.1, 2.0, 6.0, 50.0] {
            let r = Vec3::new(-0.6, 0.8, 0.0) * (share * a);
            let (found, expected) = (surface_displacement(a, NU, &r), by_chords(a, &r));
            assert!((found - expected).norm() < 1e-11 * expected.norm(), "{share}: {found} {expected}");
        }
    }

    #[test]
    fn the_slopes_are_the_derivatives_of_the_displacement() {
        for share in [0.0, 0.01, 0.3, 0.95, 1.05, 1.7, 8.0] {
            let r = Vec3::new(0.28, -0.96, 0.0) * share;
            let h = 1e-5;
            for (k, g) in surface_gradient(1.0, NU, &r).iter().enumerate() {
                let step = Vec3::from_fn(|i, _| if i == k { h } else { 0.0 });
                let there = |step: Vec3| surface_displacement(1.0, NU, &(r + step));
                let slope = (there(step) - there(-step)) / (2.0 * h);
                assert!((slope - g).norm() < 1e-8, "{share}, axis {k}: {}", slope - g);
            }
        }
    }
}
