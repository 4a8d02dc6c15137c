//! Why pulls give no modulus.

use crate::calib::export::ExportError;
use crate::calib::regression::RegressionError;
use crate::units::counted;
use std::path::PathBuf;

/// What is wrong.
#[derive(Debug, thiserror::Error)]
pub enum DumbbellError {
    /// The table lacks a column, or its unit is not known.
    #[error(transparent)]
    Table(#[from] ExportError),
    /// Bent or pressed, not pulled.
    #[error("{place}: the specimen was not pulled but {how}: a dumb-bell's modulus needs a pull")]
    NotPulled {
        /// File and line.
        place: String,
        /// What was done.
        how: &'static str,
    },
    /// A size that is needed is not said.
    #[error("{place}: the {what} is not said: say {key} under [specimen] in an override (--as)")]
    NoSize {
        /// File and line.
        place: String,
        /// Which size.
        what: &'static str,
        /// Key of the override.
        key: &'static str,
    },
    /// A size that no specimen has.
    #[error(
        "{place}: the {what} is {found}: say the true one as {key} under [specimen] in an override (--as)"
    )]
    Size {
        /// File and line.
        place: String,
        /// Which size.
        what: &'static str,
        /// What it is said to be (SI).
        found: f64,
        /// Key of the override.
        key: &'static str,
    },
    /// Too few rows inside the strain window.
    #[error("{label}: {} between strains {low} and {high}; at least {needed} are needed", counted(*rows, "row", "rows"))]
    Window {
        /// Which specimen.
        label: String,
        /// Rows found.
        rows: usize,
        /// Window's lower end.
        low: f64,
        /// Window's upper end.
        high: f64,
        /// Rows needed.
        needed: usize,
    },
    /// The force drops while the strain grows.
    #[error(
        "{}, line {line}, column {column}: the stress falls from {before:.3e} to {after:.3e} Pa at a strain of {strain:.3} while the specimen is pulled on: \
         it slipped in the grips, or was torn",
        file.display()
    )]
    Slipped {
        /// The file.
        file: PathBuf,
        /// Line of the file.
        line: u64,
        /// Field of that line.
        column: usize,
        /// Stress before (Pa).
        before: f64,
        /// Stress after (Pa).
        after: f64,
        /// Where.
        strain: f64,
    },
    /// No model came to a minimum.
    #[error("{label}: no model came to a minimum")]
    NoModel {
        /// Which specimen.
        label: String,
    },
    /// Wrong input of a regression.
    #[error(transparent)]
    Regression(#[from] RegressionError),
    /// Nothing was given.
    #[error("no specimen was given")]
    None,
}
