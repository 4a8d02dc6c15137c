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
    /// Change of the modulus' logarithm that the finer model alone would ask for instead of the extrapolation.
    pub modulus_shift: f64,
}

/// Corrections that promise less than this (in squared standard deviations) are not worth making.
const GOOD_ENOUGH: f64 = 1e-3;
const ITERATIONS: usize = 12;

impl Pair<'_> {
    fn judge(&self, state: &State) -> Result<(Blocks, Vec<Group>, Mounted), InverseError> {
        let coarse = Mounted::new(&self.coarse.bench, &self.coarse.search, &state.patches)?;
        let fine = Mounted::new(&self.fine.bench, &self.fine.search, &state.patches)?;
        let blocks = coarse.blocks.zip(&fine.blocks, Discretisation::extrapolate);
        Ok((blocks, fine.groups.clone(), fine))
    }

    /// Carries `at` to the limit. Returns the state with a Jacobian taken at it on the first discretisation.
    pub fn correct<'b>(
        &self,
        problem: &Problem<'b>,
        mut at: Linearised,
    ) -> Result<(Linearised, Limit), InverseError> {
        let mut last = f64::INFINITY;
        for _ in 0..ITERATIONS {
            let state = at.state.clone();
            let (blocks, groups, fine) = self.judge(&state)?;
            let driven = problem.evidence.driven;
            let predict = |blocks: &Blocks| {
                Forward::new(blocks, &groups, state.modulus, driven).and_then(|f| f.predict()).ok_or(
                    InverseError::Undetermined {
                        why: "the extrapolated compliance is not positive definite",
                    },
                )
            };
            let (prediction, finest) = (predict(&blocks)?, predict(&fine.blocks)?);
            let whitening = Whitening::new(problem.evidence, &prediction);
            let residual = whitening.residual(&prediction);
            let normal =
                (at.jacobian.transpose() * &at.jacobian).cholesky().ok_or(InverseError::Undetermined {
                    why: "a direction of the parameters changes no reading",
                })?;
            let gradient = at.jacobian.transpose() * &residual;
            let step = normal.solve(&gradient);
            let promised = step.dot(&gradient);
            if promised < GOOD_ENOUGH {
                let apart =
                    normal.solve(&(at.jacobian.transpose() * (whitening.residual(&finest) - &residual)));
                let limit = Limit { state, blocks, groups, prediction, residual, modulus_shift: apart[0] };
                return Ok((at, limit));
            }
            last = promised;
            at = problem.linearise(&problem.moved(&at, &step))?;
        }
        Err(InverseError::NotConverged { iterations: ITERATIONS, last_gain: last, misfit: at.chi2() })
    }
}
