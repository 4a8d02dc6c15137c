//! The surface of the half-space under the traction of a rigid flat punch, in closed form: place → displacement
//! and its slopes along the surface; and the punch's own compliance.
//!
//! A rigid flat punch of radius `a` carries `p(ρ) = P / (2πa √(a² − ρ²))` (Boussinesq 1885; Johnson 1985, equation
//! 3.34); a tangential force spreads likewise (Mindlin 1949). Seen in polar coordinates about any point of the
//! surface, the point load's `1/ρ` cancels against `ρ dρ` and every full chord of the disc carries the same
//! `∫ ds / (2πa √(c² − s²)) = 1/(2a)`, `c` half its length. The displacement is therefore `1/(2a)` times the point
//! load's kernel integrated over the angle `2β` under which the disc is seen, `sin β = a/r`; from inside, `β = π/2`
//! and it is uniform. The part of the kernel that is odd in the angle (normal load, tangential displacement and
//! conversely) follows the share of the load within `r`, as in a logarithmic potential.
//!
//! That odd part, `1 − 2ν` in size, is the only displacement that is not uniform under the punch. A bonded punch is
//! stiffer by `(1 − ν) ln(3 − 4ν) / (1 − 2ν)` along its normal (Mossakovskii 1954): by 0.1 % at ν = 0.47, not at all
//! at ν = 0.5.
//!
//! Local frame and units as in [`super::half_space`]: unit modulus, unit force.

use crate::geometry::{Mat3, Vec3};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Nearer to the rim than this share of the radius, slopes are taken this far from it: they have a square-root
/// singularity there.
const RIM: f64 = 1e-3;

/// Displacement of the disc under its own load, for a unit modulus (1/m): along a tangential and along the normal
/// axis, `(2 − ν)(1 + ν) / 4a` (Mindlin 1949) and `(1 − ν²) / 2a` (Sneddon 1946).
pub(super) fn self_compliance(radius: f64, nu: f64) -> [f64; 2] {
    [(2.0 - nu) * (1.0 + nu) / (4.0 * radius), (1.0 - nu * nu) / (2.0 * radius)]
}

/// Rotation of a rigid disc on the half-space under a unit moment, for a unit modulus (1/m³): tilt about an axis in
/// its plane, `3 (1 − ν²) / 4a³` (free of friction; Borowicka 1943), and twist about its normal,
/// `3 (1 + ν) / 8a³` (bonded; Reissner & Sagoci 1944).
pub fn turning_compliance(radius: f64, nu: f64) -> [f64; 2] {
    let cube = radius.powi(3);
    [3.0 * (1.0 - nu * nu) / (4.0 * cube), 3.0 * (1.0 + nu) / (8.0 * cube)]
}

/// Displacement at the point `r` of the surface; entry `[i, j]` in direction `i` for a force in direction `j`.
pub(super) fn surface_displacement(radius: f64, nu: f64, r: &Vec3) -> Mat3 {
    let s = r.x.hypot(r.y);
    let beta = if s > radius { (radius / s).asin() } else { FRAC_PI_2 };
    let mut u = even(beta, r.y.atan2(r.x), nu) / (2.0 * radius);
    let odd = coupling(nu) * enclosed(radius, s);
    for i in 0..2 {
        u[(i, 2)] -= odd * r[i];
        u[(2, i)] += odd * r[i];
    }
    u
}

/// Derivatives of [`surface_displacement`] along the two axes of the surface.
pub(super) fn surface_gradient(radius: f64, nu: f64, r: &Vec3) -> [Mat3; 2] {
    let s = r.x.hypot(r.y).max(1e-9 * radius);
    let (cos, sin) = if r.x == 0.0 && r.y == 0.0 { (1.0, 0.0) } else { (r.x / s, r.y / s) };
    let psi = sin.atan2(cos);
    let mut gradient = [Mat3::zeros(); 2];
    if s > radius {
        let beta = (radius / s).asin();
        let away = s.max((1.0 + RIM) * radius);
        let closing = -radius / (away * (away * away - radius * radius).sqrt());
        let along = even_by_angle(beta, psi, nu) * (closing / (2.0 * radius));
        let around = even_by_turn(beta, psi, nu) / (2.0 * radius * s);
        gradient = [along * cos - around * sin, along * sin + around * cos];
    }
    let (share, slope) = (enclosed(radius, s), enclosed_slope(radius, s));
    for (k, g) in gradient.iter_mut().enumerate() {
        for i in 0..2 {
            // ∂ₖ (rᵢ f(s)) = δᵢₖ f + rᵢ rₖ f′/s
            let odd = if i == k { share } else { 0.0 } + r[i] * r[k] * slope / s;
            g[(i, 2)] -= coupling(nu) * odd;
            g[(2, i)] += coupling(nu) * odd;
        }
    }
    gradient
}

