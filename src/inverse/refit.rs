//! Levenberg–Marquardt on modulus, places and stiffnesses, with no shrinkage.

use super::error::InverseError;
use super::problem::{Linearised, Parameter, Problem, State};
use crate::fem::disc_self_compliance;
use nalgebra::DVector;

/// Largest step of a patch (m), and of a logarithm, in one iteration.
const LONGEST_SHIFT_M: f64 = 6e-3;
const LONGEST_LOG: f64 = 1.5;

/// A step that promises less than this, in units of what is left per reading, is not worth taking.
pub(super) const GOOD_ENOUGH: f64 = 1e-3;

const ITERATIONS: usize = 60;

/// Softness (`E/k` over the phantom's local compliance under the patch) beyond which a patch is as good as absent, and below which it
/// is as good as glue: the search stays inside.
const SOFTEST: f64 = 1e4;
const STIFFEST: f64 = 1e-4;

/// Damping of the normal equations after Marquardt (1963), scaled by their diagonal and steered by the ratio of
/// actual to promised gain (Nielsen 1999).
pub(super) struct Damping {
    factor: f64,
    growth: f64,
}

impl Default for Damping {
    fn default() -> Self {
        Self { factor: 1e-3, growth: 2.0 }
    }
}

impl Damping {
    /// A step from `at` against `residual`, no longer than allowed, and the gain that it promises; `None` when the
    /// damped equations are still not positive definite.
    pub(super) fn step(&self, at: &Linearised, residual: &DVector<f64>) -> Option<(DVector<f64>, f64)> {
        let normal = at.jacobian.transpose() * &at.jacobian;
        let gradient = at.jacobian.transpose() * residual;
        let mut damped = normal.clone();
        for i in 0..normal.nrows() {
            damped[(i, i)] += self.factor * normal[(i, i)].max(f64::MIN_POSITIVE);
        }
        let mut step: DVector<f64> = damped.cholesky()?.solve(&gradient);
        let longest = at
            .parameters
            .iter()
            .zip(step.iter())
            .map(|(p, s)| {
                s.abs() / if matches!(p, Parameter::Shift(..)) { LONGEST_SHIFT_M } else { LONGEST_LOG }
            })
            .fold(1.0, f64::max);
        step /= longest;
        let promised = 2.0 * step.dot(&gradient) - (&normal * &step).dot(&step);
        Some((step, promised))
    }

    /// After a step that kept `ratio` of its promise.
    pub(super) fn accepted(&mut self, ratio: f64) {
        self.factor = (self.factor * (1.0 - (2.0 * ratio - 1.0).powi(3)).max(1.0 / 3.0)).max(1e-9);
        self.growth = 2.0;
    }

    /// After a step that failed. True when steps have become too short to matter.
    pub(super) fn refused(&mut self) -> bool {
        self.factor *= self.growth;
        self.growth *= 2.0;
        self.factor > 1e9
    }
}

/// Minimises the whitened sum of squares from `start`.
///
/// Ends when the promised gain is below a thousandth of what is left per reading; running out of iterations before
/// that is an error, not a result.
pub fn refit(problem: &Problem<'_>, start: &State) -> Result<Linearised, InverseError> {
    let mut at = problem.linearise(start)?;
    let mut damping = Damping::default();
    let mut last_gain = f64::INFINITY;
    for _ in 0..ITERATIONS {
        let enough = GOOD_ENOUGH * unit(&at);
        let Some((step, promised)) = damping.step(&at, &at.residual) else {
            damping.refused();
            continue;
        };
        if promised < enough {
            return Ok(at);
        }
        let tried = problem.linearise(&bounded(problem.moved(&at, &step), problem))?;
        let gain = at.chi2() - tried.chi2();
        if gain > 0.0 {
            last_gain = gain;
            damping.accepted(gain / promised);
            at = tried;
            if gain < enough {
                return Ok(at);
            }
        } else if damping.refused() {
            // No step however short lowers the misfit any more: a minimum up to rounding, or a bound.
            return Ok(at);
        }
    }
    Err(InverseError::NotConverged { iterations: ITERATIONS, last_gain, misfit: at.chi2() })
}

/// What is left per reading, never less than the noise: the unit in which gains are judged.
pub(super) fn unit(at: &Linearised) -> f64 {
    let freedom = at.residual.len().saturating_sub(at.parameters.len()).max(1);
    (at.chi2() / freedom as f64).max(1.0)
}

/// Keeps every softness between glue and absence.
pub(super) fn bounded(mut state: State, problem: &Problem<'_>) -> State {
    for patch in state.patches.iter_mut().filter(|patch| patch.softness > 0.0) {
        let [_, local] = disc_self_compliance(patch.radius_m, problem.bench.model.poisson_ratio());
        patch.softness = patch.softness.clamp(STIFFEST * local, SOFTEST * local);
    }
    state
}
