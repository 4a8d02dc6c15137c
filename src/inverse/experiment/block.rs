//! The block of the published simulations: 4 m × 2 m × 8 m, E = 10 kPa, ν = 0.45, 1000 N at a top corner, 171
//! observed nodes, 35 search nodes of which 10 are restrained, the rest of the back held where it is known.
//!
//! x runs along the width, y from the front (observed) to the back, z up. The paper's mesh (937 nodes, 3956
//! tetrahedra, unstructured) is not public; this one has 8 × 5 × 18 boxes: 1026 nodes and 4320 tetrahedra,
//! and its front has 9 × 19 = 171 nodes, the observed ones. On the back, the lowest five rows are known to be
//! held, and 5 × 7 nodes in the middle of the upper half are the search nodes; the upper two rows of them are
//! restrained. The load presses the top left corner of the front into the body.
//!
//! Why the upper rows: where the paper's restrained nodes lie is not said, and step two of the published
//! method depends on it. Its l1 norm prefers forces far from the known support, which do the same with less;
//! with the restraint in the middle rows it finds none of it below 50 dB, with the restraint in the upper rows
//! it comes out as published, its two sums equal and near the truth.

use crate::fem::{FemError, Model, Order, Space, Spot};
use crate::geometry::Vec3;
use crate::inverse::condensed::node_spot;
use crate::inverse::published::reactions;
use crate::inverse::{Condensed, InverseError};
use crate::mesh::{Block, TetMesh, block};
use nalgebra::DVector;

const SIZE_M: [f64; 3] = [4.0, 2.0, 8.0];
const CELLS: [usize; 3] = [8, 5, 18];
/// Rows of the back that are known to be held, from the bottom.
const KNOWN_ROWS: usize = 5;
/// Columns and rows of the back that are searched.
const SEARCH: [std::ops::RangeInclusive<usize>; 2] = [2..=6, 9..=15];
/// Rows of the search nodes that are restrained.
const RESTRAINED_ROWS: [usize; 2] = [14, 15];
/// Unequal springs over their mean; they sum to ten.
const UNEQUAL: [f64; 10] = [1.8, 0.2, 1.4, 0.6, 1.0, 0.4, 1.6, 0.8, 1.2, 1.0];
/// Into the front.
const FORCE: Vec3 = Vec3::new(0.0, 1000.0, 0.0);
/// The finer mesh; the last known row lies on its cell borders too.
const FINER_CELLS: [usize; 3] = [12, 8, 27];
/// Radius (m) of a disc with about the area that belongs to one node, 0.5 m × 0.44 m.
const DISC_M: f64 = 0.25;

/// What restrains the ten nodes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Restraint {
    /// They are held.
    Fixed,
    /// Springs of this stiffness (N/m) each.
    Springs(f64),
    /// Springs of this stiffness (N/m) in the mean, from a fifth to nine fifths of it, stiff beside soft.
    Unequal(f64),
}

/// Mesh, nodes and load of the experiment.
#[derive(Debug, Clone)]
pub struct BlockExperiment {
    /// The body, with the surface `fixed`.
    pub mesh: TetMesh,
    /// Search nodes.
    pub search: Vec<u32>,
    /// Observed nodes.
    pub observed: Vec<u32>,
    /// Which of the search nodes are restrained, as indices among them.
    pub restrained: Vec<usize>,
    /// The node that is loaded.
    pub loaded: u32,
}

impl BlockExperiment {
    /// True Young's modulus (Pa).
    pub const YOUNG_MODULUS_PA: f64 = 10_000.0;
    /// Poisson's ratio.
    pub const POISSON_RATIO: f64 = 0.45;

    /// The experiment.
    ///
    /// # Errors
    /// What the mesh reports.
    pub fn new() -> Result<Self, FemError> {
        let mesh = held_block(CELLS)?;
        let id = |i: usize, j: usize, k: usize| (i + (CELLS[0] + 1) * (j + (CELLS[1] + 1) * k)) as u32;
        let back = CELLS[1];
        let [columns, rows] = SEARCH;
        let places: Vec<(usize, usize)> = rows.flat_map(|k| columns.clone().map(move |i| (i, k))).collect();
        Ok(Self {
            search: places.iter().map(|&(i, k)| id(i, back, k)).collect(),
            restrained: (0..places.len()).filter(|&p| RESTRAINED_ROWS.contains(&places[p].1)).collect(),
            observed: (0..=CELLS[2]).flat_map(|k| (0..=CELLS[0]).map(move |i| id(i, 0, k))).collect(),
            loaded: id(0, 0, CELLS[2]),
            mesh,
        })
    }

