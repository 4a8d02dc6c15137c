//! What a person should know before trusting a camera, with the numbers that say so.

use crate::units::counted;
use std::fmt;

/// Something that the pictures leave open, or that does not fit. Pictures are counted from 0; in sentences from 1.
#[derive(Debug, Clone, PartialEq)]
pub enum Finding {
    /// Too few pictures for holding half of them out: nothing tells whether the camera holds for other pictures.
    FewPictures {
        /// How many there are.
        found: usize,
        /// How many it takes.
        needed: usize,
    },
    /// A focal length that is not well known.
    FocalLength {
        /// The focal length (px).
        focal_px: f64,
        /// Its standard deviation (px).
        sd_px: f64,
        /// Largest angle between the normals of two boards (rad).
        turned_rad: f64,
    },
    /// A lens that is not well known somewhere in the picture.
    Distortion {
        /// Largest standard deviation of where a ray is seen (px).
        sd_px: f64,
    },
    /// Corners of the picture that no board reached: distortion there is extrapolated.
    Coverage {
        /// Largest distance of a point from the optical axis, over its depth.
        covered_radius: f64,
        /// The same for the farthest corner of the picture.
        corner_radius: f64,
    },
    /// A distortion that folds over within the picture: some pixels belong to two rays or none.
    Folds,
    /// Residuals larger than the points' noise.
    Misfit {
        /// So many times as large.
        times: f64,
    },
    /// A picture that does not fit the others; it was left out if enough others are there.
    Stranger {
        /// Which one.
        picture: usize,
        /// Root mean square residual (px).
        rms_px: f64,
    },
    /// Single points that are not where they should be.
    Outliers {
        /// In which picture.
        picture: usize,
        /// How many.
        points: usize,
    },
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::FewPictures { found, needed } => write!(
                f,
                "{} too few for holding half of them out, which takes {needed}: nothing tells whether the camera holds for others",
                counted(found, "picture is", "pictures are")
            ),
            Self::FocalLength { focal_px, sd_px, turned_rad } => write!(
                f,
                "the focal length of {focal_px:.1} px is known to ± {sd_px:.1} px only; the boards are turned against one another by {:.0}° at most",
                turned_rad.to_degrees()
            ),
            Self::Distortion { sd_px } => write!(
                f,
                "somewhere in the picture the lens is known to ± {sd_px:.2} px only: hold the board there, also tilted"
            ),
            Self::Coverage { covered_radius, corner_radius } => write!(
                f,
                "the boards reach {covered_radius:.2} from the optical axis, the corners of the picture {corner_radius:.2}: distortion there is extrapolated"
            ),
            Self::Folds => write!(
                f,
                "the distortion folds over within the picture: the boards do not reach its corners, or a term is too many"
            ),
            Self::Misfit { times } => write!(
                f,
                "residuals are {times:.1} times as large as the points' noise: the board is not flat, or the lens bends in another way"
            ),
            Self::Stranger { picture, rms_px } => write!(
                f,
                "picture {} does not fit the others ({rms_px:.2} px): mirrored, moved, or another camera?",
                picture + 1
            ),
            Self::Outliers { picture, points } => {
                write!(f, "picture {}: points not where they should be: {points}", picture + 1)
            }
        }
    }
}
