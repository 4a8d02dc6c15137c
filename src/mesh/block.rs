//! A rectangular block cut into tetrahedra.

use super::{MeshError, TetMesh};
use crate::geometry::Vec3;

/// A block from the origin to `size_m`, cut into `cells` boxes of six tetrahedra each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Block {
    /// Edge lengths (m).
    pub size_m: [f64; 3],
    /// Boxes along each edge.
    pub cells: [usize; 3],
}

/// The six tetrahedra of a box (Kuhn 1960): one for each order in which the axes can be walked from corner
/// 000 to corner 111. Neighbouring boxes meet in matching triangles.
const WALKS: [[usize; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];

/// Cuts a block. Named surfaces: `x-`, `x+`, `y-`, `y+`, `z-`, `z+`.
pub fn block(block: &Block) -> Result<TetMesh, MeshError> {
    let Block { size_m, cells } = *block;
    if size_m.iter().any(|&l| !(l > 0.0 && l.is_finite())) || cells.contains(&0) {
        return Err(MeshError::EmptyBlock { size_m, cells });
    }
    let [nx, ny, nz] = cells;
    let id = |i: [usize; 3]| (i[0] + (nx + 1) * (i[1] + (ny + 1) * i[2])) as u32;
    let mut mesh = TetMesh::default();
    for k in 0..=nz {
        for j in 0..=ny {
            for i in 0..=nx {
                let share = [i as f64 / nx as f64, j as f64 / ny as f64, k as f64 / nz as f64];
                mesh.nodes.push(Vec3::from_fn(|a, _| size_m[a] * share[a]));
            }
        }
    }
    for k in 0..nz {
        for j in 0..ny {
            for i in 0..nx {
                for (which, walk) in WALKS.iter().enumerate() {
                    let mut at = [i, j, k];
                    let mut tet = [id(at); 4];
                    for (step, &axis) in walk.iter().enumerate() {
                        at[axis] += 1;
                        tet[step + 1] = id(at);
                    }
                    if which >= 3 {
                        tet.swap(2, 3);
                    }
                    mesh.tets.push(tet);
                }
            }
        }
    }
    for face in super::boundary_triangles(&mesh)? {
        let corners = mesh.triangle(face).0;
        for (axis, name) in ["x", "y", "z"].iter().enumerate() {
            for (side, at) in [("-", 0.0), ("+", size_m[axis])] {
                if corners.iter().all(|p| p[axis] == at) {
                    mesh.surfaces.entry(format!("{name}{side}")).or_default().push(face);
                }
            }
        }
    }
    Ok(mesh)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_fills_its_volume_and_names_its_sides() {
        let size_m = [0.15, 0.1, 0.025];
        let mesh = block(&Block { size_m, cells: [5, 4, 2] }).expect("a proper block");
        assert!((mesh.volume() / (0.15 * 0.1 * 0.025) - 1.0).abs() < 1e-12);
        assert!(mesh.tets.iter().all(|&t| super::super::tet_mesh::tet_volume(&mesh.corners(t)) > 0.0));
        let area: f64 = mesh.surface("z+").iter().map(|&f| mesh.triangle(f).area()).sum();
        assert!((area / 0.015 - 1.0).abs() < 1e-12);
        assert!(mesh.surface("z-").iter().all(|&f| (mesh.triangle(f).normal() + Vec3::z()).norm() < 1e-12));
    }

    #[test]
    fn a_block_without_cells_is_refused() {
        assert!(block(&Block { size_m: [1.0; 3], cells: [1, 0, 1] }).is_err());
        assert!(block(&Block { size_m: [1.0, -1.0, 1.0], cells: [1, 1, 1] }).is_err());
    }
}
