//! The mesh itself: nodes, tetrahedra, named boundary surfaces.

use crate::geometry::{Triangle, Vec3};
use std::collections::BTreeMap;

/// Boundary triangles by their three nodes, anticlockwise seen from outside.
pub type Surface = Vec<[u32; 3]>;

/// First-order tetrahedra with named boundary surfaces.
///
/// Tetrahedron `[a, b, c, d]` has positive volume `(b−a) × (c−a) · (d−a) / 6`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TetMesh {
    /// Node positions (m).
    pub nodes: Vec<Vec3>,
    /// Tetrahedra by their four nodes.
    pub tets: Vec<[u32; 4]>,
    /// Physical surfaces by name (`fixed`, `search`, `observed`, …); triangles of no named surface are free.
    pub surfaces: BTreeMap<String, Surface>,
}

impl TetMesh {
    /// The triangles of a named surface; empty when the mesh has no such surface.
    pub fn surface(&self, name: &str) -> &[[u32; 3]] {
        self.surfaces.get(name).map_or(&[], Vec::as_slice)
    }

    /// The corners of a boundary triangle.
    pub fn triangle(&self, nodes: [u32; 3]) -> Triangle {
        Triangle(nodes.map(|n| self.nodes[n as usize]))
    }

    /// The corners of a tetrahedron.
    pub fn corners(&self, tet: [u32; 4]) -> [Vec3; 4] {
        tet.map(|n| self.nodes[n as usize])
    }

    /// Volume of the whole body (m³).
    pub fn volume(&self) -> f64 {
        self.tets.iter().map(|&t| tet_volume(&self.corners(t))).sum()
    }
}

/// Signed volume of a tetrahedron (m³).
pub(super) fn tet_volume(corners: &[Vec3; 4]) -> f64 {
    let [a, b, c, d] = corners;
    (b - a).cross(&(c - a)).dot(&(d - a)) / 6.0
}
