//! Cyclic coordinate descent on the Gram matrix (Friedman, Hastie & Tibshirani 2010, section 2.2).
//!
//! Each step minimises over one unknown exactly, which is a shrinkage; the gradient is kept up to date by one
//! column of the Gram matrix per unknown that moves. Sweeps run over the unknowns that are not zero until
//! those stand still, then over all. The objective never rises; the rate depends on how parallel the columns
//! are, and the stop is the violation of the optimality conditions, not the size of the last step.

use super::{L1Problem, L1Solution};
use crate::inverse::SolveError;
use nalgebra::DVector;

/// When coordinate descent ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Descent {
    /// Accepted [`L1Problem::kkt_residual`].
    pub tolerance: f64,
    /// Most sweeps.
    pub sweeps: usize,
}

impl Default for Descent {
    fn default() -> Self {
        Self { tolerance: 1e-10, sweeps: 100_000 }
    }
}

/// Minimises from `start` (n), zero when there is none.
///
/// # Errors
/// [`SolveError::NotConverged`] when the sweeps run out; [`SolveError::Size`] for a start of another size.
pub fn coordinate_descent(
    problem: &L1Problem,
    start: Option<&DVector<f64>>,
    stop: &Descent,
) -> Result<L1Solution, SolveError> {
    let n = problem.unknowns();
    let mut y = match start {
        Some(x) if x.len() != n => {
            return Err(SolveError::Size { what: "the start", found: x.len(), expected: n });
        }
        Some(x) => problem.normalised(x),
        None => DVector::zeros(n),
    };
    let mut gradient = &problem.gram * &y - &problem.moment;
    let mut residual = f64::INFINITY;
    let mut only_support = false;
    for sweep in 1..=stop.sweeps {
        let mut greatest = 0.0_f64;
        for j in 0..n {
            if only_support && y[j] == 0.0 {
                continue;
            }
            let to = problem.shrink(j, y[j] - gradient[j]);
            let step = to - y[j];
            if step != 0.0 {
                y[j] = to;
                gradient.axpy(step, &problem.gram.column(j), 1.0);
                greatest = greatest.max(step.abs());
            }
        }
        if greatest > stop.tolerance {
            only_support = true;
        } else if only_support {
            only_support = false;
        } else {
            let solution = problem.solution(&y, sweep);
            residual = solution.kkt_residual;
            if residual <= stop.tolerance {
                return Ok(solution);
            }
            // Rounding has gathered in the running gradient: start it afresh.
            gradient = &problem.gram * &y - &problem.moment;
        }
    }
    Err(SolveError::NotConverged {
        method: "coordinate descent",
        iterations: stop.sweeps,
        residual: residual.min(problem.solution(&y, stop.sweeps).kkt_residual),
        tolerance: stop.tolerance,
    })
}
