//! Least squares: which parameters bring a model closest to what was measured, and how surely?
//!
//! | question | answer |
//! | --- | --- |
//! | model linear in its parameters? | [`fit_linear`], or [`fit_polynomial`] → [`LinearFit`]; in twice the digits of a double |
//! | model of any other kind? | a [`Model`], [`fit`] → [`Regression`] with the [`Termination`] |
//! | derivatives without writing them? | [`derivatives`] of a function of dual numbers |
//!
//! Both factor the Jacobian by orthogonal reflections and never form JᵀJ, whose condition is the square of J's. Verified on the certified
//! sets of NIST in `tests/calibration/certified.rs`.

mod dual;
mod error;
mod linear;
mod model;
mod nonlinear;
mod offset;
mod trust;
mod twofold;

pub use dual::derivatives;
pub use error::RegressionError;
pub use linear::{LinearFit, fit_linear, fit_polynomial};
pub use model::{Model, Options, Regression, Termination};
pub use nonlinear::fit;
