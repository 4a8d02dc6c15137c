//! How a body's stiffness varies: stiffness given point by point → element matrices → forces, work, displacement.
//!
//! `K = Σ over cells of ∫ m(x) D[∇u, ∇v] dV` with a factor `m` that may differ from point to point and elastic
//! constants `D` that are the same throughout ([`Constants`]). Displacements of many loads are kept side by side:
//! *fields* are matrices of loads × displacement components.

use super::elasticity::lame;
use super::element::barycentric_gradients;
use super::error::FemError;
use super::model::Model;
use super::skeleton::{HELD, Skeleton, components};
use super::space::Space;
use super::spot::Functional;
use crate::geometry::{Mat3, Vec3};
use crate::sparse::{Factor, SymmetricMatrix};
use nalgebra::{DMatrix, DMatrixView};

/// Elastic constants over the unvaried modulus, or a change of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Constants {
    /// `λ tr ε tr ε'`.
    pub lambda: f64,
    /// `2 μ ε : ε'`.
    pub mu: f64,
    /// Terms `c (P : ε) (Q : ε')` with symmetric `P` and `Q`; together they are symmetric in `ε` and `ε'`.
    pub dyads: Vec<(f64, Mat3, Mat3)>,
}

impl Constants {
    /// An isotropic body of unit modulus.
    pub fn isotropic(poisson_ratio: f64) -> Self {
        let (lambda, mu) = lame(poisson_ratio);
        Self { lambda, mu, dyads: Vec::new() }
    }
}

/// A matrix on some displacement components: of a cell, a face, a node. Symmetric.
#[derive(Debug, Clone)]
pub struct Part {
    /// Components, `3 n + i`.
    pub components: Vec<u32>,
    /// Forces per displacement (per unit of modulus: m), side as many as components.
    pub matrix: DMatrix<f64>,
}

/// `∫ m ∂ₖNₐ ∂ₗN_b dV` of one cell: what any constants need to know of it.
#[derive(Debug, Clone)]
pub struct Moments {
    nodes: usize,
    /// Block `a * nodes + b` is the matrix over `k`, `l`.
    blocks: Vec<Mat3>,
}

impl Moments {
    /// Of a cell, with barycentric points and weights whose sum over points, were `m` one, is 1: `m` times weight.
    ///
    /// A shape function's gradient is linear in the barycentric coordinates, so that `∫ m λᵢ λⱼ` is all that the points
    /// are needed for.
    pub fn new(space: &Space, cell: u32, points: impl IntoIterator<Item = ([f64; 4], f64)>) -> Self {
        let order = space.order();
        let n = order.cell_nodes();
        let (gradient, volume) = barycentric_gradients(&space.corners(cell));
        let mut second = [[0.0; 4]; 4];
        for (l, weight) in points {
            for i in 0..4 {
                for j in 0..=i {
                    second[i][j] += weight * volume * l[i] * l[j];
                }
            }
        }
        let corner: [[Vec3; 10]; 4] = std::array::from_fn(|i| {
            order.cell_gradient(std::array::from_fn(|j| f64::from(u8::from(i == j))), &gradient)
        });
        let mut blocks = vec![Mat3::zeros(); n * n];
        for a in 0..n {
            let weighed: [Vec3; 4] =
                std::array::from_fn(|j| (0..4).map(|i| corner[i][a] * second[i.max(j)][i.min(j)]).sum());
            for b in 0..=a {
                let block: Mat3 = (0..4).map(|j| weighed[j] * corner[j][b].transpose()).sum();
                blocks[a * n + b] = block;
                blocks[b * n + a] = block.transpose();
            }
        }
        Self { nodes: n, blocks }
    }

    /// The stiffness matrix for these constants, row-major, side three times the nodes.
    pub fn stiffness(&self, constants: &Constants) -> Vec<f64> {
        let n = self.nodes;
        let mut k = vec![0.0; 9 * n * n];
        for a in 0..n {
            for b in 0..n {
                let g = &self.blocks[a * n + b];
                let mut block = g * constants.lambda
                    + g.transpose() * constants.mu
                    + Mat3::identity() * (constants.mu * g.trace());
                for (c, p, q) in &constants.dyads {
                    block += p * g * q * *c;
                }
                for i in 0..3 {
                    for j in 0..3 {
                        k[(3 * a + i) * 3 * n + 3 * b + j] = block[(i, j)];
                    }
                }
            }
        }
        k
    }

