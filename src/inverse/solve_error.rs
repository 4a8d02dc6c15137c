//! What can go wrong in an optimisation: sizes, values, convergence.

use super::published::StepOneFit;

/// Why an optimisation problem was refused or its solution is not to be trusted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// Matrices and vectors whose sizes do not belong together.
    #[error("{what} has {found} entries; expected {expected}")]
    Size {
        /// Which of the arguments.
        what: &'static str,
        /// Its size.
        found: usize,
        /// The size that the others ask for.
        expected: usize,
    },
    /// A number that must be finite (and perhaps not negative), and is not.
    #[error("{what} is {value} at index {index}; expected {expected}")]
    BadValue {
        /// Which of the arguments.
        what: &'static str,
        /// Position of the value.
        index: usize,
        /// The value.
        value: f64,
        /// What it should have been.
        expected: &'static str,
    },
    /// An iteration that did not reach its tolerance.
    #[error(
        "{method} did not converge in {iterations} iterations: its optimality residual is {residual:e}, \
         tolerated are {tolerance:e}"
    )]
    NotConverged {
        /// Which iteration.
        method: &'static str,
        /// How many steps it made.
        iterations: usize,
        /// Relative violation of the optimality conditions at the last iterate.
        residual: f64,
        /// The violation that would have been accepted.
        tolerance: f64,
    },
    /// The interior-point solver stopped without a certificate.
    #[error(
        "the interior-point solver stopped after {iterations} iterations with status {status}: primal residual \
         {primal:e}, dual residual {dual:e}, relative gap {gap:e}"
    )]
    NoCertificate {
        /// Status as the solver names it.
        status: String,
        /// Iterations made.
        iterations: usize,
        /// Infeasibility of the primal iterate.
        primal: f64,
        /// Infeasibility of the dual iterate.
        dual: f64,
        /// Distance of the primal from the dual objective, relative to the primal.
        gap: f64,
    },
    /// Step one of the published method ran out of steps.
    #[error(
        "step one did not meet its stopping rules in {steps} steps: root mean square residual {rms:e} m a point \
         against an error of {error_m:e} m over all, {bounds} displacements on their bound",
        steps = last.history_m2.len() - 1, rms = last.psi_m2.sqrt(), bounds = last.at_bound
    )]
    StepOne {
        /// Norm of the observation's error (m).
        error_m: f64,
        /// Where it stood.
        last: Box<StepOneFit>,
    },
    /// A matrix that has to be positive definite, and is not.
    #[error("{what} ({size} × {size}) is not positive definite")]
    NotPositiveDefinite {
        /// Which matrix.
        what: &'static str,
        /// Its size.
        size: usize,
    },
}
