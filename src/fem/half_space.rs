//! The elastic half-space under a load on its surface: the near field of tips and restraint patches.
//!
//! A disc's load has its sharpest features next to the disc, where a mesh of the user's size cannot follow
//! them, and there the body looks like a half-space. The displacement of the half-space under a uniform
//! traction over a disc is known; what is left for the elements is smooth.
//!
//! Local frame: the surface is the plane `z = 0`, the body fills `z > 0`. Everything is for a unit Young's
//! modulus and a unit total force.
//!
//! Sources: the point loads are Boussinesq's (normal) and Cerruti's (tangential), Johnson 1985, equations
//! (3.19) and (3.75); discs follow by integration over their area.

use super::element::gauss_legendre;
use super::{even, punch};
use crate::geometry::{Mat3, Vec3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Displacement `G[i, j]` in direction `i` at `r` (m, `r.z ≥ 0`, `r ≠ 0`) under a unit point force at the
/// origin in direction `j`.
pub fn point_displacement(r: &Vec3, nu: f64) -> Mat3 {
    let (x, y, z) = (r.x, r.y, r.z);
    let distance = r.norm();
    let (a, c) = (1.0 / distance, 1.0 / (distance + z));
    let (a3, b, d) = (a * a * a, a * c, a * c * c);
    let m = 1.0 - 2.0 * nu;
    let scale = (1.0 + nu) / TAU; // 1 / 4πμ with μ = 1 / 2(1+ν)
    Mat3::new(
        a + x * x * a3 + m * (c - x * x * d),
        x * y * a3 - m * x * y * d,
        x * z * a3 - m * x * b,
        x * y * a3 - m * x * y * d,
        a + y * y * a3 + m * (c - y * y * d),
        y * z * a3 - m * y * b,
        x * z * a3 + m * x * b,
        y * z * a3 + m * y * b,
        z * z * a3 + 2.0 * (1.0 - nu) * a,
    ) * scale
}

/// Gradients of [`point_displacement`]: entry `k` is its derivative along axis `k` (1/m of it).
pub fn point_gradient(r: &Vec3, nu: f64) -> [Mat3; 3] {
    let distance = r.norm();
    let (a, c) = (1.0 / distance, 1.0 / (distance + r.z));
    let a3 = a * a * a;
    let m = 1.0 - 2.0 * nu;
    let scale = (1.0 + nu) / TAU;
    // Tangential entries are `rᵢ rⱼ p + δᵢⱼ q`, mixed ones `rᵢ (s ∓ t)`.
    let p = a3 - m * a * c * c;
    let (s, t) = (r.z * a3, m * a * c);
    let mut gradients = [Mat3::zeros(); 3];
    for (k, g) in gradients.iter_mut().enumerate() {
        let down = f64::from(u8::from(k == 2));
        let da = -r[k] * a3;
        let da3 = 3.0 * da * a * a;
        let dc = -(r[k] * a + down) * c * c;
        let dp = da3 - m * (da * c + 2.0 * a * dc) * c;
        let dq = da + m * dc;
        let ds = down * a3 + r.z * da3;
        let dt = m * (da * c + a * dc);
        g[(0, 0)] = r.x * r.x * dp + dq;
        g[(1, 1)] = r.y * r.y * dp + dq;
        g[(0, 1)] = r.x * r.y * dp;
        g[(1, 0)] = g[(0, 1)];
        for i in 0..2 {
            g[(i, 2)] = r[i] * (ds - dt);
            g[(2, i)] = r[i] * (ds + dt);
        }
        g[(2, 2)] = 2.0 * down * r.z * a3 + r.z * r.z * da3 + 2.0 * (1.0 - nu) * da;
        if k < 2 {
            for i in 0..2 {
                g[(k, i)] += r[i] * p;
                g[(i, k)] += r[i] * p;
            }
            g[(k, 2)] += s - t;
            g[(2, k)] += s + t;
        }
        *g *= scale;
    }
    gradients
}

/// Mean displacement over a disc of radius `a` (m) under its own uniform traction: compliance along a
/// tangential and along the normal axis (1/m, for unit modulus).
///
/// Normal: `16 (1 − ν²) / (3 π² a)` (Johnson 1985, equation 3.29b averaged over the disc; Love 1929);
/// tangential: `16 (1 + ν)(1 − ν/2) / (3 π² a)`, by the same integral over Cerruti's surface displacement.
pub fn disc_self_compliance(radius: f64, nu: f64) -> [f64; 2] {
    let shared = 16.0 * (1.0 + nu) / (3.0 * PI * PI * radius);
    [shared * (1.0 - 0.5 * nu), shared * (1.0 - nu)]
}

/// How a disc's load is spread over it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Profile {
    /// Evenly: a soft-faced pad, a patch that springs pull on.
    Uniform,
    /// As `1 / √(a² − ρ²)`: a rigid flat face under a force alone, free to turn.
    Rigid,
}

