//! The known glue as something that may give or let go: nodal shares, springs, tractions.
//!
//! *Giving.* Everywhere `traction = −u / s`, `s` the give (m, for a unit modulus): `1/s ∫ u·v` over the glue.
//!
//! *Letting go.* A disc of the glue, seen along z, carries nothing. On elements nodes let go one by one; between held and
//! free a node is on a spring, `γ K (1 − w)/w` with `w` the share of the node's own area that the disc covers and `γ K`
//! about what the node feels of the body (`K` its diagonal entry of the stiffness). For one node its displacement is then
//! `w` times that of the free node, so that a rim across an element acts about where it is, smoothly in place and size.
//! Where the hold gives besides, the disc takes its share off the foundation point by point.
//!
//! Left out: unilateral contact (a loose base may press, not pull), friction, and what the elements near the rim cannot
//! resolve of its singular stress.

use super::loose::{FACING, FINE, Loosened, QUICK, fine_points, hats};
use crate::diagnose::DiagnoseError;
use crate::fem::{
    FemError, Functional, Model, NodalForces, Part, Space, cell_stiffness, triangle_quadrature,
};
use crate::geometry::Vec3;
use crate::sparse::{Analysis, Factor, Ordering, Pattern, SymmetricMatrix};
use nalgebra::DMatrix;
use std::collections::HashMap;
use std::sync::Arc;

/// The known glue of a body.
pub(super) struct Glue {
    faces: Vec<usize>,
    /// Nodes on it, and the place of each in this list.
    pub nodes: Vec<u32>,
    place: HashMap<u32, usize>,
    /// Area that belongs to each node (m²).
    area: Vec<f64>,
    /// Diagonal of the body's stiffness at each of their components (m).
    diagonal: Vec<f64>,
    /// Of `∫ N N` over the glue.
    mass: Factor,
}

/// The hold of a changed body.
pub(super) struct Hold {
    pub springs: Vec<Part>,
    /// Components that stay where they are.
    pub kept: Vec<bool>,
}

/// By what the hold changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum By {
    /// Centre along x or y.
    Centre(usize),
    Radius,
    Give,
}

/// A share below this is none: its spring would be stiffer than the body by its inverse.
const NOTHING: f64 = 1e-9;

/// Stiffness that a node on the glue feels of the body with its neighbours held, over its diagonal entry.
const FELT: f64 = 0.5;

/// Least share of the glue that must stay.
const LEAST_HOLD: f64 = 0.1;

impl Glue {
    /// The glue of a model on the surface `fixed`.
    pub(super) fn new(model: &Model, fixed: &str) -> Result<Self, DiagnoseError> {
        let space = model.space();
        let faces = space.surface(fixed).to_vec();
        let mut nodes: Vec<u32> = faces.iter().flat_map(|&f| space.face_nodes(f)).copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        let place: HashMap<u32, usize> = nodes.iter().enumerate().map(|(i, &n)| (n, i)).collect();
        let lists: Vec<Vec<u32>> = faces
            .iter()
            .map(|&face| space.face_nodes(face).iter().map(|n| place[n] as u32).collect())
            .collect();
        let pattern = Arc::new(Pattern::from_elements(nodes.len(), lists.iter().map(Vec::as_slice)));
        let mut mass = SymmetricMatrix::zeros(pattern.clone());
        let mut area = vec![0.0; nodes.len()];
        for (&face, list) in faces.iter().zip(&lists) {
            let size = space.face_triangle(face).area();
            let own = products(space, face, triangle_quadrature(4).into_iter().map(|(l, w)| (l, w * size)));
            mass.add_element(list, own.as_slice());
            for (l, w) in fine_points(FINE) {
                for (&node, h) in list.iter().zip(hats(space.order(), l)) {
                    area[node as usize] += h * w * size;
                }
            }
        }
        let analysis = Analysis::new(&pattern, Ordering::MinimumDegree).map_err(FemError::from)?;
        let mass = analysis.factor(&mass).map_err(FemError::from)?;
        let mut diagonal = vec![0.0; 3 * nodes.len()];
        for cell in touching(space, &place) {
            let k = cell_stiffness(space, cell, model.poisson_ratio());
            let side = 3 * space.order().cell_nodes();
            for (a, node) in space.cell(cell).iter().enumerate() {
                let Some(at) = place.get(node) else { continue };
                for i in 0..3 {
                    diagonal[3 * at + i] += k[(3 * a + i) * side + 3 * a + i];
                }
            }
        }
        Ok(Self { faces, nodes, place, area, diagonal, mass })
    }

