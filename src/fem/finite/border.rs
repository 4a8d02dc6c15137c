//! Newton's linear system with ties: sparse tangent, few extra unknowns.
//!
//! ```text
//! ⎡ K   B ⎤ ⎡δu⎤   ⎡ r ⎤      B: one column b_j a tie, over the free components
//! ⎣ Bᵀ −C ⎦ ⎣δλ⎦ = ⎣−g ⎦      C = diag(1/k_j) for springs, 0 for rigid ties
//! ```
//! A tie couples all nodes of its patch, which would fill the sparse matrix. Instead, with X = K⁻¹B and
//! y = K⁻¹r: (Bᵀ X + C) δλ = Bᵀ y + g and δu = y − X δλ (Schur complement; Golub & Van Loan 2013, section 4.4,
//! where it is the block elimination of a saddle point). For springs this is the Woodbury formula.
//! A spring without stiffness takes no part.
//!
//! *Braces.* Where the body has room for it, ρ b bᵀ is added to K for a rigid tie, and −ρ b g to r. As b·δu = −g
//! the solution stays the same, but K + ρ b bᵀ is positive definite, for ρ large enough, as soon as K is along
//! directions that keep b·u: stability with the pad's displacement given, not its force (Nocedal & Wright 2006,
//! theorem 17.5). ρ = bᵀKb/(bᵀb)² is the stiffness against moving the loaded nodes alone, more than that against
//! the tie as the whole body yields, and leaves the largest eigenvalue of K what it was.

use super::{FiniteError, HeldBody, Tie, TieKind};
use crate::sparse::{Factor, SymmetricMatrix};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rayon::prelude::*;
use std::sync::Arc;

/// A tie counts as dependent on others when they leave less than this share of its own compliance.
const INDEPENDENCE: f64 = 1e-10;

/// A column of B: unknown, weight.
type Column = Vec<(usize, f64)>;

/// A factored system.
pub(super) struct Border {
    factor: Arc<Factor>,
    /// Which ties take part.
    active: Vec<usize>,
    /// Number of all ties.
    ties: usize,
    /// Columns of B by active tie: unknown, weight.
    columns: Vec<Column>,
    /// ρ by active tie (N/m).
    braces: Vec<f64>,
    /// X, column-major.
    spread: Vec<f64>,
    /// Bᵀ X + C.
    schur: Option<Cholesky<f64, Dyn>>,
}

/// Right-hand sides for a factored system.
pub(super) struct System<'a> {
    pub(super) border: &'a Border,
    /// Over the free components; δu once it is solved.
    pub(super) r: Vec<f64>,
    /// One a tie.
    pub(super) g: Vec<f64>,
}

impl Border {
    /// Braces and factors the tangent, `fraction` of the load being asked for, and eliminates it.
    pub(super) fn new(
        body: &HeldBody,
        ties: &[Tie],
        mut tangent: SymmetricMatrix,
        fraction: f64,
    ) -> Result<Self, FiniteError> {
        let (active, columns) = columns(body, ties);
        let unknowns = |column: &[(usize, f64)]| column.iter().map(|&(x, _)| x as u32).collect::<Vec<u32>>();
        let braces: Vec<f64> = active
            .iter()
            .zip(&columns)
            .map(|(&j, column)| {
                let has_room = ties[j].kind == TieKind::Rigid && body.has_room_for(&unknowns(column));
                if has_room { stiffness_along(&tangent, column) } else { 0.0 }
            })
            .collect();
        for (column, rho) in columns.iter().zip(&braces).filter(|(_, rho)| **rho > 0.0) {
            let square = column.iter().flat_map(|p| column.iter().map(move |q| rho * p.1 * q.1));
            tangent.add_element(&unknowns(column), &square.collect::<Vec<f64>>());
        }
        let factor = Arc::new(body.factor(&tangent, fraction)?);
        drop(tangent);
        Self::eliminate(factor, ties, active, columns, braces)
    }

    /// The system of a tangent that is factored already, without braces.
    pub(super) fn over(factor: Arc<Factor>, body: &HeldBody, ties: &[Tie]) -> Result<Self, FiniteError> {
        let (active, columns) = columns(body, ties);
        let braces = vec![0.0; active.len()];
        Self::eliminate(factor, ties, active, columns, braces)
    }