impl Profile {
    /// Points and weights (sum 1) along the radius `a` for the load's share: `(ρ, weight)`.
    ///
    /// Uniform: equal areas, `ρ dρ = a²/2 dt`, `ρ = a √t`. Rigid: the load within `ρ` is `1 − t`, `ρ = a √(1 − t²)`.
    /// Both are exact for polynomials in `ρ²`.
    pub(super) fn radial(self, radius: f64, points: usize) -> Vec<(f64, f64)> {
        let share = |t: f64| match self {
            Self::Uniform => t.sqrt(),
            Self::Rigid => (1.0 - t * t).sqrt(),
        };
        gauss_legendre(points).into_iter().map(|(t, w)| (radius * share(t), w)).collect()
    }

    /// Distance from the centre (over the radius) at a share of the way along the radius, and the load per share
    /// there: smooth in the share, unlike the load over the distance at a rigid disc's rim.
    fn along(self, share: f64) -> (f64, f64) {
        match self {
            Self::Uniform => (share, 2.0 * share),
            Self::Rigid => {
                let rho = (FRAC_PI_2 * share).sin();
                (rho, FRAC_PI_2 * rho)
            }
        }
    }
}

/// A disc on the surface, centre at the origin, carrying a traction of unit total force.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadedDisc {
    /// Radius (m).
    radius: f64,
    /// How the load is spread.
    profile: Profile,
    /// Poisson's ratio.
    poisson_ratio: f64,
    /// Rules over the disc for each row of [`FAR`]: most points of a body are far from most discs.
    far: [Vec<[f64; 3]>; FAR.len()],
    /// Rule over a cell each way, where a point is close.
    cell_rule: Vec<(f64, f64)>,
}

/// From which distance (in radii) how many rings of how many points integrate the disc to 10⁻³ of its stress.
const FAR: [(f64, usize, usize); 5] = [(13.0, 1, 3), (7.0, 1, 4), (5.0, 1, 6), (2.5, 2, 8), (1.5, 3, 10)];

/// Places and weights (sum 1) of a rule over a disc.
fn rule(profile: Profile, radius: f64, rings: usize, around: usize) -> Vec<[f64; 3]> {
    // The rigid profile's rule needs a ring more to be exact to the same power of ρ.
    let rings = rings + usize::from(profile == Profile::Rigid);
    let mut points = Vec::with_capacity(rings * around);
    for (k, (rho, weight)) in profile.radial(radius, rings).into_iter().enumerate() {
        // Neighbouring rings are turned against each other.
        let turn = 0.5 * (k as f64 + 0.5) / rings as f64;
        for i in 0..around {
            let (sin, cos) = (TAU * (i as f64 + turn) / around as f64).sin_cos();
            points.push([rho * cos, rho * sin, weight / around as f64]);
        }
    }
    points
}

impl LoadedDisc {
    /// A disc of `radius` (m) on a half-space of `poisson_ratio`, its load spread by `profile`.
    pub fn new(radius: f64, profile: Profile, poisson_ratio: f64) -> Self {
        let far = FAR.map(|(_, rings, around)| rule(profile, radius, rings, around));
        Self { radius, profile, poisson_ratio, far, cell_rule: gauss_legendre(CELL_POINTS) }
    }