/// `(1 − 2ν)(1 + ν) / 2π`: tangential displacement at unit distance from a unit normal force.
fn coupling(nu: f64) -> f64 {
    (1.0 - 2.0 * nu) * (1.0 + nu) / TAU
}

/// Share of the load within `s`, over `s²`: `(1 − √(1 − s²/a²)) / s²`.
fn enclosed(radius: f64, s: f64) -> f64 {
    if s >= radius { 1.0 / (s * s) } else { 1.0 / (radius * radius * (1.0 + height(radius, s))) }
}

fn enclosed_slope(radius: f64, s: f64) -> f64 {
    if s >= radius {
        -2.0 / (s * s * s)
    } else {
        let q = height(radius, s);
        s / (radius.powi(4) * q.max((2.0 * RIM).sqrt()) * (1.0 + q).powi(2))
    }
}

/// `√(1 − s²/a²)`, 0 from the rim on.
pub(super) fn height(radius: f64, s: f64) -> f64 {
    (1.0 - (s / radius).powi(2)).max(0.0).sqrt()
}

/// The part of the point load's kernel that is even in the angle, `(1 + ν)/2π · [2(1 − ν) + 2ν e eᵀ]` with the
/// tangential direction `e` (normal: the first term alone), integrated over angles within `beta` of `psi`.
fn even(beta: f64, psi: f64, nu: f64) -> Mat3 {
    let double = (2.0 * beta).sin();
    let (sin, cos) = (2.0 * psi).sin_cos();
    let shared = 4.0 * (1.0 - nu) * beta;
    tangential(
        shared + nu * (2.0 * beta + double * cos),
        shared + nu * (2.0 * beta - double * cos),
        nu * double * sin,
        shared,
    ) * ((1.0 + nu) / TAU)
}

/// Derivative of [`even`] by `beta`.
fn even_by_angle(beta: f64, psi: f64, nu: f64) -> Mat3 {
    let double = (2.0 * beta).cos();
    let (sin, cos) = (2.0 * psi).sin_cos();
    let shared = 4.0 * (1.0 - nu);
    tangential(
        shared + 2.0 * nu * (1.0 + double * cos),
        shared + 2.0 * nu * (1.0 - double * cos),
        2.0 * nu * double * sin,
        shared,
    ) * ((1.0 + nu) / TAU)
}

/// Derivative of [`even`] by `psi`.
fn even_by_turn(beta: f64, psi: f64, nu: f64) -> Mat3 {
    let double = 2.0 * nu * (2.0 * beta).sin();
    let (sin, cos) = (2.0 * psi).sin_cos();
    tangential(-double * sin, double * sin, double * cos, 0.0) * ((1.0 + nu) / TAU)
}