    /// Tractions of the glue on the body as nodal values (`loads × 3 nodes of the glue`) for fields under nodal loads,
    /// on the unchanged body.
    pub(super) fn tractions(
        &self,
        model: &Model,
        loads: &[Functional],
        fields: &DMatrix<f64>,
    ) -> Result<DMatrix<f64>, DiagnoseError> {
        let space = model.space();
        let mut forces = NodalForces::of(fields);
        let side = 3 * space.order().cell_nodes();
        for cell in touching(space, &self.place) {
            let k = cell_stiffness(space, cell, model.poisson_ratio());
            let nodes = space.cell(cell).iter();
            let components = nodes.flat_map(|&n| (0..3).map(move |i| 3 * n + i)).collect();
            forces.add(&Part { components, matrix: DMatrix::from_row_slice(side, side, &k) });
        }
        let components: Vec<u32> = self.components().collect();
        let mut reactions = forces.on(&components);
        for (load, functional) in loads.iter().enumerate() {
            for (c, w) in functional {
                if let Some(at) = self.place.get(&(c / 3)) {
                    reactions[(load, 3 * at + *c as usize % 3)] -= w;
                }
            }
        }
        // One system for all loads and axes: its right-hand sides are the columns of `[node, (load, axis)]`.
        let (count, n) = (loads.len(), self.nodes.len());
        let mut rhs = vec![0.0; 3 * count * n];
        for load in 0..count {
            for c in 0..3 * n {
                rhs[(3 * load + c % 3) * n + c / 3] = reactions[(load, c)];
            }
        }
        self.mass.solve_in_place(&mut rhs, 3 * count).map_err(FemError::from)?;
        Ok(DMatrix::from_fn(count, 3 * n, |load, c| rhs[(3 * load + c % 3) * n + c / 3]))
    }

    /// `∫ m t·t'` of nodal tractions over the glue: parts on components `3 place + i`, with `m` of the distance from a
    /// centre (m), or 1 everywhere.
    pub(super) fn weighed(
        &self,
        space: &Space,
        loose: Option<(&Loosened, &dyn Fn(f64) -> f64)>,
    ) -> Vec<Part> {
        let mut parts = Vec::new();
        for &face in &self.faces {
            let triangle = space.face_triangle(face);
            let size = triangle.area();
            let matrix = match loose {
                None => products(space, face, triangle_quadrature(4).into_iter().map(|(l, w)| (l, w * size))),
                Some((disc, _)) if !disc.reaches(&triangle.0) => continue,
                Some((disc, m)) => {
                    let points =
                        fine_points(QUICK).map(|(l, w)| (l, w * size * m(disc.distance(&triangle.at(l)))));
                    products(space, face, points)
                }
            };
            if matrix.amax() > 0.0 {
                let places = space.face_nodes(face).iter().map(|n| self.place[n] as u32);
                parts.push(on_axes(places.collect(), &matrix));
            }
        }
        parts
    }

    /// The hold when the glue gives by `give_m` and a disc of it is loose.
    ///
    /// # Errors
    /// [`DiagnoseError::GlueGone`] when too little stays.
    pub(super) fn hold(
        &self,
        space: &Space,
        loose: Option<&Loosened>,
        give_m: f64,
    ) -> Result<Hold, DiagnoseError> {
        let shares = loose.map(|disc| self.shares(space, disc));
        if let Some(shares) = &shares {
            let whole: f64 = self.area.iter().sum();
            let gone: f64 = shares.iter().zip(&self.area).map(|(s, area)| s[0] * area).sum();
            if 1.0 - gone / whole < LEAST_HOLD {
                return Err(DiagnoseError::GlueGone { left_share: 1.0 - gone / whole, least: LEAST_HOLD });
            }
        }
        let mut kept = vec![false; space.components()];
        if give_m > 0.0 {
            let springs = self.foundation(space, loose, |share| (1.0 - share[0]) / give_m, true);
            return Ok(Hold { springs, kept });
        }
        let mut springs = Vec::new();
        for (at, &node) in self.nodes.iter().enumerate() {
            let share = shares.as_ref().map_or(0.0, |s| s[at][0]);
            for i in 0..3 {
                let component = 3 * node + i as u32;
                if share <= NOTHING {
                    kept[component as usize] = true;
                } else {
                    let k = FELT * self.diagonal[3 * at + i] * (1.0 - share) / share;
                    springs.push(spring(component, k));
                }
            }
        }
        Ok(Hold { springs, kept })
    }

    /// How the springs of [`Glue::hold`] change.
    pub(super) fn change(&self, space: &Space, loose: Option<&Loosened>, give_m: f64, by: By) -> Vec<Part> {
        let which = match by {
            By::Centre(axis) => 1 + axis,
            By::Radius => 3,
            By::Give => {
                return self.foundation(space, loose, |s| -(1.0 - s[0]) / (give_m * give_m), true);
            }
        };
        if give_m > 0.0 {
            return self.foundation(space, loose, |share| -share[which] / give_m, false);
        }
        let Some(disc) = loose else { return Vec::new() };
        let mut springs = Vec::new();
        for ((at, &node), share) in self.nodes.iter().enumerate().zip(self.shares(space, disc)) {
            if share[0] > NOTHING && share[which] != 0.0 {
                for i in 0..3 {
                    let k = -FELT * self.diagonal[3 * at + i] * share[which] / (share[0] * share[0]);
                    springs.push(spring(3 * node + i as u32, k));
                }
            }
        }
        springs
    }