    /// Traction (1/m²) at distance `s` from the centre. At the rigid disc's rim it has no bound and is taken a
    /// thousandth of the radius from there.
    pub fn traction(&self, s: f64) -> f64 {
        let a = self.radius;
        match self.profile {
            _ if s > a => 0.0,
            Profile::Uniform => 1.0 / (PI * a * a),
            Profile::Rigid => 1.0 / (TAU * a * a * punch::height(a, s.min(0.999 * a))),
        }
    }

    /// Displacement of the disc under its own load, along a tangential and the normal axis (1/m): the mean weighed
    /// as `reading` spreads. For the rigid profile the displacement is uniform, and by reciprocity what a rigid
    /// disc reads of a uniform load is the same.
    pub fn self_compliance(&self, reading: Profile) -> [f64; 2] {
        match (self.profile, reading) {
            (Profile::Uniform, Profile::Uniform) => disc_self_compliance(self.radius, self.poisson_ratio),
            _ => punch::self_compliance(self.radius, self.poisson_ratio),
        }
    }

    /// Displacement at `r`, entry `[i, j]` in direction `i` for a force in direction `j`. On the surface
    /// (`r.z = 0`) it is exact inside the disc and outside; below the surface `r` must not lie in the disc.
    pub fn displacement(&self, r: &Vec3) -> Mat3 {
        if r.z.abs() <= 1e-9 * self.radius {
            return match self.profile {
                Profile::Uniform => even::surface_displacement(self.radius, self.poisson_ratio, r),
                Profile::Rigid => punch::surface_displacement(self.radius, self.poisson_ratio, r),
            };
        }
        let mut sum = Mat3::zeros();
        self.integrate(r, |from, weight| sum += point_displacement(&from, self.poisson_ratio) * weight);
        sum
    }

    /// Gradient of the displacement at `r` below the surface: entry `k` is the derivative along axis `k`.
    pub fn gradient(&self, r: &Vec3) -> [Mat3; 3] {
        let mut sum = [Mat3::zeros(); 3];
        self.integrate(r, |from, weight| {
            for (s, g) in sum.iter_mut().zip(point_gradient(&from, self.poisson_ratio)) {
                *s += g * weight;
            }
        });
        sum
    }

    /// Derivatives along the two tangential axes at a point of the surface away from the rim.
    pub fn surface_gradient(&self, r: &Vec3) -> [Mat3; 2] {
        match self.profile {
            Profile::Uniform => even::surface_gradient(self.radius, self.poisson_ratio, r),
            Profile::Rigid => punch::surface_gradient(self.radius, self.poisson_ratio, r),
        }
    }

    /// Distance of `r` from a disc of `radius` (m). Roots, not `hypot`: no body has the ranges that it guards against, and this is asked at
    /// every point.
    pub(super) fn away(r: &Vec3, radius: f64) -> f64 {
        let beyond = ((r.x * r.x + r.y * r.y).sqrt() - radius).max(0.0);
        (beyond * beyond + r.z * r.z).sqrt()
    }

    /// Calls `f(r − source, weight)` over the disc, weights summing to 1, as finely as the distance of `r`
    /// from the disc needs.
    fn integrate(&self, r: &Vec3, mut f: impl FnMut(Vec3, f64)) {
        let distance = Self::away(r, self.radius) / self.radius;
        match FAR.iter().position(|&(from, ..)| distance > from) {
            Some(tier) => {
                for &[x, y, weight] in &self.far[tier] {
                    f(Vec3::new(r.x - x, r.y - y, r.z), weight);
                }
            }
            None => self.integrate_near(r, &mut f),
        }
    }

