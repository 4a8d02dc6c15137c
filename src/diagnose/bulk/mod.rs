//! Linear changes of the body: a place of another modulus, a stiffer axis, another Poisson's ratio, glue that has let go
//! or gives, elements that are too coarse → what they do to the compliance between tips, restraint discs and markers.
//!
//! Everything is for a unit modulus of the unvaried body, as in the body of a march in time. A [`Lab`] answers exactly,
//! with derivatives, by factoring the changed body anew on the same elements, or to first order, quickly, for scans.
//!
//! Only differences from the baseline are handed on, and loads are the baseline's: a tip keeps the shape of its traction.
//! Where a change reaches under a tip or a disc that is smaller than the elements, its effect there is as coarse as they
//! are; for changes of the whole body that is made up for (`own.rs`).
//!
//! | entry | what is modelled | what is left out |
//! | --- | --- | --- |
//! | `inclusion` | one bonded ball of the phantom's Poisson's ratio | other shapes; the jump of strain at its rim is smeared over a cell, so that a ball of less than two cells across is a rough one |
//! | `anisotropy` | more (or less) stiffness along one axis | stiffness in shear and lateral strain of their own |
//! | `poisson-ratio` | another ratio, the modulus kept | – |
//! | `base-debonding` | a disc of glue, seen along z, without traction | contact and friction of the loose part; the singular stress at its rim, so that a disc of less than two cells across gives too little |
//! | `compliant-base` | the same foundation in all directions, everywhere | a layer's own Poisson effect, its thickness and edges |
//! | `coarse-mesh` | the pattern of the difference to finer elements | errors that finer elements at the end of the glue and near discs do not change |

mod ball;
mod changes;
mod exact;
mod finer;
mod first;
mod glue;
mod knob;
mod lab;
mod laws;
mod loose;
mod own;
mod places;
mod rim;
#[cfg(test)]
mod tests;

pub use changes::BodyChange;
pub use knob::BulkKnob;
pub use lab::Lab;