    /// The stiffness matrix of the cell as a part of a whole.
    pub fn part(&self, space: &Space, cell: u32, constants: &Constants) -> Part {
        let side = 3 * self.nodes;
        Part {
            components: components(space.cell(cell)).map(|c| c as u32).collect(),
            matrix: DMatrix::from_row_slice(side, side, &self.stiffness(constants)),
        }
    }
}

/// Touched components of other fields that are copied at once, where all of them would be another set of fields.
const TOUCHED_AT_ONCE: usize = 256;

/// Nodal forces `δK u` of a change of stiffness, put together part by part, for several fields at once.
#[derive(Debug, Clone)]
pub struct NodalForces<'a> {
    fields: &'a DMatrix<f64>,
    /// Place of each component among those touched.
    place: Vec<u32>,
    touched: Vec<u32>,
    /// Loads × touched components, column by column.
    forces: Vec<f64>,
}

impl<'a> NodalForces<'a> {
    /// None yet, of these fields (loads × components).
    pub fn of(fields: &'a DMatrix<f64>) -> Self {
        Self { fields, place: vec![u32::MAX; fields.ncols()], touched: Vec::new(), forces: Vec::new() }
    }

    /// Adds a part's.
    pub fn add(&mut self, part: &Part) {
        let loads = self.fields.nrows();
        let own = DMatrix::from_fn(loads, part.components.len(), |i, j| {
            self.fields[(i, part.components[j] as usize)]
        }) * &part.matrix;
        for (column, &c) in own.column_iter().zip(&part.components) {
            let place = &mut self.place[c as usize];
            if *place == u32::MAX {
                *place = self.touched.len() as u32;
                self.touched.push(c);
                self.forces.resize(self.forces.len() + loads, 0.0);
            }
            let from = *place as usize * loads;
            self.forces[from..from + loads].iter_mut().zip(&column).for_each(|(f, own)| *f += own);
        }
    }

    /// Their work on other fields: other loads × loads.
    pub fn work(&self, other: &DMatrix<f64>) -> DMatrix<f64> {
        Self::work_of(std::slice::from_ref(self), other).pop().unwrap_or_default()
    }

    /// The work of several that were put together from the same parts in the same order.
    pub fn work_of(all: &[Self], other: &DMatrix<f64>) -> Vec<DMatrix<f64>> {
        let Some(first) = all.first() else { return Vec::new() };
        let loads = first.fields.nrows();
        let mut work = vec![DMatrix::zeros(other.nrows(), loads); all.len()];
        let mut seen = DMatrix::zeros(other.nrows(), first.touched.len().min(TOUCHED_AT_ONCE));
        for (chunk, touched) in first.touched.chunks(TOUCHED_AT_ONCE).enumerate() {
            let mut seen = seen.columns_mut(0, touched.len());
            seen.column_iter_mut()
                .zip(touched)
                .for_each(|(mut seen, &c)| seen.copy_from(&other.column(c as usize)));
            for (work, own) in work.iter_mut().zip(all) {
                let forces = &own.forces[chunk * TOUCHED_AT_ONCE * loads..][..touched.len() * loads];
                let forces = DMatrixView::from_slice(forces, loads, touched.len()).transpose();
                work.gemm(1.0, &seen, &forces, 1.0);
            }
        }
        work
    }

    /// On these components: loads × components.
    pub fn on(&self, components: &[u32]) -> DMatrix<f64> {
        let loads = self.fields.nrows();
        let mut all = DMatrix::zeros(loads, components.len());
        for (mut column, &c) in all.column_iter_mut().zip(components) {
            if let Some(at) = self.place.get(c as usize).filter(|at| **at != u32::MAX) {
                column.copy_from_slice(&self.forces[*at as usize * loads..(*at as usize + 1) * loads]);
            }
        }
        all
    }

    /// On all components.
    pub fn whole(&self) -> DMatrix<f64> {
        self.on(&(0..self.fields.ncols() as u32).collect::<Vec<_>>())
    }
}

