//! Rubber bands → stiffness: how much force does a band add per metre, at the pull that it has on the rig?
//!
//! | question | answer |
//! | --- | --- |
//! | how was it pulled, and how often? | [`Stretching`], cut into [`Branch`]es |
//! | slack, slope, knee? | [`estimate`] → [`Stiffness`] |
//!
//! Extension x in metres as the machine gives it, force in newtons, a pull positive. Bands side by side share the force: all that is said is of all
//! together, and of one where their number is given.

mod error;
mod estimate;
mod line;
mod stretching;

pub use error::BandError;
pub use estimate::{OfBranch, Settings, Stiffness, estimate};
pub use line::{Bend, Line};
pub use stretching::{Branch, Stretching};
