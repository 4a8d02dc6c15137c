//! Pictures of a session → the dots in them → markers of a recording.
//!
//! - **Follow** (`follow`): the tracker walks through the frames of each stretch of a session; every dot that is there at rest (`reference`) is in each
//!   frame certain, with a place in the camera frame, or a gap; so is one that is covered in part (`clear`).
//! - **Rest** (`rest`): where the dots are while nothing touches the phantom, and how surely: what a registration is found from.
//! - **Markers** (`markers`): the dots that lie on the phantom's observed surface, in the phantom frame.

mod clear;
mod follow;
mod markers;
mod reference;
mod rest;
#[cfg(test)]
mod tests;

pub use follow::{Eye, Followed, FollowedFrame, FrameCounts, Place, follow};
pub use markers::{Attached, attach_dots};
pub use rest::{RestingDot, dots_at_rest};
