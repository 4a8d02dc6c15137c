//! What was observed: the phantom and its pokes, what the stage, the force sensor and the camera reported,
//! and how noisy each of them is.
//!
//! Everything is in the phantom frame and on one clock; a [`Recording`] has passed every check of the bundle
//! format before it reaches anybody who computes with it.

mod recording;

pub use recording::{
    Contact, Gravity, MarkerRow, Markers, Noise, Phantom, PlannedPoke, Poke, Recording, Stage, Tip, TipShape,
    Wrench,
};
