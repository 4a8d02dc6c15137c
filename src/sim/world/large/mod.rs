//! Large strain and softening: the phantom as hexahedra of its own, total Lagrangian, one mesh a tip.
//!
//! [`Large`] says which law; `material` is that law at one point, `solid` the elements, `descent` the equilibria as one tip
//! goes in and out, `course` the session. Elements are few and points of integration are eight a box: what they get wrong
//! in the linear answer is known, because the accurate linear bench gives it, and is taken off.
//!
//! Symbols: `F` deformation gradient, `P` first Piola–Kirchhoff stress (Pa), `w` strain energy density (J/m³).

mod course;
mod descent;
mod effect;
mod material;
mod solid;

pub(super) use course::{LargeBody, LargeCourse};
pub use effect::{Large, StiffeningLaw};
