//! The near field of one loaded disc in the phantom frame, and the load that it leaves to the elements.
//!
//! The displacement is split, `u = u_half-space + w`. The half-space's part carries the disc's traction and
//! leaves none on its plane; `w` is what remains: on the held surface `w = −u_half-space`, on every other face
//! off the plane the traction `−σ(u_half-space) n`. Both are smooth, so that `w` needs no fine elements at the
//! disc, whatever the mesh there.

use super::elasticity::lame;
use super::element::triangle_quadrature;
use super::half_space::{LoadedDisc, Profile};
use super::space::Space;
use super::spot::{Spot, SpotKind, turned};
use crate::geometry::{Disc, Mat3, Vec3, basis_from_axis};
use rayon::prelude::*;
use std::sync::LazyLock;

/// The half-space's displacement under a disc of unit force, in the phantom frame, for a unit modulus.
#[derive(Debug, Clone)]
pub struct Near {
    disc: Disc,
    /// Columns: two tangents and the inward normal.
    frame: Mat3,
    local: LoadedDisc,
    /// Poisson's ratio.
    poisson_ratio: f64,
}

/// A face counts as part of the disc's plane within this share of the radius.
const ON_PLANE: f64 = 1e-4;

impl Near {
    /// The near field of `disc` (normal outward), its load spread as `profile` says.
    pub fn new(disc: Disc, profile: Profile, poisson_ratio: f64) -> Self {
        let frame = basis_from_axis(&-disc.normal);
        Self { disc, frame, local: LoadedDisc::new(disc.radius, profile, poisson_ratio), poisson_ratio }
    }

    /// The near field of a load on `spot`; none unless it is a flat disc.
    pub fn of(spot: &Spot, poisson_ratio: f64) -> Option<Self> {
        match spot.kind {
            SpotKind::Disc { disc, profile, flat: true, .. } => Some(Self::new(disc, profile, poisson_ratio)),
            _ => None,
        }
    }

    /// The point in local coordinates, on the plane exactly when it is within tolerance of it.
    fn local(&self, p: &Vec3) -> Vec3 {
        let mut r = self.frame.transpose() * (p - self.disc.centre);
        if r.z < ON_PLANE * self.disc.radius {
            r.z = 0.0;
        }
        r
    }

    /// Displacement at `p`: column `j` for a unit force along axis `j`.
    pub fn displacement(&self, p: &Vec3) -> Mat3 {
        self.frame * self.local.displacement(&self.local(p)) * self.frame.transpose()
    }

    /// Displacement gradients at `p`, one for each force direction: `[i, k] = ∂uᵢ/∂xₖ`. On the plane, only the
    /// part that turns (antisymmetric) is complete: the stretch along the normal is left out.
    fn gradients(&self, p: &Vec3) -> [Mat3; 3] {
        let q = &self.frame;
        // ∂/∂xₖ = Σₘ Q[k, m] ∂/∂x'ₘ, and each derivative is a tensor that turns with the frame.
        let turned: [Mat3; 3] = self.derivatives(p).map(|g| q * g * q.transpose());
        std::array::from_fn(|j| Mat3::from_fn(|i, k| (0..3).map(|m| q[(k, m)] * turned[m][(i, j)]).sum()))
    }

    /// Traction at `p`, off the plane, on a face with this outward normal: column `j` for a unit force along axis `j`.
    /// In local coordinates as far as may be, so that no gradient is turned.
    fn tractions(&self, p: &Vec3, normal: &Vec3) -> Mat3 {
        let q = &self.frame;
        let (derivatives, n) = (self.derivatives(p), q.transpose() * normal);
        let (lambda, mu) = lame(self.poisson_ratio);
        let along = (0..3).map(|k| derivatives[k] * n[k]).sum::<Mat3>() * mu;
        let local = Mat3::from_fn(|i, j| {
            let volume: f64 = (0..3).map(|k| derivatives[k][(k, j)]).sum();
            let across: f64 = (0..3).map(|k| derivatives[i][(k, j)] * n[k]).sum();
            lambda * volume * n[i] + along[(i, j)] + mu * across
        });
        q * local * q.transpose()
    }