    /// Where the search nodes are (m).
    pub fn search_places(&self) -> Vec<Vec3> {
        self.search.iter().map(|&n| self.mesh.nodes[n as usize]).collect()
    }

    /// The body condensed on the experiment's own mesh, first-order elements as in the paper.
    ///
    /// # Errors
    /// What the model reports.
    pub fn condense(&self) -> Result<Condensed, FemError> {
        let model = Model::new(&self.mesh, Order::P1, Self::POISSON_RATIO, "fixed")?;
        let spots = |nodes: &[u32]| -> Vec<Spot> {
            nodes.iter().map(|&n| node_spot(n, self.mesh.nodes[n as usize])).collect()
        };
        let load = node_spot(self.loaded, self.mesh.nodes[self.loaded as usize]);
        Condensed::new(&model, &spots(&self.search), &spots(&self.observed), &[(load, FORCE)])
    }

    /// The body on another mesh, half as coarse, with second-order elements: what the data of a body that is
    /// not the model's come from. A force at a node has no limit there, so that load and springs act over discs
    /// of about the area that belongs to a node, centred where the node is.
    ///
    /// # Errors
    /// What the model reports.
    pub fn condense_finer(&self) -> Result<Condensed, FemError> {
        let mesh = held_block(FINER_CELLS)?;
        let model = Model::new(&mesh, Order::P2, Self::POISSON_RATIO, "fixed")?;
        let disc = |space: &Space, side: &str, node: u32, radius: f64| {
            Spot::disc(space, space.surface(side), &self.mesh.nodes[node as usize], radius)
        };
        let search: Result<Vec<Spot>, FemError> =
            self.search.iter().map(|&n| disc(model.space(), "y+", n, DISC_M)).collect();
        // At a corner a quarter of the disc lies on the face: twice the radius has the area of one node.
        let load = disc(model.space(), "y-", self.loaded, 2.0 * DISC_M)?;
        let observed: Result<Vec<Spot>, FemError> = self
            .observed
            .iter()
            .map(|&n| Spot::marker(model.space(), &mesh, "y-", &self.mesh.nodes[n as usize]).map(|(s, _)| s))
            .collect();
        Condensed::new(&model, &search?, &observed?, &[(load, FORCE)])
    }

    /// One stiffness a search node (N/m).
    pub fn stiffness(&self, restraint: Restraint) -> Vec<f64> {
        let mut stiffness = vec![0.0; self.search.len()];
        for (&j, share) in self.restrained.iter().zip(UNEQUAL) {
            stiffness[j] = match restraint {
                Restraint::Fixed => f64::INFINITY,
                Restraint::Springs(k) => k,
                Restraint::Unequal(mean) => mean * share,
            };
        }
        stiffness
    }

    /// Displacement (m) of every node under the load for each of `states`: Young's modulus (Pa) and the
    /// displacements of the search nodes (3 Nₛ, m).
    ///
    /// # Errors
    /// What the model and the solvers report.
    pub fn deformed(&self, states: &[(f64, &[f64])]) -> Result<Vec<Vec<Vec3>>, InverseError> {
        let model = Model::new(&self.mesh, Order::P1, Self::POISSON_RATIO, "fixed")?;
        let body = self.condense()?;
        let mut loads = Vec::new();
        for &(young_modulus_pa, search) in states {
            let forces = reactions(&body, young_modulus_pa, &DVector::from_column_slice(search))?;
            let mut load = vec![0.0; model.space().components()];
            (0..3).for_each(|i| load[3 * self.loaded as usize + i] = FORCE[i]);
            for (j, &n) in self.search.iter().enumerate() {
                (0..3).for_each(|i| load[3 * n as usize + i] += forces[3 * j + i]);
            }
            loads.push(load);
        }
        let fields = model.displace(loads)?;
        let vectors = |(field, (young_modulus_pa, _)): (Vec<f64>, &(f64, &[f64]))| {
            field.chunks_exact(3).map(|u| Vec3::new(u[0], u[1], u[2]) / *young_modulus_pa).collect()
        };
        Ok(fields.into_iter().zip(states).map(vectors).collect())
    }
}

/// The block with the known support as the surface `fixed`: the back up to the last known row.
fn held_block(cells: [usize; 3]) -> Result<TetMesh, FemError> {
    let mut mesh = block(&Block { size_m: SIZE_M, cells })?;
    let known_m = SIZE_M[2] * (KNOWN_ROWS - 1) as f64 / CELLS[2] as f64 + 1e-9;
    let held = |n: &u32| mesh.nodes[*n as usize].z <= known_m;
    let fixed = mesh.surface("y+").iter().filter(|t| t.iter().all(held)).copied().collect();
    mesh.surfaces.insert("fixed".to_owned(), fixed);
    Ok(mesh)
}