fn tangential(xx: f64, yy: f64, xy: f64, zz: f64) -> Mat3 {
    Mat3::new(xx, xy, 0.0, xy, yy, 0.0, 0.0, 0.0, zz)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::element::gauss_legendre;
    use crate::fem::half_space::point_displacement;

    const NU: f64 = 0.3;

    /// The traction summed up load by load, along rays from the point (so that the kernel's pole falls away), each
    /// end at the rim with points crowding where the traction is unbounded.
    fn summed(a: f64, r: &Vec3) -> Mat3 {
        let s = r.x.hypot(r.y);
        let towards = (-r.y).atan2(-r.x);
        let mut sum = Mat3::zeros();
        let line = gauss_legendre(60);
        let around = if s < a { gauss_legendre(400) } else { gauss_legendre(60) };
        let reach = if s < a { std::f64::consts::PI } else { (a / s).asin() };
        for &(v, wv) in &around {
            // Odd in the angle's middle: sin turns the tangent ray's square root into a smooth function.
            let angle = reach * (2.0 * v - 1.0);
            let middle = s * angle.cos();
            let half = (a * a - (s * angle.sin()).powi(2)).max(0.0).sqrt();
            let start = if s < a { -middle } else { -half };
            let mut carried = 0.0;
            for &(w, ww) in &line {
                // x = start + (half − start)(1 − w²) from the chord's middle; for full chords both ends crowd.
                let (x, dx) = if s < a {
                    (start + (half - start) * (1.0 - w * w), 2.0 * w * (half - start))
                } else {
                    let t = std::f64::consts::PI * (w - 0.5);
                    (half * t.sin(), std::f64::consts::PI * half * t.cos())
                };
                let rho = ((s * angle.sin()).powi(2) + x * x).sqrt();
                carried += ww * dx / (TAU * a * (a * a - rho * rho).sqrt());
            }
            let (sin, cos) = (towards + angle).sin_cos();
            let kernel = point_displacement(&Vec3::new(-cos, -sin, 0.0), NU);
            sum += kernel * (carried * 2.0 * reach * wv);
        }
        sum
    }

    #[test]
    fn the_closed_form_is_the_sum_of_point_loads() {
        let a = 0.7;
        for r in [
            Vec3::new(0.3, -0.2, 0.0),
            Vec3::new(-0.05, 0.01, 0.0),
            Vec3::new(0.9, 0.4, 0.0),
            Vec3::new(-0.2, 3.0, 0.0),
        ] {
            let (closed, summed) = (surface_displacement(a, NU, &r), summed(a, &r));
            assert!((closed - summed).norm() < 1e-6 * summed.norm(), "{r}: {closed} {summed}");
        }
    }

    /// Under the punch the even part is uniform: Sneddon's and Mindlin's compliances.
    #[test]
    fn the_disc_moves_as_one() {
        let [tangential, normal] = self_compliance(0.7, NU);
        for r in [Vec3::zeros(), Vec3::new(0.4, 0.5, 0.0)] {
            let u = surface_displacement(0.7, NU, &r);
            for (i, expected) in [tangential, tangential, normal].into_iter().enumerate() {
                assert!((u[(i, i)] / expected - 1.0).abs() < 1e-14);
            }
            assert!(u[(0, 1)].abs() < 1e-15);
        }
    }

    #[test]
    fn slopes_are_the_derivatives() {
        let (a, h) = (0.7, 1e-6);
        for r in
            [Vec3::new(0.3, -0.2, 0.0), Vec3::new(0.9, 0.4, 0.0), Vec3::new(-0.2, -3.0, 0.0), Vec3::zeros()]
        {
            for (k, slope) in surface_gradient(a, NU, &r).iter().enumerate() {
                let mut step = Vec3::zeros();
                step[k] = h;
                let difference = (surface_displacement(a, NU, &(r + step))
                    - surface_displacement(a, NU, &(r - step)))
                    / (2.0 * h);
                assert!((difference - slope).norm() < 1e-8, "{r} {k}: {difference} {slope}");
            }
        }
    }

    /// Tractions `3 x / (2πa³ √(a² − ρ²))` (tilt) and `3 ρ / (4πa³ √(a² − ρ²))` around the normal (twist) have unit
    /// moment; summed up along rays from a point under the disc they turn it as the closed forms say.
    #[test]
    fn a_unit_moment_turns_the_disc() {
        let (a, r) = (0.7, Vec3::new(0.3, -0.2, 0.0));
        let (rays, line) = (720, gauss_legendre(40));
        let mut moved = [Vec3::zeros(); 2];
        for k in 0..rays {
            let (sin, cos) = (TAU * f64::from(k) / f64::from(rays)).sin_cos();
            let towards = Vec3::new(cos, sin, 0.0);
            let (middle, off) = (-r.dot(&towards), r.norm_squared() - r.dot(&towards).powi(2));
            let reach = middle + (a * a - off).sqrt();
            let kernel = point_displacement(&-towards, NU) * (TAU / f64::from(rays));
            for &(w, ww) in &line {
                // Points crowd at the rim, where the traction is unbounded.
                let source = r + towards * (reach * (1.0 - w * w));
                let spread =
                    ww * 2.0 * w * reach * 3.0 / (TAU * a.powi(3) * (a * a - source.norm_squared()).sqrt());
                moved[0] += kernel * Vec3::new(0.0, 0.0, source.x) * spread;
                moved[1] += kernel * Vec3::new(-source.y, source.x, 0.0) * (0.5 * spread);
            }
        }
        let [tilt, twist] = turning_compliance(a, NU);
        assert!((moved[0].z / (tilt * r.x) - 1.0).abs() < 1e-6, "{} {}", moved[0].z, tilt * r.x);
        let expected = Vec3::new(-r.y, r.x, 0.0) * twist;
        assert!((moved[1] - expected).norm() < 1e-6 * expected.norm(), "{} {expected}", moved[1]);
    }
}
