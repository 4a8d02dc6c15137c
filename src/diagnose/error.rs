//! What stops a diagnosis.

use crate::fem::FemError;
use crate::fem::finite::FiniteError;
use crate::fem::material::MaterialError;
use crate::inverse::InverseError;
use thiserror::Error;

/// Why a recording cannot be diagnosed.
#[derive(Debug, Error)]
pub enum DiagnoseError {
    /// The baseline could not be fitted.
    #[error(transparent)]
    Baseline(#[from] InverseError),
    /// Elements cannot be put on the mesh, or tip, restraint or marker not on the elements.
    #[error(transparent)]
    Elements(#[from] FemError),
    /// The body at finite strain cannot be made.
    #[error(transparent)]
    Solid(#[from] FiniteError),
    /// A law without meaning.
    #[error(transparent)]
    Material(#[from] MaterialError),
    /// The wrench drives the model.
    #[error(
        "without stage.csv nothing says how the tip moved in time; such a recording is not diagnosed yet"
    )]
    NoStage,
    /// A tip that may lift off, slide or roll.
    #[error(
        "the tip's force is not in proportion to its displacement; only bonded pads and flat faces are diagnosed yet"
    )]
    TipNotLinear,
    /// The baseline needs so many patches that something else must be wrong.
    #[error("the baseline has {patches} patches, more than can be told apart from anything else")]
    TooManyPatches {
        /// How many it has.
        patches: usize,
    },
    /// The compliance between tips and restraint is not positive definite, or the readings leave a parameter open.
    #[error(
        "the extended model has no answer where the baseline settled; a parameter is left open by the readings"
    )]
    Singular,
    /// One poke explains itself.
    #[error(
        "the recording has {pokes} poke(s): none can be predicted from the others, at least 2 are needed"
    )]
    TooFewPokes {
        /// How many it has.
        pokes: usize,
    },
    /// A place of which not all parameters are given.
    #[error("a change of the body needs {id}, which is not among its parameters")]
    KnobMissing {
        /// Id of the parameter.
        id: &'static str,
    },
    /// A parameter with a value for which there is no body.
    #[error("{id} = {value}: no body has that")]
    KnobOutOfRange {
        /// Id of the parameter.
        id: &'static str,
        /// Its value.
        value: f64,
    },
    /// Hardly anything would hold the body.
    #[error(
        "only {left_share:.2} of the known glue would be left, at least {least} is needed to hold the body"
    )]
    GlueGone {
        /// Share of the glue's area that still holds.
        left_share: f64,
        /// Least share.
        least: f64,
    },
}

impl DiagnoseError {
    /// Whether the baseline still says something where this stops the rest.
    pub(super) fn leaves_undecided(&self) -> bool {
        matches!(
            self,
            Self::NoStage
                | Self::TipNotLinear
                | Self::TooManyPatches { .. }
                | Self::TooFewPokes { .. }
                | Self::Singular
        )
    }
}
