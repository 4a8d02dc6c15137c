//! What the camera looks at: a triangulated surface that moves, and places on it that move with it.
//!
//! The resting positions are the material's coordinates: a disc that was painted on the resting surface stays the same set of material
//! points, whatever the surface does.

use super::error::PixelError;
use crate::geometry::{Triangle, Vec3};
use std::collections::HashMap;

/// Beyond an edge there is no triangle.
pub(super) const NONE: u32 = u32::MAX;

/// A place on the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attachment {
    /// Index of the triangle.
    pub triangle: u32,
    /// Weights of its corners, sum 1.
    pub barycentric: [f64; 3],
}

/// A surface at rest: its vertices and how they are joined.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    rest: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    /// The triangle beyond the edge opposite to each corner.
    neighbours: Vec<[u32; 3]>,
}

impl Surface {
    /// A surface from its resting vertices (m, phantom frame) and triangles, whose corners run anticlockwise seen from outside. Where
    /// an edge is sharp, each side has vertices of its own.
    ///
    /// # Errors
    /// [`PixelError::NoSuchVertex`].
    pub fn new(rest: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Result<Self, PixelError> {
        for (triangle, corners) in triangles.iter().enumerate() {
            if let Some(&vertex) = corners.iter().find(|&&v| v as usize >= rest.len()) {
                return Err(PixelError::NoSuchVertex { triangle, vertex, vertices: rest.len() });
            }
        }
        let edge =
            |corners: &[u32; 3], opposite: usize| (corners[(opposite + 1) % 3], corners[(opposite + 2) % 3]);
        let mut sides = HashMap::new();
        for (corners, index) in triangles.iter().zip(0..) {
            for opposite in 0..3 {
                sides.insert(edge(corners, opposite), index);
            }
        }
        let beyond = |corners: &[u32; 3], opposite: usize| {
            let (a, b) = edge(corners, opposite);
            sides.get(&(b, a)).copied().unwrap_or(NONE)
        };
        let neighbours =
            triangles.iter().map(|corners| std::array::from_fn(|i| beyond(corners, i))).collect();
        Ok(Self { rest, triangles, neighbours })
    }

    /// The top and the four sides of a block that reaches from the origin to `size_m`, cut into squares of about `cell_m`.
    ///
    /// # Errors
    /// [`PixelError::BadFigure`]: a length that is not positive.
    pub fn block(size_m: [f64; 3], cell_m: f64) -> Result<Self, PixelError> {
        for length in size_m.into_iter().chain([cell_m]) {
            super::error::within("a length of the block (m)", length, 1e-6, 1e3, "more than 0")?;
        }
        let size = Vec3::from(size_m);
        let (x, y, z) = (Vec3::x() * size.x, Vec3::y() * size.y, Vec3::z() * size.z);
        let faces = [(z, x, y), (Vec3::zeros(), x, z), (x, y, z), (x + y, -x, z), (y, -y, z)];
        let (mut rest, mut triangles) = (Vec::new(), Vec::new());
        for (corner, along, across) in faces {
            let [m, n] = [along, across].map(|edge| (edge.norm() / cell_m).round().max(1.0) as u32);
            let first = rest.len() as u32;
            for j in 0..=n {
                for i in 0..=m {
                    let share = [i, j].map(f64::from);
                    rest.push(
                        corner + along * (share[0] / f64::from(m)) + across * (share[1] / f64::from(n)),
                    );
                }
            }
            for j in 0..n {
                for i in 0..m {
                    let a = first + j * (m + 1) + i;
                    let (b, c, d) = (a + 1, a + m + 2, a + m + 1);
                    // Diagonals alternate, so that the surface has no grain.
                    if (i + j) % 2 == 0 {
                        triangles.extend([[a, b, c], [a, c, d]]);
                    } else {
                        triangles.extend([[a, b, d], [b, c, d]]);
                    }
                }
            }
        }
        Self::new(rest, triangles)
    }

    /// Resting vertices (m).
    pub fn rest(&self) -> &[Vec3] {
        &self.rest
    }

    /// Corners of each triangle.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    pub(super) fn neighbours(&self, triangle: u32) -> [u32; 3] {
        self.neighbours[triangle as usize]
    }