    /// [`LoadedDisc::integrate`] close to the disc: cells are quartered until each is small against its distance
    /// from `r`, so that only those next to it are fine.
    fn integrate_near(&self, r: &Vec3, f: &mut impl FnMut(Vec3, f64)) {
        let mut left: Vec<DiscCell> = DiscCell::whole();
        while let Some(cell) = left.pop() {
            let (outer, _) = self.profile.along(cell.share[1]);
            let (inner, _) = self.profile.along(cell.share[0]);
            let (middle, _) = self.profile.along(0.5 * (cell.share[0] + cell.share[1]));
            let (sin, cos) = (0.5 * (cell.angle[0] + cell.angle[1])).sin_cos();
            let wide = outer * (cell.angle[1] - cell.angle[0]);
            let size = (outer - inner).max(wide) * self.radius;
            let away = (r - Vec3::new(middle * cos, middle * sin, 0.0) * self.radius).norm() - 0.5 * size;
            if size > CELL_SIZE * away && size > SMALLEST_CELL * self.radius {
                left.extend(cell.quartered());
                continue;
            }
            let spread = (cell.share[1] - cell.share[0]) * (cell.angle[1] - cell.angle[0]) / TAU;
            for &(t, wt) in &self.cell_rule {
                let (rho, weight) = self.profile.along(cell.share[0] + t * (cell.share[1] - cell.share[0]));
                for &(s, ws) in &self.cell_rule {
                    let (sin, cos) = (cell.angle[0] + s * (cell.angle[1] - cell.angle[0])).sin_cos();
                    let from = Vec3::new(rho * cos, rho * sin, 0.0) * self.radius;
                    f(r - from, spread * weight * wt * ws);
                }
            }
        }
    }
}

/// Largest size of a cell of a disc over its distance, and the smallest over the disc's radius.
const CELL_SIZE: f64 = 1.0;
const SMALLEST_CELL: f64 = 3e-4;

/// Gauss points each way in a cell.
const CELL_POINTS: usize = 4;

/// A part of a disc: from a share of the way along the radius ([`Profile::along`]) to another, between two angles.
#[derive(Debug, Clone, Copy)]
struct DiscCell {
    share: [f64; 2],
    angle: [f64; 2],
}

impl DiscCell {
    /// The cells that a disc begins with.
    fn whole() -> Vec<Self> {
        const AROUND: usize = 6;
        let at = |i: usize| TAU * i as f64 / AROUND as f64;
        (0..AROUND).map(|i| Self { share: [0.0, 1.0], angle: [at(i), at(i + 1)] }).collect()
    }

