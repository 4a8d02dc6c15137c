//! Why a lens was not calibrated.

use crate::units::counted;

/// Why a board was not found, or a lens not calibrated. Pictures and points are counted from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LensError {
    /// A board that cannot be.
    #[error("{name} is {value}; expected {expected}")]
    Board {
        /// Which of its numbers.
        name: &'static str,
        /// What was given.
        value: f64,
        /// What is allowed.
        expected: &'static str,
    },
    /// A board of which too little is in the picture, or nothing at all.
    #[error(
        "{found} of {points} {what} found in one grid; at least {least} must be in the picture, sharp and not in glare"
    )]
    Partial {
        /// Dots or corners.
        what: &'static str,
        /// How many of them lie in one grid.
        found: usize,
        /// How many it takes.
        least: usize,
        /// How many the board has.
        points: usize,
    },
    /// A grid that holds the board in more than one way.
    #[error(
        "a grid of {} × {} {what} was found, in which a board of {} × {} lies in {ways} ways: check the numbers of columns and rows",
        seen[0], seen[1], expected[0], expected[1]
    )]
    Larger {
        /// Dots or corners.
        what: &'static str,
        /// Columns and rows of the grid in the picture.
        seen: [usize; 2],
        /// Columns and rows of the board.
        expected: [usize; 2],
        /// In how many ways the one lies in the other.
        ways: usize,
    },
    /// Fewer pictures than the unknowns need.
    #[error("{} of the board; at least {needed} are needed, tilted in different directions", counted(*found, "picture", "pictures"))]
    TooFewPictures {
        /// How many there are.
        found: usize,
        /// How many it takes.
        needed: usize,
    },
    /// Fewer points than unknowns.
    #[error("{} in all pictures; at least {needed} are needed for so many pictures", counted(*found, "point", "points"))]
    TooFewPoints {
        /// How many there are.
        found: usize,
        /// How many it takes.
        needed: usize,
    },
    /// A point that is not finite, outside the picture, or without a covariance.
    #[error("point {index} of picture {picture} has a place or a covariance that makes no sense")]
    NotAPoint {
        /// Which picture.
        picture: usize,
        /// Which of its points.
        index: usize,
    },
    /// Points that are not those of a flat board in front of a camera.
    #[error("the points of picture {picture} are not those of a flat board in front of the camera")]
    NotABoard {
        /// Which picture.
        picture: usize,
    },
    /// A board seen from behind, which is a mirrored one.
    #[error(
        "the board of picture {picture} is mirrored: its rows and columns are numbered the wrong way round"
    )]
    Mirrored {
        /// Which picture.
        picture: usize,
    },
    /// Pictures that leave the focal length open.
    #[error(
        "the focal length is {focal_px:.0} ± {sd_px:.0} px: the pictures leave it open. The boards are turned against one another \
         by {turned_deg:.1}° at most; tilt them by 20° to 40°, each in another direction"
    )]
    Undetermined {
        /// Focal length that fits best (px).
        focal_px: f64,
        /// Its standard deviation (px); infinite where nothing limits it.
        sd_px: f64,
        /// Largest angle between the normals of two boards (°).
        turned_deg: f64,
    },
    /// An adjustment that did not come to an end.
    #[error(
        "no camera fits after {steps} steps; {rms_px:.2} px are left. Is it one camera, one focus and one board in all pictures?"
    )]
    NotConverged {
        /// Steps taken.
        steps: usize,
        /// Root mean square residual that is left (px).
        rms_px: f64,
    },
    /// A file that holds no lens.
    #[error("{why}")]
    File {
        /// What is wrong with it.
        why: String,
    },
}
