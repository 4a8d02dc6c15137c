//! What strain that is not small, damage and weight add to the baseline's answer to a poke.
//!
//! The baseline is linear: with its restraint, a tip displaced by `x` along the poke answers with the force `E a x` and
//! moves the markers by `b x`. Here the same body, restraint and tip are given another law, and what comes out is the
//! *difference* between the two on one mesh, so that what the elements get wrong in both falls out.
//!
//! [`Bench::of`] (what of a settled fit matters here) → [`Lab::new`] (elements, one factor, linear answers) → one of
//! - `finite-strain` and `strain-stiffening`, [`Lab::curves`]: solved in full at a few depths; [`Stiffening`]
//!   interpolates them in the law's parameter;
//! - `stress-softening`, [`Lab::softening`];
//! - `self-weight`, [`Lab::weight`].
//!
//! Everything is for a unit modulus: forces in N/Pa, springs as `k/E`. That is exact for all laws here, whose stress is
//! in proportion to the modulus, as long as `k/E` is that of the bench; after a refit has moved it by much the
//! differences are slightly off, to the extent to which the springs matter to them, and a new lab is needed.
//!
//! Left out everywhere: what the tip does aside of the poke's direction; glue and springs that yield at large strain;
//! a rigid flat tip's resistance to turning (its difference is that of a face of the same traction that may turn);
//! the finite rotation of a marker's stand-off. Tips that may slide or lift off are refused.
//!
//! Symbols: `x` depth (m), `E` Young's modulus (Pa), `b` stiffening (–), `w` strain energy density (J/m³).

mod bench;
mod curve;
mod lab;
mod points;
mod softening;
mod solve;
mod stiffening;
#[cfg(test)]
mod tests;
mod weight;

pub use bench::{Bench, Hold, Poke};
pub use curve::{Curve, Curves};
pub use lab::Lab;
pub use softening::{Softened, Softening, Softer};
pub use stiffening::{Stiffened, Stiffening, StiffeningLaw};
pub use weight::Weight;
