//! What the observed points do when springs hold search nodes, and how that changes with each of them.
//!
//! With `D = diag(κ)` on the components of the search nodes, the free body's blocks give
//! `E u_S = (I + C_SS D)⁻¹ c_S` and `E u_O = c_O − C_OS D E u_S`. In `s = κ / (κ + κ₀)` nothing is infinite:
//! with `M = diag(1 − s) + κ₀ C_SS diag(s)` and `M q = c_S`,
//!
//! `E u_S = (1 − s) q`,  `E u_O = c_O − κ₀ C_OS (s q)`,  `∂(E u_O)/∂sⱼ = −κ₀ (M⁻¹ C_SO)ⱼᵀ qⱼ`,
//!
//! the last because `I − diag(s)(I − κ₀ C_SS) = Mᵀ`. Nodes with `s = 0` drop out of `M`, so that all costs go
//! with the number of nodes that hold. Observations enter by their components along the columns of
//! `[C_OS c_O]`, to which all predictions belong; the rest of them is pure error.

use crate::inverse::{Condensed, SolveError};
use nalgebra::{DMatrix, DVector, Dyn, LU};

/// The condensed body, made ready for fits.
#[derive(Debug, Clone)]
pub struct NodalProblem {
    /// C_SS (3 Nₛ × 3 Nₛ, 1/m).
    compliance: DMatrix<f64>,
    /// c_S (3 Nₛ, N/m).
    search_load: DVector<f64>,
    /// C_SO in the reduced observations (3 Nₛ × r, 1/m).
    onto_observed: DMatrix<f64>,
    /// Its transpose (r × 3 Nₛ), whose columns lie together.
    from_search: DMatrix<f64>,
    /// c_O in the reduced observations (r, N/m).
    observed_load: DVector<f64>,
    /// Orthonormal columns that reduce observations (3 Nₒ × r).
    reduction: DMatrix<f64>,
    /// κ₀ (m).
    pub(super) kappa0: f64,
}

/// Observed displacements of one body, reduced.
#[derive(Debug, Clone, PartialEq)]
pub struct NodalData {
    /// Components along the reduction (r, m).
    pub(super) reduced: DVector<f64>,
    /// Squared norm of what no prediction reaches (m²).
    pub(super) unreachable_m2: f64,
    /// Standard deviation of one component (m).
    pub(super) sigma_m: f64,
    /// Number of components observed.
    pub(super) count: usize,
}

impl NodalData {
    /// What the information criterion (Schwarz, Annals of Statistics 6, 1978) charges, in χ², for one more thing to
    /// be said about the restraint: the logarithm of the number of observed components.
    pub(super) fn price(&self) -> f64 {
        (self.count as f64).ln()
    }
}

/// The body with springs: prediction and derivatives.
#[derive(Debug, Clone)]
pub(super) struct State {
    support: Vec<usize>,
    s: Vec<f64>,
    /// q on the support (3 a).
    q: DVector<f64>,
    /// M⁻¹ C_SO on the support (3 a × r).
    inverse: DMatrix<f64>,
    /// E u_O, reduced (r).
    pub(super) shape: DVector<f64>,
}

impl NodalProblem {
    /// Prepares `body`.
    ///
    /// # Errors
    /// [`SolveError::Size`] when nothing is observed or searched.
    pub fn new(body: &Condensed) -> Result<Self, SolveError> {
        for (what, found) in
            [("the search nodes", body.search_nodes()), ("the observed points", body.observed_points())]
        {
            if found == 0 {
                return Err(SolveError::Size { what, found, expected: 1 });
            }
        }
        let n = body.search_load.len();
        let mut all = body.observed_search.clone().insert_column(n, 0.0);
        all.set_column(n, &body.observed_load);
        // Columns of one size, so that rounding treats them alike.
        for mut column in all.column_iter_mut() {
            let norm = column.norm();
            if norm > 0.0 {
                column /= norm;
            }
        }
        let reduction = all.qr().q();
        Ok(Self {
            from_search: reduction.tr_mul(&body.observed_search),
            onto_observed: body.observed_search.tr_mul(&reduction),
            observed_load: reduction.tr_mul(&body.observed_load),
            kappa0: n as f64 / body.search_search.trace(),
            compliance: body.search_search.clone(),
            search_load: body.search_load.clone(),
            reduction,
        })
    }

    /// Number of search nodes.
    pub fn nodes(&self) -> usize {
        self.search_load.len() / 3
    }

    /// Reduces observed displacements (3 Nₒ, m) with error of standard deviation `sigma_m` in each component.
    ///
    /// # Errors
    /// [`SolveError::Size`]; [`SolveError::BadValue`] for a standard deviation that is not positive.
    pub fn reduce(&self, observed: &DVector<f64>, sigma_m: f64) -> Result<NodalData, SolveError> {
        let expected = self.reduction.nrows();
        if observed.len() != expected {
            return Err(SolveError::Size { what: "the observation", found: observed.len(), expected });
        }
        if !(sigma_m > 0.0 && sigma_m.is_finite()) {
            let expected = "finite and positive";
            return Err(SolveError::BadValue {
                what: "the standard deviation",
                index: 0,
                value: sigma_m,
                expected,
            });
        }
        let reduced = self.reduction.tr_mul(observed);
        let unreachable_m2 = (observed - &self.reduction * &reduced).norm_squared();
        Ok(NodalData { reduced, unreachable_m2, sigma_m, count: expected })
    }

