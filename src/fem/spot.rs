//! A place on the surface where the body is loaded or seen: the mean over a disc, or a marker.
//!
//! A spot is a linear functional of the displacement with three components. By reciprocity the same weights
//! are the nodal forces of a unit load there, so that a spot serves as an observation and as a load.

use super::element::barycentric_gradients;
use super::error::FemError;
use super::half_space::Profile;
use super::space::Space;
use crate::geometry::{Disc, DiscPoint, Mat3, Triangle, Vec3, basis_from_axis};
use crate::mesh::{Attachment, SurfaceIndex, TetMesh};

/// Weights on displacement components (`3 n + i`) whose sum is one component of a spot's displacement.
pub type Functional = Vec<(u32, f64)>;

/// A place on the surface.
#[derive(Debug, Clone)]
pub struct Spot {
    /// One functional for each axis.
    pub weights: [Functional; 3],
    /// What it is.
    pub kind: SpotKind,
}

/// What a spot is.
#[derive(Debug, Clone)]
pub enum SpotKind {
    /// Mean displacement over a disc; as a load, a traction over it. Mean and traction are weighed alike.
    Disc {
        /// The disc, normal outward.
        disc: Disc,
        /// How it is weighed.
        profile: Profile,
        /// Share of the profile that lies on the body's surface: 1 unless the disc hangs over an edge.
        covered: f64,
        /// Whether the surface under the disc is flat, the disc wholly on it, and the body behind its plane:
        /// then the half-space carries its near field.
        flat: bool,
    },
    /// A marker that rides on the surface, with its stand-off turned by the rotation there.
    Marker {
        /// The point of attachment (m).
        foot: Vec3,
        /// From the point of attachment to the marker (m).
        offset: Vec3,
    },
}

/// Flatness tolerance relative to the disc's radius: what a mesh file's rounding leaves.
const FLAT: f64 = 1e-4;

impl Spot {
    /// The uniformly weighed disc of `radius` (m) centred at the point of the faces `on` nearest to `centre`, with
    /// the outward normal there. Faces belong to `space.faces()`.
    pub fn disc(space: &Space, on: &[usize], centre: &Vec3, radius: f64) -> Result<Self, FemError> {
        Self::weighed(space, on, centre, radius, Profile::Uniform)
    }

    /// As [`Spot::disc`], weighed as a rigid flat face bonded to the surface is loaded: the displacement that it
    /// reads is that of the face, the traction that it exerts is the face's (exactly on a half-space; elsewhere the
    /// Galerkin approximation with this one shape). The face is free to turn.
    pub fn rigid_disc(space: &Space, on: &[usize], centre: &Vec3, radius: f64) -> Result<Self, FemError> {
        Self::weighed(space, on, centre, radius, Profile::Rigid)
    }

    /// As [`Spot::disc`] or [`Spot::rigid_disc`].
    pub fn weighed(
        space: &Space,
        on: &[usize],
        centre: &Vec3,
        radius: f64,
        profile: Profile,
    ) -> Result<Self, FemError> {
        let off = || FemError::DiscOffSurface { centre_m: [centre.x, centre.y, centre.z], radius_m: radius };
        let (nearest, point) = on
            .iter()
            .map(|&f| (f, space.face_triangle(f).nearest(centre)))
            .min_by(|a, b| (a.1.position - centre).norm().total_cmp(&(b.1.position - centre).norm()))
            .ok_or_else(off)?;
        let disc = Disc { centre: point.position, normal: space.face_triangle(nearest).normal(), radius };
        let mut weights: [Functional; 3] = Default::default();
        let (mut covered, mut level) = (0.0, 0.0);
        for (face, p) in points(space, &disc, profile) {
            covered += p.weight;
            if (p.position - disc.centre).dot(&disc.normal).abs() <= FLAT * radius {
                level += p.weight;
            }
            for (&node, n) in space.face_nodes(face).iter().zip(space.order().face_shape(p.barycentric)) {
                for (i, w) in weights.iter_mut().enumerate() {
                    w.push((3 * node + i as u32, p.weight * n));
                }
            }
        }
        if covered <= 1e-9 {
            return Err(off());
        }
        for w in &mut weights {
            gather(w);
            w.iter_mut().for_each(|(_, x)| *x /= covered);
        }
        let behind = space.nodes().iter().all(|p| (p - disc.centre).dot(&disc.normal) <= FLAT * radius);
        let flat = behind && (level - 1.0).abs() < 1e-6;
        Ok(Self { weights, kind: SpotKind::Disc { disc, profile, covered, flat } })
    }

