//! What a camera's lens does, from pictures of a flat board.
//!
//! | question | answer |
//! | --- | --- |
//! | which board is it? | [`Board`], of dots or of squares |
//! | where are its points in a picture? | [`board_in`] |
//! | what camera took these pictures? | [`calibrate_lens`]: a [`crate::track::Camera`] with its covariance and with [`Finding`]s on what the pictures leave open |
//! | where is that kept? | [`LensFile`] |
//!
//! Frames: the board frame has its origin in the first point, x along the columns, y along the rows and z away from who looks at it, so
//! that it is right-handed like the camera frame (x right, y down, z forward). Metres and pixels; pixels are counted from the centre of the
//! upper left one.
//!
//! What pictures of a flat board cannot tell:
//!
//! - A wrong pitch. All distances grow with it and the camera stays the same: measure the printed board with a ruler.
//! - Which end of the board is up. A grid looks the same turned by 180°, with as many rows as columns also by 90°; its pose is another one,
//!   the camera is not.
//! - Which points of a board that is partly outside of the picture are seen: it may be shifted by some columns or rows, the camera not.
//! - That all pictures are mirrored. A grid is its own mirror image, and a mirrored camera with a mirrored principal point explains them as
//!   well. A mirrored picture among others shows in its residuals: see [`LensFound::strangers`].

mod adjust;
mod block;
mod board;
mod calibrate;
mod corners;
mod crossing;
mod error;
mod extent;
mod finding;
mod found;
mod held_out;
mod homography;
mod lattice;
mod lens_file;
mod normal;
mod pose;
mod profile;
mod report;
mod seen;
mod smooth;
mod zhang;

#[cfg(test)]
mod tests;

pub use board::{Board, BoardKind};
pub use calibrate::{Distortion, calibrate_lens, calibrate_lens_with};
pub use error::LensError;
pub use finding::Finding;
pub use found::{LeftOut, LensFound, PictureFit};
pub use lens_file::LensFile;
pub use pose::Pose;
pub use seen::{BoardPoint, BoardView, board_in};