/// Unknowns of a body that nothing holds: where glue may give or let go.
pub struct Loose(Skeleton);

/// The stiffness of a body, put together from its cells.
pub struct Stiffness(SymmetricMatrix);

/// A body of the same elements as a model, of another stiffness or hold, factored.
pub struct Varied<'a> {
    skeleton: &'a Skeleton,
    factor: Factor,
    kept: Vec<bool>,
}

impl Model {
    /// The stiffness of the body as it is held, every cell's as given (row-major, side three times its nodes).
    pub fn stiffness(&self, of_cell: impl Fn(u32) -> Vec<f64> + Sync) -> Stiffness {
        Stiffness(self.skeleton().layout.assembled(self.space(), of_cell))
    }

    /// As [`Model::stiffness`], of the body that nothing holds.
    pub fn loose_stiffness(&self, loose: &Loose, of_cell: impl Fn(u32) -> Vec<f64> + Sync) -> Stiffness {
        Stiffness(loose.0.layout.assembled(self.space(), of_cell))
    }

    /// The body of this stiffness and `more` in some cells, held as it is.
    ///
    /// # Errors
    /// What the factorisation refuses.
    pub fn varied(&self, stiffness: &Stiffness, more: &[(u32, Vec<f64>)]) -> Result<Varied<'_>, FemError> {
        let factor = self.skeleton().factor(self.space(), &stiffness.0, more, &[], &[])?;
        Ok(Varied { skeleton: self.skeleton(), factor, kept: Vec::new() })
    }

    /// The unknowns of the body without its hold.
    ///
    /// # Errors
    /// What the analysis refuses.
    pub fn loose(&self) -> Result<Loose, FemError> {
        Ok(Loose(Skeleton::new(self.space(), &vec![false; self.space().nodes().len()])?))
    }

    /// As [`Model::varied`], the hold replaced: components `kept` stay where they are, `springs` pull besides. The stiffness
    /// is that of [`Model::loose_stiffness`].
    ///
    /// # Errors
    /// What the factorisation refuses.
    pub fn varied_hold<'a>(
        &self,
        loose: &'a Loose,
        stiffness: &Stiffness,
        more: &[(u32, Vec<f64>)],
        springs: &[Part],
        kept: Vec<bool>,
    ) -> Result<Varied<'a>, FemError> {
        let factor = loose.0.factor(self.space(), &stiffness.0, more, springs, &kept)?;
        Ok(Varied { skeleton: &loose.0, factor, kept })
    }
}

impl Varied<'_> {
    /// Fields under nodal forces, both loads × components.
    pub fn displace(&self, forces: &DMatrix<f64>) -> Result<DMatrix<f64>, FemError> {
        let (loads, n) = (forces.nrows(), self.skeleton.layout.unknowns());
        let solved = |c: usize| {
            let u = self.skeleton.layout.unknown[c];
            (u != HELD && !self.kept.get(c).is_some_and(|kept| *kept)).then_some(u as usize)
        };
        let mut rhs = vec![0.0; n * loads];
        for (c, force) in forces.column_iter().enumerate() {
            if let Some(u) = solved(c) {
                force.iter().zip(&mut rhs[u * loads..]).for_each(|(force, rhs)| *rhs = *force);
            }
        }
        self.factor.solve_rows_in_place(&mut rhs, loads)?;
        let mut fields = DMatrix::zeros(loads, forces.ncols());
        for (c, mut field) in fields.column_iter_mut().enumerate() {
            if let Some(u) = solved(c) {
                field.copy_from_slice(&rhs[u * loads..][..loads]);
            }
        }
        Ok(fields)
    }
}

/// Nodal forces of loads given as weights on components: loads × components.
pub fn nodal_loads(space: &Space, loads: &[Functional]) -> DMatrix<f64> {
    let mut all = DMatrix::zeros(loads.len(), space.components());
    for (load, functional) in loads.iter().enumerate() {
        functional.iter().for_each(|&(c, w)| all[(load, c as usize)] += w);
    }
    all
}