    /// How the mean over this disc changes as the disc is moved along `tangent` (a unit vector in its plane):
    /// weights on the displacement components, for each axis. `∂/∂s mean(u) = mean(∂u/∂s)`, with the slope of
    /// the elements under the disc. Empty for a marker.
    pub fn slope(&self, space: &Space, tangent: &Vec3) -> [Functional; 3] {
        let mut weights: [Functional; 3] = Default::default();
        let SpotKind::Disc { disc, profile, covered, .. } = self.kind else { return weights };
        for (face, p) in points(space, &disc, profile) {
            let cell = space.faces()[face].cell;
            let corners = space.corners(cell);
            let (gradient, _) = barycentric_gradients(&corners);
            let at = std::array::from_fn(|i| {
                gradient[i].dot(&(p.position - corners[0])) + f64::from(u8::from(i == 0))
            });
            for (&node, g) in space.cell(cell).iter().zip(space.order().cell_gradient(at, &gradient)) {
                let along = p.weight / covered * g.dot(tangent);
                for (i, w) in weights.iter_mut().enumerate() {
                    w.push((3 * node + i as u32, along));
                }
            }
        }
        weights.iter_mut().for_each(gather);
        weights
    }

    /// A marker at `rest` (m), attached to the nearest point of the named surface. Its offset from there turns
    /// with the local rotation `½ (∇u − ∇uᵀ)`.
    pub fn marker(
        space: &Space,
        mesh: &TetMesh,
        surface: &str,
        rest: &Vec3,
    ) -> Result<(Self, Attachment), FemError> {
        let index = SurfaceIndex::new(mesh, mesh.surface(surface));
        Self::marker_in(space, &index, surface, rest)
    }

    /// As [`Spot::marker`], with the look-up prepared once for many markers. `index` must have been made from
    /// the same surface of the mesh that `space` was made from.
    pub fn marker_in(
        space: &Space,
        index: &SurfaceIndex,
        surface: &str,
        rest: &Vec3,
    ) -> Result<(Self, Attachment), FemError> {
        let attached =
            index.nearest(rest).ok_or_else(|| FemError::NoSurface { surface: surface.to_owned() })?;
        let face = space.surface(surface)[attached.triangle];
        let (foot, offset) = (attached.point.position, rest - attached.point.position);
        let nodes = space.face_nodes(face);
        // The named surface may list a triangle's corners from another corner on than the element face does.
        let shape = space.order().face_shape(space.face_triangle(face).nearest(&foot).barycentric);
        let mut weights: [Functional; 3] = Default::default();
        for (i, w) in weights.iter_mut().enumerate() {
            w.extend(nodes.iter().zip(shape).map(|(&n, s)| (3 * n + i as u32, s)));
        }
        // u_i + (ω × o)_i with ω × o = ½ (∇u − ∇uᵀ) o.
        let cell = space.faces()[face].cell;
        let (gradient, _) = barycentric_gradients(&space.corners(cell));
        let corner = space.corners(cell)[0];
        let at = std::array::from_fn(|i| gradient[i].dot(&(foot - corner)) + f64::from(u8::from(i == 0)));
        let slope = space.order().cell_gradient(at, &gradient);
        for (&node, g) in space.cell(cell).iter().zip(slope) {
            let along = g.dot(&offset);
            for i in 0..3 {
                weights[i].push((3 * node + i as u32, 0.5 * along));
                for j in 0..3 {
                    weights[i].push((3 * node + j as u32, -0.5 * g[i] * offset[j]));
                }
            }
        }
        weights.iter_mut().for_each(gather);
        Ok((Self { weights, kind: SpotKind::Marker { foot, offset } }, attached))
    }

    /// The spot's displacement in a nodal field.
    pub fn of(&self, nodal: &[f64]) -> Vec3 {
        Vec3::from_fn(|i, _| self.weights[i].iter().map(|&(c, w)| w * nodal[c as usize]).sum())
    }

    /// Whether this is a disc that hangs over no edge of the body.
    pub fn wholly_on_body(&self) -> bool {
        matches!(self.kind, SpotKind::Disc { covered, .. } if (covered - 1.0).abs() < 1e-3)
    }

    /// The disc and whether the half-space carries its near field; `None` for a marker.
    pub fn as_disc(&self) -> Option<(Disc, bool)> {
        match self.kind {
            SpotKind::Disc { disc, flat, .. } => Some((disc, flat)),
            SpotKind::Marker { .. } => None,
        }
    }
}

/// Rings and points on each of a rigid disc's polar rule: exact for a displacement that is one polynomial under the
/// disc, and finer than the elements' kinks where it is not.
const RINGS: usize = 16;
const AROUND: usize = 48;

