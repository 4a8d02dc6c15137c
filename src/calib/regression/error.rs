//! Why a regression has no answer.

/// What is wrong with a regression's input.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RegressionError {
    /// Fewer values than parameters.
    #[error("{values} values for {parameters} parameters")]
    TooFew {
        /// Values that were measured.
        values: usize,
        /// Parameters asked for.
        parameters: usize,
    },
    /// Rows of the design or bounds of another length.
    #[error("{what} has {found} entries; {expected} are needed")]
    Length {
        /// Which list.
        what: &'static str,
        /// Its length.
        found: usize,
        /// Length needed.
        expected: usize,
    },
    /// A number that is none.
    #[error("{what} {index} is {value}")]
    NotFinite {
        /// Which list.
        what: &'static str,
        /// Entry, from 0.
        index: usize,
        /// What stands there.
        value: f64,
    },
    /// A column that the others make up.
    #[error("column {column} of the design is a mixture of the others (what it adds is {share:.1e} of it)")]
    Dependent {
        /// Column, from 0.
        column: usize,
        /// Length of what is new in it over its own length.
        share: f64,
    },
    /// Start outside of the bounds.
    #[error("parameter {index} starts at {start}, outside of {low} to {high}")]
    OutOfBounds {
        /// Parameter, from 0.
        index: usize,
        /// Its start.
        start: f64,
        /// Lower bound.
        low: f64,
        /// Upper bound.
        high: f64,
    },
}
