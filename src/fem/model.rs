//! The phantom's response to loads on its spots: one factor, many loads, for a unit Young's modulus.
//!
//! With the known glue holding and everything linear, a body of modulus `E` under a force `f` at a spot moves
//! by `C f / E`. The compliance `C` between spots is all that the inverse problem needs of the elements.

use super::elasticity::cell_stiffness;
use super::element::{Order, barycentric_gradients, tet_quadrature};
use super::error::FemError;
use super::near::Near;
use super::skeleton::{HELD, Skeleton, components};
use super::space::Space;
use super::spot::{Functional, Spot};
use crate::geometry::{Mat3, Vec3};
use crate::mesh::TetMesh;
use crate::sparse::Factor;
use rayon::prelude::*;
use std::sync::OnceLock;

/// Nodal values for a force along each axis, `[3 n + i]`.
type ByAxis = [Vec<f64>; 3];

/// A linear elastic body, held at its known glue, factored once.
pub struct Model {
    space: Space,
    poisson_ratio: f64,
    held: Vec<bool>,
    skeleton: Skeleton,
    factor: Factor,
    /// Between free and held components, worked out when first needed.
    coupling: OnceLock<Vec<Coupled>>,
}

/// A free component, a held one, and the stiffness between them.
type Coupled = (u32, u32, f64);

/// What is solved for.
#[derive(Default)]
struct Load {
    /// Forces (N) on unknowns; those on one add up.
    forces: Vec<(u32, f64)>,
    /// Displacements (m) of held components.
    prescribed: Vec<(u32, f64)>,
}

/// Displacement of the whole body under a unit force at one spot, for a unit modulus.
#[derive(Debug, Clone)]
pub struct Response {
    /// Nodal displacement for a force along each axis, `[3 n + i]`; without the near field when there is one.
    nodal: ByAxis,
    near: Option<Near>,
}

/// Largest Poisson's ratio that second-order displacement elements answer for without visible locking.
const LARGEST_POISSON_RATIO: f64 = 0.4999;

impl Model {
    /// Puts elements of the given order on `mesh`, holds the named surface and factors the stiffness.
    pub fn new(mesh: &TetMesh, order: Order, poisson_ratio: f64, fixed: &str) -> Result<Self, FemError> {
        if !(poisson_ratio > -1.0 && poisson_ratio <= LARGEST_POISSON_RATIO) {
            return Err(FemError::PoissonRatio { poisson_ratio });
        }
        let space = Space::new(mesh, order)?;
        let held = space.on_surface(fixed);
        if !held.contains(&true) {
            return Err(FemError::NotHeld { surface: fixed.to_owned() });
        }
        let (skeleton, stiffness) =
            Skeleton::with_stiffness(&space, &held, |cell| cell_stiffness(&space, cell, poisson_ratio))?;
        let factor = skeleton.factor(&space, &stiffness, &[], &[], &[])?;
        Ok(Self { space, poisson_ratio, held, skeleton, factor, coupling: OnceLock::new() })
    }

    /// The elements.
    pub fn space(&self) -> &Space {
        &self.space
    }

    /// Its unknowns.
    pub(super) fn skeleton(&self) -> &Skeleton {
        &self.skeleton
    }

    /// Which nodes the known glue holds.
    pub fn held(&self) -> &[bool] {
        &self.held
    }

    /// Poisson's ratio.
    pub fn poisson_ratio(&self) -> f64 {
        self.poisson_ratio
    }

    /// Displacement components solved for.
    pub fn unknowns(&self) -> usize {
        self.skeleton.layout.unknowns()
    }

    /// Responses to a unit force along each axis at each spot. Flat discs carry their near field by the
    /// half-space; everything else is left to the elements.
    pub fn respond(&self, spots: &[&Spot]) -> Result<Vec<Response>, FemError> {
        let near: Vec<Option<Near>> = spots.iter().map(|spot| Near::of(spot, self.poisson_ratio)).collect();
        if near.iter().any(Option::is_some) {
            // Before any thread asks for it.
            self.coupling();
        }
        let loads = spots.par_iter().zip(&near).map(|(spot, near)| match near {
            Some(near) => self.remainder(near),
            None => spot.weights.each_ref().map(|weights| self.weighed(weights)),
        });
        let loads: Vec<[Load; 3]> = loads.collect();
        let mut solved = self.solve(loads.as_flattened())?.into_iter();
        Ok(near
            .into_iter()
            .map(|near| {
                let mut next = || solved.next().unwrap_or_default();
                Response { nodal: [next(), next(), next()], near }
            })
            .collect())
    }

