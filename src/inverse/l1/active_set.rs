//! The penalised problem solved exactly on a support that is found by an active set.
//!
//! With the signs fixed at σ the penalty is linear and σ∘y ≥ 0 is a non-negative problem for
//! [`crate::inverse::nnls`]. Unknowns at zero take the sign towards which they would leave; when an answer
//! shows that an unknown wants the other sign, it is turned and the problem solved again from the same
//! support. The objective falls at each turn, so that no set of signs comes twice.

use super::{L1Problem, L1Solution, Sign};
use crate::inverse::{SolveError, nnls};
use nalgebra::{DMatrix, DVector};

/// Accepted [`L1Problem::kkt_residual`].
const TOLERANCE: f64 = 1e-9;

/// Minimises, starting from the signs and the support of `start` (n), zero when there is none.
///
/// Entries of `start` below 1e-6 of the greatest (in normalised columns) count as zero, so that the answer of
/// an interior-point method can be given as it is.
///
/// # Errors
/// [`SolveError::NotConverged`] when the signs do not settle or the columns are too nearly dependent for
/// the answer to reach 1e-9.
pub fn active_set(problem: &L1Problem, start: Option<&DVector<f64>>) -> Result<L1Solution, SolveError> {
    let n = problem.unknowns();
    let mut y = match start {
        Some(x) if x.len() != n => {
            return Err(SolveError::Size { what: "the start", found: x.len(), expected: n });
        }
        Some(x) => problem.normalised(x),
        None => DVector::zeros(n),
    };
    let floor = 1e-6 * y.amax();
    y.apply(|v| *v = if v.abs() <= floor { 0.0 } else { *v });
    let mut changes = 0;
    let mut residual = f64::INFINITY;
    for _ in 0..=2 * n {
        let slope = &problem.moment - &problem.gram * &y;
        let signs = DVector::from_fn(n, |j, _| match problem.sign {
            Sign::NonNegative => 1.0,
            Sign::Free if y[j] != 0.0 => y[j].signum(),
            Sign::Free => slope[j].signum(),
        });
        let gram = DMatrix::from_fn(n, n, |r, c| signs[r] * problem.gram[(r, c)] * signs[c]);
        let moment = signs.component_mul(&problem.moment) - &problem.penalty;
        let support: Vec<usize> = (0..n).filter(|&j| y[j] != 0.0).collect();
        let found = nnls(&gram, &moment, &support)?;
        changes += found.changes;
        y = found.x.component_mul(&signs);
        let solution = problem.solution(&y, changes);
        residual = solution.kkt_residual;
        if residual <= TOLERANCE {
            return Ok(solution);
        }
    }
    Err(SolveError::NotConverged {
        method: "the active-set method",
        iterations: changes,
        residual,
        tolerance: TOLERANCE,
    })
}