    /// `∫ m u·v` over the glue, `m` of the share of the disc and its derivatives; `everywhere`, or only where the disc
    /// reaches.
    fn foundation(
        &self,
        space: &Space,
        loose: Option<&Loosened>,
        m: impl Fn([f64; 4]) -> f64,
        everywhere: bool,
    ) -> Vec<Part> {
        let mut parts = Vec::new();
        for &face in &self.faces {
            let triangle = space.face_triangle(face);
            let size = triangle.area();
            let across = loose.filter(|disc| disc.reaches(&triangle.0));
            let matrix = match across {
                Some(disc) => {
                    let points =
                        fine_points(FINE).map(|(l, w)| (l, w * size * m(disc.share(&triangle.at(l)))));
                    products(space, face, points)
                }
                None if everywhere => {
                    let plain = m([0.0; 4]) * size;
                    products(space, face, triangle_quadrature(4).into_iter().map(|(l, w)| (l, w * plain)))
                }
                None => continue,
            };
            parts.push(on_axes(space.face_nodes(face).to_vec(), &matrix));
        }
        parts
    }

    /// Share of each node's area that the disc covers, with derivatives by the centre's x and y and by the radius.
    fn shares(&self, space: &Space, disc: &Loosened) -> Vec<[f64; 4]> {
        let mut shares = vec![[0.0; 4]; self.nodes.len()];
        for &face in &self.faces {
            let triangle = space.face_triangle(face);
            if !disc.reaches(&triangle.0) {
                continue;
            }
            let size = triangle.area();
            for (l, w) in fine_points(FINE) {
                let share = disc.share(&triangle.at(l));
                if share == [0.0; 4] {
                    continue;
                }
                for (node, h) in space.face_nodes(face).iter().zip(hats(space.order(), l)) {
                    let at = self.place[node];
                    for k in 0..4 {
                        shares[at][k] += h * w * size * share[k] / self.area[at];
                    }
                }
            }
        }
        shares.iter_mut().for_each(|s| s[0] = s[0].min(1.0));
        shares
    }

    /// Displacement components of its nodes.
    fn components(&self) -> impl Iterator<Item = u32> + '_ {
        self.nodes.iter().flat_map(|&n| (0..3).map(move |i| 3 * n + i))
    }

    /// Centres (m) of its faces that face along z.
    pub(super) fn faces_along_z(&self, space: &Space) -> Vec<Vec3> {
        let flat = |f: &&usize| space.face_triangle(**f).normal().z.abs() > FACING;
        self.faces.iter().filter(flat).map(|&f| space.face_triangle(f).at([1.0 / 3.0; 3])).collect()
    }

    /// Midpoints (m) of the edges where faces along z end.
    pub(super) fn ends_along_z(&self, space: &Space) -> Vec<Vec3> {
        let mut edges: HashMap<(u32, u32), u32> = HashMap::new();
        for &face in self.faces.iter().filter(|&&f| space.face_triangle(f).normal().z.abs() > FACING) {
            let nodes = space.faces()[face].nodes;
            for (a, b) in [(nodes[0], nodes[1]), (nodes[1], nodes[2]), (nodes[2], nodes[0])] {
                *edges.entry((a.min(b), a.max(b))).or_insert(0) += 1;
            }
        }
        let mut ends: Vec<_> =
            edges.into_iter().filter(|(_, count)| *count == 1).map(|(edge, _)| edge).collect();
        ends.sort_unstable();
        let node = |n: u32| space.nodes()[n as usize];
        ends.into_iter().map(|(a, b)| (node(a) + node(b)) * 0.5).collect()
    }
}

fn spring(component: u32, stiffness: f64) -> Part {
    Part { components: vec![component], matrix: DMatrix::from_element(1, 1, stiffness) }
}

/// Cells with a node on the glue.
fn touching<'a>(space: &'a Space, place: &'a HashMap<u32, usize>) -> impl Iterator<Item = u32> + 'a {
    (0..space.cells().len() as u32).filter(|&c| space.cell(c).iter().any(|n| place.contains_key(n)))
}

/// `∫ m N N` of a face, with barycentric points and their weights (m²).
fn products(space: &Space, face: usize, points: impl Iterator<Item = ([f64; 3], f64)>) -> DMatrix<f64> {
    let n = space.face_nodes(face).len();
    let mut all = DMatrix::zeros(n, n);
    for (l, w) in points {
        let shape = space.order().face_shape(l);
        for a in 0..n {
            for b in 0..n {
                all[(a, b)] += w * shape[a] * shape[b];
            }
        }
    }
    all
}

/// The same matrix for each axis.
fn on_axes(nodes: Vec<u32>, matrix: &DMatrix<f64>) -> Part {
    let n = nodes.len();
    let components = nodes.iter().flat_map(|&n| (0..3).map(move |i| 3 * n + i)).collect();
    let matrix =
        DMatrix::from_fn(3 * n, 3 * n, |a, b| if a % 3 == b % 3 { matrix[(a / 3, b / 3)] } else { 0.0 });
    Part { components, matrix }
}
