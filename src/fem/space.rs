//! The discrete displacement: nodes and connectivity of first- or second-order elements on a mesh.

use super::element::{Order, TET_EDGES, TRIANGLE_EDGES};
use crate::geometry::{Triangle, Vec3};
use crate::mesh::{MeshError, TetMesh, boundary_triangles};
use std::collections::HashMap;

/// One boundary face of the body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Face {
    /// Its nodes, corners first, anticlockwise from outside; the first [`Order::face_nodes`] count.
    pub nodes: [u32; 6],
    /// The cell behind it.
    pub cell: u32,
}

/// Nodes and connectivity of a displacement of given order on a mesh.
///
/// The mesh's nodes come first, with their own numbers; the edge nodes of second order follow. Unknown `3 n + i`
/// is component `i` of the displacement at node `n`.
#[derive(Debug, Clone)]
pub struct Space {
    order: Order,
    /// Position of every node (m).
    nodes: Vec<Vec3>,
    /// Nodes of all cells, [`Order::cell_nodes`] each.
    cells: Vec<u32>,
    /// All boundary faces.
    faces: Vec<Face>,
    /// Faces of each named surface, as indices into `faces`.
    surfaces: HashMap<String, Vec<usize>>,
}

impl Space {
    /// Puts nodes of the given order on `mesh`.
    pub fn new(mesh: &TetMesh, order: Order) -> Result<Self, MeshError> {
        let mut nodes = mesh.nodes.clone();
        let mut edge_node: HashMap<(u32, u32), u32> = HashMap::new();
        let mut cells = Vec::with_capacity(mesh.tets.len() * order.cell_nodes());
        let mut behind: HashMap<[u32; 3], u32> = HashMap::new();
        for (cell, tet) in mesh.tets.iter().enumerate() {
            cells.extend_from_slice(tet);
            if order == Order::P2 {
                for [i, j] in TET_EDGES {
                    let (a, b) = (tet[i].min(tet[j]), tet[i].max(tet[j]));
                    let node = *edge_node.entry((a, b)).or_insert_with(|| {
                        nodes.push(0.5 * (mesh.nodes[a as usize] + mesh.nodes[b as usize]));
                        (nodes.len() - 1) as u32
                    });
                    cells.push(node);
                }
            }
            for without in 0..4 {
                let mut face = [0; 3];
                let mut at = 0;
                for (i, &n) in tet.iter().enumerate() {
                    if i != without {
                        face[at] = n;
                        at += 1;
                    }
                }
                face.sort_unstable();
                behind.insert(face, cell as u32);
            }
        }
        let mut number = HashMap::new();
        let faces: Vec<Face> = boundary_triangles(mesh)?
            .into_iter()
            .enumerate()
            .map(|(index, triangle)| {
                let mut key = triangle;
                key.sort_unstable();
                number.insert(key, index);
                let mut face = [triangle[0], triangle[1], triangle[2], u32::MAX, u32::MAX, u32::MAX];
                if order == Order::P2 {
                    for (k, [i, j]) in TRIANGLE_EDGES.into_iter().enumerate() {
                        let (a, b) = (triangle[i].min(triangle[j]), triangle[i].max(triangle[j]));
                        face[3 + k] = edge_node[&(a, b)];
                    }
                }
                Face { nodes: face, cell: behind[&key] }
            })
            .collect();
        let mut surfaces = HashMap::new();
        for (name, triangles) in &mesh.surfaces {
            let mut list = Vec::with_capacity(triangles.len());
            for (triangle, &nodes) in triangles.iter().enumerate() {
                let mut key = nodes;
                key.sort_unstable();
                list.push(*number.get(&key).ok_or_else(|| MeshError::NotOnBoundary {
                    surface: name.clone(),
                    triangle,
                    nodes,
                })?);
            }
            surfaces.insert(name.clone(), list);
        }
        Ok(Self { order, nodes, cells, faces, surfaces })
    }

    /// Order of the displacement.
    pub fn order(&self) -> Order {
        self.order
    }

    /// Position of every node (m).
    pub fn nodes(&self) -> &[Vec3] {
        &self.nodes
    }

    /// Number of displacement components, constrained ones included.
    pub fn components(&self) -> usize {
        3 * self.nodes.len()
    }

    /// Nodes of every cell.
    pub fn cells(&self) -> impl ExactSizeIterator<Item = &[u32]> + Clone {
        self.cells.chunks_exact(self.order.cell_nodes())
    }

    /// Nodes of one cell.
    pub fn cell(&self, cell: u32) -> &[u32] {
        let n = self.order.cell_nodes();
        &self.cells[cell as usize * n..(cell as usize + 1) * n]
    }

    /// Corners of one cell (m).
    pub fn corners(&self, cell: u32) -> [Vec3; 4] {
        let nodes = self.cell(cell);
        std::array::from_fn(|i| self.nodes[nodes[i] as usize])
    }

    /// All boundary faces.
    pub fn faces(&self) -> &[Face] {
        &self.faces
    }

    /// The nodes of a boundary face that count.
    pub fn face_nodes(&self, face: usize) -> &[u32] {
        &self.faces[face].nodes[..self.order.face_nodes()]
    }

    /// The corners of a boundary face.
    pub fn face_triangle(&self, face: usize) -> Triangle {
        let nodes = self.faces[face].nodes;
        Triangle(std::array::from_fn(|i| self.nodes[nodes[i] as usize]))
    }

    /// Faces of a named surface, as indices into [`Space::faces`]; empty when there is no such surface.
    pub fn surface(&self, name: &str) -> &[usize] {
        self.surfaces.get(name).map_or(&[], Vec::as_slice)
    }

    /// Names of the surfaces, in alphabetical order.
    pub fn surface_names(&self) -> Vec<&str> {
        let mut names: Vec<&str> = self.surfaces.keys().map(String::as_str).collect();
        names.sort_unstable();
        names
    }

    /// Which nodes lie on a named surface.
    pub fn on_surface(&self, name: &str) -> Vec<bool> {
        let mut on = vec![false; self.nodes.len()];
        for &face in self.surface(name) {
            for &n in self.face_nodes(face) {
                on[n as usize] = true;
            }
        }
        on
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Block, block};

    #[test]
    fn edge_nodes_are_shared_midpoints() {
        let mesh = block(&Block { size_m: [1.0, 1.0, 1.0], cells: [2, 2, 2] }).expect("block");
        let space = Space::new(&mesh, Order::P2).expect("space");
        // A block of n³ boxes cut by Kuhn's walks has (2n+1)³ second-order nodes.
        assert_eq!(space.nodes().len(), 125);
        for cell in space.cells() {
            for (k, [i, j]) in TET_EDGES.into_iter().enumerate() {
                let middle = 0.5 * (space.nodes()[cell[i] as usize] + space.nodes()[cell[j] as usize]);
                assert!((space.nodes()[cell[4 + k] as usize] - middle).norm() < 1e-15);
            }
        }
        assert_eq!(space.on_surface("z-").iter().filter(|&&b| b).count(), 25);
        for &face in space.surface("z+") {
            let (f, t) = (space.faces()[face], space.face_triangle(face));
            assert!((t.normal() - Vec3::z()).norm() < 1e-14);
            assert!(space.cell(f.cell).contains(&f.nodes[0]) && space.cell(f.cell).contains(&f.nodes[5]));
        }
    }
}
