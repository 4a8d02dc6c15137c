//! What can go wrong with a sparse system.

/// Why a system was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SparseError {
    /// A matrix without unknowns.
    #[error("the matrix has no unknowns")]
    Empty,
    /// A position that the pattern does not hold.
    #[error("entry ({row}, {column}) is not in the pattern of the {dimension} unknowns")]
    NotInPattern {
        /// Its row.
        row: usize,
        /// Its column.
        column: usize,
        /// Number of unknowns.
        dimension: usize,
    },
    /// A list whose length does not fit the matrix.
    #[error("{what}: expected {expected} numbers, got {found}")]
    Length {
        /// Which list.
        what: &'static str,
        /// Length that fits.
        expected: usize,
        /// Length that was given.
        found: usize,
    },
    /// A matrix of another pattern than the analysis was made for.
    #[error("the matrix has {found} entries in another pattern than the {expected} that were analysed")]
    OtherPattern {
        /// Entries of the analysed pattern.
        expected: usize,
        /// Entries of the matrix.
        found: usize,
    },
    /// An entry that is not a number.
    #[error("entry {entry} of the lower triangle is {value}; expected a finite number")]
    NonFinite {
        /// Its place in the list of values.
        entry: usize,
        /// What it is.
        value: f64,
    },
    /// A pivot that is not positive: the body can move without resistance, or the matrix is indefinite.
    #[error(
        "the matrix is not positive definite: elimination stops at unknown {unknown} (diagonal entry {diagonal:e}, step {step} of {dimension})"
    )]
    NotPositiveDefinite {
        /// The unknown whose pivot is not positive.
        unknown: usize,
        /// Its diagonal entry before elimination.
        diagonal: f64,
        /// Its place in the elimination order, from 0.
        step: usize,
        /// Number of unknowns.
        dimension: usize,
    },
    /// A factor that does not solve its own system.
    #[error("the factor leaves the probe residual {residual:e}; expected at most {limit:e}")]
    ProbeResidual {
        /// `‖A x − b‖ / (‖A‖ ‖x‖ + ‖b‖)` in maximum norms.
        residual: f64,
        /// What is accepted.
        limit: f64,
    },
    /// A factor too large for its indices or for the memory.
    #[error("the factor of the {dimension} unknowns does not fit: {reason}")]
    TooLarge {
        /// Number of unknowns.
        dimension: usize,
        /// What overflowed.
        reason: &'static str,
    },
}
