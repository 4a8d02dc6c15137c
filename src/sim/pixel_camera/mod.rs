//! The simulated camera above the simulated phantom: what it delivers of a session that goes on or has happened.
//!
//! A [`PixelCamera`] is put in front of a bench ([`PixelCamera::above`]) or of a session that has happened ([`PixelCamera::of_past`]), both
//! prepared with a skin. From then on every [`Glimpse`](super::Glimpse) makes a [`Frame`](super::pixels::Frame): grey levels, depth,
//! and the truth of every dot. The dots are the bench's markers, under the same numbers.
//!
//! Two ways lead out, both [`FrameSink`]s: files in a folder ([`FrameFolder`](super::pixels::FrameFolder)), and raw frames in a named
//! pipe ([`FramePipe`]), which a media pipeline reads as it would a camera. [`PixelCamera::film`] goes through a session that has
//! happened; a [`LiveCamera`] takes pictures of a bench that goes on, at the pace of the clock and in a thread of its own.

mod camera;
mod frame_pipe;
mod live_camera;
mod pipe;
mod sink;
#[cfg(test)]
mod tests;
mod truth;

pub use camera::{PixelCamera, PixelCameraSetup};
pub use frame_pipe::FramePipe;
pub use live_camera::LiveCamera;
pub use sink::FrameSink;
pub use truth::TruthTable;