    /// κ of a spring in units of s, and back: `k = E κ₀ s / (1 − s)` (N/m), infinite at 1.
    pub fn stiffness(&self, young_modulus_pa: f64, s: f64) -> f64 {
        young_modulus_pa * self.kappa0 * s / (1.0 - s)
    }

    /// s of a spring of `stiffness` (N/m, may be infinite) on a body of `young_modulus_pa`.
    pub fn saturation(&self, young_modulus_pa: f64, stiffness: f64) -> f64 {
        let kappa = stiffness / young_modulus_pa;
        if kappa.is_infinite() { 1.0 } else { kappa / (kappa + self.kappa0) }
    }

    /// Displacements of the search nodes (3 Nₛ, m) and of the observed points (3 Nₒ, m) of a body of
    /// `young_modulus_pa` with the springs `stiffness` (one a search node, N/m, infinite where held).
    ///
    /// # Errors
    /// [`SolveError::Size`]; [`SolveError::NotPositiveDefinite`] for springs below zero that undo the body.
    pub fn displace(
        &self,
        young_modulus_pa: f64,
        stiffness: &[f64],
    ) -> Result<(DVector<f64>, DVector<f64>), SolveError> {
        if stiffness.len() != self.nodes() {
            return Err(SolveError::Size {
                what: "the springs",
                found: stiffness.len(),
                expected: self.nodes(),
            });
        }
        let support: Vec<usize> = (0..self.nodes()).filter(|&j| stiffness[j] != 0.0).collect();
        let s: Vec<f64> = support.iter().map(|&j| self.saturation(young_modulus_pa, stiffness[j])).collect();
        let state = self.state(&support, &s)?;
        Ok((self.search(&state) / young_modulus_pa, &self.reduction * state.shape / young_modulus_pa))
    }

    /// The body with springs `s` on the nodes `support`.
    pub(super) fn state(&self, support: &[usize], s: &[f64]) -> Result<State, SolveError> {
        let rows = components(support);
        if rows.is_empty() {
            let inverse = DMatrix::zeros(0, self.observed_load.len());
            let shape = self.observed_load.clone();
            return Ok(State { support: vec![], s: vec![], q: DVector::zeros(0), inverse, shape });
        }
        let s3 = |r: usize| s[r / 3];
        let m = DMatrix::from_fn(rows.len(), rows.len(), |r, c| {
            let own = if r == c { 1.0 - s3(r) } else { 0.0 };
            own + self.kappa0 * self.compliance[(rows[r], rows[c])] * s3(c)
        });
        let lu: LU<f64, Dyn, Dyn> = m.lu();
        let singular = || SolveError::NotPositiveDefinite { what: "the restrained body", size: rows.len() };
        let q = lu.solve(&self.search_load.select_rows(&rows)).ok_or_else(singular)?;
        let to_observed = self.onto_observed.select_rows(&rows);
        let inverse = lu.solve(&to_observed).ok_or_else(singular)?;
        let held = DVector::from_fn(rows.len(), |r, _| self.kappa0 * s3(r) * q[r]);
        let shape = &self.observed_load - to_observed.tr_mul(&held);
        Ok(State { support: support.to_vec(), s: s.to_vec(), q, inverse, shape })
    }

    /// E u_O, reduced (r), with the same spring κ (m, may be infinite) on all `nodes`.
    pub(super) fn shape_of(&self, nodes: &[usize], kappa: f64) -> Option<DVector<f64>> {
        let rows = components(nodes);
        let mut flexibility =
            DMatrix::from_fn(rows.len(), rows.len(), |r, c| self.compliance[(rows[r], rows[c])]);
        for r in 0..rows.len() {
            flexibility[(r, r)] += 1.0 / kappa;
        }
        let mut pull = DVector::from_fn(rows.len(), |r, _| self.search_load[rows[r]]);
        flexibility.cholesky()?.solve_mut(&mut pull);
        let mut shape = self.observed_load.clone();
        for (r, &row) in rows.iter().enumerate() {
            shape.axpy(-pull[r], &self.from_search.column(row), 1.0);
        }
        Some(shape)
    }

    /// E u_S (3 Nₛ).
    fn search(&self, state: &State) -> DVector<f64> {
        let rows = components(&state.support);
        let mut u = self.search_load.clone();
        for (r, &row) in rows.iter().enumerate() {
            u.axpy(-self.kappa0 * state.s[r / 3] * state.q[r], &self.compliance.column(row), 1.0);
        }
        u
    }

    /// ∂(E u_O)/∂sⱼ, reduced, for the support's nodes in order (r × a).
    pub(super) fn derivatives(&self, state: &State) -> DMatrix<f64> {
        let columns = (0..state.support.len()).map(|j| {
            let block = state.inverse.rows(3 * j, 3);
            block.tr_mul(&state.q.rows(3 * j, 3)) * -self.kappa0
        });
        columns_of(columns.collect(), state.shape.len())
    }
}

fn components(nodes: &[usize]) -> Vec<usize> {
    nodes.iter().flat_map(|&j| 3 * j..3 * j + 3).collect()
}

fn columns_of(columns: Vec<DVector<f64>>, rows: usize) -> DMatrix<f64> {
    if columns.is_empty() { DMatrix::zeros(rows, 0) } else { DMatrix::from_columns(&columns) }
}