    /// Derivatives of the displacement along the axes of the disc's frame, in that frame, as [`Near::gradients`].
    fn derivatives(&self, p: &Vec3) -> [Mat3; 3] {
        let r = self.local(p);
        if r.z != 0.0 {
            return self.local.gradient(&r);
        }
        let [gx, gy] = self.local.surface_gradient(&r);
        // No shear traction on the plane but the disc's own: ∂u_t/∂z = −∂u_z/∂t − t_t/μ.
        let mut gz = Mat3::zeros();
        let traction = 2.0 * (1.0 + self.poisson_ratio) * self.local.traction(r.norm());
        for j in 0..3 {
            gz[(0, j)] = -gx[(2, j)] - if j == 0 { traction } else { 0.0 };
            gz[(1, j)] = -gy[(2, j)] - if j == 1 { traction } else { 0.0 };
        }
        [gx, gy, gz]
    }

    /// Displacement of a spot.
    pub fn at(&self, spot: &Spot) -> Mat3 {
        match spot.kind {
            SpotKind::Marker { foot, offset } => {
                let mut u = self.displacement(&foot);
                if offset.norm() > 1e-9 * self.disc.radius {
                    for (j, gradient) in self.gradients(&foot).iter().enumerate() {
                        let mut column = u.column_mut(j);
                        column += turned(gradient, &offset);
                    }
                }
                u
            }
            SpotKind::Disc { disc, profile, .. } => self.mean_over(&disc, profile),
        }
    }

    fn is(&self, other: &Disc) -> bool {
        (other.centre - self.disc.centre).norm() < 1e-9 * self.disc.radius
            && (other.radius / self.disc.radius - 1.0).abs() < 1e-9
            && (other.normal - self.disc.normal).norm() < 1e-9
    }

    /// Slope along `tangent` (in the disc's plane) of the mean displacement over another disc; zero for the loaded
    /// disc itself, whose near field moves with it, and for a marker.
    pub fn slope_over(&self, spot: &Spot, tangent: &Vec3) -> Mat3 {
        let mut mean = Mat3::zeros();
        let SpotKind::Disc { disc, profile, .. } = spot.kind else { return mean };
        if !self.is(&disc) {
            over(&disc, profile, |p, weight| {
                for (j, gradient) in self.gradients(&p).iter().enumerate() {
                    let mut column = mean.column_mut(j);
                    column += gradient * tangent * weight;
                }
            });
        }
        mean
    }

    /// Mean displacement over another disc, weighed as its profile says, or over the loaded disc itself.
    fn mean_over(&self, other: &Disc, profile: Profile) -> Mat3 {
        if self.is(other) {
            let [tangential, normal] = self.local.self_compliance(profile);
            let local = Mat3::from_diagonal(&Vec3::new(tangential, tangential, normal));
            return self.frame * local * self.frame.transpose();
        }
        let mut mean = Mat3::zeros();
        over(other, profile, |p, weight| mean += self.displacement(&p) * weight);
        mean
    }

    /// What is left to the elements: forces of `−σ n` on the faces off the plane, for every node, and the prescribed
    /// displacement `−u` of every held node; column `j` for a unit force along axis `j`.
    pub fn remainder(&self, space: &Space, held: &[bool]) -> (Vec<Mat3>, Vec<(u32, Mat3)>) {
        let held_nodes = space.nodes().iter().zip(0..).zip(held).filter(|(_, held)| **held);
        let prescribed = held_nodes.map(|((p, node), _)| (node, -self.displacement(p))).collect();
        let faces = (0..space.faces().len()).into_par_iter();
        let on_faces: Vec<Option<[Mat3; 6]>> = faces.map(|face| self.on_face(space, face, held)).collect();
        let mut force = vec![Mat3::zeros(); space.nodes().len()];
        for (face, on_nodes) in on_faces.iter().enumerate() {
            for (&node, f) in space.face_nodes(face).iter().zip(on_nodes.iter().flatten()) {
                force[node as usize] += f;
            }
        }
        (force, prescribed)
    }

