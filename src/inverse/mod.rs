//! Which parameters explain the observations, and how surely.
//!
//! Symbols: `E` Young's modulus (Pa), `k` stiffness of a restraint patch (N/m).

mod result;

pub use result::{
    Discretisation, Estimate, Fit, FitMethod, MarkerView, Patch, PatchKind, PokeView, Residual, Sample,
};
