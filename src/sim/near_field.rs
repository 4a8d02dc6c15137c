//! The field that a loaded disc on one side of the block would make if that side were all there is.
//!
//! Under a disc the stress is steep, and there the block looks like a half-space. So the bench writes the displacement
//! as that of the half-space, known to rounding, and a remainder, which only the other sides and the glue
//! cause and which is smooth (see `linear`).
//!
//! Off the side, and on it at some distance, the field is a sum over polar points of the disc, the more of them the
//! nearer the place. On the side itself it is an integral over directions: seen from a place y, the displacement
//! is ∫ G(e_θ) ∫ φ(y + ρ e_θ) dρ dθ, as the distance ρ in dA = ρ dρ dθ cancels that in the kernel; the integrals along
//! the rays are closed for a uniform traction and smooth for that of a glued spot. The test below compares with
//! closed forms.

use super::half_space::HalfSpace;
use super::hex_mesh::{Feature, Place, Slab};
use super::legendre::gauss_legendre;
use super::supports::{Patch, Shape, polar};
use crate::geometry::{Mat3, Vec3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Point sums for places at least so far from the disc, in its radii: with points along the radius and around.
/// A sum over n points around a circle of radius r sees a source at distance d from it to (r / (r + d))ⁿ.
const RULES: [(f64, usize, usize); 5] =
    [(4.0, 2, 7), (2.0, 3, 10), (1.0, 4, 15), (0.4, 7, 30), (0.0, 12, 60)];
/// On the disc's own side, nearer than this (radii), the field is integrated over directions.
const NEAR: f64 = 0.4;
/// Directions from a place in the disc, and from one outside it.
const DIRECTIONS_INSIDE: usize = 96;
const DIRECTIONS_OUTSIDE: usize = 32;
/// Points along a ray through a glued spot, whose traction is a polynomial of the fourth degree there.
const ALONG: usize = 8;

/// Places in a disc (radii), each with the values of all support functions times its weight.
type Rule = Vec<([f64; 2], Vec<f64>)>;

/// The field of one disc; one function of a pad or spring patch, several of a glued spot.
#[derive(Debug, Clone)]
pub(super) struct NearField {
    patch: Patch,
    shape: Shape,
    space: HalfSpace,
    /// Axes along the disc, then the one along its normal.
    axes: [usize; 3],
    /// +1 when the block lies ahead along the normal's axis, −1 when behind.
    inward: f64,
    rules: Vec<Rule>,
    own: Rule,
    gauss: Vec<(f64, f64)>,
    along: Vec<(f64, f64)>,
}

impl NearField {
    /// The field of a disc of `slab` with E = 1 Pa.
    pub(super) fn new(patch: Patch, shape: Shape, slab: &Slab, poisson_ratio: f64) -> Self {
        let Patch { centre, axis, .. } = patch;
        // The functions of a held disc have to be resolved too.
        let (deeper, rounder) = if shape == Shape::Held { (2, 5) } else { (0, 0) };
        let rule = |radial, around| -> Rule {
            polar(radial + deeper, around + rounder, shape)
                .map(|(x, y, weight)| ([x, y], shape.values(x, y).into_iter().map(|v| v * weight).collect()))
                .collect()
        };
        Self {
            patch,
            shape,
            space: HalfSpace::new(poisson_ratio),
            axes: [(axis + 1) % 3, (axis + 2) % 3, axis],
            inward: if centre[axis] > 0.5 * slab.size_m[axis] { -1.0 } else { 1.0 },
            rules: RULES.iter().map(|&(_, radial, around)| rule(radial, around)).collect(),
            own: rule(24, 40),
            gauss: gauss_legendre(DIRECTIONS_OUTSIDE),
            along: gauss_legendre(ALONG),
        }
    }

    /// Number of support functions.
    pub(super) fn functions(&self) -> usize {
        self.shape.functions()
    }

    /// Whether a side (normal along `axis`, outward in the sense of `outward`) is the disc's own.
    pub(super) fn is_on(&self, axis: usize, outward: f64) -> bool {
        self.patch.axis == axis && outward == -self.inward
    }

    /// A place in the disc's frame, in its radii.
    fn local(&self, point: [f64; 3]) -> [f64; 3] {
        let along = |k: usize| (point[self.axes[k]] - self.patch.centre[self.axes[k]]) / self.patch.radius;
        [along(0), along(1), self.inward * along(2)]
    }

    /// A tensor in the disc's frame turned into the block's.
    fn global(&self, tensor: &Mat3) -> Mat3 {
        let sign = [1.0, 1.0, self.inward];
        let mut turned = Mat3::zeros();
        for i in 0..3 {
            for j in 0..3 {
                turned[(self.axes[i], self.axes[j])] = sign[i] * sign[j] * tensor[(i, j)];
            }
        }
        turned
    }

    /// Adds up a kernel over the disc.
    fn sum(&self, at: [f64; 3], kernel: impl Fn(Vec3) -> Mat3) -> Vec<Mat3> {
        let away = (at[0].hypot(at[1]) - 1.0).max(0.0).hypot(at[2]);
        let rule = RULES.iter().position(|r| away >= r.0).unwrap_or(RULES.len() - 1);
        let mut sums = vec![Mat3::zeros(); self.functions()];
        for ([x, y], values) in &self.rules[rule] {
            let tensor = kernel(Vec3::new(at[0] - x, at[1] - y, at[2].max(0.0)));
            for (sum, value) in sums.iter_mut().zip(values) {
                *sum += tensor * *value;
            }
        }
        sums
    }

    /// Displacement at a place (m) of the block: of each function, entry (i, j) along axis i for a unit force along
    /// axis j.
    pub(super) fn displacement(&self, point: [f64; 3]) -> Vec<Mat3> {
        let at = self.local(point);
        let sums = if at[2].abs() < 1e-9 && at[0].hypot(at[1]) < 1.0 + NEAR {
            self.beside(at[0], at[1])
        } else {
            self.sum(at, |x| self.space.displacement(x))
        };
        sums.iter().map(|s| self.global(s) / self.patch.radius).collect()
    }

    /// Traction at a place (m) on a plane whose normal is `outward` along `axis`: of each function, entry (i, j) along
    /// axis i for a unit force along axis j.
    pub(super) fn traction(&self, point: [f64; 3], axis: usize, outward: f64) -> Vec<Mat3> {
        let normal = (0..3).find(|&k| self.axes[k] == axis).unwrap_or(2);
        let sign = if normal == 2 { outward * self.inward } else { outward };
        let sums = self.sum(self.local(point), |x| self.space.traction(x, normal));
        sums.iter().map(|s| self.global(s) * (sign / self.patch.radius.powi(2))).collect()
    }

    /// Displacement on the disc's own side, in and near the disc.
    fn beside(&self, x: f64, y: f64) -> Vec<Mat3> {
        let distance = x.hypot(y);
        let mut sums = vec![Mat3::zeros(); self.functions()];
        let mut add = |c: f64, s: f64, from: f64, ray: Ray, weight: f64| {
            let kernel = self.space.on_surface(c, s) * weight;
            for (sum, value) in sums.iter_mut().zip(self.along_ray([x, y], [c, s], from, ray)) {
                *sum += kernel * value;
            }
        };
        if distance < 1.0 {
            for i in 0..DIRECTIONS_INSIDE {
                let (s, c) = (TAU * (i as f64 + 0.5) / DIRECTIONS_INSIDE as f64).sin_cos();
                let middle = -(x * c + y * s);
                let half = (1.0 - (x * s - y * c).powi(2)).max(0.0).sqrt();
                add(c, s, 0.0, Ray { middle, half }, TAU / DIRECTIONS_INSIDE as f64);
            }
        } else {
            // Directions that hit the disc: sin ψ = sin(t) / distance from that of its centre.
            for &(share, weight) in &self.gauss {
                let t = PI * (share - 0.5);
                let sine = t.sin() / distance;
                let cosine = (1.0 - sine * sine).sqrt();
                let toward = [-x / distance, -y / distance];
                let (c, s) = (toward[0] * cosine - toward[1] * sine, toward[1] * cosine + toward[0] * sine);
                let ray = Ray { middle: distance * cosine, half: t.cos() };
                add(c, s, ray.middle - ray.half, ray, PI * weight * t.cos() / (distance * cosine));
            }
        }
        sums
    }

    /// ∫ φ dρ along a ray from ρ = `from` to where it leaves the disc.
    fn along_ray(&self, at: [f64; 2], e: [f64; 2], from: f64, ray: Ray) -> Vec<f64> {
        let Ray { middle, half } = ray;
        match self.shape {
            Shape::Uniform => vec![(middle + half - from) / PI],
            // φ = T / (2π √(1 − r²)), and 1 − r² is half² − (ρ − middle)² on the ray: ρ = middle + half sin t.
            Shape::Held => {
                let start = ((from - middle) / half).clamp(-1.0, 1.0).asin();
                let span = FRAC_PI_2 - start;
                let mut sums = vec![0.0; self.functions()];
                for &(share, weight) in &self.along {
                    let rho = middle + half * (start + share * span).sin();
                    let values = self.shape.values(at[0] + rho * e[0], at[1] + rho * e[1]);
                    for (sum, value) in sums.iter_mut().zip(values) {
                        *sum += value * weight * span / TAU;
                    }
                }
                sums
            }
        }
    }

    /// Places in the disc (m), each with the support functions' values times its weight: ∫ φ f = Σ value f(place).
    pub(super) fn places(&self) -> impl Iterator<Item = ([f64; 3], &[f64])> {
        self.own.iter().map(|([x, y], values)| (self.patch.point(*x, *y), values.as_slice()))
    }

    /// Where the remainder has its sources: the disc's mirror images behind the other sides, and behind the end of
    /// the glue when the disc lies on its side.
    pub(super) fn images(&self, slab: &Slab, growth: f64) -> Vec<Feature> {
        let Patch { centre, axis, radius } = self.patch;
        let sides = (0..3).flat_map(|a| [(a, 0.0), (a, slab.size_m[a])]);
        let is_own = |(a, side): (usize, f64)| a == axis && (centre[a] - side).abs() < 1e-9;
        let mut mirrored: Vec<(usize, f64)> = sides.filter(|&side| !is_own(side)).collect();
        if axis == 2 && centre[2] < 0.5 * slab.size_m[2] {
            mirrored.push((0, slab.glue_end_m));
        }
        let image = |(a, side): (usize, f64)| {
            let mut image = centre;
            image[a] = 2.0 * side - centre[a];
            Feature { place: Place::Disc { centre: image, axis, radius }, cell_m: 0.0, growth }
        };
        mirrored.into_iter().map(image).collect()
    }
}

/// Where a straight line crosses the unit disc: the middle of the chord (distance from the start) and half its
/// length.
#[derive(Clone, Copy)]
struct Ray {
    middle: f64,
    half: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;

    const NU: f64 = 0.47;
    const SLAB: Slab = Slab { size_m: [10.0, 10.0, 5.0], glue_end_m: 1.0 };

    fn disc(shape: Shape) -> NearField {
        let patch = Patch::on(&SLAB, "disc", [5.0, 4.0, 5.0], Vec3::z(), 0.7).expect("on the top");
        NearField::new(patch, shape, &SLAB, NU)
    }

    /// Compliance of the functions among themselves.
    fn own(field: &NearField) -> DMatrix<f64> {
        let n = 3 * field.functions();
        let mut work = DMatrix::zeros(n, n);
        for (place, values) in field.places() {
            for (j, moved) in field.displacement(place).iter().enumerate() {
                for (i, value) in values.iter().enumerate() {
                    let mut block = work.fixed_view_mut::<3, 3>(3 * i, 3 * j);
                    block += *moved * *value;
                }
            }
        }
        work
    }

    /// Mean displacement of a uniformly loaded disc: 16 (1 − ν²) p a / (3 π E) along the pressure (Love 1929; Johnson
    /// 1985, section 3.4). For a tangential traction the kernel (1 − ν)/r becomes (1 − ν)/r + ν x²/r³ (Cerruti; Johnson
    /// 1985, 3.75), whose double integral over a disc is that of (1 − ν/2)/r.
    #[test]
    fn a_uniform_traction_moves_its_disc_as_in_closed_form() {
        let compliance = own(&disc(Shape::Uniform));
        let normal = 16.0 * (1.0 - NU * NU) / (3.0 * PI * PI * 0.7);
        let tangential = normal * (1.0 - 0.5 * NU) / (1.0 - NU);
        for (axis, exact) in [(0, tangential), (1, tangential), (2, normal)] {
            let ratio = compliance[(axis, axis)] / exact;
            assert!((ratio - 1.0).abs() < 3e-6, "axis {axis}: {ratio}");
        }
    }

    /// A disc that its functions hold still is as stiff as a rigid bonded one: along its axis
    /// 4 μ a ln(3 − 4ν) / (1 − 2ν) (Mossakovskii 1954; Spence 1968), about it 16 μ a³ / 3 (Reissner & Sagoci 1944).
    #[test]
    fn a_held_disc_is_as_stiff_as_a_bonded_rigid_one() {
        let field = disc(Shape::Held);
        let compliance = own(&field);
        let asymmetry = (&compliance - compliance.transpose()).amax() / compliance.amax();
        assert!(asymmetry < 1e-4, "{asymmetry:e}");
        let factor = (0.5 * (&compliance + compliance.transpose())).cholesky().expect("distinct functions");
        let stiffness = |motion: &dyn Fn([f64; 3]) -> [f64; 3]| {
            let mut g = nalgebra::DVector::zeros(3 * field.functions());
            for (place, values) in field.places() {
                for (i, value) in values.iter().enumerate() {
                    for (c, u) in motion(place).into_iter().enumerate() {
                        g[3 * i + c] += value * u;
                    }
                }
            }
            g.dot(&factor.solve(&g))
        };
        let (mu, a) = (0.5 / (1.0 + NU), 0.7_f64);
        let pressed =
            stiffness(&|_| [0.0, 0.0, 1.0]) / (4.0 * mu * a * (3.0 - 4.0 * NU).ln() / (1.0 - 2.0 * NU));
        let turned = stiffness(&|p| [4.0 - p[1], p[0] - 5.0, 0.0]) / (16.0 * mu * a.powi(3) / 3.0);
        assert!((pressed - 1.0).abs() < 1e-4 && (turned - 1.0).abs() < 1e-4, "{pressed}, {turned}");
    }

    /// Where both can be had, the sum over the disc and the integral over directions agree, and so do the sums of
    /// neighbouring rules.
    #[test]
    fn the_ways_of_integrating_agree() {
        for shape in [Shape::Uniform, Shape::Held] {
            let field = disc(shape);
            for away in [0.4, 1.0, 2.0, 4.0] {
                let (x, y) = ((1.0 + away) * 0.6, (1.0 + away) * 0.8);
                let exact = field.beside(x, y);
                for r in [1.0 + away + 1e-9, 1.0 + away - 1e-9] {
                    let sum = field.sum([r * 0.6, r * 0.8, 0.0], |x| field.space.displacement(x));
                    for (sum, exact) in sum.iter().zip(&exact) {
                        assert!(
                            (sum - exact).amax() < 3e-5 * field.beside(0.0, 0.0)[0].amax(),
                            "{shape:?} {away}"
                        );
                    }
                }
            }
        }
    }
}
