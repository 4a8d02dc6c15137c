//! The simulated bench at the level of pixels: what a structured-light camera above the phantom would deliver.
//!
//! A [`Renderer`] is put in front of a [`Surface`] with painted [`Dot`]s once; each [`Scene`] (where the vertices are, where the tip is)
//! then makes one [`Frame`]: grey levels, depth and, for tests and proofs only, the truth. Nothing here knows what physics moves the
//! surface, and nothing here is shared with what finds the dots in the pictures: the camera model, too, is the bench's own.
//!
//! Frames: the phantom frame (m) for everything that is handed in and for the truth; the camera frame has x to the right, y down and z along
//! the optical axis; pixel coordinates count from the centre of the first pixel, columns first.
//!
//! What is not there: motion blur within a row's exposure, light from one surface to another, focus, colour.

mod camera;
mod depth;
mod error;
mod frame;
mod lens;
mod light;
mod local;
mod noise;
mod outline;
mod paint;
mod raster;
mod renderer;
mod scene;
mod sensor;
mod solid;
mod spread;
mod surface;
mod surroundings;
#[cfg(test)]
mod verification;
mod write;

pub use camera::Camera;
pub use depth::DepthSetup;
pub use error::PixelError;
pub use frame::{Depth, DotTruth, Frame, Grey};
pub use lens::Lens;
pub use light::{Finish, Lamp, Lighting};
pub use renderer::{PixelSetup, Renderer, Shutter};
pub use scene::{Dot, Scene};
pub use sensor::Sensor;
pub use solid::{Shape, Solid};
pub use surface::{Attachment, Surface};
pub use write::{Channels, FrameFolder};
