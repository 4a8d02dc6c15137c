//! How a block is cut into boxes that are small where the stress is steep.
//!
//! The block is first cut into a grid of boxes with an edge plane at the end of the glue; then a box is halved
//! along all axes, again and again, until it is as small as wanted at its place. Small boxes meet large ones
//! without transition elements: where they do, the nodes of the small ones on the shared face follow the
//! large one's shape functions, so that the displacement stays continuous (see `unknowns`).

use super::SimError;
use std::collections::HashMap;

/// A block with its known glue: its underside z = 0 is held for x ≤ `glue_end_m`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slab {
    /// Edge lengths (m); the block extends from the origin.
    pub size_m: [f64; 3],
    /// Where the glue ends (m).
    pub glue_end_m: f64,
}

impl Slab {
    /// Whether the glue holds a point of the block (m).
    pub(super) fn holds(&self, point: [f64; 3]) -> bool {
        let rounding = 1e-12 * self.size_m[0];
        point[2] <= rounding && point[0] <= self.glue_end_m + rounding
    }

    /// Distance (m) from a box to the rim of the glue: its end and the edges of the block that it reaches.
    fn distance_to_glue_rim(&self, low: [f64; 3], high: [f64; 3]) -> f64 {
        let beyond = (low[0] - self.glue_end_m).max(0.0);
        let to_end = beyond.max(self.glue_end_m - high[0]);
        let to_edges = low[0].min(beyond.hypot(low[1].min(self.size_m[1] - high[1]).max(0.0)));
        to_end.min(to_edges).hypot(low[2])
    }
}

/// A circle or line to which the mesh is graded: cells at a distance d from it are at most
/// `cell_m + growth · d` long.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Feature {
    pub(super) place: Place,
    /// Longest edge of the cells that touch it (m).
    pub(super) cell_m: f64,
    /// How much longer they may be per distance from it.
    pub(super) growth: f64,
}

/// Where the stress is steep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Place {
    /// The rim of a disc on a side whose normal is along `axis`.
    Rim { centre: [f64; 3], axis: usize, radius: f64 },
    /// A disc in a plane whose normal is along `axis`; it may lie outside the block.
    Disc { centre: [f64; 3], axis: usize, radius: f64 },
    /// The surface of a ball.
    Ball { centre: [f64; 3], radius: f64 },
    /// The end of the glue: x = `x`, z = 0, all y.
    GlueEnd { x: f64 },
}

/// How boxes grow away from the features.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Grading {
    /// Boxes of the first grid (m).
    pub(super) cell_m: f64,
    /// How often a box may be halved.
    pub(super) halvings: u32,
    /// Halves the boxes around the glue, at its end and along the sides, once more; how much longer they may be per
    /// distance from it. Far from there the mesh is the same as without.
    pub(super) finer_glue: Option<f64>,
}

impl Place {
    /// Distance (m) from a box to this place.
    pub(super) fn distance(&self, low: [f64; 3], high: [f64; 3]) -> f64 {
        let gap = |axis: usize, at: f64| (low[axis] - at).max(at - high[axis]).max(0.0);
        match *self {
            Self::GlueEnd { x } => gap(0, x).hypot(gap(2, 0.0)),
            Self::Ball { centre, radius } => {
                let nearest = (0..3).map(|a| gap(a, centre[a]).powi(2)).sum::<f64>().sqrt();
                let reach = |a: usize| (centre[a] - low[a]).abs().max((high[a] - centre[a]).abs());
                let farthest = (0..3).map(|a| reach(a).powi(2)).sum::<f64>().sqrt();
                (nearest - radius).max(radius - farthest).max(0.0)
            }
            Self::Disc { centre, axis, radius } => {
                let (p, q) = ((axis + 1) % 3, (axis + 2) % 3);
                (gap(p, centre[p]).hypot(gap(q, centre[q])) - radius).max(0.0).hypot(gap(axis, centre[axis]))
            }
            Self::Rim { centre, axis, radius } => {
                let (p, q) = ((axis + 1) % 3, (axis + 2) % 3);
                let nearest = gap(p, centre[p]).hypot(gap(q, centre[q]));
                let reach = |a: usize| (centre[a] - low[a]).abs().max((high[a] - centre[a]).abs());
                let farthest = reach(p).hypot(reach(q));
                let in_plane = (nearest - radius).max(radius - farthest).max(0.0);
                in_plane.hypot(gap(axis, centre[axis]))
            }
        }
    }
}

/// One box: its refinement level and its place in the grid of that level.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Cell {
    pub(super) level: u32,
    pub(super) index: [u32; 3],
}

/// The block cut into boxes.
#[derive(Debug, Clone)]
pub(super) struct HexMesh {
    pub(super) slab: Slab,
    /// Planes of the first grid along each axis (m).
    planes: [Vec<f64>; 3],
    /// The boxes, in the order of the first grid.
    pub(super) cells: Vec<Cell>,
    find: HashMap<Cell, u32>,
    /// The finest level in use.
    finest: u32,
}

