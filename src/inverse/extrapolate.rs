//! The fit carried to the limit of fine elements: the state found on one discretisation, corrected with the
//! residual of two finer ones.
//!
//! The compliance on two discretisations whose sizes at the end of the glue differ by a factor of two is
//! extrapolated (Richardson 1911). The state is corrected by Gauss–Newton steps whose residual is that of the
//! extrapolated model and whose Jacobian is that of the first one (defect correction, Stetter 1978): the limit is
//! that of the accurate model, the way there is that of the cheap one.

use super::blocks::Blocks;
use super::error::InverseError;
use super::forward::{Forward, Group, Prediction};
use super::problem::{Linearised, Problem, State};
use super::refit::{Damping, GOOD_ENOUGH, bounded};
use super::residual::Whitening;
use super::restraint::Mounted;
use crate::fem::Discretisation;
use nalgebra::DVector;

/// Two problems on a pair of discretisations.
pub struct Pair<'a> {
    /// On the coarser.
    pub coarse: Problem<'a>,
    /// On the finer.
    pub fine: Problem<'a>,
}

/// A state judged by the extrapolated model.
pub struct Limit {
    /// The state.
    pub state: State,
    /// Extrapolated compliance.
    pub blocks: Blocks,
    /// Restraint groups.
    pub groups: Vec<Group>,
    /// What the extrapolated model says.
    pub prediction: Prediction,
    /// Whitened residual of the extrapolated model.
    pub residual: DVector<f64>,
    /// Change of every parameter that the finer model alone would ask for instead of the extrapolation.
    pub shift: DVector<f64>,
}

/// Trials, each of which solves for the patches on both discretisations.
const TRIALS: usize = 40;

impl Pair<'_> {
    /// The extrapolated model's word on a state, and the fine model's alone.
    fn judge(&self, problem: &Problem<'_>, state: &State) -> Result<(Limit, DVector<f64>), InverseError> {
        let coarse = Mounted::new(&self.coarse.bench, &self.coarse.search, &state.patches)?;
        let fine = Mounted::new(&self.fine.bench, &self.fine.search, &state.patches)?;
        let blocks = coarse.blocks.zip(&fine.blocks, Discretisation::extrapolate);
        let groups = fine.groups;
        let predict = |blocks: &Blocks| {
            Forward::new(blocks, &groups, state.modulus, problem.evidence.driven)
                .and_then(|forward| forward.predict())
                .ok_or(InverseError::Undetermined {
                    why: "the extrapolated compliance is not positive definite",
                })
        };
        let (prediction, finest) = (predict(&blocks)?, predict(&fine.blocks)?);
        let whitening = Whitening::new(problem.evidence, &prediction);
        let (residual, finest) = (whitening.residual(&prediction), whitening.residual(&finest));
        Ok((
            Limit { state: state.clone(), blocks, groups, prediction, residual, shift: DVector::zeros(0) },
            finest,
        ))
    }

    /// Carries `at` to the limit. Returns the state with a Jacobian taken at it on the first discretisation.
    pub fn correct<'b>(
        &self,
        problem: &Problem<'b>,
        mut at: Linearised,
    ) -> Result<(Linearised, Limit), InverseError> {
        let (mut limit, mut finest) = self.judge(problem, &at.state)?;
        let mut damping = Damping::default();
        let mut last_gain = f64::INFINITY;
        for _ in 0..TRIALS {
            let trial = damping.step(&at, &limit.residual);
            let enough = GOOD_ENOUGH * (limit.residual.norm_squared() / limit.residual.len() as f64).max(1.0);
            let done = |mut limit: Limit, at: Linearised, finest: &DVector<f64>| {
                let normal = (at.jacobian.transpose() * &at.jacobian).cholesky().ok_or(FLAT)?;
                limit.shift = normal.solve(&(at.jacobian.transpose() * (finest - &limit.residual)));
                Ok((at, limit))
            };
            let Some((step, promised)) = trial else {
                damping.refused();
                continue;
            };
            if promised < enough {
                return done(limit, at, &finest);
            }
            let state = bounded(problem.moved(&at, &step), problem);
            let (tried, tried_finest) = self.judge(problem, &state)?;
            let gain = limit.residual.norm_squared() - tried.residual.norm_squared();
            if gain > 0.0 {
                last_gain = gain;
                damping.accepted(gain / promised);
                at = problem.linearise(&state)?;
                (limit, finest) = (tried, tried_finest);
                if gain < enough {
                    return done(limit, at, &finest);
                }
            } else if damping.refused() {
                // The Jacobian is the first discretisation's: where it promises more than the limit can give,
                // no step lowers the misfit any more.
                return done(limit, at, &finest);
            }
        }
        Err(InverseError::NotConverged {
            iterations: TRIALS,
            last_gain,
            misfit: limit.residual.norm_squared(),
        })
    }
}

const FLAT: InverseError =
    InverseError::Undetermined { why: "a direction of the parameters changes no reading" };