    /// Nodal forces of `−σ n` on one face; none on the held surface and the disc's plane.
    fn on_face(&self, space: &Space, face: usize, held: &[bool]) -> Option<[Mat3; 6]> {
        let nodes = space.face_nodes(face);
        if nodes.iter().all(|&n| held[n as usize]) {
            return None;
        }
        let triangle = space.face_triangle(face);
        let height = triangle.0.map(|p| -(p - self.disc.centre).dot(&self.disc.normal));
        if height.iter().all(|h| h.abs() <= ON_PLANE * self.disc.radius) {
            return None;
        }
        let (area, normal) = (triangle.area(), triangle.normal());
        let mut forces = [Mat3::zeros(); 6];
        for &(l, w) in self.rule(&triangle.0) {
            let tractions = self.tractions(&triangle.at(l), &normal) * (-w * area);
            for (f, s) in forces.iter_mut().zip(space.order().face_shape(l)) {
                *f += tractions * s;
            }
        }
        Some(forces)
    }

    /// The rule over a face that its [`Near::crowding`] needs.
    fn rule(&self, corners: &[Vec3; 3]) -> &'static TriangleRule {
        static RULES: LazyLock<[Box<TriangleRule>; 4]> =
            LazyLock::new(|| [2, 4, 8, 14].map(|degree| triangle_quadrature(degree).into()));
        &RULES[self.crowding(corners)]
    }

    /// How strongly the near field varies over a face: 0 hardly, 3 sharply (edge length against distance).
    fn crowding(&self, corners: &[Vec3; 3]) -> usize {
        let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
        let size = corners.iter().map(|p| (p - centre).norm()).fold(0.0, f64::max);
        let ratio = size / (self.distance(&centre) - 0.5 * size).max(1e-12);
        usize::from(ratio > 0.12) + usize::from(ratio > 0.4) + usize::from(ratio > 1.0)
    }

    /// Distance (m) of a point from the disc.
    pub fn distance(&self, p: &Vec3) -> f64 {
        let r = self.frame.transpose() * (p - self.disc.centre);
        LoadedDisc::away(&r, self.disc.radius)
    }
}

/// Barycentric places and weights (sum 1).
type TriangleRule = [([f64; 3], f64)];

/// Points over a disc with weights that sum to 1, spread as the profile.
fn over(disc: &Disc, profile: Profile, mut f: impl FnMut(Vec3, f64)) {
    const AROUND: u32 = 16;
    let basis = basis_from_axis(&disc.normal);
    for (rho, wr) in profile.radial(disc.radius, 5) {
        for i in 0..AROUND {
            let (sin, cos) = (std::f64::consts::TAU * (f64::from(i) + 0.5) / f64::from(AROUND)).sin_cos();
            f(disc.centre + basis * Vec3::new(rho * cos, rho * sin, 0.0), wr / f64::from(AROUND));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::elasticity::stress;
    use super::*;

    /// Tractions are those of the stress of the gradients, for a disc that lies askew.
    #[test]
    fn tractions_are_of_the_stress() {
        const NU: f64 = 0.47;
        let normal = Vec3::new(0.3, -0.5, 0.8).normalize();
        let disc = Disc { centre: Vec3::new(0.01, 0.02, 0.03), normal, radius: 0.005 };
        let near = Near::new(disc, Profile::Uniform, NU);
        let p = disc.centre - normal * 0.011 + Vec3::new(0.004, 0.007, -0.002);
        let face = Vec3::new(-0.7, 0.1, 0.4).normalize();
        let tractions = near.tractions(&p, &face);
        for (j, gradient) in near.gradients(&p).iter().enumerate() {
            let exact = stress(gradient, NU) * face;
            assert!((tractions.column(j) - exact).norm() < 1e-12 * tractions.norm(), "{j}: {exact}");
        }
    }
}
