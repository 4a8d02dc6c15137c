//! The fit as a least-squares problem on one discretisation: residual and exact Jacobian for a state.

use super::blocks::{Bench, Blocks};
use super::error::InverseError;
use super::evidence::Evidence;
use super::forward::{Change, Forward, Prediction};
use super::limit::{Correction, Finer};
use super::residual::Whitening;
use super::restraint::{Mounted, Restraint};
use crate::fem::Response;
use crate::geometry::{Vec3, basis_from_axis};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::sync::Arc;

/// What is to be found.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// Young's modulus (Pa).
    pub modulus: f64,
    /// Restraint patches.
    pub patches: Vec<Restraint>,
}

/// One column of the Jacobian.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Parameter {
    /// Logarithm of Young's modulus.
    LogModulus,
    /// Shift of a patch along a unit vector in the surface (m).
    Shift(usize, Vec3),
    /// Logarithm of a patch's softness `E/k`.
    LogSoftness(usize),
    /// Logarithm of a glued spot's radius.
    LogRadius(usize),
}

/// The problem: evidence, and a model to explain it with.
pub struct Problem<'a> {
    /// What was observed.
    pub evidence: &'a Evidence,
    /// The model.
    pub bench: Arc<Bench>,
    /// Faces of the search surface.
    pub search: Vec<usize>,
    /// Faces of the known glue.
    pub held: Vec<usize>,
    /// Responses to a force on each marker, by which their compliance with any place on the surface is known;
    /// without them patches keep their places.
    pub adjoint: Arc<[Response]>,
    /// What finer elements add to the model's compliance.
    pub correction: Option<Correction>,
    /// How readings are weighed; kept while states are compared, renewed between.
    pub whitening: Whitening<'a>,
    /// Whether a fit that has not come to rest after all its steps is taken as it is.
    pub unrested: bool,
}

/// A state with residual and Jacobian.
pub struct Linearised {
    /// The state.
    pub state: State,
    /// Its restraint on the model.
    pub mounted: Mounted,
    /// What the model says.
    pub prediction: Prediction,
    /// Whitened residual.
    pub residual: DVector<f64>,
    /// Columns in the order of `parameters`: derivative of the prediction, whitened.
    pub jacobian: DMatrix<f64>,
    /// What the columns are.
    pub parameters: Vec<Parameter>,
    /// By how much a further step promises to lower the sum of squares although no step does, however short: the misfit is not
    /// smooth there. 0 at rest.
    pub unrest: f64,
    /// By how much the last of all rounds of looking for restraint, weighing and fitting still lowered the sum of squares; none where they
    /// settled.
    pub unsettled: Option<f64>,
}

/// The model at a state, without its derivatives: they cost as much again.
pub struct Predicted {
    /// The state.
    pub state: State,
    /// Its restraint on the model.
    pub mounted: Mounted,
    /// What the model says.
    pub prediction: Prediction,
    /// Whitened residual.
    pub residual: DVector<f64>,
}

/// What is left beyond noise, in standard deviations of a sum of squares, from where on something is not explained.
const UNEXPLAINED_SD: f64 = 5.0;

impl Linearised {
    /// Column of a parameter, if the state has it.
    pub fn column(&self, parameter: Parameter) -> Option<usize> {
        self.parameters.iter().position(|p| *p == parameter)
    }

    /// Sum of squares.
    pub fn chi2(&self) -> f64 {
        self.residual.norm_squared()
    }

    /// What is left beyond noise.
    pub(super) fn beyond_noise(&self) -> f64 {
        self.chi2() - self.residual.len().saturating_sub(self.parameters.len()) as f64
    }

    /// Whether no more is left than noise leaves.
    pub(super) fn explained(&self) -> bool {
        self.beyond_noise() < UNEXPLAINED_SD * (2.0 * self.residual.len() as f64).sqrt()
    }

    /// Covariance of the parameters for unit noise, `(JᵀJ)⁻¹`; `None` when a direction is not determined.
    pub fn covariance(&self) -> Option<DMatrix<f64>> {
        (self.jacobian.transpose() * &self.jacobian).cholesky().map(|c| c.inverse())
    }
}

impl<'a> Problem<'a> {
    /// The problem on one discretisation, in which patches may move.
    pub fn new(
        evidence: &'a Evidence,
        bench: Bench,
        search: Vec<usize>,
        held: Vec<usize>,
        elements_sd: f64,
    ) -> Result<Self, InverseError> {
        let adjoint = bench.model.respond(&bench.markers.iter().collect::<Vec<_>>())?.into();
        let whitening = Whitening::new(evidence, elements_sd);
        let bench = Arc::new(bench);
        Ok(Self { evidence, bench, search, held, adjoint, correction: None, whitening, unrested: false })
    }

