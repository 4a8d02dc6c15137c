//! Which displacement components a body solves for, and how their stiffness is put together and factored.
//!
//! Worked out once for a body and a hold; bodies of the same elements and another stiffness share it.

use super::element::Order;
use super::error::FemError;
use super::space::Space;
use super::variation::Part;
use crate::sparse::{Analysis, Factor, Ordering, Pattern, SymmetricMatrix};
use rayon::prelude::*;
use std::sync::Arc;

/// Components that the known glue holds have no unknown.
pub(super) const HELD: u32 = u32::MAX;

/// Unknowns of a body, and where they meet.
pub(super) struct Layout {
    /// Unknown of each displacement component, or [`HELD`].
    pub unknown: Vec<u32>,
    /// Displacement component of each unknown.
    pub components: Vec<u32>,
    /// Unknowns of every cell, those of held components left out.
    lists: Vec<Vec<u32>>,
    pattern: Arc<Pattern>,
}

/// Unknowns of a body, and the structure of its factored stiffness.
pub(super) struct Skeleton {
    /// The unknowns.
    pub layout: Layout,
    analysis: Analysis,
}

/// Cells whose stiffness is held in memory at once.
const CELLS_AT_ONCE: usize = 2048;

impl Layout {
    /// For a body whose nodes `held` have no unknowns; and a point (m) for each unknown.
    fn new(space: &Space, held: &[bool]) -> (Self, Vec<[f64; 3]>) {
        let mut unknown = vec![HELD; space.components()];
        let (mut position, mut free) = (Vec::new(), Vec::new());
        for (node, p) in space.nodes().iter().enumerate().filter(|&(node, _)| !held[node]) {
            for i in 0..3 {
                unknown[3 * node + i] = position.len() as u32;
                free.push((3 * node + i) as u32);
                position.push([p.x, p.y, p.z]);
            }
        }
        let lists: Vec<Vec<u32>> = space
            .cells()
            .map(|cell| components(cell).map(|c| unknown[c]).filter(|&u| u != HELD).collect())
            .collect();
        let pattern = Arc::new(Pattern::from_elements(free.len(), lists.iter().map(Vec::as_slice)));
        (Self { unknown, components: free, lists, pattern }, position)
    }

    /// Number of unknowns.
    pub(super) fn unknowns(&self) -> usize {
        self.components.len()
    }

    /// The stiffness of all cells together (row-major, as [`cell_stiffness`](super::cell_stiffness) gives it).
    pub(super) fn assembled(
        &self,
        space: &Space,
        stiffness: impl Fn(u32) -> Vec<f64> + Sync,
    ) -> SymmetricMatrix {
        let mut matrix = SymmetricMatrix::zeros(self.pattern.clone());
        for chunk in (0..self.lists.len()).collect::<Vec<_>>().chunks(CELLS_AT_ONCE) {
            let all: Vec<Vec<f64>> = chunk.par_iter().map(|&cell| stiffness(cell as u32)).collect();
            chunk.iter().zip(&all).for_each(|(&cell, k)| self.add(&mut matrix, space, cell, k));
        }
        matrix
    }

    /// Adds the stiffness `k` of one cell.
    fn add(&self, matrix: &mut SymmetricMatrix, space: &Space, cell: usize, k: &[f64]) {
        let side = 3 * Order::cell_nodes(space.order());
        let free: Vec<usize> = components(space.cell(cell as u32))
            .enumerate()
            .filter(|&(_, c)| self.unknown[c] != HELD)
            .map(|(local, _)| local)
            .collect();
        let block: Vec<f64> = free.iter().flat_map(|&a| free.iter().map(move |&b| k[a * side + b])).collect();
        matrix.add_element(&self.lists[cell], &block);
    }
}

impl Skeleton {
    /// The structure for a body whose nodes `held` have no unknowns.
    pub(super) fn new(space: &Space, held: &[bool]) -> Result<Self, FemError> {
        let (layout, position) = Layout::new(space, held);
        let analysis = Analysis::new(&layout.pattern, Ordering::NestedDissection { position: &position })?;
        Ok(Self { layout, analysis })
    }

    /// As [`Skeleton::new`], and the stiffness of all cells together, as [`Layout::assembled`] gives it: side by side, as much of either
    /// keeps one core only.
    pub(super) fn with_stiffness(
        space: &Space,
        held: &[bool],
        stiffness: impl Fn(u32) -> Vec<f64> + Sync,
    ) -> Result<(Self, SymmetricMatrix), FemError> {
        let (layout, position) = Layout::new(space, held);
        let ordering = Ordering::NestedDissection { position: &position };
        let (analysis, matrix) =
            rayon::join(|| Analysis::new(&layout.pattern, ordering), || layout.assembled(space, &stiffness));
        Ok((Self { layout, analysis: analysis? }, matrix))
    }

    /// Factors a stiffness with `more` in some cells and `springs` besides; components that are `kept` (none where the list
    /// is empty) stay where they are although they have unknowns.
    pub(super) fn factor(
        &self,
        space: &Space,
        stiffness: &SymmetricMatrix,
        more: &[(u32, Vec<f64>)],
        springs: &[Part],
        kept: &[bool],
    ) -> Result<Factor, FemError> {
        if more.is_empty() && springs.is_empty() && kept.is_empty() {
            return Ok(self.analysis.factor(stiffness)?);
        }
        let mut matrix = stiffness.clone();
        more.iter().for_each(|(cell, k)| self.layout.add(&mut matrix, space, *cell as usize, k));
        for spring in springs {
            let list: Vec<u32> = spring.components.iter().map(|&c| self.layout.unknown[c as usize]).collect();
            matrix.add_element(&list, spring.matrix.as_slice());
        }
        if kept.iter().any(|kept| *kept) {
            let mut pinned = vec![false; self.layout.unknowns()];
            for (_, &u) in kept.iter().zip(&self.layout.unknown).filter(|(kept, u)| **kept && **u != HELD) {
                pinned[u as usize] = true;
            }
            matrix.pin(&pinned);
        }
        Ok(self.analysis.factor(&matrix)?)
    }
}

/// Displacement components of a cell's nodes.
pub(super) fn components(nodes: &[u32]) -> impl Iterator<Item = usize> + '_ {
    nodes.iter().flat_map(|&n| (0..3).map(move |i| 3 * n as usize + i))
}
