//! Why no equilibrium at finite strain can be given.

use crate::fem::material::MaterialError;
use crate::sparse::SparseError;

/// What stopped a search for equilibrium, or made its question meaningless.
#[derive(Debug, thiserror::Error)]
pub enum FiniteError {
    /// Newton's method needed more iterations than it may take.
    #[error(
        "no equilibrium after {iterations} iterations at {fraction} of the load: relative residual {residual:e}, expected at most {tolerance:e}"
    )]
    OutOfIterations {
        /// Iterations made.
        iterations: usize,
        /// Share of the load that was asked for.
        fraction: f64,
        /// Relative residual that was left.
        residual: f64,
        /// Relative residual that counts as equilibrium.
        tolerance: f64,
    },
    /// The load was cut into steps as small as allowed, and the next one still failed.
    #[error(
        "equilibrium holds up to {reached} of the load; a further step of {step} fails, smallest allowed {smallest}"
    )]
    LoadStepTooSmall {
        /// Share of the load up to which equilibrium was found.
        reached: f64,
        /// The next step, which would be too small.
        step: f64,
        /// The smallest step allowed.
        smallest: f64,
        /// Why the last attempt failed.
        #[source]
        because: Box<FiniteError>,
    },
    /// The tangent of the free components is not positive definite: the body is not held, or it buckles.
    #[error(
        "at {fraction} of the load the tangent is not positive definite at node {node}, axis {axis}: the body is loose or loses stability"
    )]
    TangentNotPositiveDefinite {
        /// Share of the load that was asked for.
        fraction: f64,
        /// Node at which elimination stopped.
        node: usize,
        /// Axis of the component, 0 to 2.
        axis: usize,
        /// What the factorisation saw.
        #[source]
        source: SparseError,
    },
    /// No step along Newton's direction, however small, brings the body nearer to equilibrium.
    #[error(
        "at {fraction} of the load no step along Newton's direction helps (shortest tried {shortest:e}): relative residual {residual:e}"
    )]
    LineSearch {
        /// Share of the load that was asked for.
        fraction: f64,
        /// Shortest step tried, as a share of Newton's.
        shortest: f64,
        /// Relative residual before the step.
        residual: f64,
    },
    /// A cell that the step turns inside out or stretches beyond its law.
    #[error("cell {cell} cannot follow the deformation")]
    Cell {
        /// Index of the cell, from 0.
        cell: usize,
        /// What its material says.
        #[source]
        source: MaterialError,
    },
    /// Ties that contradict or repeat each other, so that their forces are not determined.
    #[error(
        "the {ties} ties are not independent: at least two of them pull at the same place in the same direction"
    )]
    TiesDependent {
        /// Number of ties.
        ties: usize,
    },
    /// An input list whose length does not fit the body.
    #[error("{what}: expected {expected} entries, got {found}")]
    Length {
        /// Which list.
        what: &'static str,
        /// Length that fits.
        expected: usize,
        /// Length that was given.
        found: usize,
    },
    /// A load, a tie or a modulus that is not a meaningful number.
    #[error("{what} number {index} is {value}; expected {expected}")]
    Value {
        /// Which list.
        what: &'static str,
        /// Place in the list, from 0.
        index: usize,
        /// What was given.
        value: f64,
        /// What is accepted.
        expected: &'static str,
    },
    /// A displacement that is prescribed where the body is not held.
    #[error(
        "a displacement is prescribed for component {component}, which is not a held component of the body"
    )]
    NotHeld {
        /// Component 3 n + i.
        component: usize,
    },
    /// The linear solver refused its system for a reason other than definiteness.
    #[error("the linear system of a Newton iteration cannot be solved")]
    Linear(#[from] SparseError),
}

impl FiniteError {
    /// Whether a smaller load step may succeed where this one failed.
    pub(super) fn yields_to_smaller_steps(&self) -> bool {
        matches!(
            self,
            Self::OutOfIterations { .. }
                | Self::TangentNotPositiveDefinite { .. }
                | Self::LineSearch { .. }
                | Self::Cell { .. }
        )
    }
}
