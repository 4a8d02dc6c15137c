//! Which parameters explain the observations, and how surely.
//!
//! Symbols: `E` Young's modulus (Pa), `k` stiffness of a restraint patch (N/m).

mod error;
mod evidence;
pub mod l1;
mod nnls;
mod result;
mod solve_error;

pub use error::InverseError;
pub use evidence::{DRIVE, Drive, DriveTrack, Driven, Evidence, Reading, Site, WEIGHT};
pub use nnls::{NonNegative, nnls};
pub use result::{
    Discretisation, Estimate, Fit, FitMethod, MarkerView, Patch, PatchKind, PokeView, Residual, Sample,
};
pub use solve_error::SolveError;
