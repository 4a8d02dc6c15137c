//! What there is to see at one instant, and the same in the camera's terms: where every triangle lies for a ray.

use super::camera::Camera;
use super::error::{PixelError, within};
use super::solid::Solid;
use super::surface::{Attachment, Surface};
use crate::geometry::Vec3;

/// Solids that a picture tells apart.
const MOST_SOLIDS: f64 = 13.0;

/// A dot painted on the resting surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dot {
    /// Its number.
    pub number: u32,
    /// Where its centre is.
    pub place: Attachment,
    /// Radius on the resting surface (m).
    pub radius_m: f64,
    /// How much its edge wavers, as a share of the radius; 0 for a disc. The centroid of a wavering dot is off its centre by the square
    /// of that.
    pub raggedness: f64,
}

/// The scene when the first row of the picture is exposed. All in the phantom frame (m, m/s).
#[derive(Debug, Clone, Copy)]
pub struct Scene<'a> {
    /// Where the vertices of the surface are.
    pub positions: &'a [Vec3],
    /// Their unit normals; by default [`Surface::normals`].
    pub normals: Option<&'a [Vec3]>,
    /// How fast they move; seen only by a camera that exposes its rows one after the other.
    pub velocities: Option<&'a [Vec3]>,
    /// The tip and what holds it.
    pub solids: &'a [Solid],
    /// How fast these move.
    pub solids_velocity: Vec3,
    /// Height z of the plate on which the phantom lies.
    pub plate_m: f64,
}

impl<'a> Scene<'a> {
    /// A scene at rest on the plane z = 0.
    pub fn still(positions: &'a [Vec3], solids: &'a [Solid]) -> Self {
        let (normals, velocities) = (None, None);
        Self { positions, normals, velocities, solids, solids_velocity: Vec3::zeros(), plate_m: 0.0 }
    }

    pub(super) fn check(&self, surface: &Surface) -> Result<(), PixelError> {
        within("the number of solids", self.solids.len() as f64, 0.0, MOST_SOLIDS, "at most 13")?;
        let wanted = surface.rest().len();
        let slices =
            [("positions", Some(self.positions)), ("normals", self.normals), ("velocities", self.velocities)];
        for (what, slice) in slices {
            if let Some(slice) = slice.filter(|s| s.len() != wanted) {
                return Err(PixelError::VertexCount { what, given: slice.len(), wanted });
            }
        }
        Ok(())
    }
}

/// The scene as one picture takes it, every vertex and solid where it is when its row is exposed.
pub(super) struct Placed {
    /// Phantom frame (m).
    pub(super) positions: Vec<Vec3>,
    pub(super) normals: Vec<Vec3>,
    pub(super) solids: Vec<Solid>,
    /// Pixel coordinates; none behind the camera.
    pub(super) pixels: Vec<Option<[f64; 2]>>,
    /// Of each triangle that faces the camera, the rows of [P₀ P₁ P₂]⁻¹ with its corners Pᵢ in the camera frame (1/m), else zeros.
    ///
    /// With the ray r = (x, y, 1), wᵢ = rowᵢ · r gives 1/z = Σ wᵢ and the barycentric weights wᵢ z: exact perspective, linear in x and y.
    pub(super) rows: Vec<[Vec3; 3]>,
}

impl Placed {
    /// `old` is what was before, if anything: it stays where nothing has moved, else its memory is taken. Whether it stayed is told too.
    pub(super) fn new(
        scene: &Scene,
        surface: &Surface,
        camera: &Camera,
        row_s: f64,
        old: Option<Self>,
    ) -> (Self, bool) {
        let later = |position: &Vec3, velocity: &Vec3| {
            // Its row, and hence its time, depends on where it has moved by then; the row changes by far less than one.
            camera.project(position).map_or(*position, |pixel| position + velocity * (row_s * pixel[1]))
        };
        let positions: Vec<Vec3> = match scene.velocities {
            Some(velocities) if row_s != 0.0 => {
                scene.positions.iter().zip(velocities).map(|(p, v)| later(p, v)).collect()
            }
            _ => scene.positions.to_vec(),
        };
        let normals = scene.normals.map_or_else(|| surface.normals(&positions), <[Vec3]>::to_vec);
        let moved = |solid: &Solid| {
            let foot = solid.foot();
            solid.moved(&(later(&foot, &scene.solids_velocity) - foot))
        };
        let solids: Vec<Solid> = scene.solids.iter().map(moved).collect();
        let (mut pixels, mut inverse) = (Vec::new(), Vec::new());
        match old {
            Some(old) if old.positions == positions && old.normals == normals && old.solids == solids => {
                return (old, true);
            }
            Some(old) => (pixels, inverse) = (old.pixels, old.rows),
            None => {}
        }
        let seen: Vec<Vec3> = positions.iter().map(|p| camera.seen(p)).collect();
        pixels.clear();
        pixels.extend(seen.iter().map(|p| camera.lens.project(p)));
        inverse.clear();
        inverse.extend(surface.triangles().iter().map(|corners| rows(corners.map(|v| seen[v as usize]))));
        (Self { positions, normals, solids, pixels, rows: inverse }, false)
    }

    /// wᵢ of a triangle for a ray.
    pub(super) fn weights(&self, triangle: u32, [x, y]: [f64; 2]) -> [f64; 3] {
        let [a, b, c] = &self.rows[triangle as usize];
        [a.x * x + a.y * y + a.z, b.x * x + b.y * y + b.z, c.x * x + c.y * y + c.z]
    }

    /// Whether the camera sees its outside.
    pub(super) fn faces(&self, triangle: u32) -> bool {
        self.rows[triangle as usize][0] != Vec3::zeros()
    }
}

fn rows([a, b, c]: [Vec3; 3]) -> [Vec3; 3] {
    let volume = a.dot(&b.cross(&c));
    // Negative: the outward normal points to the camera.
    if volume < 0.0 {
        [b.cross(&c) / volume, c.cross(&a) / volume, a.cross(&b) / volume]
    } else {
        [Vec3::zeros(); 3]
    }
}