    /// Eliminates the tangent.
    fn eliminate(
        factor: Arc<Factor>,
        ties: &[Tie],
        active: Vec<usize>,
        columns: Vec<Column>,
        braces: Vec<f64>,
    ) -> Result<Self, FiniteError> {
        let n = factor.dimension();
        let mut spread = vec![0.0; n * active.len()];
        for (column, x) in columns.iter().zip(spread.chunks_exact_mut(n)) {
            for &(unknown, weight) in column {
                x[unknown] += weight;
            }
        }
        let mut border = Self { factor, active, ties: ties.len(), columns, braces, spread, schur: None };
        let m = border.active.len();
        if m > 0 {
            border.factor.solve_in_place(&mut border.spread, m)?;
            let mut schur = DMatrix::zeros(m, m);
            for (row, column) in (0..m).flat_map(|row| (0..=row).map(move |column| (row, column))) {
                let value = border.pull(row, &border.spread[column * n..][..n]);
                schur[(row, column)] = value;
                schur[(column, row)] = value;
            }
            for (at, &j) in border.active.iter().enumerate() {
                schur[(at, at)] += ties[j].compliance().unwrap_or(0.0);
            }
            let own = schur.diagonal();
            let dependent = FiniteError::TiesDependent { ties: ties.len() };
            let Some(cholesky) = Cholesky::new(schur) else { return Err(dependent) };
            let left = cholesky.l_dirty().diagonal();
            if left.iter().zip(&own).any(|(l, own)| l * l <= INDEPENDENCE * own) {
                return Err(dependent);
            }
            border.schur = Some(cholesky);
        }
        Ok(border)
    }

    /// Solves for δu (over `r`, which it replaces) and δλ (one a tie; 0 for those that take no part).
    pub(super) fn solve(&self, r: &mut [f64], g: &[f64]) -> Result<Vec<f64>, FiniteError> {
        self.brace(r, g);
        self.factor.solve_in_place(r, 1)?;
        Ok(self.tie(r, g))
    }

