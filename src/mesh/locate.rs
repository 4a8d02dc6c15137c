//! The point of a surface nearest to a given point.

use super::TetMesh;
use crate::geometry::{Triangle, TrianglePoint, Vec3};

/// Where on a surface a point is attached.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attachment {
    /// Index of the triangle in the surface.
    pub triangle: usize,
    /// The point on it.
    pub point: TrianglePoint,
    /// Distance (m) from the point that was asked for.
    pub distance_m: f64,
}

/// Nearest-point look-ups on a list of triangles.
#[derive(Debug, Clone)]
pub struct SurfaceIndex {
    triangles: Vec<Triangle>,
    /// Bounding sphere of each triangle: centre and radius.
    spheres: Vec<(Vec3, f64)>,
}

impl SurfaceIndex {
    /// Prepares look-ups on `surface`, triangles of `mesh`.
    pub fn new(mesh: &TetMesh, surface: &[[u32; 3]]) -> Self {
        Self::of(surface.iter().map(|&t| mesh.triangle(t)).collect())
    }

    /// As [`SurfaceIndex::new`], of a surface's triangles themselves.
    pub fn of(triangles: Vec<Triangle>) -> Self {
        let spheres = triangles
            .iter()
            .map(|t| {
                let centre = (t.0[0] + t.0[1] + t.0[2]) / 3.0;
                (centre, t.0.iter().map(|p| (p - centre).norm()).fold(0.0, f64::max))
            })
            .collect();
        Self { triangles, spheres }
    }

    /// The nearest point of the surface; `None` when the surface has no triangle.
    pub fn nearest(&self, p: &Vec3) -> Option<Attachment> {
        let mut best: Option<Attachment> = None;
        for (i, triangle) in self.triangles.iter().enumerate() {
            let (centre, radius) = &self.spheres[i];
            if best.is_some_and(|b| (p - centre).norm() - radius > b.distance_m) {
                continue;
            }
            let point = triangle.nearest(p);
            let distance_m = (p - point.position).norm();
            if best.is_none_or(|b| distance_m < b.distance_m) {
                best = Some(Attachment { triangle: i, point, distance_m });
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Block, block};

    #[test]
    fn the_nearest_point_is_the_foot_of_the_perpendicular() {
        let mesh = block(&Block { size_m: [1.0, 1.0, 1.0], cells: [4, 4, 4] }).expect("block");
        let index = SurfaceIndex::new(&mesh, mesh.surface("z+"));
        let found = index.nearest(&Vec3::new(0.31, 0.77, 1.25)).expect("a surface");
        assert!((found.distance_m - 0.25).abs() < 1e-14);
        assert!((found.point.position - Vec3::new(0.31, 0.77, 1.0)).norm() < 1e-14);
        assert!(SurfaceIndex::new(&mesh, &[]).nearest(&Vec3::zeros()).is_none());
    }
}
