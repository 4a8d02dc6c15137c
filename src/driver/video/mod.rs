//! How depth cameras are captured: what OpenCV grabs → frames of grey levels and distances.
//!
//! [`open_video`] opens what [`VideoSource`] names and checks a first picture; then it is a
//! [`DepthCamera`](crate::device::DepthCamera). One thread for each stream grabs all the time, stamps what it has grabbed, and only then
//! unpacks it. Grey pictures and depth pictures that come separately are put together by their times.
//!
//! ```text
//! grab ─ stamp ─ retrieve ─ check ─┐ grey
//!                                  ├ pairing ─ queue ─ frame()
//! grab ─ stamp ─ retrieve ─ check ─┘ depth
//! ```
//!
//! OpenCV's calls block: for 10 s where a V4L2 device has died, without end on a pipeline that nothing comes through. No caller ever waits
//! for one of them. A thread that hangs in such a call when its camera is let go of is left behind, with what it holds, until the call
//! returns or the program ends.
//!
//! Only `backend`, `capture`, `open` and `pixels` name OpenCV. Without the cargo feature `opencv` there are the options, and a refusal.
//!
//! Absent on purpose: intrinsics and anything else that has to be calibrated; guessing of a picture's kind; frames that nobody grabbed.

mod options;
mod pipes;
pub use options::{ImageFiles, Pace, V4l2Stream, VideoOptions, VideoSource};

#[cfg(not(feature = "opencv"))]
mod absent;
#[cfg(not(feature = "opencv"))]
pub use absent::open_video;

#[cfg(feature = "opencv")]
mod backend;
#[cfg(feature = "opencv")]
mod camera;
#[cfg(feature = "opencv")]
mod capture;
#[cfg(feature = "opencv")]
mod desk;
#[cfg(feature = "opencv")]
mod feed;
#[cfg(feature = "opencv")]
mod files;
#[cfg(feature = "opencv")]
mod grab;
#[cfg(feature = "opencv")]
mod open;
#[cfg(feature = "opencv")]
mod pairing;
#[cfg(feature = "opencv")]
mod pixels;
#[cfg(feature = "opencv")]
mod times;
#[cfg(feature = "opencv")]
pub use open::open_video;

#[cfg(all(test, feature = "opencv"))]
mod tests;