    /// As [`Border::solve`] for many systems; what is over one factor reads that once for all. δλ of each.
    pub(super) fn solve_together(systems: &mut [System<'_>]) -> Result<Vec<Vec<f64>>, FiniteError> {
        systems.par_iter_mut().for_each(|one| one.border.brace(&mut one.r, &one.g));
        let mut left: Vec<&mut System<'_>> = systems.iter_mut().collect();
        while let Some(first) = left.first() {
            let factor = Arc::clone(&first.border.factor);
            let (mut these, others): (Vec<_>, Vec<_>) =
                left.into_iter().partition(|one| Arc::ptr_eq(&one.border.factor, &factor));
            let mut all: Vec<f64> = these.iter().flat_map(|one| one.r.iter().copied()).collect();
            factor.solve_in_place(&mut all, these.len())?;
            let solved = all.chunks_exact(factor.dimension());
            these.iter_mut().zip(solved).for_each(|(one, solved)| one.r.copy_from_slice(solved));
            left = others;
        }
        Ok(systems.par_iter_mut().map(|one| one.border.tie(&mut one.r, &one.g)).collect())
    }

    /// What braces add to a right-hand side.
    fn brace(&self, r: &mut [f64], g: &[f64]) {
        for ((&j, column), rho) in self.active.iter().zip(&self.columns).zip(&self.braces) {
            for &(unknown, weight) in column {
                r[unknown] -= rho * g[j] * weight;
            }
        }
    }

    /// From K⁻¹r, which it replaces by δu, to δλ.
    fn tie(&self, r: &mut [f64], g: &[f64]) -> Vec<f64> {
        let mut multipliers = vec![0.0; self.ties];
        if let Some(schur) = &self.schur {
            let rhs = self.active.iter().enumerate().map(|(at, &j)| self.pull(at, r) + g[j]);
            let change = schur.solve(&DVector::from_iterator(self.active.len(), rhs));
            let n = self.factor.dimension();
            for (at, &j) in self.active.iter().enumerate() {
                multipliers[j] = change[at];
                for (r, x) in r.iter_mut().zip(&self.spread[at * n..][..n]) {
                    *r -= change[at] * x;
                }
            }
        }
        multipliers
    }

    /// b · x of an active tie over the free components.
    fn pull(&self, at: usize, x: &[f64]) -> f64 {
        self.columns[at].iter().map(|&(unknown, weight)| weight * x[unknown]).sum()
    }
}

/// The ties that take part, and their columns of B.
fn columns(body: &HeldBody, ties: &[Tie]) -> (Vec<usize>, Vec<Column>) {
    let active: Vec<usize> = (0..ties.len()).filter(|&j| ties[j].compliance().is_some()).collect();
    let column = |&j: &usize| -> Column {
        let free = ties[j].functional.iter();
        free.filter_map(|&(c, w)| body.unknown(c).map(|x| (x as usize, w))).collect()
    };
    let columns = active.iter().map(column).collect();
    (active, columns)
}

/// |bᵀKb|/(bᵀb)² (N/m).
fn stiffness_along(tangent: &SymmetricMatrix, b: &[(usize, f64)]) -> f64 {
    let mut x = vec![0.0; tangent.pattern().dimension()];
    b.iter().for_each(|&(unknown, weight)| x[unknown] = weight);
    let mut product = vec![0.0; x.len()];
    tangent.multiply(&x, &mut product);
    let square: f64 = b.iter().map(|(_, weight)| weight * weight).sum();
    let energy: f64 = b.iter().map(|&(unknown, weight)| weight * product[unknown]).sum();
    if square > 0.0 { energy.abs() / (square * square) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::finite::Solid;
    use crate::fem::material::{Law, Material, Moduli};
    use crate::fem::{Order, Space, Spot};
    use crate::geometry::Vec3;
    use crate::mesh::{Block, block};

    /// One over a factor of its own, braced, between two that share another: each as it is alone.
    #[test]
    fn systems_that_are_solved_together_are_told_apart() {
        let mesh = block(&Block { size_m: [0.03, 0.02, 0.02], cells: [3, 2, 2] }).expect("a block");
        let space = Arc::new(Space::new(&mesh, Order::P2).expect("a space"));
        let pad = |x: f64| -> [Vec<(u32, f64)>; 3] {
            let centre = Vec3::new(x, 0.01, 0.02);
            Spot::disc(&space, space.surface("z+"), &centre, 0.006).expect("on top").weights
        };
        let held: Vec<bool> = space.on_surface("z-").into_iter().flat_map(|on| [on; 3]).collect();
        let body = HeldBody::with_pads(Arc::clone(&space), &held, &[pad(0.01)]).expect("held");
        let moduli = Moduli::new(1e4, 0.45).expect("a proper solid");
        let solid = Solid::homogeneous(Material::new(moduli, Law::Linear).expect("a proper law"));
        let rest = vec![0.0; space.components()];
        let tangent = || body.linear(&solid, &rest, &[]).expect("sound").tangent;
        let ties = |x: f64| Tie::pad(&pad(x), &Vec3::zeros()).to_vec();
        let factor = Arc::new(body.factor(&tangent(), 1.0).expect("positive definite"));
        let over = |x: f64| Border::over(Arc::clone(&factor), &body, &ties(x)).expect("independent");
        let own = Border::new(&body, &ties(0.01), tangent(), 1.0).expect("independent");
        let borders = [over(0.01), own, over(0.02)];
        assert!(borders[1].braces.iter().all(|brace| *brace > 0.0));
        let system = |(i, border)| {
            let r = (0..body.free().len()).map(|c| 1e-3 * ((c + i) % 7) as f64).collect();
            let g = (0..3).map(|j| 1e-3 * (j + i + 1) as f64).collect();
            System { border, r, g }
        };
        let mut systems: Vec<System<'_>> = borders.iter().enumerate().map(system).collect();
        let pulls = Border::solve_together(&mut systems).expect("solvable");
        for (i, (one, pull)) in systems.iter().zip(&pulls).enumerate() {
            let System { mut r, g, .. } = system((i, one.border));
            let alone = one.border.solve(&mut r, &g).expect("solvable");
            let close = |a: &[f64], b: &[f64]| {
                let largest = b.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
                a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-10 * largest)
            };
            assert!(close(&one.r, &r) && close(pull, &alone), "{i}: {pull:?} {alone:?}");
        }
    }
}
