//! Whether a mesh can be computed on.

use super::tet_mesh::tet_volume;
use super::{MeshError, TetMesh, boundary::sorted, boundary_triangles};
use crate::geometry::Vec3;
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

/// Measures the shape of all tetrahedra.
///
/// # Errors
/// [`MeshError::Empty`] when there are none.
pub fn quality(mesh: &TetMesh) -> Result<Quality, MeshError> {
    let mut ratios: Vec<f64> = mesh.tets.iter().map(|&t| radius_ratio(&mesh.corners(t))).collect();
    ratios.sort_unstable_by(f64::total_cmp);
    let mut edges: Vec<[u32; 2]> = mesh
        .tets
        .iter()
        .flat_map(|t| [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)].map(|(i, j)| [t[i], t[j]]))
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    edges.sort_unstable();
    edges.dedup();
    let mut lengths: Vec<f64> =
        edges.iter().map(|&[a, b]| (mesh.nodes[a as usize] - mesh.nodes[b as usize]).norm()).collect();
    lengths.sort_unstable_by(f64::total_cmp);
    Ok(Quality {
        worst_radius_ratio: *ratios.first().ok_or(MeshError::Empty)?,
        median_radius_ratio: ratios[ratios.len() / 2],
        median_edge_m: lengths[lengths.len() / 2],
    })
}

/// `3 r / R` of a tetrahedron with inradius `r = 3 V / S` (`S` the area of its faces) and circumradius
/// `R = |a² b×c + b² c×a + c² a×b| / 12 V`, where `a`, `b`, `c` are the edges from one corner. Negative when
/// the tetrahedron is inverted, 0 when it is flat.
fn radius_ratio(corners: &[Vec3; 4]) -> f64 {
    let [a, b, c] = [1, 2, 3].map(|i| corners[i] - corners[0]);
    let volume = tet_volume(corners);
    let [ab, bc, ca] = [a.cross(&b), b.cross(&c), c.cross(&a)];
    let surface = (ab.norm() + bc.norm() + ca.norm() + (b - a).cross(&(c - a)).norm()) / 2.0;
    let twelve_r_v = (bc * a.norm_squared() + ca * b.norm_squared() + ab * c.norm_squared()).norm();
    let below = surface * twelve_r_v;
    if below > 0.0 { 108.0 * volume * volume.abs() / below } else { 0.0 }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Block, block};

    fn one_tet(nodes: [[f64; 3]; 4]) -> TetMesh {
        TetMesh { nodes: nodes.map(Vec3::from).to_vec(), tets: vec![[0, 1, 2, 3]], ..TetMesh::default() }
    }

    #[test]
    fn a_regular_tetrahedron_is_perfect_whatever_its_size() {
        for size in [1e-3, 1.0, 1e3] {
            let corners = [[1.0, 1.0, 1.0], [-1.0, 1.0, -1.0], [1.0, -1.0, -1.0], [-1.0, -1.0, 1.0]];
            let q = quality(&one_tet(corners.map(|p| p.map(|x| size * x)))).expect("one tetrahedron");
            assert!((q.worst_radius_ratio - 1.0).abs() < 1e-14, "{q:?}");
            assert!((q.median_edge_m / (8.0_f64.sqrt() * size) - 1.0).abs() < 1e-14);
        }
    }

    /// Corner of a unit cube: `r = 1 / (3 + √3)`, `R = √3 / 2`.
    #[test]
    fn the_corner_of_a_cube_has_its_known_ratio() {
        let corner = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let expected = 3.0 / (3.0 + 3.0_f64.sqrt()) / (3.0_f64.sqrt() / 2.0);
        let q = quality(&one_tet(corner)).expect("one tetrahedron");
        assert!((q.worst_radius_ratio - expected).abs() < 1e-14);
        let mut mirrored = one_tet(corner);
        mirrored.tets[0].swap(0, 1);
        let q = quality(&mirrored).expect("one tetrahedron");
        assert!((q.worst_radius_ratio + expected).abs() < 1e-14, "inverted is negative");
    }

    #[test]
    fn flat_and_missing_tetrahedra() {
        let flat = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
        assert_eq!(quality(&one_tet(flat)).expect("one tetrahedron").worst_radius_ratio, 0.0);
        assert_eq!(quality(&TetMesh::default()), Err(MeshError::Empty));
    }

    /// Of the 19 edges of a cube of six tetrahedra 12 have length 1: the median.
    #[test]
    fn shared_edges_count_once() {
        let cube = block(&Block { size_m: [1.0; 3], cells: [1, 1, 1] }).expect("block");
        let q = quality(&cube).expect("six tetrahedra");
        assert_eq!(q.median_edge_m, 1.0);
        assert!((q.worst_radius_ratio - q.median_radius_ratio).abs() < 1e-14, "congruent");
    }
}