/// Points of the boundary faces under a disc; the weights sum to the share of the profile that lies on the body.
///
/// Uniform: exact on every face. Rigid: the profile has no bound at the rim, so that a rule along its own radius
/// takes the place of one on each face, its points looked up in the faces, seen along the disc's normal.
fn points(space: &Space, disc: &Disc, profile: Profile) -> Vec<(usize, DiscPoint)> {
    let faces: Vec<(usize, Triangle)> = under(space, disc).map(|f| (f, space.face_triangle(f))).collect();
    let mut points = Vec::new();
    match profile {
        Profile::Uniform => {
            for (face, triangle) in &faces {
                for p in disc.quadrature(triangle) {
                    points.push((*face, DiscPoint { weight: p.weight / disc.area(), ..p }));
                }
            }
        }
        Profile::Rigid => {
            let basis = basis_from_axis(&disc.normal);
            for (ring, (rho, weight)) in profile.radial(disc.radius, RINGS).into_iter().enumerate() {
                // Neighbouring rings are turned against each other, so that no row of points follows an edge.
                let turn = (ring as f64 + 0.5) / RINGS as f64;
                for k in 0..AROUND {
                    let (sin, cos) = (std::f64::consts::TAU * (k as f64 + turn) / AROUND as f64).sin_cos();
                    let p = disc.centre + basis * Vec3::new(rho * cos, rho * sin, 0.0);
                    let found =
                        faces.iter().find_map(|(face, t)| Some((*face, t, seen_along(&disc.normal, t, &p)?)));
                    if let Some((face, triangle, barycentric)) = found {
                        let position = triangle.at(barycentric);
                        let weight = weight / AROUND as f64;
                        points.push((face, DiscPoint { barycentric, position, weight }));
                    }
                }
            }
        }
    }
    points
}

/// Barycentric place at which a line through `p` along `normal` meets a triangle.
fn seen_along(normal: &Vec3, triangle: &Triangle, p: &Vec3) -> Option<[f64; 3]> {
    /// Points on a shared edge must not fall between two faces.
    const SLACK: f64 = -1e-9;
    let [a, b, c] = triangle.0;
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let whole = ab.cross(&ac).dot(normal);
    let (v, w) = (ap.cross(&ac).dot(normal) / whole, ab.cross(&ap).dot(normal) / whole);
    let l = [1.0 - v - w, v, w];
    l.iter().all(|&x| x >= SLACK).then_some(l)
}

/// Boundary faces that may lie under a disc: near its plane, facing its way, within reach of its rim.
pub(super) fn under(space: &Space, disc: &Disc) -> impl Iterator<Item = usize> {
    (0..space.faces().len()).filter(move |&face| {
        let triangle = space.face_triangle(face);
        let arm = triangle.0.map(|p| p - disc.centre);
        let reach = arm.iter().map(|a| (a - arm[0]).norm()).fold(0.0, f64::max) + disc.radius;
        arm[0].norm() <= reach
            && arm.iter().any(|a| a.dot(&disc.normal).abs() <= disc.radius)
            && triangle.normal().dot(&disc.normal) >= 0.5
    })
}

/// Adds up weights on the same component; drops zeros.
pub(super) fn gather(functional: &mut Functional) {
    functional.sort_unstable_by_key(|&(c, _)| c);
    functional.dedup_by(|next, kept| {
        let same = next.0 == kept.0;
        if same {
            kept.1 += next.1;
        }
        same
    });
    functional.retain(|&(_, w)| w != 0.0);
}