impl HexMesh {
    /// Cuts `slab` into boxes, smaller near `features`.
    pub(super) fn new(slab: Slab, features: &[Feature], grading: &Grading) -> Result<Self, SimError> {
        let Slab { size_m, glue_end_m } = slab;
        let cell_m = grading.cell_m;
        let positive = size_m.iter().chain([&cell_m]).all(|&l| l > 0.0 && l.is_finite());
        if !positive || !(0.0..=size_m[0]).contains(&glue_end_m) {
            return Err(SimError::BadBlock { size_m, glue_end_m, cell_m });
        }
        let mut planes = [vec![0.0], vec![0.0], vec![0.0]];
        for (axis, planes) in planes.iter_mut().enumerate() {
            let ends = if axis == 0 { vec![glue_end_m, size_m[0]] } else { vec![size_m[axis]] };
            for end in ends {
                let start = planes[planes.len() - 1];
                let cells = ((end - start) / cell_m).round().max(1.0) as usize;
                // A glue that ends at a side leaves no second stretch.
                if end > start {
                    planes.extend((1..=cells).map(|i| {
                        if i == cells { end } else { start + (end - start) * i as f64 / cells as f64 }
                    }));
                }
            }
        }
        let mut mesh = Self { slab, planes, cells: Vec::new(), find: HashMap::new(), finest: 0 };
        let count = mesh.planes.each_ref().map(|p| p.len() as u32 - 1);
        for k in 0..count[2] {
            for j in 0..count[1] {
                for i in 0..count[0] {
                    mesh.split(Cell { level: 0, index: [i, j, k] }, features, grading);
                }
            }
        }
        mesh.find = mesh.cells.iter().zip(0..).map(|(&cell, i)| (cell, i)).collect();
        mesh.finest = mesh.cells.iter().map(|c| c.level).max().unwrap_or(0);
        Ok(mesh)
    }

    fn split(&mut self, cell: Cell, features: &[Feature], grading: &Grading) {
        let (low, high) = self.corners(cell);
        let longest = (0..3).map(|a| high[a] - low[a]).fold(0.0, f64::max);
        let allowed = |f: &Feature| f.cell_m + f.growth * f.place.distance(low, high);
        let mut wanted = features.iter().map(allowed).fold(f64::INFINITY, f64::min);
        if let Some(growth) = grading.finer_glue {
            // Boxes of the first grid are longer or shorter than asked for, by less than this.
            let there = wanted.min(1.3 * grading.cell_m);
            wanted = wanted.min(0.5 * (there + growth * self.slab.distance_to_glue_rim(low, high)));
        }
        if cell.level < grading.halvings && longest > wanted {
            for child in 0..8 {
                let index = std::array::from_fn(|a| 2 * cell.index[a] + (child >> a & 1));
                self.split(Cell { level: cell.level + 1, index }, features, grading);
            }
        } else {
            self.cells.push(cell);
        }
    }

    /// Lowest and highest corner of a box (m).
    pub(super) fn corners(&self, cell: Cell) -> ([f64; 3], [f64; 3]) {
        let at = |offset: u32| {
            std::array::from_fn(|a| {
                self.plane(a, f64::from(cell.index[a] + offset) / f64::from(1 << cell.level))
            })
        };
        (at(0), at(1))
    }

    /// Edge lengths of a box (m).
    pub(super) fn size(&self, cell: Cell) -> [f64; 3] {
        let (low, high) = self.corners(cell);
        std::array::from_fn(|a| high[a] - low[a])
    }

    /// Edge lengths (m) of the box at a point (m).
    pub(super) fn size_at(&self, point: [f64; 3]) -> [f64; 3] {
        self.size(self.cells[self.locate(point).0])
    }

    /// Position (m) along an axis of a place counted in boxes of the first grid.
    fn plane(&self, axis: usize, count: f64) -> f64 {
        let planes = &self.planes[axis];
        let below = (count as usize).min(planes.len() - 2);
        planes[below] + (count - below as f64) * (planes[below + 1] - planes[below])
    }

    /// The box that holds a point (m; moved to the block if it lies outside) and the point's place in it,
    /// in [−1, 1]³.
    pub(super) fn locate(&self, point: [f64; 3]) -> (usize, [f64; 3]) {
        let count: [f64; 3] = std::array::from_fn(|a| {
            let planes = &self.planes[a];
            let below = planes.partition_point(|&p| p <= point[a]).clamp(1, planes.len() - 1) - 1;
            let share = (point[a] - planes[below]) / (planes[below + 1] - planes[below]);
            below as f64 + share.clamp(0.0, 1.0)
        });
        let mut level = 0;
        loop {
            let scale = f64::from(1_u32 << level);
            let last = |a: usize| ((self.planes[a].len() - 1) << level) as u32 - 1;
            let index = std::array::from_fn(|a| ((count[a] * scale) as u32).min(last(a)));
            if let Some(&found) = self.find.get(&Cell { level, index }) {
                let local = |a: usize| 2.0 * (count[a] * scale - f64::from(index[a])) - 1.0;
                return (found as usize, std::array::from_fn(local));
            }
            level += 1;
            assert!(level <= self.finest, "the boxes fill the block");
        }
    }

    /// Steps of the finest lattice of nodes in one box of this level: its nodes are half of it apart.
    pub(super) fn lattice_step(&self, level: u32) -> u32 {
        1 << (self.finest - level + 1)
    }

    /// Position (m) of a node of the finest lattice.
    pub(super) fn lattice_position(&self, node: [u32; 3]) -> [f64; 3] {
        let per_box = f64::from(self.lattice_step(0));
        std::array::from_fn(|a| self.plane(a, f64::from(node[a]) / per_box))
    }

    /// The largest box that touches a node of the finest lattice. Of equal ones, any: their nodes agree.
    pub(super) fn largest_at(&self, node: [u32; 3]) -> Cell {
        for level in 0..=self.finest {
            let step = self.lattice_step(level);
            for side in 0..8_u32 {
                let index: [Option<u32>; 3] = std::array::from_fn(|a| {
                    if side >> a & 1 == 0 {
                        Some(node[a] / step)
                    } else {
                        node[a].checked_sub(1).map(|n| n / step)
                    }
                });
                if let [Some(i), Some(j), Some(k)] = index {
                    let cell = Cell { level, index: [i, j, k] };
                    if self.find.contains_key(&cell) {
                        return cell;
                    }
                }
            }
        }
        unreachable!("every node of the lattice touches a box")
    }
}