    /// The place of the resting surface nearest to a point (m).
    pub fn attach(&self, point: &Vec3) -> Option<Attachment> {
        let places = self.triangles.iter().zip(0..).map(|(corners, triangle)| {
            let nearest = Triangle(corners.map(|v| self.rest[v as usize])).nearest(point);
            ((nearest.position - point).norm(), Attachment { triangle, barycentric: nearest.barycentric })
        });
        places.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, place)| place)
    }

    /// Where a place is when the vertices are at `positions`.
    pub fn at(&self, place: &Attachment, positions: &[Vec3]) -> Vec3 {
        Triangle(self.corners(place.triangle, positions)).at(place.barycentric)
    }

    pub(super) fn corners(&self, triangle: u32, positions: &[Vec3]) -> [Vec3; 3] {
        self.triangles[triangle as usize].map(|v| positions[v as usize])
    }

    /// Unit normals of the vertices when they are at `positions`: those of the triangles around, weighted by area.
    pub fn normals(&self, positions: &[Vec3]) -> Vec<Vec3> {
        let mut normals = vec![Vec3::zeros(); positions.len()];
        for corners in &self.triangles {
            let outward = Triangle(corners.map(|v| positions[v as usize])).area_vector();
            for &vertex in corners {
                normals[vertex as usize] += outward;
            }
        }
        for normal in &mut normals {
            *normal = normal.try_normalize(0.0).unwrap_or_else(Vec3::z);
        }
        normals
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_is_closed_but_for_its_underside() -> Result<(), PixelError> {
        let size = [0.10, 0.15, 0.03];
        let block = Surface::block(size, 0.005)?;
        let area: f64 =
            block.triangles.iter().map(|t| Triangle(t.map(|v| block.rest[v as usize])).area()).sum();
        let expected = size[0] * size[1] + 2.0 * size[2] * (size[0] + size[1]);
        assert!((area / expected - 1.0).abs() < 1e-12);
        let middle = Vec3::from(size) * 0.5;
        for (vertex, normal) in block.rest.iter().zip(block.normals(&block.rest)) {
            assert!(normal.dot(&(vertex - middle)) > 0.0);
        }
        // An edge between two squares is shared; one at the rim of a face is not.
        let rims = block.neighbours.iter().flatten().filter(|&&n| n == NONE).count();
        assert_eq!(rims, 2 * ((20 + 30) + 2 * (20 + 6) + 2 * (30 + 6)));
        Ok(())
    }

    #[test]
    fn a_place_moves_with_the_surface() -> Result<(), PixelError> {
        let block = Surface::block([0.1, 0.1, 0.02], 0.01)?;
        let point = Vec3::new(0.0312, 0.0777, 0.02);
        let place = block.attach(&point).ok_or(PixelError::BadFigure {
            what: "place",
            value: 0.0,
            expected: "one",
        })?;
        let moved: Vec<Vec3> =
            block.rest.iter().map(|p| Vec3::new(1.1 * p.x, p.y - 0.2 * p.x, 0.9 * p.z)).collect();
        let expected = Vec3::new(1.1 * point.x, point.y - 0.2 * point.x, 0.9 * point.z);
        assert!((block.at(&place, &moved) - expected).norm() < 1e-15);
        Ok(())
    }

    #[test]
    fn a_triangle_without_its_vertex_is_refused() {
        let refused = Surface::new(vec![Vec3::zeros(); 3], vec![[0, 1, 3]]);
        assert!(matches!(refused, Err(PixelError::NoSuchVertex { triangle: 0, vertex: 3, vertices: 3 })));
    }
}