/// Rotation of a displacement gradient applied to an offset: `½ (∇u − ∇uᵀ) o`.
pub(super) fn turned(gradient: &Mat3, offset: &Vec3) -> Vec3 {
    (gradient - gradient.transpose()) * offset * 0.5
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::element::Order;
    use crate::mesh::{Block, block};

    fn slab(order: Order) -> (TetMesh, Space) {
        let mesh = block(&Block { size_m: [0.15, 0.1, 0.025], cells: [10, 7, 3] }).expect("block");
        let space = Space::new(&mesh, order).expect("space");
        (mesh, space)
    }

    fn field(space: &Space, u: impl Fn(&Vec3) -> Vec3) -> Vec<f64> {
        space.nodes().iter().flat_map(|p| <[f64; 3]>::from(u(p))).collect()
    }

    /// A quadratic field has mean `c + ½ · ¼ a² ∇²` over a disc: exact on P2 wherever the mesh lies.
    #[test]
    fn the_mean_over_a_disc_is_exact_for_quadratic_fields() {
        let (_, space) = slab(Order::P2);
        let on: Vec<usize> = (0..space.faces().len()).collect();
        let u = field(&space, |p| Vec3::new(1.0 + p.x, p.y * p.y, p.x * p.y + 3.0 * p.x * p.x));
        for centre in [Vec3::new(0.0314, 0.0517, 0.025), Vec3::new(0.1, 0.05, 0.025)] {
            let spot = Spot::disc(&space, &on, &centre, 0.008).expect("on the surface");
            assert!(matches!(spot.kind, SpotKind::Disc { flat: true, .. }));
            let second = 0.25 * 0.008 * 0.008;
            let (x, y) = (centre.x, centre.y);
            let exact = Vec3::new(1.0 + x, y * y + second, x * y + 3.0 * (x * x + second));
            assert!((spot.of(&u) - exact).norm() < 1e-12);
        }
    }

    /// A rigid disc's weights have the whole force (1), no moment, and the profile's second moment `a²/3` along
    /// each axis: exact for quadratic fields on P2 wherever the mesh lies.
    #[test]
    fn a_rigid_disc_is_in_equilibrium() {
        let (_, space) = slab(Order::P2);
        let on: Vec<usize> = (0..space.faces().len()).collect();
        let u = field(&space, |p| Vec3::new(1.0 + p.x, p.y * p.y, p.x * p.y + 3.0 * p.x * p.x));
        for centre in [Vec3::new(0.0314, 0.0517, 0.025), Vec3::new(0.0, 0.05, 0.0125)] {
            let spot = Spot::rigid_disc(&space, &on, &centre, 0.008).expect("on the surface");
            assert!(matches!(spot.kind, SpotKind::Disc { flat: true, profile: Profile::Rigid, .. }));
            assert!(spot.wholly_on_body());
            for (axis, w) in spot.weights.iter().enumerate() {
                let mut moment = Vec3::zeros();
                for &(c, w) in w {
                    assert_eq!(c as usize % 3, axis);
                    moment += (space.nodes()[c as usize / 3] - centre) * w;
                }
                assert!((w.iter().map(|(_, w)| w).sum::<f64>() - 1.0).abs() < 1e-12);
                assert!(moment.norm() < 1e-14, "{moment}");
            }
            let second = 0.008 * 0.008 / 3.0;
            let along_x = if centre.x > 0.0 { second } else { 0.0 };
            let (x, y) = (centre.x, centre.y);
            let exact = Vec3::new(1.0 + x, y * y + second, x * y + 3.0 * (x * x + along_x));
            assert!((spot.of(&u) - exact).norm() < 1e-12);
        }
    }

    /// Moving the disc changes its mean by the slope: exact where the field is quadratic.
    #[test]
    fn the_slope_is_the_derivative_of_the_mean() {
        let (_, space) = slab(Order::P2);
        let on: Vec<usize> = space.surface("z+").to_vec();
        let u = field(&space, |p| Vec3::new(1.0 + p.x, p.y * p.y, p.x * p.y + 3.0 * p.x * p.x));
        let centre = Vec3::new(0.0314, 0.0517, 0.025);
        let spot = Spot::disc(&space, &on, &centre, 0.005).expect("on the surface");
        let slope =
            |t: &Vec3| spot.slope(&space, t).map(|w| w.iter().map(|&(c, w)| w * u[c as usize]).sum::<f64>());
        let along_x = Vec3::from(slope(&Vec3::x()));
        let along_y = Vec3::from(slope(&Vec3::y()));
        assert!((along_x - Vec3::new(1.0, 0.0, centre.y + 6.0 * centre.x)).norm() < 1e-11);
        assert!((along_y - Vec3::new(0.0, 2.0 * centre.y, centre.x)).norm() < 1e-11);
    }

    #[test]
    fn a_disc_over_an_edge_is_not_flat_and_covers_half() {
        let (_, space) = slab(Order::P1);
        let on: Vec<usize> = space.surface("z+").to_vec();
        let spot = Spot::disc(&space, &on, &Vec3::new(0.15, 0.05, 0.025), 0.005).expect("half on");
        let SpotKind::Disc { covered, flat, .. } = spot.kind else { panic!("a disc") };
        assert!((covered - 0.5).abs() < 1e-9 && !flat);
        assert!(Spot::disc(&space, &[], &Vec3::zeros(), 0.005).is_err());
    }

    /// A marker on a rigidly turning body follows the turn with its stand-off.
    #[test]
    fn a_marker_carries_its_offset_with_the_rotation() {
        let spin = Mat3::new(0.0, -0.3, 0.2, 0.3, 0.0, -0.7, -0.2, 0.7, 0.0);
        for order in [Order::P1, Order::P2] {
            let (mut mesh, _) = slab(order);
            // A mesh file may list a surface triangle from any corner on.
            mesh.surfaces.values_mut().flatten().for_each(|t| t.rotate_left(1));
            let space = Space::new(&mesh, order).expect("space");
            let u = field(&space, |p| spin * p + Vec3::new(0.1, 0.2, -0.1));
            let rest = Vec3::new(0.0613, 0.0432, 0.031);
            let (spot, attached) = Spot::marker(&space, &mesh, "z+", &rest).expect("attached");
            assert!((attached.distance_m - 0.006).abs() < 1e-12);
            assert!((spot.of(&u) - (spin * rest + Vec3::new(0.1, 0.2, -0.1))).norm() < 1e-12);
        }
    }
}
