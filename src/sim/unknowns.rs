//! Which displacements of a mesh are unknown, and how every node's displacement follows from them.
//!
//! A node on the glue does not move (or as it is told: see `linear`). A node of a small box on the face or edge of a larger one follows the
//! larger one's shape functions; as these may name following nodes themselves, the rule is applied until only
//! free nodes are left. Because every node on a shared face follows the largest box there, the displacement is
//! continuous (and linear fields are reproduced exactly: the patch test in `linear`).

use super::hex_mesh::{Cell, HexMesh};
use super::quadratic::{NODES, PLACES, shape};
use std::collections::HashMap;

/// A linear combination of free nodes: `(free node, weight)`, ascending by node. Applied to each component.
pub(super) type Row = Vec<(u32, f64)>;

/// One box with the free nodes on which its 20 nodes depend.
#[derive(Debug, Clone)]
pub(super) struct Element {
    pub(super) cell: Cell,
    /// Unknowns: component c of `nodes[s]` is `unknowns[3 s + c]`.
    pub(super) unknowns: Vec<u32>,
    /// How the 20 nodes follow: `(node of the box, slot in the list of free nodes, weight)`.
    pub(super) follow: Vec<(u8, u16, f64)>,
    /// How they follow nodes on the glue: `(node of the box, node on the glue, weight)`.
    pub(super) held: Vec<(u8, u32, f64)>,
}

/// The mesh with its unknowns: three components a free node, component c of free node i at `3 i + c`.
#[derive(Debug, Clone)]
pub(super) struct Unknowns {
    pub(super) mesh: HexMesh,
    pub(super) elements: Vec<Element>,
    /// Positions of the free nodes (m).
    pub(super) position: Vec<[f64; 3]>,
    /// Positions of the nodes on the glue (m).
    pub(super) held: Vec<[f64; 3]>,
}

/// Nodes on the glue are numbered from here on while rows are made.
const HELD: u32 = 1 << 31;

/// Nodes of the lattice already looked at, by place.
#[derive(Default)]
struct Numbering {
    rows: HashMap<[u32; 3], Row>,
    position: Vec<[f64; 3]>,
    held: Vec<[f64; 3]>,
    /// Whether nodes on the glue are unknown as all others are.
    unglued: bool,
}

impl Numbering {
    fn row(&mut self, mesh: &HexMesh, node: [u32; 3]) -> Row {
        if let Some(row) = self.rows.get(&node) {
            return row.clone();
        }
        let largest = mesh.largest_at(node);
        let half = mesh.lattice_step(largest.level) / 2;
        let origin = largest.index.map(|i| 2 * half * i);
        let middles = (0..3).filter(|&a| node[a] - origin[a] == half).count();
        let on_its_lattice = node.iter().all(|n| n % half == 0) && middles < 2;
        let row = if on_its_lattice {
            let position = mesh.lattice_position(node);
            if !self.unglued && mesh.slab.holds(position) {
                self.held.push(position);
                vec![(HELD + self.held.len() as u32 - 1, 1.0)]
            } else {
                self.position.push(position);
                vec![(self.position.len() as u32 - 1, 1.0)]
            }
        } else {
            let local = std::array::from_fn(|a| f64::from(node[a] - origin[a]) / f64::from(half) - 1.0);
            let mut parts = Row::new();
            for (n, weight) in shape(local).into_iter().enumerate() {
                if weight != 0.0 {
                    let leader = std::array::from_fn(|a| origin[a] + half * PLACES[n][a]);
                    parts.extend(self.row(mesh, leader).into_iter().map(|(i, w)| (i, w * weight)));
                }
            }
            gather(parts)
        };
        self.rows.insert(node, row.clone());
        row
    }
}

