//! A body some of whose displacement components are held: numbering of the free ones and elimination order.
//!
//! All that depends neither on the material nor on the loads is made once here and serves every iteration of
//! every load case.

use super::FiniteError;
use crate::fem::{Functional, Space, barycentric_gradients, tet_quadrature};
use crate::geometry::Vec3;
use crate::sparse::{Analysis, Factor, Ordering, Pattern, SymmetricMatrix};
use std::sync::Arc;

/// Marks a held component in the numbering of the unknowns.
const HELD: u32 = u32::MAX;

/// A discretised body with held components.
#[derive(Debug)]
pub struct HeldBody {
    space: Arc<Space>,
    /// Unknown of each component, or [`HELD`].
    unknown: Vec<u32>,
    /// Component of each unknown.
    free: Vec<u32>,
    /// Held components, ascending.
    held: Vec<u32>,
    /// Unknowns of each functional that may be braced, in the order of its entries.
    braced: Vec<Vec<u32>>,
    pattern: Arc<Pattern>,
    analysis: Analysis,
}

impl HeldBody {
    /// Numbers the components that are not `held` (one flag a component, `3 n + i`) and finds an elimination
    /// order for them. The held components must leave no rigid motion free; ties do not count.
    pub fn new(space: Arc<Space>, held: &[bool]) -> Result<Self, FiniteError> {
        Self::with_pads(space, held, &[])
    }

    /// As [`HeldBody::new`], with room in the tangent for pads (their functionals, by axis) that will be tied
    /// rigidly.
    ///
    /// Why: pressed deep, a soft body may yield more force back than it takes (a limit point). Under a given
    /// force it is then unstable and its tangent indefinite, but under a given displacement of the pad it is
    /// not; a rigid tie to a functional that is announced here braces the tangent, so that the latter is what
    /// counts. Costs the coupling of each pad's nodes with each other.
    pub fn with_pads(
        space: Arc<Space>,
        held: &[bool],
        pads: &[[Functional; 3]],
    ) -> Result<Self, FiniteError> {
        let expected = space.components();
        if held.len() != expected {
            return Err(FiniteError::Length {
                what: "flags of held components",
                expected,
                found: held.len(),
            });
        }
        let mut unknown = vec![HELD; expected];
        let (mut free, mut kept) = (Vec::new(), Vec::new());
        for (component, &is_held) in held.iter().enumerate() {
            if is_held {
                kept.push(component as u32);
            } else {
                unknown[component] = free.len() as u32;
                free.push(component as u32);
            }
        }
        if let Some(&(c, _)) = pads.iter().flatten().flatten().find(|(c, _)| *c as usize >= expected) {
            let (what, found) = ("components of the pads' body", c as usize + 1);
            return Err(FiniteError::Length { what, expected, found });
        }
        let unknowns = |components: &mut dyn Iterator<Item = u32>| -> Vec<u32> {
            components.map(|c| unknown[c as usize]).filter(|&x| x != HELD).collect()
        };
        let cells: Vec<Vec<u32>> = space.cells().map(|nodes| unknowns(&mut components(nodes))).collect();
        let braced: Vec<Vec<u32>> =
            pads.iter().flatten().map(|pad| unknowns(&mut pad.iter().map(|&(c, _)| c))).collect();
        let couplings = cells.iter().chain(&braced).map(Vec::as_slice);
        let pattern = Arc::new(Pattern::from_elements(free.len(), couplings));
        let position: Vec<[f64; 3]> = free.iter().map(|&c| space.nodes()[c as usize / 3].into()).collect();
        let analysis = Analysis::new(&pattern, Ordering::NestedDissection { position: &position })?;
        Ok(Self { space, unknown, free, held: kept, braced, pattern, analysis })
    }

    /// The body with all three components of the nodes of a named surface held.
    pub fn clamped(space: Arc<Space>, surface: &str) -> Result<Self, FiniteError> {
        let held: Vec<bool> = space.on_surface(surface).into_iter().flat_map(|on| [on; 3]).collect();
        Self::new(space, &held)
    }

    /// Its nodes and cells.
    pub fn space(&self) -> &Arc<Space> {
        &self.space
    }

    /// Held components (`3 n + i`), ascending.
    pub fn held(&self) -> &[u32] {
        &self.held
    }

    /// Components that are free to move (`3 n + i`), ascending.
    pub fn free(&self) -> &[u32] {
        &self.free
    }

    pub(super) fn is_held(&self, component: usize) -> bool {
        self.unknown[component] == HELD
    }

    /// The unknown of a component, or `None` when it is held.
    pub(super) fn unknown(&self, component: u32) -> Option<u32> {
        Some(self.unknown[component as usize]).filter(|&x| x != HELD)
    }

    /// Whether the tangent has room to couple these unknowns, a functional's, with each other.
    pub(super) fn has_room_for(&self, unknowns: &[u32]) -> bool {
        self.braced.iter().any(|braced| braced == unknowns)
    }

    pub(super) fn zero_matrix(&self) -> SymmetricMatrix {
        SymmetricMatrix::zeros(Arc::clone(&self.pattern))
    }

    /// Factors a tangent, `fraction` of the load being asked for.
    pub(super) fn factor(&self, tangent: &SymmetricMatrix, fraction: f64) -> Result<Factor, FiniteError> {
        use crate::sparse::SparseError::NotPositiveDefinite;
        self.analysis.factor(tangent).map_err(|source| match source {
            NotPositiveDefinite { unknown, .. } => {
                let component = self.free[unknown] as usize;
                let (node, axis) = (component / 3, component % 3);
                FiniteError::TangentNotPositiveDefinite { fraction, node, axis, source }
            }
            other => FiniteError::Linear(other),
        })
    }

    /// Forces (N) on all components by a body force per undeformed volume (N/m³).
    pub fn body_force(&self, per_volume: &Vec3) -> Vec<f64> {
        let mut forces = vec![0.0; self.space.components()];
        self.add_body_force(per_volume, &mut forces);
        forces
    }

    /// Adds ∫ Nₐ b dV of a dead body force `b` (N/m³) to forces on components (N); exact.
    pub(super) fn add_body_force(&self, body_force: &Vec3, forces: &mut [f64]) {
        if *body_force == Vec3::zeros() {
            return;
        }
        let order = self.space.order();
        // Shape functions are of second degree at most.
        let rule = tet_quadrature(2);
        let mut share = [0.0; 10];
        for (l, weight) in rule {
            for (s, n) in share.iter_mut().zip(order.cell_shape(l)) {
                *s += weight * n;
            }
        }
        for (cell, nodes) in self.space.cells().enumerate() {
            let (_, volume) = barycentric_gradients(&self.space.corners(cell as u32));
            for (&node, share) in nodes.iter().zip(share) {
                for i in 0..3 {
                    forces[3 * node as usize + i] += share * volume * body_force[i];
                }
            }
        }
    }
}

/// Components of a list of nodes, node by node.
pub(super) fn components(nodes: &[u32]) -> impl Iterator<Item = u32> + '_ {
    nodes.iter().flat_map(|&n| [3 * n, 3 * n + 1, 3 * n + 2])
}