    /// Nodal displacement under loads given as weights on components, for a unit modulus.
    pub fn respond_to(&self, loads: &[Functional]) -> Result<Vec<Vec<f64>>, FemError> {
        self.solve(&loads.iter().map(|weights| self.weighed(weights)).collect::<Vec<_>>())
    }

    /// Nodal displacement under arbitrary nodal forces (`[3 n + i]`, N) for a unit modulus.
    pub fn displace(&self, forces: Vec<Vec<f64>>) -> Result<Vec<Vec<f64>>, FemError> {
        let load = |forces: Vec<f64>| {
            self.weighed(&(0..).zip(forces).filter(|(_, force)| *force != 0.0).collect::<Functional>())
        };
        self.solve(&forces.into_iter().map(load).collect::<Vec<_>>())
    }

    /// Nodal forces of a body force per volume (N/m³): `∫ b N`.
    pub fn body_force(&self, per_volume: &Vec3) -> Vec<f64> {
        let order = self.space.order();
        let rule = tet_quadrature(2);
        let mut force = vec![0.0; self.space.components()];
        for (cell, nodes) in self.space.cells().enumerate() {
            let (_, volume) = barycentric_gradients(&self.space.corners(cell as u32));
            for (l, w) in &rule {
                for (&node, n) in nodes.iter().zip(order.cell_shape(*l)) {
                    for i in 0..3 {
                        force[3 * node as usize + i] += n * w * volume * per_volume[i];
                    }
                }
            }
        }
        force
    }

    /// Nodal displacement under each load.
    fn solve(&self, loads: &[Load]) -> Result<Vec<Vec<f64>>, FemError> {
        let at_rest = |load: &Load| {
            let mut field = vec![0.0; self.space.components()];
            load.prescribed.iter().for_each(|&(component, u)| field[component as usize] = u);
            field
        };
        let mut fields: Vec<Vec<f64>> = loads.iter().map(at_rest).collect();
        let forces: Vec<&[(u32, f64)]> = loads.iter().map(|load| load.forces.as_slice()).collect();
        self.factor.solve_loads(&forces, &self.skeleton.layout.components, &mut fields)?;
        Ok(fields)
    }

    /// A load of weights on components; what is held does not feel it.
    fn weighed(&self, weights: &Functional) -> Load {
        let unknown = &self.skeleton.layout.unknown;
        let on_unknowns = weights.iter().map(|&(component, weight)| (unknown[component as usize], weight));
        Load { forces: on_unknowns.filter(|(unknown, _)| *unknown != HELD).collect(), ..Load::default() }
    }

    /// What a near field leaves to the elements, for a force along each axis.
    fn remainder(&self, near: &Near) -> [Load; 3] {
        let (mut forces, held) = near.remainder(&self.space, &self.held);
        let mut moved = vec![Mat3::zeros(); forces.len()];
        held.iter().for_each(|&(node, u)| moved[node as usize] = u);
        let at = |component: u32| (component as usize / 3, component as usize % 3);
        // What prescribed displacements exert on free components.
        for &(free, held, k) in self.coupling() {
            let ((node, i), (other, l)) = (at(free), at(held));
            let exerted = moved[other].row(l) * k;
            forces[node].row_mut(i).zip_apply(&exerted, |force, exerted| *force -= exerted);
        }
        [0, 1, 2].map(|j| {
            let on = |(component, &unknown)| (unknown, forces[at(component).0][(at(component).1, j)]);
            let on_unknowns = (0..).zip(&self.skeleton.layout.unknown).map(on);
            let prescribed =
                |&(node, u): &(u32, Mat3)| (0..3).map(move |i| (3 * node + i, u[(i as usize, j)]));
            Load {
                forces: on_unknowns.filter(|(unknown, force)| *unknown != HELD && *force != 0.0).collect(),
                prescribed: held.iter().flat_map(prescribed).collect(),
            }
        })
    }

