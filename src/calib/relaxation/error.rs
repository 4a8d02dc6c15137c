//! Why a recording of relaxation gives no model.

use crate::calib::export::ExportError;
use crate::calib::regression::RegressionError;

/// What is wrong.
#[derive(Debug, thiserror::Error)]
pub enum RelaxationError {
    /// The table lacks a column, or its unit is not known.
    #[error(transparent)]
    Table(#[from] ExportError),
    /// The deformation never moves.
    #[error("{place}: the deformation stays within {spread:.2e} (SI): nothing was ramped")]
    NoRamp {
        /// File, line and column of the heading.
        place: String,
        /// Greatest less least.
        spread: f64,
    },
    /// It is never held.
    #[error("{place}: the deformation is held for {rows} rows; at least {needed} are needed")]
    NoHold {
        /// File, line and column of the heading.
        place: String,
        /// Rows of the hold.
        rows: usize,
        /// Rows needed.
        needed: usize,
    },
    /// The force answers in the other direction, or not at all.
    #[error("{place}: the force changes by {force:.2e} (SI) over the ramp: no specimen pushes back")]
    NoForce {
        /// File, line and column of the heading.
        place: String,
        /// Change of the force.
        force: f64,
    },
    /// No hold lasts long enough beside its ramp: what relaxes is over before the force can tell.
    #[error(
        "no share that relaxes can be told: {}; a hold must last {longer} times as long as its ramp",
        each.iter().map(|(label, [ramp, hold])| format!("{label} is ramped in {ramp:.3} s and held for {hold:.3} s")).collect::<Vec<_>>().join(", ")
    )]
    NoShare {
        /// Recording, duration of its ramp and of its hold (s).
        each: Vec<(String, [f64; 2])>,
        /// Durations of the ramp that are needed.
        longer: f64,
    },
    /// Nothing came to a minimum.
    #[error("none of {tried} models came to a minimum")]
    NoModel {
        /// Models tried.
        tried: usize,
    },
    /// Wrong input of a regression.
    #[error(transparent)]
    Regression(#[from] RegressionError),
}
