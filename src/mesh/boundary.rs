//! The outer faces of a mesh.

use super::{MeshError, TetMesh};

/// Faces of a tetrahedron of positive volume, anticlockwise seen from outside.
const FACES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];

/// All boundary triangles, anticlockwise seen from outside, in the order of their tetrahedra.
///
/// A face that belongs to more than two tetrahedra is refused.
pub fn boundary_triangles(mesh: &TetMesh) -> Result<Vec<[u32; 3]>, MeshError> {
    let all: Vec<[u32; 3]> = faces(mesh).collect();
    let mut keyed: Vec<([u32; 3], usize)> = all.iter().map(|&face| sorted(face)).zip(0..).collect();
    keyed.sort_unstable();
    let mut count = vec![0; all.len()];
    for same in keyed.chunk_by(|a, b| a.0 == b.0) {
        same.iter().for_each(|&(_, face)| count[face] = same.len());
    }
    let mut boundary = Vec::new();
    for (face, count) in all.into_iter().zip(count) {
        match count {
            1 => boundary.push(face),
            2 => {}
            count => return Err(MeshError::BranchingFace { face, count }),
        }
    }
    Ok(boundary)
}

fn faces(mesh: &TetMesh) -> impl Iterator<Item = [u32; 3]> + '_ {
    mesh.tets.iter().flat_map(|t| FACES.map(|f| f.map(|i| t[i])))
}

pub(super) fn sorted(mut face: [u32; 3]) -> [u32; 3] {
    face.sort_unstable();
    face
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;

    #[test]
    fn the_boundary_of_one_tetrahedron_points_outward() {
        let mesh = TetMesh {
            nodes: vec![Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::z()],
            tets: vec![[0, 1, 2, 3]],
            ..TetMesh::default()
        };
        let centre = Vec3::from_element(0.25);
        let faces = boundary_triangles(&mesh).expect("one tetrahedron");
        assert_eq!(faces.len(), 4);
        for f in faces {
            let t = mesh.triangle(f);
            assert!(t.normal().dot(&(t.0[0] - centre)) > 0.0);
        }
    }
}
