//! Levenberg–Marquardt on modulus, places and stiffnesses, with no shrinkage.

use super::error::InverseError;
use super::problem::{Linearised, Parameter, Problem, State};
use nalgebra::DVector;

/// Largest step of a patch (m), and of a logarithm, in one iteration.
const LONGEST_SHIFT_M: f64 = 6e-3;
const LONGEST_LOG: f64 = 1.5;

/// A step that promises less than this (in units of one squared standard deviation) is not worth taking.
const GOOD_ENOUGH: f64 = 1e-3;

const ITERATIONS: usize = 60;

/// Softness (`E/k` over the patch's own compliance) beyond which a patch is as good as absent, and below which it
/// is as good as glue: the search stays inside.
const SOFTEST: f64 = 1e4;
const STIFFEST: f64 = 1e-4;

/// Minimises the whitened sum of squares from `start`.
///
/// Damping after Marquardt (1963) on the scaled normal equations, its factor steered by the ratio of actual to
/// promised gain (Nielsen 1999). Ends when the promised gain is below a thousandth of a squared standard deviation;
/// running out of iterations before that is an error, not a result.
pub fn refit(problem: &Problem<'_>, start: &State) -> Result<Linearised, InverseError> {
    let mut at = problem.linearise(start)?;
    let mut damping = 1e-3;
    let mut growth = 2.0;
    let mut last_gain = f64::INFINITY;
    for _ in 0..ITERATIONS {
        let normal = at.jacobian.transpose() * &at.jacobian;
        let gradient = at.jacobian.transpose() * &at.residual;
        let mut damped = normal.clone();
        for i in 0..normal.nrows() {
            damped[(i, i)] += damping * normal[(i, i)].max(f64::MIN_POSITIVE);
        }
        let Some(factor) = damped.cholesky() else {
            damping *= growth;
            growth *= 2.0;
            continue;
        };
        let mut step: DVector<f64> = factor.solve(&gradient);
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
        if promised < GOOD_ENOUGH {
            return Ok(at);
        }
        let tried = problem.linearise(&bounded(problem.moved(&at, &step), &at))?;
        let gain = at.chi2() - tried.chi2();
        if gain > 0.0 {
            last_gain = gain;
            let ratio = gain / promised;
            damping = (damping * (1.0 - (2.0 * ratio - 1.0).powi(3)).max(1.0 / 3.0)).max(1e-9);
            growth = 2.0;
            at = tried;
            if gain < GOOD_ENOUGH {
                return Ok(at);
            }
        } else {
            damping *= growth;
            growth *= 2.0;
            if damping > 1e12 {
                // No step however short lowers the misfit any more: a minimum up to rounding, or a bound.
                return Ok(at);
            }
        }
    }
    Err(InverseError::NotConverged { iterations: ITERATIONS, last_gain, misfit: at.chi2() })
}

/// Keeps every softness between glue and absence.
fn bounded(mut state: State, at: &Linearised) -> State {
    for (patch, group) in state.patches.iter_mut().zip(&at.mounted.groups) {
        if patch.softness > 0.0 {
            let own = own_compliance(at, group.discs.start);
            patch.softness = patch.softness.clamp(STIFFEST * own, SOFTEST * own);
        }
    }
    state
}

/// Mean compliance of a disc under its own force (1/m).
pub(super) fn own_compliance(at: &Linearised, disc: usize) -> f64 {
    (0..3).map(|i| at.mounted.blocks.discs_discs[(3 * disc + i, 3 * disc + i)]).sum::<f64>() / 3.0
}
