//! The fit as a least-squares problem on one discretisation: residual and exact Jacobian for a state.

use super::blocks::{Bench, Blocks};
use super::error::InverseError;
use super::evidence::Evidence;
use super::forward::{Change, Forward, Prediction};
use super::residual::Whitening;
use super::restraint::{Mounted, Restraint};
use crate::fem::{Response, Spot};
use crate::geometry::{Vec3, basis_from_axis};
use nalgebra::{DMatrix, DVector};

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
}

/// The problem: evidence, and a model to explain it with.
pub struct Problem<'a> {
    /// What was observed.
    pub evidence: &'a Evidence,
    /// The model.
    pub bench: Bench,
    /// Faces of the search surface.
    pub search: Vec<usize>,
    /// Responses to a force on each marker; only where the fit searches for places.
    pub adjoint: Vec<Response>,
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
}

impl Linearised {
    /// Sum of squares.
    pub fn chi2(&self) -> f64 {
        self.residual.norm_squared()
    }

    /// Covariance of the parameters for unit noise, `(JᵀJ)⁻¹`; `None` when a direction is not determined.
    pub fn covariance(&self) -> Option<DMatrix<f64>> {
        (self.jacobian.transpose() * &self.jacobian).cholesky().map(|c| c.inverse())
    }
}

impl Problem<'_> {
    fn forward<'b>(&self, mounted: &'b Mounted, modulus: f64) -> Result<Forward<'b>, InverseError> {
        Forward::new(&mounted.blocks, &mounted.groups, modulus, self.evidence.driven).ok_or(NOT_POSITIVE)
    }

    /// Residual and prediction for restraint that is already on the model.
    pub fn residual(
        &self,
        mounted: &Mounted,
        modulus: f64,
    ) -> Result<(DVector<f64>, Prediction), InverseError> {
        let prediction = self.forward(mounted, modulus)?.predict().ok_or(NOT_POSITIVE)?;
        Ok((Whitening::new(self.evidence, &prediction).residual(&prediction), prediction))
    }

    /// Sensitivity to the modulus' logarithm, whitened.
    pub fn modulus_sensitivity(&self, mounted: &Mounted, modulus: f64) -> Result<DVector<f64>, InverseError> {
        let forward = self.forward(mounted, modulus)?;
        let prediction = forward.predict().ok_or(NOT_POSITIVE)?;
        let derivative = forward.derivative(&Change::LogModulus).ok_or(NOT_POSITIVE)?;
        Ok(Whitening::new(self.evidence, &prediction).sensitivity(&derivative))
    }

    /// Sensitivity to the softness of a patch (1/m), whitened; also where the patch is glued.
    pub fn softness_sensitivity(&self, at: &Linearised, patch: usize) -> Result<DVector<f64>, InverseError> {
        let derivative = self
            .forward(&at.mounted, at.state.modulus)?
            .derivative(&Change::Softness(patch))
            .ok_or(NOT_POSITIVE)?;
        Ok(Whitening::new(self.evidence, &at.prediction).sensitivity(&derivative))
    }

    /// Residual and Jacobian. Patches move only when the problem has adjoint responses.
    pub fn linearise(&self, state: &State) -> Result<Linearised, InverseError> {
        let mounted = Mounted::new(&self.bench, &self.search, &state.patches)?;
        let (prediction, jacobian, parameters) = {
            let forward = self.forward(&mounted, state.modulus)?;
            let prediction = forward.predict().ok_or(NOT_POSITIVE)?;
            let whitening = Whitening::new(self.evidence, &prediction);
            let mut parameters = vec![Parameter::LogModulus];
            let mut changes: Vec<Blocks> = Vec::new();
            let mut columns = Vec::new();
            for (p, (patch, group)) in state.patches.iter().zip(&mounted.groups).enumerate() {
                if !self.adjoint.is_empty() {
                    for tangent in tangents(&mounted.discs[group.discs.start]) {
                        let moved = group
                            .discs
                            .clone()
                            .map(|d| {
                                self.bench.shifted(
                                    &mounted.discs,
                                    &mounted.responses,
                                    &self.adjoint,
                                    d,
                                    &tangent,
                                )
                            })
                            .reduce(|a, b| a.zip(&b, |x, y| x + y));
                        if let Some(moved) = moved {
                            changes.push(moved);
                            parameters.push(Parameter::Shift(p, tangent));
                        }
                    }
                }
                if patch.softness > 0.0 {
                    parameters.push(Parameter::LogSoftness(p));
                }
            }
            let mut moved = changes.iter();
            for parameter in &parameters {
                let change = match parameter {
                    Parameter::LogModulus => Change::LogModulus,
                    Parameter::LogSoftness(p) => Change::Softness(*p),
                    Parameter::Shift(..) => match moved.next() {
                        Some(blocks) => Change::Blocks(blocks),
                        None => continue,
                    },
                };
                let derivative = forward.derivative(&change).ok_or(NOT_POSITIVE)?;
                let scale = match parameter {
                    Parameter::LogSoftness(p) => mounted.groups[*p].softness,
                    _ => 1.0,
                };
                columns.push(whitening.sensitivity(&derivative) * scale);
            }
            (prediction, DMatrix::from_columns(&columns), parameters)
        };
        let residual = Whitening::new(self.evidence, &prediction).residual(&prediction);
        Ok(Linearised { state: state.clone(), mounted, prediction, residual, jacobian, parameters })
    }

    /// The state moved by a step in the parameters; patches stay on the search surface.
    pub fn moved(&self, at: &Linearised, step: &DVector<f64>) -> State {
        let mut state = at.state.clone();
        for (parameter, &value) in at.parameters.iter().zip(step.iter()) {
            match parameter {
                Parameter::LogModulus => state.modulus *= value.exp(),
                Parameter::Shift(p, tangent) => state.patches[*p].centre += tangent * value,
                Parameter::LogSoftness(p) => state.patches[*p].softness *= value.exp(),
            }
        }
        let space = self.bench.model.space();
        for patch in &mut state.patches {
            let nearest = self
                .search
                .iter()
                .map(|&f| space.face_triangle(f).nearest(&patch.centre).position)
                .min_by(|a, b| (a - patch.centre).norm().total_cmp(&(b - patch.centre).norm()));
            if let Some(nearest) = nearest {
                patch.centre = nearest;
            }
        }
        state
    }
}

/// Two unit vectors in a disc's plane.
fn tangents(disc: &Spot) -> Vec<Vec3> {
    disc.as_disc().map_or_else(Vec::new, |(disc, _)| {
        let basis = basis_from_axis(&disc.normal);
        vec![basis.column(0).into_owned(), basis.column(1).into_owned()]
    })
}

const NOT_POSITIVE: InverseError = InverseError::Undetermined {
    why: "the compliance between tips and restraint is not positive definite; the mesh or its held surface is unsound",
};
