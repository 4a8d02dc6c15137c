//! Young's modulus and non-negative springs on single nodes, jointly, by maximum likelihood: the default
//! estimator's counterpart for experiments whose restraints are nodal.
//!
//! The observed displacements (3 Nₒ, independent error of known standard deviation) are predicted by
//! `P (E K₁ + Σⱼ kⱼ Mⱼ)⁻¹ F`; unknown are `E` and `kⱼ ≥ 0` of the search nodes, up to and including `kⱼ = ∞`.
//! [`NodalProblem`] holds the prediction and its exact derivatives, [`fit_support`] the likelihood's maximum
//! on given nodes, [`fit`] the search for the nodes, [`bound`] the Cramér–Rao bound.
//!
//! Symbols: `β = 1 / E`, `κ = k / E` (m), `κ₀` the stiffness of a typical search node against the body,
//! `s = κ / (κ + κ₀)`: 0 is free, 1 is held.

mod alike;
mod bound;
mod forward;
mod outline;
mod select;
mod support;
#[cfg(test)]
mod tests;

pub use bound::{Bound, bound};
pub use forward::{NodalData, NodalProblem};
pub use outline::Outline;
pub use select::{NodalFit, Springs, fit};
pub use support::{SupportFit, fit_support};