    /// The stiffness between free and held components, worked out when first needed.
    fn coupling(&self) -> &[Coupled] {
        self.coupling.get_or_init(|| self.coupled())
    }

    /// The stiffness between free and held components.
    fn coupled(&self) -> Vec<Coupled> {
        let touching: Vec<u32> = (0..self.space.cells().len() as u32)
            .filter(|&cell| self.space.cell(cell).iter().any(|&n| self.held[n as usize]))
            .collect();
        let side = 3 * self.space.order().cell_nodes();
        let of_cell = |&cell: &u32| {
            let stiffness = cell_stiffness(&self.space, cell, self.poisson_ratio);
            let parts: Vec<usize> = components(self.space.cell(cell)).collect();
            let is_held = |component: usize| self.skeleton.layout.unknown[component] == HELD;
            let mut own: Vec<Coupled> = Vec::new();
            for (a, &free) in parts.iter().enumerate().filter(|(_, c)| !is_held(**c)) {
                for (b, &held) in parts.iter().enumerate().filter(|(_, c)| is_held(**c)) {
                    own.push((free as u32, held as u32, stiffness[a * side + b]));
                }
            }
            own
        };
        // By one thread: who waits for it must not take up another solve, which would wait for itself.
        let mut all: Vec<Coupled> = touching.iter().flat_map(of_cell).collect();
        all.sort_by_key(|&(free, held, _)| (free, held));
        all.dedup_by(|next, sum| {
            let same = (next.0, next.1) == (sum.0, sum.1);
            if same {
                sum.2 += next.2;
            }
            same
        });
        all
    }
}

impl Response {
    /// Nodal displacement for a force along each axis, `[3 n + i]`; without the near field when there is one.
    pub fn elements(&self) -> &[Vec<f64>; 3] {
        &self.nodal
    }

    /// Displacement of a spot: column `j` for a unit force along axis `j`. This is the block `C(spot, load)` of
    /// the compliance; by reciprocity `C(load, spot)` is its transpose.
    pub fn at(&self, spot: &Spot) -> Mat3 {
        let elements = self.of_elements(spot);
        match &self.near {
            Some(near) => elements + near.at(spot),
            None => elements,
        }
    }

    /// [`Response::at`] without the near field.
    pub(super) fn of_elements(&self, spot: &Spot) -> Mat3 {
        Mat3::from_columns(&[0, 1, 2].map(|j: usize| spot.of(&self.nodal[j])))
    }

    /// The near field's part of [`Response::at`]; zero where the elements carry everything.
    pub fn near_at(&self, spot: &Spot) -> Mat3 {
        self.near.as_ref().map_or_else(Mat3::zeros, |near| near.at(spot))
    }

    /// How the mean over the disc `spot` changes as the disc moves along `tangent`, `slope` being its
    /// [`Spot::slope`]: column `j` for a unit force along axis `j`. A disc's own near field moves with it and adds
    /// nothing.
    pub fn slope_at(&self, slope: &[Functional; 3], spot: &Spot, tangent: &Vec3) -> Mat3 {
        let elements = self.slope_of_elements(slope);
        match &self.near {
            Some(near) => elements + near.slope_over(spot, tangent),
            None => elements,
        }
    }

    /// [`Response::slope_at`] without the near field: for a disc that moves together with the loaded one.
    pub fn slope_of_elements(&self, slope: &[Functional; 3]) -> Mat3 {
        Mat3::from_fn(|i, j| slope[i].iter().map(|&(c, w)| w * self.nodal[j][c as usize]).sum())
    }

    /// Displacement of node `node` at `position`: column `j` for a unit force along axis `j`.
    pub fn at_node(&self, node: usize, position: &Vec3) -> Mat3 {
        let elements = Mat3::from_fn(|i, j| self.nodal[j][3 * node + i]);
        match &self.near {
            Some(near) => elements + near.displacement(position),
            None => elements,
        }
    }
}