/// What functionals read of fields (loads × components): functionals × loads.
pub fn readings(functionals: &[Functional], fields: &DMatrix<f64>) -> DMatrix<f64> {
    let mut all = DMatrix::zeros(functionals.len(), fields.nrows());
    for (row, functional) in functionals.iter().enumerate() {
        for &(c, w) in functional {
            for (x, u) in all.row_mut(row).iter_mut().zip(fields.column(c as usize).iter()) {
                *x += w * u;
            }
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::element::{Order, tet_quadrature};
    use crate::fem::{Spot, cell_stiffness};
    use crate::mesh::{Block, block};

    fn slab() -> Model {
        let mesh = block(&Block { size_m: [0.06, 0.05, 0.02], cells: [4, 3, 2] }).expect("a block");
        Model::new(&mesh, Order::P2, 0.45, "z-").expect("held")
    }

    /// Moments with a factor of one and isotropic constants give the stiffness that a model is made of.
    #[test]
    fn moments_give_the_isotropic_stiffness() {
        let model = slab();
        let space = model.space();
        let moments = Moments::new(space, 3, tet_quadrature(2));
        let own = moments.stiffness(&Constants::isotropic(0.45));
        let expected = cell_stiffness(space, 3, 0.45);
        let largest = expected.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        assert!(own.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-12 * largest));
    }

    /// Twice the stiffness gives half the displacement; springs that stiffen to no end hold as the glue does; and the
    /// work of the stiffness on its own fields is that of the loads.
    #[test]
    fn varied_bodies_answer_as_they_must() {
        let model = slab();
        let space = model.space();
        let spot =
            Spot::disc(space, space.surface("z+"), &Vec3::new(0.03, 0.025, 0.02), 0.006).expect("on top");
        let loads = nodal_loads(space, &spot.weights);
        let plain = |c| cell_stiffness(space, c, 0.45);
        let before =
            model.varied(&model.stiffness(plain), &[]).expect("sound").displace(&loads).expect("sound");
        let twice = |c| plain(c).iter().map(|k| 2.0 * k).collect();
        let half =
            model.varied(&model.stiffness(twice), &[]).expect("sound").displace(&loads).expect("sound");
        assert!((&before - half * 2.0).amax() < 1e-12 * before.amax());

        let loose = model.loose().expect("sound");
        let whole = model.loose_stiffness(&loose, plain);
        let more: Vec<(u32, Vec<f64>)> = (0..space.cells().len() as u32).map(|c| (c, plain(c))).collect();
        let doubled = model.varied(&model.stiffness(plain), &more).expect("sound");
        let doubled = doubled.displace(&loads).expect("sound");
        assert!((&before - doubled * 2.0).amax() < 1e-12 * before.amax());
        let held = space.on_surface("z-");
        let components: Vec<u32> =
            (0..space.components()).filter(|c| held[c / 3]).map(|c| c as u32).collect();
        let spring = |k: f64| -> Vec<Part> {
            components
                .iter()
                .map(|&c| Part { components: vec![c], matrix: DMatrix::from_element(1, 1, k) })
                .collect()
        };
        let none = vec![false; space.components()];
        let stiff = model.varied_hold(&loose, &whole, &[], &spring(1e7), none).expect("sound");
        let stiff = stiff.displace(&loads).expect("sound");
        assert!((&before - stiff).amax() < 1e-7 * before.amax());
        let kept = (0..space.components()).map(|c| held[c / 3]).collect();
        let kept = model.varied_hold(&loose, &whole, &[], &[], kept).expect("sound");
        let kept = kept.displace(&loads).expect("sound");
        assert!((&before - kept).amax() < 1e-11 * before.amax());

        let mut forces = NodalForces::of(&before);
        for cell in 0..space.cells().len() as u32 {
            forces.add(&Moments::new(space, cell, tet_quadrature(2)).part(
                space,
                cell,
                &Constants::isotropic(0.45),
            ));
        }
        let read = readings(&spot.weights, &before);
        assert!((forces.work(&before) - &read).amax() < 1e-11 * read.amax());
        let free = forces.whole();
        let off = (0..space.components())
            .filter(|c| !held[c / 3])
            .map(|c| (free.column(c) - loads.column(c)).amax());
        assert!(off.fold(0.0, f64::max) < 1e-10 * loads.amax());
    }
}