/// Adds up the weights of equal nodes; ascending by node.
pub(super) fn gather(mut parts: Row) -> Row {
    parts.sort_by_key(|p| p.0);
    let mut row = Row::with_capacity(parts.len());
    for (node, weight) in parts {
        match row.last_mut() {
            Some(last) if last.0 == node => last.1 += weight,
            _ => row.push((node, weight)),
        }
    }
    row
}

impl Unknowns {
    /// Numbers the free nodes of a mesh.
    pub(super) fn new(mesh: HexMesh) -> Self {
        Self::numbered(mesh, Numbering::default())
    }

    /// Numbers all nodes of a mesh, those on the glue as well: something else has to hold it.
    pub(super) fn unglued(mesh: HexMesh) -> Self {
        Self::numbered(mesh, Numbering { unglued: true, ..Numbering::default() })
    }

    fn numbered(mesh: HexMesh, mut numbering: Numbering) -> Self {
        let mut elements = Vec::with_capacity(mesh.cells.len());
        for &cell in &mesh.cells {
            let half = mesh.lattice_step(cell.level) / 2;
            let mut rows = Vec::with_capacity(NODES);
            for place in PLACES {
                let node = std::array::from_fn(|a| half * (2 * cell.index[a] + place[a]));
                rows.push(numbering.row(&mesh, node));
            }
            let parts = rows
                .iter()
                .zip(0_u8..)
                .flat_map(|(row, n)| row.iter().map(move |&(node, weight)| (n, node, weight)));
            let (bound, followed): (Vec<_>, Vec<_>) = parts.partition(|&(_, node, _)| node >= HELD);
            let mut free: Vec<u32> = followed.iter().map(|p| p.1).collect();
            free.sort_unstable();
            free.dedup();
            let slot = |node: u32| free.partition_point(|&f| f < node) as u16;
            let follow = followed.iter().map(|&(n, node, weight)| (n, slot(node), weight)).collect();
            let held = bound.iter().map(|&(n, node, weight)| (n, node - HELD, weight)).collect();
            let unknowns = free.iter().flat_map(|&f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
            elements.push(Element { cell, unknowns, follow, held });
        }
        Self { mesh, elements, position: numbering.position, held: numbering.held }
    }

    /// Number of unknowns.
    pub(super) fn dimension(&self) -> usize {
        3 * self.position.len()
    }

    /// The displacement at a point as a combination of free nodes.
    pub(super) fn row_at(&self, point: [f64; 3]) -> Row {
        let (element, local) = self.mesh.locate(point);
        let values = shape(local);
        let element = &self.elements[element];
        gather(
            element
                .follow
                .iter()
                .filter(|f| values[f.0 as usize] != 0.0)
                .map(|&(n, slot, w)| (element.unknowns[3 * slot as usize] / 3, w * values[n as usize]))
                .collect(),
        )
    }
}

impl Element {
    /// The displacements of the 20 nodes (m).
    pub(super) fn nodal(&self, u: &[f64]) -> [[f64; 3]; NODES] {
        let mut nodal = [[0.0; 3]; NODES];
        for &(n, slot, weight) in &self.follow {
            for c in 0..3 {
                nodal[n as usize][c] += weight * u[self.unknowns[3 * slot as usize + c] as usize];
            }
        }
        nodal
    }

    /// Turns a stiffness of the 20 nodes (60 × 60, row by row) into one of the unknowns (row by row).
    pub(super) fn reduce(&self, full: &[f64]) -> Vec<f64> {
        let (n, m) = (3 * NODES, self.unknowns.len());
        let mut reduced = vec![0.0; m * m];
        for &(a, i, wa) in &self.follow {
            for &(b, j, wb) in &self.follow {
                let w = wa * wb;
                for c in 0..3 {
                    let from = (3 * a as usize + c) * n + 3 * b as usize;
                    let to = (3 * i as usize + c) * m + 3 * j as usize;
                    for d in 0..3 {
                        reduced[to + d] += w * full[from + d];
                    }
                }
            }
        }
        reduced
    }
}
