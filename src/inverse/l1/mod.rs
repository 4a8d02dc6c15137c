//! Least squares with an l1 penalty: minimise ½‖Ax − b‖² + Σⱼ λⱼ|xⱼ|, with free signs or with x ≥ 0.
//!
//! An [`L1Problem`] is solved by [`interior_point`] (a certificate of its own, no exact zeros), by
//! [`coordinate_descent`] (warm starts, exact zeros, many sweeps when columns are nearly parallel) or by
//! [`active_set`] (exact on the support it ends with; the polish of the other two). Each returns an
//! [`L1Solution`] with the violation of the optimality conditions at the answer, measured by the same
//! function; an iteration that does not reach its tolerance is an error.

mod active_set;
mod descent;
mod interior_point;
mod problem;
#[cfg(test)]
mod tests;

pub use active_set::active_set;
pub use descent::{Descent, coordinate_descent};
pub use interior_point::interior_point;
pub use problem::{L1Problem, L1Solution, Sign};
