//! Evidence that needs a whole camera: exact points, points with noise, and pictures of boards by a renderer of its own.

mod dice;
mod pictures;
mod points;
mod refusals;
mod render;
pub(crate) mod scene;