    fn quartered(self) -> [Self; 4] {
        let halves = |[from, to]: [f64; 2]| [[from, 0.5 * (from + to)], [0.5 * (from + to), to]];
        let ([near, far], [first, second]) = (halves(self.share), halves(self.angle));
        [(near, first), (near, second), (far, first), (far, second)]
            .map(|(share, angle)| Self { share, angle })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::elasticity::stress;

    const NU: f64 = 0.47;

    fn uniform(radius: f64) -> LoadedDisc {
        LoadedDisc::new(radius, Profile::Uniform, NU)
    }

    fn rigid(radius: f64) -> LoadedDisc {
        LoadedDisc::new(radius, Profile::Rigid, NU)
    }

    /// Displacement gradient tensor for force direction `j` from the three axis derivatives.
    fn tensor(g: &[Mat3; 3], j: usize) -> Mat3 {
        Mat3::from_fn(|i, k| g[k][(i, j)])
    }

    #[test]
    fn gradient_is_the_derivative() {
        let r = Vec3::new(0.3, -0.5, 0.4);
        let g = point_gradient(&r, NU);
        let h = 1e-6;
        for k in 0..3 {
            let mut step = Vec3::zeros();
            step[k] = h;
            let difference =
                (point_displacement(&(r + step), NU) - point_displacement(&(r - step), NU)) / (2.0 * h);
            assert!((difference - g[k]).norm() < 1e-8, "axis {k}");
        }
    }

    /// The stress through any hemisphere around the load balances it, and the surface carries no traction.
    #[test]
    fn point_loads_are_in_equilibrium() {
        for j in 0..3 {
            let mut force = Vec3::zeros();
            let n = 64;
            for (t, wt) in gauss_legendre(n) {
                for i in 0..n {
                    let phi = TAU * i as f64 / n as f64;
                    let rho = (1.0 - t * t).sqrt();
                    let normal = Vec3::new(rho * phi.cos(), rho * phi.sin(), t);
                    let s = stress(&tensor(&point_gradient(&(normal * 0.7), NU), j), NU);
                    force += s * normal * (0.49 * TAU / n as f64 * wt);
                }
            }
            let mut load = Vec3::zeros();
            load[j] = 1.0;
            assert!((force + load).norm() < 1e-10, "{j}: {force}");
            let s = stress(&tensor(&point_gradient(&Vec3::new(0.4, -0.2, 0.0), NU), j), NU);
            assert!((s * Vec3::z()).norm() < 1e-12);
        }
    }

    /// The surface displacement averaged over the disc is the closed form.
    #[test]
    fn mean_over_the_disc_is_the_closed_form() {
        let disc = uniform(0.008);
        let mut mean = Mat3::zeros();
        for (t, wt) in gauss_legendre(24) {
            // ρ = a (1 − s²): the rim's logarithmic slope is resolved by points crowding there.
            let rho = 1.0 - t * t;
            mean += disc.displacement(&Vec3::new(rho * 0.008, 0.0, 0.0)) * (wt * 2.0 * t * 2.0 * rho);
        }
        let [tangential, normal] = disc_self_compliance(0.008, NU);
        // Averaging over one ray leaves (xx + yy) / 2 for the tangential mean.
        assert!((0.5 * (mean[(0, 0)] + mean[(1, 1)]) / tangential - 1.0).abs() < 1e-5);
        assert!((mean[(2, 2)] / normal - 1.0).abs() < 1e-5, "{} {normal}", mean[(2, 2)]);
    }

    /// Centre of a uniformly loaded disc: `2 (1 − ν²) p a / E` (Boussinesq 1885).
    #[test]
    fn centre_of_a_loaded_disc() {
        let a = 0.005;
        let disc = uniform(a);
        let centre = disc.displacement(&Vec3::zeros())[(2, 2)];
        assert!((centre / (2.0 * (1.0 - NU * NU) / (PI * a)) - 1.0).abs() < 1e-12);
    }

    /// On the axis below a uniformly loaded disc: `σ_z = −p (1 − z³ / (a² + z²)^{3/2})` (Boussinesq 1885).
    #[test]
    fn stress_on_the_axis_and_every_distance_of_the_rule() {
        let a = 1.0;
        let disc = uniform(a);
        for z in [0.01, 0.03, 0.1, 0.3, 1.0, 1.4, 1.6, 2.4, 2.6, 4.9, 5.1_f64] {
            let s = stress(&tensor(&disc.gradient(&Vec3::new(0.0, 0.0, z)), 2), NU);
            let exact = -(1.0 - z.powi(3) / (a * a + z * z).powf(1.5)) / (PI * a * a);
            assert!((s[(2, 2)] / exact - 1.0).abs() < 1e-3, "z = {z}: {} {exact}", s[(2, 2)]);
        }
    }

    /// Just beyond each distance at which the rule changes, all round, against one of many points.
    #[test]
    fn the_rule_is_as_exact_at_every_distance_and_all_round() {
        for profile in [Profile::Uniform, Profile::Rigid] {
            let disc = LoadedDisc::new(1.0, profile, NU);
            let many = rule(profile, 1.0, 10, 40);
            for (from, ..) in FAR {
                for (polar, around) in (0..6).flat_map(|p| (0..7).map(move |a| (p, a))) {
                    let (height, angle) = ((0.05 + 0.18 * f64::from(polar)).sin(), 0.9 * f64::from(around));
                    let level = (1.0 - height * height).sqrt();
                    let direction = Vec3::new(level * angle.cos(), level * angle.sin(), height);
                    // So far from the rim, or a little farther.
                    let r = direction * (1.001 * from + level);
                    let mut exact = [Mat3::zeros(); 3];
                    for &[x, y, weight] in &many {
                        let own = point_gradient(&(r - Vec3::new(x, y, 0.0)), NU);
                        exact.iter_mut().zip(own).for_each(|(sum, g)| *sum += g * weight);
                    }
                    let largest = exact.iter().map(Mat3::amax).fold(0.0, f64::max);
                    for (own, exact) in disc.gradient(&r).iter().zip(&exact) {
                        assert!((own - exact).amax() < 1e-3 * largest, "{profile:?} {from} {direction}");
                    }
                }
            }
        }
    }

    /// The interior rule and the surface rule meet at the surface, and the slopes are its derivatives.
    #[test]
    fn rules_meet_at_the_surface() {
        let disc = uniform(1.0);
        for r in [Vec3::new(1.6, 0.3, 0.0), Vec3::new(-1.1, 1.0, 0.0), Vec3::new(0.3, -4.0, 0.0)] {
            let below = disc.displacement(&(r + Vec3::new(0.0, 0.0, 1e-6)));
            assert!((below - disc.displacement(&r)).norm() < 1e-5);
            let h = 1e-5;
            for (k, g) in disc.surface_gradient(&r).iter().enumerate() {
                let mut step = Vec3::zeros();
                step[k] = h;
                let slope = (disc.displacement(&(r + step)) - disc.displacement(&(r - step))) / (2.0 * h);
                assert!((slope - g).norm() < 1e-6, "{r} {k}");
            }
        }
        let inside = Vec3::new(0.3, 0.2, 0.0);
        let h = 1e-5;
        let slope = (disc.displacement(&(inside + Vec3::x() * h))
            - disc.displacement(&(inside - Vec3::x() * h)))
            / (2.0 * h);
        assert!((slope - disc.surface_gradient(&inside)[0]).norm() < 1e-6);
    }

    /// On the axis below a rigid punch: `σ_z = −(1 + 3ζ²) / (2πa² (1 + ζ²)²)`, `ζ = z/a` (Sneddon 1946).
    #[test]
    fn stress_on_the_axis_of_a_rigid_punch() {
        for z in [0.01, 0.03, 0.1, 0.3, 1.0, 1.4, 1.6, 2.4, 2.6, 4.9, 5.1_f64] {
            let s = stress(&tensor(&rigid(1.0).gradient(&Vec3::new(0.0, 0.0, z)), 2), NU);
            let exact = -(1.0 + 3.0 * z * z) / (TAU * (1.0 + z * z).powi(2));
            assert!((s[(2, 2)] / exact - 1.0).abs() < 1e-3, "z = {z}: {} {exact}", s[(2, 2)]);
        }
    }

    /// The rigid profile's interior rule and closed form meet at the surface.
    #[test]
    fn the_rigid_profile_meets_its_surface() {
        for r in [Vec3::new(1.6, 0.3, 0.0), Vec3::new(-1.1, 1.0, 0.0), Vec3::new(0.3, -4.0, 0.0)] {
            let below = rigid(1.0).displacement(&(r + Vec3::new(0.0, 0.0, 1e-6)));
            assert!((below - rigid(1.0).displacement(&r)).norm() < 1e-5, "{r}");
        }
    }

    /// The whole load is 1, for both profiles, and the mean of `ρ²` is `a²/2` and `2a²/3`.
    #[test]
    fn radial_rules_carry_the_load() {
        for (profile, second) in [(Profile::Uniform, 0.5), (Profile::Rigid, 2.0 / 3.0)] {
            let rule = profile.radial(3.0, 4);
            assert!((rule.iter().map(|(_, w)| w).sum::<f64>() - 1.0).abs() < 1e-14);
            let found: f64 = rule.iter().map(|(rho, w)| w * rho * rho / 9.0).sum();
            assert!((found - second).abs() < 1e-14);
        }
    }

    /// What a rigid disc reads of a uniform load on itself is what the uniform load's closed form says.
    #[test]
    fn profiles_are_reciprocal() {
        let [tangential, normal] = uniform(1.0).self_compliance(Profile::Rigid);
        let mut read = Mat3::zeros();
        for (rho, w) in Profile::Rigid.radial(1.0, 40) {
            read += uniform(1.0).displacement(&Vec3::new(rho, 0.0, 0.0)) * w;
        }
        assert!((read[(2, 2)] / normal - 1.0).abs() < 1e-4, "{} {normal}", read[(2, 2)]);
        assert!((0.5 * (read[(0, 0)] + read[(1, 1)]) / tangential - 1.0).abs() < 1e-4);
    }
}
