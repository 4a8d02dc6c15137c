//! Step one: Young's modulus and the displacements of all search nodes from the observed displacements, by
//! regularised Gauss–Newton (equations 1, 3, 4, 6 and the two stopping rules).
//!
//! In: the condensed body, observed displacements (3 Nₒ, m), the norm of their error (m). Out: modulus (Pa),
//! search displacements (3 Nₛ, m), Ψ (m²) and why the iteration ended.

use super::basis::Basis;
use super::spectrum::{greatest, raised};
use crate::inverse::{Condensed, SolveError};
use nalgebra::{DMatrix, DVector};

/// The matrix that α multiplies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Regularisation {
    /// The Hessian of the deformation energy.
    Energy,
    /// The unit matrix on `[E; S]` in Pa and m, as printed. It holds the modulus where it started: one pascal
    /// weighs as much as one metre.
    Unit,
    /// The unit matrix on `[E / E₀; S / s₀]`, both relative to the start: the benevolent reading.
    UnitScaled,
    /// Nothing.
    None,
}

/// How the two stopping rules are joined.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Joined {
    /// The iteration ends when both hold.
    Both,
    /// It ends when either holds.
    Either,
}

/// Where the iteration starts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    /// Young's modulus (Pa).
    pub young_modulus_pa: f64,
    /// Every component of every search displacement (m).
    pub displacement_m: f64,
}

/// Start, bounds and stopping rules.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepOneRules {
    /// Where it starts.
    pub start: Start,
    /// Greatest modulus of a search displacement's component (m).
    pub bound_m: f64,
    /// How the stopping rules are joined.
    pub joined: Joined,
    /// Second stopping rule: smallest relative change of Ψ worth another step (0.01 in the paper).
    pub least_change: f64,
    /// Most steps.
    pub steps: usize,
}

impl StepOneRules {
    /// Those of the block in section 3.1.
    pub const BLOCK: Self = Self {
        start: Start { young_modulus_pa: 6000.0, displacement_m: 0.5 },
        bound_m: 1.0,
        joined: Joined::Both,
        least_change: 0.01,
        steps: 200,
    };

    /// Those of the phantom in section 3.2. The paper names no bound there: a phantom 25 mm thick does not move
    /// by more than 20 mm.
    pub const PHANTOM: Self = Self {
        start: Start { young_modulus_pa: 10_000.0, displacement_m: 1e-4 },
        bound_m: 0.02,
        ..Self::BLOCK
    };
}

/// What step one found.
#[derive(Debug, Clone, PartialEq)]
pub struct StepOneFit {
    /// Young's modulus (Pa).
    pub young_modulus_pa: f64,
    /// Displacements of the search nodes (3 Nₛ, m).
    pub search_m: DVector<f64>,
    /// Displacements of the observed points by the model (3 Nₒ, m).
    pub observed_m: DVector<f64>,
    /// Mean square residual of a point Ψ (m²), equation 1.
    pub psi_m2: f64,
    /// Ψ before every step and at the end (m²).
    pub history_m2: Vec<f64>,
    /// Regularisation parameter of the last step.
    pub alpha: f64,
    /// Components of the search displacements that lie on their bound.
    pub at_bound: usize,
}

/// Step one, prepared for any number of observations of one body under one load.
#[derive(Debug, Clone)]
pub struct StepOne {
    regularisation: Regularisation,
    /// G (3 Nₒ × 3 Nₛ): observed displacement per search displacement.
    jacobian: DMatrix<f64>,
    /// c (3 Nₒ, N/m): E times the observed displacement with all search nodes held at zero.
    held_load: DVector<f64>,
    /// w (N²/m): E times the work of the load on that displacement.
    held_work: f64,
    /// Greatest eigenvalue of `C_SS⁻¹` (m).
    stiffest: f64,
    basis: Basis,
    /// Eigenvalues of `G Gᵀ` with the components of c along their vectors, and last a zero with what of c lies
    /// outside the range of G.
    modes: (DVector<f64>, DVector<f64>),
}

impl StepOne {
    /// Prepares the iteration on `body`.
    ///
    /// # Errors
    /// [`SolveError::NotPositiveDefinite`] for search nodes that are held or named twice.
    pub fn new(body: &Condensed, regularisation: Regularisation) -> Result<Self, SolveError> {
        let factor = body.search_factor()?;
        let lower = factor.l();
        // L⁻¹ C_SO, then G = C_OS C_SS⁻¹ = (L⁻ᵀ L⁻¹ C_SO)ᵀ.
        let mut whitened = body.observed_search.transpose();
        lower.solve_lower_triangular_mut(&mut whitened);
        let mut transposed = whitened.clone();
        lower.tr_solve_lower_triangular_mut(&mut transposed);
        let jacobian = transposed.transpose();
        let held_load = &body.observed_load - &jacobian * &body.search_load;
        let held_work = body.load_load - body.search_load.dot(&factor.solve(&body.search_load));
        let basis = match regularisation {
            // R = C_SS⁻¹, T = L, J_S T = G L = (L⁻¹ C_SO)ᵀ.
            Regularisation::Energy => Basis::new(&whitened.transpose(), |right| &lower * right),
            _ => Basis::new(&jacobian, |right| right),
        };
        let stiffest = greatest(body.search_load.len(), |v| factor.solve(v));
        let modes = match regularisation {
            Regularisation::Energy => modes(&Basis::new(&jacobian, |right| right), &held_load),
            _ => modes(&basis, &held_load),
        };
        Ok(Self { regularisation, jacobian, held_load, held_work, stiffest, basis, modes })
    }

