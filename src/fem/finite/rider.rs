//! A marker that rides on the surface through large rotations: where a displacement of the body takes it.
//!
//! The marker stands off the surface by `o` from its foot. It goes where the foot goes, and `o` turns with the body there:
//! displacement `u + (R − I) o`, `F = R U` the polar decomposition of the foot's deformation gradient (R a rotation, U symmetric).
//! The exact derivative along `δF` is `δR = R [ω]×` with `(tr(U) I − U) ω = axial(Rᵀ δF − δFᵀ R)` (from δF = δR U + R δU, whose second
//! part is symmetric in the frame of U). Verified against a turned body and by a Taylor test below.

use crate::fem::{FemError, Space, barycentric_gradients};
use crate::geometry::{Mat3, Vec3};
use crate::mesh::SurfaceIndex;

/// A marker on a body.
#[derive(Debug, Clone)]
pub struct Rider {
    /// Where it stands on the surface (m).
    at: Vec3,
    /// Displacement of the foot: the share of every node.
    foot: Vec<(u32, f64)>,
    /// Displacement gradient at the foot: what every node adds, `∂u_i/∂x_j = Σ u_i(node) g_j`.
    gradient: Vec<(u32, Vec3)>,
    /// From the foot to the marker (m).
    offset: Vec3,
}

impl Rider {
    /// A marker at `rest` (m), on the point of the named surface nearest to it. `index` must have been made from the same surface of
    /// the mesh that `space` was made from.
    ///
    /// # Errors
    /// [`FemError::NoSurface`].
    pub fn new(space: &Space, index: &SurfaceIndex, surface: &str, rest: &Vec3) -> Result<Self, FemError> {
        let attached =
            index.nearest(rest).ok_or_else(|| FemError::NoSurface { surface: surface.to_owned() })?;
        let (face, foot) = (space.surface(surface)[attached.triangle], attached.point.position);
        let shape = space.order().face_shape(space.face_triangle(face).nearest(&foot).barycentric);
        let cell = space.faces()[face].cell;
        let corners = space.corners(cell);
        let (gradient, _) = barycentric_gradients(&corners);
        let at = std::array::from_fn(|i| gradient[i].dot(&(foot - corners[0])) + f64::from(u8::from(i == 0)));
        let slope = space.order().cell_gradient(at, &gradient);
        Ok(Self {
            at: foot,
            foot: space.face_nodes(face).iter().copied().zip(shape).collect(),
            gradient: space.cell(cell).iter().copied().zip(slope).collect(),
            offset: rest - foot,
        })
    }

    /// Where the marker stands on the surface at rest (m).
    pub fn foot(&self) -> Vec3 {
        self.at
    }

    /// Displacement of the marker (m) where the body's is `u` (`3 n + i`, m).
    pub fn displacement(&self, u: &[f64]) -> Vec3 {
        let (rotation, _) = self.polar(u);
        self.carried(u) + (rotation - Mat3::identity()) * self.offset
    }

    /// Change of that displacement where `u` changes by `du`, to first order.
    pub fn change(&self, u: &[f64], du: &[f64]) -> Vec3 {
        let (rotation, stretch) = self.polar(u);
        let turned = rotation.transpose() * self.slope(du);
        let skew = turned - turned.transpose();
        let axial = Vec3::new(skew[(2, 1)], skew[(0, 2)], skew[(1, 0)]);
        // Positive definite wherever two principal stretches add up to more than nothing.
        let spin = (Mat3::identity() * stretch.trace() - stretch).try_inverse().unwrap_or_default() * axial;
        self.carried(du) + rotation * spin.cross(&self.offset)
    }

    fn carried(&self, u: &[f64]) -> Vec3 {
        self.foot.iter().map(|&(n, share)| at(u, n) * share).sum()
    }

    fn slope(&self, u: &[f64]) -> Mat3 {
        self.gradient.iter().map(|(n, g)| at(u, *n) * g.transpose()).sum()
    }

    /// Rotation and right stretch at the foot.
    fn polar(&self, u: &[f64]) -> (Mat3, Mat3) {
        let deformation = Mat3::identity() + self.slope(u);
        let svd = deformation.svd(true, true);
        let (Some(left), Some(right)) = (svd.u, svd.v_t) else { return (Mat3::identity(), deformation) };
        let rotation = left * right;
        (rotation, rotation.transpose() * deformation)
    }
}

fn at(u: &[f64], node: u32) -> Vec3 {
    Vec3::from_fn(|i, _| u[3 * node as usize + i])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::Order;
    use crate::mesh::{Block, block};

    fn rider(order: Order) -> (Space, Rider, Vec3) {
        let mesh = block(&Block { size_m: [0.1, 0.03, 0.03], cells: [5, 2, 2] }).expect("a block");
        let space = Space::new(&mesh, order).expect("a space");
        let index = SurfaceIndex::new(&mesh, mesh.surface("z+"));
        let rest = Vec3::new(0.083, 0.011, 0.036);
        let rider = Rider::new(&space, &index, "z+", &rest).expect("on the surface");
        (space, rider, rest)
    }

    fn field(space: &Space, u: impl Fn(&Vec3) -> Vec3) -> Vec<f64> {
        space.nodes().iter().flat_map(|p| <[f64; 3]>::from(u(p))).collect()
    }

    /// On a body that turns as a whole, and one that is stretched besides, a marker goes where the body would take it.
    #[test]
    fn a_marker_turns_with_the_body() {
        for order in [Order::P1, Order::P2] {
            let (space, rider, rest) = rider(order);
            let turn = nalgebra::Rotation3::new(Vec3::new(0.3, -1.1, 0.7)).into_inner();
            let moved = rider.displacement(&field(&space, |p| turn * p - p));
            assert!((moved - (turn * rest - rest)).norm() < 1e-12, "{order:?}: {moved}");
            let stretch = Mat3::from_diagonal(&Vec3::new(1.2, 0.9, 0.8));
            let foot = Vec3::new(rest.x, rest.y, 0.03);
            let moved = rider.displacement(&field(&space, |p| turn * stretch * p - p));
            let expected = turn * (stretch * foot + (rest - foot)) - rest;
            assert!((moved - expected).norm() < 1e-12, "{order:?}: {moved}");
        }
    }

    /// What is left of the change after its first-order part falls with the square of the step.
    #[test]
    fn the_change_is_the_derivative() {
        let (space, rider, _) = rider(Order::P2);
        let u = field(&space, |p| Vec3::new(-30.0 * p.x * p.z, 8.0 * p.y * p.x, -40.0 * p.x * p.x) * 1.5);
        let du = field(&space, |p| Vec3::new(0.1 * p.z, p.x * p.y, -2.0 * p.x * p.x + 0.3 * p.y));
        let change = rider.change(&u, &du);
        let left = |t: f64| {
            let moved: Vec<f64> = u.iter().zip(&du).map(|(u, d)| u + t * d).collect();
            (rider.displacement(&moved) - rider.displacement(&u) - change * t).norm()
        };
        let order = (left(2e-2) / left(1e-2)).log2();
        assert!((order - 2.0).abs() < 0.1, "order {order}");
    }
}