    /// The same model, not corrected yet, with other evidence of the same pokes to explain.
    pub(super) fn with<'b>(&self, evidence: &'b Evidence, elements_sd: f64) -> Problem<'b> {
        Problem {
            evidence,
            bench: Arc::clone(&self.bench),
            search: self.search.clone(),
            held: self.held.clone(),
            adjoint: Arc::clone(&self.adjoint),
            correction: None,
            whitening: Whitening::new(evidence, elements_sd),
            unrested: self.unrested,
        }
    }

    /// Whether a fit is taken as it is though it has not come to rest after all its steps: where the model is wrong, weights and restraint
    /// may follow each other for ever, and what is left says so.
    pub(super) fn takes_unrested(&self, at: &Linearised) -> bool {
        self.unrested || !at.explained()
    }

    /// Puts restraint on the model.
    ///
    /// # Errors
    /// [`InverseError::Undetermined`] where a model that is corrected has no answer by itself: a correction that was made for patches
    /// elsewhere may lend it one.
    pub fn mount(&self, patches: &[Restraint]) -> Result<Mounted, InverseError> {
        let mut mounted = Mounted::new(&self.bench, &self.search, patches)?;
        if let Some(correction) = &self.correction {
            self.forward(&mounted, 1.0)?;
            correction.limit.add_to(&mut mounted.blocks, patches, &mounted.groups);
        }
        Ok(mounted)
    }

    fn forward<'b>(&self, mounted: &'b Mounted, modulus: f64) -> Result<Forward<'b>, InverseError> {
        Forward::new(&mounted.blocks, &mounted.groups, modulus, self.evidence.driven).ok_or(NOT_POSITIVE)
    }

    /// Whitened residual for restraint that is already on the model.
    pub fn residual(&self, mounted: &Mounted, modulus: f64) -> Result<DVector<f64>, InverseError> {
        let prediction = self.forward(mounted, modulus)?.predict().ok_or(NOT_POSITIVE)?;
        Ok(self.whitening.residual(&prediction))
    }

    /// Corrects the model for `patches` where they are, unless the correction that it has still holds for them.
    ///
    /// # Errors
    /// [`InverseError::Undetermined`] where the corrected model has no answer; it stays as it was.
    pub fn correct(&mut self, finer: &Finer, patches: &[Restraint]) -> Result<(), InverseError> {
        if self.correction.as_ref().is_some_and(|made| made.holds_for(patches)) {
            return Ok(());
        }
        let first = Mounted::new(&self.bench, &self.search, patches)?;
        let before = self.correction.replace(finer.correction(&first, patches)?);
        // What is extrapolated from two compliances need not be one, where patches crowd round a tip or each other.
        let answer = self.mount(patches).and_then(|mounted| self.forward(&mounted, 1.0).map(|_| ()));
        if answer.is_err() {
            self.correction = before;
        }
        answer
    }

    /// What the readings would be.
    pub fn predict(&self, mounted: &Mounted, modulus: f64) -> Result<Prediction, InverseError> {
        self.forward(mounted, modulus)?.predict().ok_or(NOT_POSITIVE)
    }

    /// Sensitivity to the modulus' logarithm, whitened.
    pub fn modulus_sensitivity(&self, mounted: &Mounted, modulus: f64) -> Result<DVector<f64>, InverseError> {
        let derivative =
            self.forward(mounted, modulus)?.derivative(&Change::LogModulus).ok_or(NOT_POSITIVE)?;
        Ok(self.whitening.sensitivity(&derivative))
    }

    /// Sensitivity to the softness of a patch (1/m), whitened; also where the patch is glued.
    pub fn softness_sensitivity(&self, at: &Linearised, patch: usize) -> Result<DVector<f64>, InverseError> {
        let derivative = self
            .forward(&at.mounted, at.state.modulus)?
            .derivative(&Change::Softness(patch))
            .ok_or(NOT_POSITIVE)?;
        Ok(self.whitening.sensitivity(&derivative))
    }

    /// How the blocks change with every parameter that moves discs: two shifts of every patch, and the radius of a
    /// glued spot. None without adjoint responses.
    pub fn changes(&self, patches: &[Restraint], mounted: &Mounted) -> Vec<(Parameter, Blocks)> {
        if self.adjoint.is_empty() {
            return Vec::new();
        }
        let mut moves: Vec<(Parameter, Vec<(usize, Vec3)>)> = Vec::new();
        for (p, (patch, group)) in patches.iter().zip(&mounted.groups).enumerate() {
            let Some((disc, _)) = mounted.discs[group.discs.start].spot.as_disc() else { continue };
            let basis = basis_from_axis(&disc.normal);
            for tangent in [0, 1].map(|axis| basis.column(axis).into_owned()) {
                let together = group.discs.clone().map(|disc| (disc, tangent)).collect();
                moves.push((Parameter::Shift(p, tangent), together));
            }
            if patch.glued {
                let apart = group.discs.clone().zip(patch.growth(&disc.normal)).collect();
                moves.push((Parameter::LogRadius(p), apart));
            }
        }
        // All of these first, side by side: several moves need the same.
        mounted.discs.par_iter().for_each(|disc| {
            disc.slopes(&self.bench, &self.adjoint);
        });
        let change = |(parameter, moved): (Parameter, Vec<(usize, Vec3)>)| {
            let grown = matches!(parameter, Parameter::LogRadius(_));
            (parameter, self.bench.changed(&mounted.discs, &self.adjoint, &moved, grown))
        };
        moves.into_par_iter().map(change).collect()
    }

    /// What the model says at a state.
    pub fn predicted(&self, state: &State) -> Result<Predicted, InverseError> {
        let mounted = self.mount(&state.patches)?;
        let prediction = self.predict(&mounted, state.modulus)?;
        let residual = self.whitening.residual(&prediction);
        Ok(Predicted { state: state.clone(), mounted, prediction, residual })
    }

    /// Residual and Jacobian. Patches move only when the problem has adjoint responses.
    pub fn linearise(&self, state: &State) -> Result<Linearised, InverseError> {
        self.linearised(self.predicted(state)?)
    }

    /// With the Jacobian where the model was predicted.
    pub fn linearised(&self, at: Predicted) -> Result<Linearised, InverseError> {
        let Predicted { state, mounted, prediction, residual } = at;
        let (jacobian, parameters) = {
            let forward = self.forward(&mounted, state.modulus)?;
            let changes = self.changes(&state.patches, &mounted);
            let mut all = vec![(Parameter::LogModulus, Change::LogModulus, 1.0)];
            all.extend(changes.iter().map(|(parameter, blocks)| (*parameter, Change::Blocks(blocks), 1.0)));
            for (p, group) in mounted.groups.iter().enumerate().filter(|(_, group)| group.softness > 0.0) {
                all.push((Parameter::LogSoftness(p), Change::Softness(p), group.softness));
            }
            let column = |(_, change, scale): &(Parameter, Change<'_>, f64)| {
                let derivative = forward.derivative(change).ok_or(NOT_POSITIVE)?;
                Ok(self.whitening.sensitivity(&derivative) * *scale)
            };
            let columns = all.par_iter().map(column).collect::<Result<Vec<_>, InverseError>>()?;
            let parameters = all.into_iter().map(|(parameter, ..)| parameter).collect();
            (DMatrix::from_columns(&columns), parameters)
        };
        Ok(Linearised {
            state,
            mounted,
            prediction,
            residual,
            jacobian,
            parameters,
            unrest: 0.0,
            unsettled: None,
        })
    }

    /// The state moved by a step in the parameters; patches stay on the search surface.
    pub fn moved(&self, at: &Linearised, step: &DVector<f64>) -> Moved {
        let mut state = at.state.clone();
        for (parameter, &value) in at.parameters.iter().zip(step.iter()) {
            match parameter {
                Parameter::LogModulus => state.modulus *= value.exp(),
                Parameter::Shift(p, tangent) => state.patches[*p].centre += tangent * value,
                Parameter::LogSoftness(p) => state.patches[*p].softness *= value.exp(),
                Parameter::LogRadius(p) => state.patches[*p].radius_m *= value.exp(),
            }
        }
        let mut held_back = Vec::new();
        for (p, (patch, before)) in state.patches.iter_mut().zip(&at.state.patches).enumerate() {
            let nearest = self.on_the_surface(&patch.centre);
            let asked = (patch.centre - before.centre).norm();
            let short = patch.centre - nearest;
            if short.norm() > OFF_SURFACE * asked {
                held_back.push((p, short));
            }
            patch.centre = nearest;
        }
        Moved { state, held_back }
    }

    /// The point of the search surface (m) that is nearest to a place.
    pub fn on_the_surface(&self, place: &Vec3) -> Vec3 {
        let space = self.bench.model.space();
        let nearest = self.search.iter().map(|&f| space.face_triangle(f).nearest(place).position);
        nearest.min_by(|a, b| (a - place).norm().total_cmp(&(b - place).norm())).unwrap_or(*place)
    }
}

/// A state moved by a step.
pub struct Moved {
    /// The state.
    pub state: State,
    /// Patches that could not go where the step wanted them, each with the way from where it came to where it was wanted (m).
    pub held_back: Vec<(usize, Vec3)>,
}

/// A patch was held back when it had to be brought back by more than this share of its step.
const OFF_SURFACE: f64 = 0.1;

const NOT_POSITIVE: InverseError = InverseError::Undetermined {
    why: "the compliance between tips and restraint is not positive definite; the mesh or its held surface is unsound",
};
