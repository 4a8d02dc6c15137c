//! Which parameters explain the observations, and how surely.
//!
//! Symbols: `E` Young's modulus (Pa), `k` stiffness of a restraint patch (N/m).

mod error;
pub mod l1;
mod nnls;
mod result;

pub use error::InverseError;
pub use nnls::{NonNegative, nnls};
pub use result::{
    Discretisation, Estimate, Fit, FitMethod, MarkerView, Patch, PatchKind, PokeView, Residual, Sample,
};
