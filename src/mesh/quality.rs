//! Whether a mesh can be computed on.

use super::tet_mesh::tet_volume;
use super::{MeshError, TetMesh, boundary::sorted, boundary_triangles};
use std::collections::{HashMap, HashSet};

/// Shape of the worst and the median tetrahedron.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quality {
    /// Smallest radius ratio `3 · inradius / circumradius` (1 for a regular tetrahedron, 0 for a flat one).
    pub worst_radius_ratio: f64,
    /// Median radius ratio.
    pub median_radius_ratio: f64,
    /// Median edge length (m).
    pub median_edge_m: f64,
}

/// Refuses a mesh that is empty, inverted, disconnected, branching, or whose named surfaces are not boundary
/// faces.
pub fn check(mesh: &TetMesh) -> Result<(), MeshError> {
    if mesh.tets.is_empty() {
        return Err(MeshError::Empty);
    }
    for (node, p) in mesh.nodes.iter().enumerate() {
        if !p.iter().all(|x| x.is_finite()) {
            return Err(MeshError::NonFinite { node, position: [p.x, p.y, p.z] });
        }
    }
    let nodes = mesh.nodes.len();
    for (element, tet) in mesh.tets.iter().enumerate() {
        if let Some(&node) = tet.iter().find(|&&n| n as usize >= nodes) {
            return Err(MeshError::MissingNode { element, node, nodes });
        }
        let volume_m3 = tet_volume(&mesh.corners(*tet));
        if volume_m3 <= 0.0 {
            return Err(MeshError::Inverted { tet: element, volume_m3 });
        }
    }
    let boundary: HashSet<[u32; 3]> = boundary_triangles(mesh)?.into_iter().map(sorted).collect();
    for (name, triangles) in &mesh.surfaces {
        for (triangle, &face) in triangles.iter().enumerate() {
            if !boundary.contains(&sorted(face)) {
                return Err(MeshError::NotOnBoundary { surface: name.clone(), triangle, nodes: face });
            }
        }
    }
    connected(mesh)
}

/// Union of tetrahedra over shared nodes.
fn connected(mesh: &TetMesh) -> Result<(), MeshError> {
    let mut parent: Vec<u32> = (0..mesh.nodes.len() as u32).collect();
    fn root(parent: &mut [u32], mut i: u32) -> u32 {
        while parent[i as usize] != i {
            parent[i as usize] = parent[parent[i as usize] as usize];
            i = parent[i as usize];
        }
        i
    }
    for tet in &mesh.tets {
        let a = root(&mut parent, tet[0]);
        for &n in &tet[1..] {
            let b = root(&mut parent, n);
            parent[b as usize] = a;
        }
    }
    let mut pieces: HashMap<u32, usize> = HashMap::new();
    for tet in &mesh.tets {
        *pieces.entry(root(&mut parent, tet[0])).or_default() += 1;
    }
    match pieces.values().min() {
        Some(&smallest) if pieces.len() > 1 => {
            Err(MeshError::Disconnected { pieces: pieces.len(), smallest })
        }
        _ => Ok(()),
    }
}
