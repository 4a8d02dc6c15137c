//! Levenberg–Marquardt on modulus, places and stiffnesses, with no shrinkage.

use super::error::InverseError;
use super::problem::{Linearised, Parameter, Problem, State};
use super::rim::Given;
use crate::fem::{FemError, disc_self_compliance};
use nalgebra::DVector;
use std::collections::VecDeque;

/// Largest step of a patch (m), and of a logarithm, in one iteration.
const LONGEST_SHIFT_M: f64 = 6e-3;
const LONGEST_LOG: f64 = 1.5;
const LONGEST_LOG_RADIUS: f64 = 0.4;

/// A step that promises less than this, in units of what is left per reading, is not worth taking: it moves nothing by
/// more than a tenth of its standard deviation.
pub(super) const GOOD_ENOUGH: f64 = 1e-2;

const ITERATIONS: usize = 60;

/// Weights and correction have settled when renewing them lets the misfit fall by less than this, in units of what is
/// left per reading: a third of a standard deviation of one parameter at most.
pub(super) const SETTLED: f64 = 0.1;

/// A descent that ends while more than this is still promised, in units of what is left per reading, is not at rest: that is a
/// whole standard deviation.
const STILL_PROMISED: f64 = 1.0;

/// One that ends while more than this is promised has not converged: that is what a patch must bring.
const MOST_PROMISED: f64 = 30.0;

/// Softness (`E/k` over the phantom's local compliance under the patch) beyond which a patch is as good as absent, and below which it
/// is as good as glue: the search stays inside.
const SOFTEST: f64 = 1e4;
const STIFFEST: f64 = 3e-3;

/// So many steps that together gain less than [`SETTLED`] are the last: the misfit is not smooth there, and the others would
/// be like them.
const SLOW: usize = 10;

