//! Which parameters explain the observations, and how surely.
//!
//! Symbols: `E` Young's modulus (Pa), `k` stiffness of a restraint patch (N/m).

mod error;
mod evidence;
mod result;

pub use error::InverseError;
pub use evidence::{DRIVE, Drive, DriveTrack, Driven, Evidence, Reading, Site, WEIGHT};
pub use result::{
    Discretisation, Estimate, Fit, FitMethod, MarkerView, Patch, PatchKind, PokeView, Residual, Sample,
};
