//! Dumb-bells → Young's modulus: what pulls to failure, and pulls short of it, say of a material at small strain.
//!
//! | question | answer |
//! | --- | --- |
//! | what was pulled, how far, with which force? | [`Pull`], from a table of [`crate::calib::export`] |
//! | how does stress follow from stretch? | [`Elastic`] |
//! | which modulus, and within what? | [`estimate`] → [`Modulus`] |
//!
//! Engineering stress P = force over first cross-section, strain ε = extension over first length, stretch λ = 1 + ε. SI.
//! E is the slope at zero strain. A strain from the crosshead holds what grips and machine give way, so that such an E is a lower bound of
//! sorts: results carry the source (ASTM D638 rules it out for moduli; on soft silicones it is what there is).

mod elastic;
mod error;
mod estimate;
mod evidence;
mod interval;
mod pull;

pub use elastic::Elastic;
pub use error::DumbbellError;
pub use estimate::{Modulus, OfOne, Settings, estimate};
pub use evidence::Score;
pub use interval::{Budget, Tolerances};
pub use pull::Pull;