/// What a descent may gain over the promise of its next step.
const OPTIMISM: f64 = 4.0;

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
    /// A step from `at` with what is `given`, no longer than allowed, and the gain that it promises; `None` when the
    /// damped equations are still not positive definite.
    fn step(&self, at: &Linearised, given: &Given) -> Option<(DVector<f64>, f64)> {
        let normal = at.jacobian.transpose() * &at.jacobian;
        let gradient = at.jacobian.transpose() * &at.residual;
        let damping = normal.diagonal().map(|d| self.factor * d.max(f64::MIN_POSITIVE));
        let mut step = given.least(&normal, &gradient, &damping)?;
        let longest = at
            .parameters
            .iter()
            .zip(step.iter())
            .map(|(p, s)| {
                let longest = match p {
                    Parameter::Shift(..) => LONGEST_SHIFT_M,
                    Parameter::LogRadius(_) => LONGEST_LOG_RADIUS,
                    Parameter::LogModulus | Parameter::LogSoftness(_) => LONGEST_LOG,
                };
                s.abs() / longest
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

/// How a descent ended.
pub(super) struct Descent {
    /// Where.
    pub(super) at: Linearised,
    /// How much the sum of squares fell.
    pub(super) gained: f64,
}

/// Goes down from `start` until the promised gain is below `enough` in units of what is left per reading, or no step
/// however short lowers the misfit any more, or steps run out. A step to where the model has no
/// answer is refused like one that raises the misfit.
pub(super) fn descend(problem: &Problem<'_>, start: &State, enough: f64) -> Result<Descent, InverseError> {
    descend_below(problem, start, enough, f64::INFINITY)
}

/// As [`descend`], but given up where even so many times what a step promises would leave more than `hopeless`.
pub(super) fn descend_below(
    problem: &Problem<'_>,
    start: &State,
    enough: f64,
    hopeless: f64,
) -> Result<Descent, InverseError> {
    let mut at = problem.linearise(start)?;
    let mut damping = Damping::default();
    let start = at.chi2();
    // What the first step promised that was refused since one was taken.
    let mut refused: Option<f64> = None;
    let mut passed = VecDeque::from([start]);
    for _ in 0..ITERATIONS {
        if passed.len() > SLOW && passed[0] - at.chi2() < SETTLED * unit(&at) {
            break;
        }
        let enough = enough * unit(&at);
        let mut given = Given::default();
        let mut step = damping.step(&at, &given);
        let mut moved = step.as_ref().map(|(step, _)| problem.moved(&at, step));
        while moved.as_ref().is_some_and(|moved| given.take(&at, moved)) {
            step = damping.step(&at, &given);
            moved = step.as_ref().map(|(step, _)| problem.moved(&at, step));
        }
        let Some(((_, promised), moved)) = step.zip(moved) else {
            damping.refused();
            continue;
        };
        if promised < enough || at.chi2() - OPTIMISM * promised > hopeless {
            break;
        }
        let inside = moved.held_back.is_empty();
        let tried = where_answered(problem.predicted(&bounded(moved.state, problem)))?;
        match tried.map(|tried| (at.chi2() - tried.residual.norm_squared(), tried)) {
            Some((gain, tried)) if gain > 0.0 => {
                damping.accepted(gain / promised);
                (at, refused) = (problem.linearised(tried)?, None);
                if gain < enough {
                    return Ok(Descent { gained: start - at.chi2(), at });
                }
            }
            _ => {
                // On the rim of the search surface a minimum may promise more beyond it.
                // A second refusal where the first promised less than a standard deviation: the misfit is not smooth at
                // this scale.
                let close = refused.is_some_and(|first| first < STILL_PROMISED * unit(&at));
                refused = refused.or(inside.then_some(promised));
                if damping.refused() || close {
                    break;
                }
            }
        }
        passed.push_back(at.chi2());
        if passed.len() > SLOW + 1 {
            passed.pop_front();
        }
    }
    at.unrest = refused.filter(|promised| *promised > STILL_PROMISED * unit(&at)).unwrap_or(0.0);
    Ok(Descent { gained: start - at.chi2(), at })
}

/// `None` where the model has no answer: a spot off the body, a compliance that is not positive definite.
pub(super) fn where_answered<T>(tried: Result<T, InverseError>) -> Result<Option<T>, InverseError> {
    match tried {
        Ok(tried) => Ok(Some(tried)),
        Err(InverseError::Undetermined { .. } | InverseError::Fem(FemError::DiscOffSurface { .. })) => {
            Ok(None)
        }
        Err(other) => Err(other),
    }
}

/// Minimises the whitened sum of squares from `start`.
///
/// # Errors
/// [`InverseError::NotConverged`] where as much is still promised as a patch must bring, but where the model is wrong.
pub fn refit(problem: &Problem<'_>, start: &State) -> Result<Linearised, InverseError> {
    converged(problem, descend(problem, start, GOOD_ENOUGH)?.at)
}

/// What a descent has come to. Ending where as much is still promised as a patch must bring is an error, not a result, but where the
/// model is wrong.
pub(super) fn converged(problem: &Problem<'_>, at: Linearised) -> Result<Linearised, InverseError> {
    match at.unrest < MOST_PROMISED * unit(&at) || problem.takes_unrested(&at) {
        true => Ok(at),
        false => Err(InverseError::NotConverged { promised: at.unrest, misfit: at.chi2() }),
    }
}

/// Whether a descent that gained this much changed nothing that the misfit's roughness would not.
pub(super) fn settled(at: &Linearised, gained: f64) -> bool {
    gained < SETTLED * unit(at) + at.unrest
}

/// What is left per reading, never less than the noise: the unit in which gains are judged.
pub(super) fn unit(at: &Linearised) -> f64 {
    let freedom = at.residual.len().saturating_sub(at.parameters.len()).max(1);
    (at.chi2() / freedom as f64).max(1.0)
}

/// Smallest radius of a glued spot (m): smaller ones look the same to every marker and hold next to nothing.
const SMALLEST_SPOT_M: f64 = 1e-3;

/// Keeps every softness between glue and absence; one as small as glue's becomes glue.
pub(super) fn bounded(mut state: State, problem: &Problem<'_>) -> State {
    for patch in state.patches.iter_mut().filter(|patch| patch.softness > 0.0) {
        let [_, local] = disc_self_compliance(patch.radius_m, problem.bench.model.poisson_ratio());
        patch.softness = patch.softness.min(SOFTEST * local);
        if patch.softness < STIFFEST * local {
            patch.softness = 0.0;
        }
    }
    for patch in state.patches.iter_mut().filter(|patch| patch.glued) {
        patch.radius_m = patch.radius_m.max(SMALLEST_SPOT_M);
    }
    state
}
