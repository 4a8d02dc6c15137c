//! Which parameters explain the observations, and how surely.
//!
//! Symbols: `E` Young's modulus (Pa), `k` stiffness of a restraint patch (N/m).

mod condensed;
pub mod experiment;
pub mod l1;
mod nnls;
pub mod nodal;
pub mod published;
mod result;
mod solve_error;

pub use condensed::{Condensed, NodalForce};
pub use nnls::{NonNegative, nnls};
pub use result::{
    Discretisation, Estimate, Fit, FitMethod, MarkerView, Patch, PatchKind, PokeView, Residual, Sample,
};
pub use solve_error::SolveError;
