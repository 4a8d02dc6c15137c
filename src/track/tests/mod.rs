//! Evidence that needs pictures: a renderer of its own, and what is measured with it.

mod front_door;
pub(crate) mod random;
pub(crate) mod render;
