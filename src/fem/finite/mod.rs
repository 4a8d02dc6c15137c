//! How a body that is held, loaded and tied deforms at finite strain (total Lagrangian, static).
//!
//! # Symbols
//! - `u`: displacement (m), component `3 n + i` for axis i of node n; `h` marks held components, `f` free ones.
//! - `R(u)` = f_int(u) − f_ext + Σ λ_j b_j: residual (N), zero in equilibrium.
//! - `K` = ∂f_int/∂u: tangent stiffness (N/m), symmetric.
//! - `b_j`: functional of tie j, `b_j · u` its displacement (m); `λ_j` the force (N) by which the body pulls on
//!   it, the tie pulls on the body by −λ_j. A spring has λ = k (b·u − d); a rigid tie has b·u = d.
//! - `d_j`: where the far end of tie j has been moved to (m).
//!
//! # The path
//! [`HeldBody::new`] (numbering, elimination order: once) → [`HeldBody::equilibrium`] (load steps, Newton) →
//! [`Equilibrium`] → [`HeldBody::linearise`] → [`Linearisation::change`] (exact sensitivities, one back-solve
//! each).
//!
//! Many small loads on one body: [`HeldBody::at_rest`] (one factor) → [`AtRest::tied`] → [`Tied::linear`],
//! [`HeldBody::equilibria`] (quasi-Newton).
//!
//! An [`Equilibrium`] is a converged state; anything else is an error that says how far the load got and why
//! not farther. Deliberately absent: loads that follow the deformation, contact, inertia, and unstable states:
//! the tangent of the free components must be positive definite, for rigid ties announced to
//! [`HeldBody::with_pads`] only along motions that leave them where they are.

mod assembly;
mod body;
mod border;
mod cell;
mod equilibrium;
mod error;
mod linearisation;
mod loads;
mod newton;
mod quasi;
mod rider;
mod solid;
mod stepping;
mod tied;

pub use body::HeldBody;
pub use equilibrium::{Equilibrium, LoadStep};
pub use error::FiniteError;
pub use linearisation::{Change, Linearisation, Sensitivity};
pub use loads::{Loads, Tie, TieKind};
pub use rider::Rider;
pub use solid::Solid;
pub use stepping::Controls;
pub use tied::{AtRest, Sought, Tied};