    /// Runs the iteration on displacements `observed` (3 Nₒ, m) whose error has the norm `error` (m, over all
    /// components).
    ///
    /// # Errors
    /// [`SolveError::StepOne`] with the last state when the steps run out; [`SolveError::Size`]; [`SolveError::BadValue`] for
    /// observations not larger than their error.
    pub fn fit(
        &self,
        observed: &DVector<f64>,
        error: f64,
        rules: &StepOneRules,
    ) -> Result<StepOneFit, SolveError> {
        if observed.len() != self.held_load.len() {
            let expected = self.held_load.len();
            return Err(SolveError::Size { what: "the observation", found: observed.len(), expected });
        }
        if !(error >= 0.0 && error < observed.norm()) {
            let expected = "not negative and below the norm of the observation";
            return Err(SolveError::BadValue {
                what: "the norm of the error",
                index: 0,
                value: error,
                expected,
            });
        }
        let start = rules.start;
        let mut modulus = start.young_modulus_pa;
        let mut search = DVector::from_element(self.jacobian.ncols(), start.displacement_m);
        let points = (observed.len() / 3) as f64;
        let mut history = Vec::new();
        let mut alpha = 0.0;
        loop {
            let modelled = &self.held_load / modulus + &self.jacobian * &search;
            let residual = observed - &modelled;
            let psi = residual.norm_squared() / points;
            let step = history.len();
            history.push(psi);
            let below = psi.sqrt() < 2.0 * error / points.sqrt();
            let stands = step > 1 && (psi - history[step - 1]).abs() / history[step - 1] < rules.least_change;
            let stop = match rules.joined {
                Joined::Both => (below || error == 0.0) && stands,
                Joined::Either => below || stands,
            };
            if stop || step == rules.steps {
                let at_bound = search.iter().filter(|s| s.abs() >= rules.bound_m).count();
                let last = StepOneFit {
                    young_modulus_pa: modulus,
                    search_m: search,
                    observed_m: modelled,
                    psi_m2: psi,
                    history_m2: history,
                    alpha,
                    at_bound,
                };
                return if stop {
                    Ok(last)
                } else {
                    Err(SolveError::StepOne { error_m: error, last: Box::new(last) })
                };
            }
            let (d_modulus, d_search);
            (alpha, d_modulus, d_search) = self.step(modulus, &residual, observed.norm(), error, &start);
            modulus =
                (modulus + d_modulus).clamp(1e-3 * start.young_modulus_pa, 1e3 * start.young_modulus_pa);
            search += d_search;
            search.apply(|s| *s = s.clamp(-rules.bound_m, rules.bound_m));
        }
    }

    /// α and the Gauss–Newton step (equation 3) for modulus and search displacements.
    fn step(
        &self,
        modulus: f64,
        residual: &DVector<f64>,
        observed_norm: f64,
        error: f64,
        start: &Start,
    ) -> (f64, f64, DVector<f64>) {
        let column = &self.held_load * (-1.0 / (modulus * modulus));
        // The regulariser: `on_search` times the unit of the basis, `on_modulus`, and its spectral norm. `unit`
        // is what one unit of W's search part is, which α's ‖A‖ needs.
        let (on_search, on_modulus, norm, units) = match self.regularisation {
            Regularisation::Energy => {
                let of_modulus = self.held_work / modulus.powi(3);
                (modulus, of_modulus, of_modulus.max(modulus * self.stiffest), (1.0, 1.0))
            }
            Regularisation::Unit => (1.0, 1.0, 1.0, (1.0, 1.0)),
            Regularisation::UnitScaled => {
                let units = (start.young_modulus_pa, start.displacement_m);
                (units.1.powi(-2), units.0.powi(-2), 1.0, units)
            }
            Regularisation::None => (0.0, 0.0, f64::INFINITY, (1.0, 1.0)),
        };
        let alpha = self.sensitivity_norm2(modulus, units) * error / ((observed_norm - error) * norm);
        let Basis { observed, search, singular } = &self.basis;
        let onto_residual = observed.tr_mul(residual);
        let onto_column = observed.tr_mul(&column);
        let stiffness = singular.map(|s| s * s + alpha * on_search);
        let mut pivot = column.norm_squared() + alpha * on_modulus;
        let mut right = column.dot(residual);
        for i in 0..singular.len() {
            let weight = singular[i].powi(2) / stiffness[i];
            pivot -= weight * onto_column[i].powi(2);
            right -= weight * onto_column[i] * onto_residual[i];
        }
        // A pivot lost to rounding means that search displacements can do all that the modulus can.
        let d_modulus = if pivot > f64::EPSILON * column.norm_squared() { right / pivot } else { 0.0 };
        let coordinates = DVector::from_fn(singular.len(), |i, _| {
            singular[i] * (onto_residual[i] - onto_column[i] * d_modulus) / stiffness[i]
        });
        (alpha, d_modulus, search * coordinates)
    }

    /// ‖A‖² (spectral) of `A = [−c / E², G]` in the given units of modulus and displacement: the greatest
    /// eigenvalue of `G Gᵀ + c cᵀ / E⁴`, a diagonal and one vector in the modes of G.
    fn sensitivity_norm2(&self, modulus: f64, units: (f64, f64)) -> f64 {
        let (square, along) = &self.modes;
        raised(&(square * (units.1 * units.1)), &(along * (units.0 / (modulus * modulus))))
    }
}

/// See [`StepOne::modes`].
fn modes(of: &Basis, vector: &DVector<f64>) -> (DVector<f64>, DVector<f64>) {
    let along = of.observed.tr_mul(vector);
    let outside = (vector.norm_squared() - along.norm_squared()).max(0.0).sqrt();
    let n = along.len();
    (of.singular.map(|s| s * s).insert_row(n, 0.0), along.insert_row(n, outside))
}
