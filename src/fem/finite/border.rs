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

use super::{FiniteError, HeldBody, Tie};
use crate::sparse::Factor;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// A tie counts as dependent on others when they leave less than this share of its own compliance.
const INDEPENDENCE: f64 = 1e-10;

/// A factored system.
pub(super) struct Border {
    factor: Factor,
    /// Which ties take part.
    active: Vec<usize>,
    /// Number of all ties.
    ties: usize,
    /// Columns of B by active tie: unknown, weight.
    columns: Vec<Vec<(usize, f64)>>,
    /// X, column-major.
    spread: Vec<f64>,
    /// Bᵀ X + C.
    schur: Option<Cholesky<f64, Dyn>>,
}

impl Border {
    /// Prepares the system; K is already factored.
    pub(super) fn new(body: &HeldBody, ties: &[Tie], factor: Factor) -> Result<Self, FiniteError> {
        let n = factor.dimension();
        let active: Vec<usize> = (0..ties.len()).filter(|&j| ties[j].compliance().is_some()).collect();
        let columns: Vec<Vec<(usize, f64)>> = active
            .iter()
            .map(|&j| {
                let free = ties[j].functional.iter();
                free.filter_map(|&(c, w)| body.unknown(c).map(|x| (x as usize, w))).collect()
            })
            .collect();
        let mut spread = vec![0.0; n * active.len()];
        for (column, x) in columns.iter().zip(spread.chunks_exact_mut(n)) {
            for &(unknown, weight) in column {
                x[unknown] += weight;
            }
        }
        let mut border = Self { factor, active, ties: ties.len(), columns, spread, schur: None };
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
        self.factor.solve_in_place(r, 1)?;
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
        Ok(multipliers)
    }

    /// b · x of an active tie over the free components.
    fn pull(&self, at: usize, x: &[f64]) -> f64 {
        self.columns[at].iter().map(|&(unknown, weight)| weight * x[unknown]).sum()
    }
}
