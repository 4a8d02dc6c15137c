//! What a nonlinear fit is given, and what it gives back.

use nalgebra::{DMatrix, DVector};

/// A model beside its data: residual r(p) = measured − modelled, over the noise where that is known.
pub trait Model {
    /// Residuals r(p), n of them; none where the model has no value there.
    fn residuals(&self, parameters: &[f64]) -> Option<DVector<f64>>;

    /// Derivatives ∂r_i/∂p_j (n × p); none where the model has no value there.
    fn jacobian(&self, parameters: &[f64]) -> Option<DMatrix<f64>>;
}

/// How a fit goes about it.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Steps tried at most.
    pub steps: usize,
    /// Bounds of each parameter; empty: none.
    pub bounds: Vec<[f64; 2]>,
    /// First radius of the trusted region over the scaled length of the start.
    pub radius: f64,
    /// Relative offset that is a minimum: how far the parameters may be from it, in their standard deviations (see `offset`).
    pub offset: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self { steps: 5_000, bounds: Vec::new(), radius: 1.0, offset: 1e-8 }
    }
}

/// Why a fit stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Termination {
    /// A minimum: what is left is at right angles to what the free parameters can do.
    Minimum,
    /// A minimum to the last digits: no free parameter can be told better in double precision.
    Rounding,
    /// No step helps, and the place is no minimum: not an answer.
    Stagnated,
    /// Steps used up: not an answer.
    StepsUsedUp,
    /// The start has no finite residuals: not an answer.
    NoStart,
}

impl Termination {
    /// Whether the parameters are an answer.
    pub fn is_answer(self) -> bool {
        matches!(self, Self::Minimum | Self::Rounding)
    }

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Minimum => "a minimum",
            Self::Rounding => "a minimum, to rounding",
            Self::Stagnated => "stuck where there is no minimum",
            Self::StepsUsedUp => "out of steps",
            Self::NoStart => "no value at the start",
        }
    }
}

/// A nonlinear fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Regression {
    /// Where it ended.
    pub parameters: Vec<f64>,
    /// Their standard deviations, from the scatter of what is left; not a number where the data leave one open, zero at a bound.
    pub sd: Vec<f64>,
    /// Covariance (p × p) of the same.
    pub covariance: DMatrix<f64>,
    /// Σ r².
    pub squares: f64,
    /// Number of residuals.
    pub values: usize,
    /// Steps tried.
    pub steps: usize,
    /// Why it ended.
    pub termination: Termination,
    /// Parameters that lie on a bound.
    pub at_bound: Vec<bool>,
}
