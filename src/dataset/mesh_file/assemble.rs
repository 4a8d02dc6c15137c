//! What a mesh file holds → the phantom's tetrahedra with outward-facing named surfaces.

use super::MeshFileError;
use crate::geometry::Vec3;
use crate::mesh::{MeshError, TetMesh, boundary_triangles, check};
use std::collections::{BTreeMap, HashSet};

/// The volume that is the body.
pub(super) const PHANTOM: &str = "phantom";

/// Elements of a file by the name of their group. Node numbers are indices into `nodes`, and exist.
#[derive(Debug, Default)]
pub(super) struct RawMesh {
    /// Coordinates as they stand in the file.
    pub(super) nodes: Vec<[f64; 3]>,
    /// Tetrahedra by volume.
    pub(super) volumes: BTreeMap<String, Vec<[u32; 4]>>,
    /// Triangles by surface, turned either way.
    pub(super) surfaces: BTreeMap<String, Vec<[u32; 3]>>,
}

impl RawMesh {
    /// The phantom's mesh: its tetrahedra and nodes in the file's order, nodes of nothing else, surfaces
    /// turned outward.
    ///
    /// # Errors
    /// No phantom, or whatever [`check`] refuses.
    pub(super) fn assemble(mut self) -> Result<TetMesh, MeshFileError> {
        let tets = self
            .volumes
            .remove(PHANTOM)
            .filter(|t| !t.is_empty())
            .ok_or_else(|| MeshFileError::NoPhantom { found: self.volumes.keys().cloned().collect() })?;
        let mut new_number: Vec<Option<u32>> = vec![None; self.nodes.len()];
        for &node in tets.iter().flatten() {
            new_number[node as usize] = Some(0);
        }
        let mut nodes = Vec::new();
        for (number, position) in new_number.iter_mut().zip(&self.nodes) {
            if number.is_some() {
                *number = Some(nodes.len() as u32);
                nodes.push(Vec3::from(*position));
            }
        }
        let renumber = |node: u32| new_number[node as usize];
        // Every node of a tetrahedron has just been numbered.
        let tets = tets.iter().filter_map(|t| all(t.map(renumber))).collect();
        let mut mesh = TetMesh { nodes, tets, surfaces: BTreeMap::new() };
        for (name, triangles) in &self.surfaces {
            let mut surface = Vec::with_capacity(triangles.len());
            for (triangle, face) in triangles.iter().enumerate() {
                surface.push(all(face.map(renumber)).ok_or_else(|| {
                    let stray = face.iter().find(|&&n| renumber(n).is_none()).unwrap_or(&face[0]);
                    MeshFileError::OffPhantom {
                        surface: name.clone(),
                        triangle,
                        position: self.nodes[*stray as usize],
                    }
                })?);
            }
            mesh.surfaces.insert(name.clone(), surface);
        }
        check(&mesh)?;
        face_outward(&mut mesh)?;
        Ok(mesh)
    }
}

fn all<const N: usize>(numbers: [Option<u32>; N]) -> Option<[u32; N]> {
    let mut out = [0; N];
    for (o, n) in out.iter_mut().zip(numbers) {
        *o = n?;
    }
    Some(out)
}

/// Turns surface triangles so that they run anticlockwise seen from outside. A triangle that does already
/// keeps its first node.
fn face_outward(mesh: &mut TetMesh) -> Result<(), MeshError> {
    let outward: HashSet<[u32; 3]> = boundary_triangles(mesh)?.into_iter().map(smallest_first).collect();
    for face in mesh.surfaces.values_mut().flatten() {
        if !outward.contains(&smallest_first(*face)) {
            face.swap(1, 2);
        }
    }
    Ok(())
}

/// The same triangle, turned the same way, beginning with its smallest node.
fn smallest_first([a, b, c]: [u32; 3]) -> [u32; 3] {
    if a < b && a < c {
        [a, b, c]
    } else if b < c {
        [b, c, a]
    } else {
        [c, a, b]
    }
}
