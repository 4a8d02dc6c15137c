//! Where the dots are and which is which.
//!
//! A grey picture and a depth picture of the same camera come in, frame after frame; out come the dots of a reference picture, each with
//! its centre in the picture and in space and a covariance for both, or with the reason why not.
//!
//! ```text
//! grey ─ find: levels → components → candidates → centre (blurred disc) ┐
//!                                                                       ├ identity: seeds → growth → what fits
//! depth ───────────────── plane on the ring around each dot ─ point ◄───┘
//! ```
//!
//! [`Tracker`] walks all of it; [`Finder`] alone finds dots in one picture. Pixels are counted from the centre of the upper left one, x to the
//! right and y downwards; space is the camera frame, z forward, in metres.
//!
//! Light that changes on a dot, such as the edge of a shadow, would move its centre: what it does is measured, and taken off where it is more
//! than noise (`light`, `slow`).
//!
//! An identity is [`State::Certain`] or it is a gap. Nothing in between is ever reported, and nothing that could be explained otherwise is
//! certain: see [`IdentitySettings`] for what is taken for granted about how far dots move.

mod camera;
mod centre;
mod depth;
mod dot;
mod error;
mod find;
mod identity;
mod image;
mod light;
mod point;
mod settings;
mod shown;
mod slow;
mod tilt;
mod tracker;

#[cfg(test)]
mod tests;

pub use camera::Camera;
pub use depth::{NoDepth, SurfaceAtDot};
pub use dot::{Dot, LightShift};
pub use error::TrackError;
pub use find::{Finder, Found};
pub use identity::Lost;
pub use image::{Channels, DepthView, GreyView, grey_from_colour};
pub use point::DotInSpace;
pub use settings::{DepthSettings, DotSettings, IdentitySettings, Settings};
pub use shown::ShownDots;
pub use tilt::DiscInSpace;
pub use tracker::{Frame, State, Tracker};
