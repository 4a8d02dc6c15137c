//! Why a band's test gives no stiffness.

use crate::calib::export::ExportError;
use crate::calib::regression::RegressionError;

/// What is wrong.
#[derive(Debug, thiserror::Error)]
pub enum BandError {
    /// The table lacks a column, or its unit is not known.
    #[error(transparent)]
    Table(#[from] ExportError),
    /// Bent or pressed, not pulled.
    #[error(
        "{place}: the specimen was not pulled but {how}, as the export says: a band's stiffness needs a pull"
    )]
    NotPulled {
        /// File and line.
        place: String,
        /// What was done.
        how: &'static str,
    },
    /// A slack in which the table carries load.
    #[error(
        "{label}: a line through the loading is slack up to {:.2} mm, where the table carries up to {carried:.2} N of {top:.2} N already: \
         this is no band that is pulled", 1e3 * slack_m
    )]
    LoadedSlack {
        /// Which band.
        label: String,
        /// Where the line begins to pull (m).
        slack_m: f64,
        /// Greatest force before that, less the tare (N).
        carried: f64,
        /// Greatest force of the loading, less the tare (N).
        top: f64,
    },
    /// Never stretched.
    #[error("{place}: no branch of {needed} rows in one direction: nothing was stretched")]
    NoBranch {
        /// File, line and column of the heading.
        place: String,
        /// Rows needed.
        needed: usize,
    },
    /// The force drops while the band is pulled on.
    #[error(
        "{place}: the force falls from {before:.3} to {after:.3} N while the band is pulled on: it slipped in the grips, or was torn"
    )]
    Slipped {
        /// File, line and column.
        place: String,
        /// Force before (N).
        before: f64,
        /// Force after (N).
        after: f64,
    },
    /// The pull on the rig is not reached.
    #[error(
        "{label}: a pretension of {wanted:.3} N lies outside of what was measured ({low:.3} to {high:.3} N)"
    )]
    Pretension {
        /// Which band.
        label: String,
        /// Pull asked for (N).
        wanted: f64,
        /// Least force (N).
        low: f64,
        /// Greatest force (N).
        high: f64,
    },
    /// No model came to a minimum.
    #[error("{label}: no model of the force came to an answer")]
    NoModel {
        /// Which band.
        label: String,
    },
    /// The rows leave the slope open.
    #[error(
        "{label}: at a pull of {pull:.3} N ({:.3} mm) the rows do not tell the slope: test beyond it, with more rows",
        1e3 * extension_m
    )]
    Open {
        /// Which band.
        label: String,
        /// Pull asked for (N).
        pull: f64,
        /// Where that is (m).
        extension_m: f64,
    },
    /// A number of bands that is none.
    #[error("{count} parallel bands; at least one is needed")]
    Count {
        /// What was said.
        count: u32,
    },
    /// Wrong input of a regression.
    #[error(transparent)]
    Regression(#[from] RegressionError),
}
