//! What a tracker refuses to work with.
//!
//! A dot that is hidden, or a depth that its surroundings do not support, is no error: it is a gap in the frame, with its reason.

/// Why pictures, a camera or settings were refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TrackError {
    /// A picture without pixels.
    #[error("the {picture} picture is empty: {width} × {height} pixels")]
    Empty {
        /// Grey or depth.
        picture: &'static str,
        /// Its width (px).
        width: usize,
        /// Its height (px).
        height: usize,
    },
    /// A buffer too short for its size, or rows closer together than they are long.
    #[error(
        "the {picture} picture of {width} × {height} pixels with {stride} values a row needs {needed} values, but has {values}"
    )]
    Buffer {
        /// Grey, colour or depth.
        picture: &'static str,
        /// Its width (px).
        width: usize,
        /// Its height (px).
        height: usize,
        /// Values from the start of a row to the start of the next.
        stride: usize,
        /// Values that are there.
        values: usize,
        /// Values that are needed.
        needed: usize,
    },
    /// Pictures of a size other than the camera's.
    #[error("the {picture} picture has {} × {} pixels; the camera has {} × {}", found[0], found[1], expected[0], expected[1])]
    Size {
        /// Grey or depth.
        picture: &'static str,
        /// Width and height of the picture (px).
        found: [usize; 2],
        /// Width and height of the camera (px).
        expected: [usize; 2],
    },
    /// A depth picture whose values fit into eight bits: it has lost its upper half on the way.
    #[error("no depth is greater than {largest}: it looks as if the driver delivered 8 bits instead of 16")]
    EightBitDepth {
        /// The largest value that was found.
        largest: u16,
    },
    /// A number that makes no sense.
    #[error("{name} is {value}; expected {expected}")]
    Setting {
        /// What it is.
        name: &'static str,
        /// What was given.
        value: f64,
        /// What is allowed.
        expected: &'static str,
    },
    /// Too few dots to tell them apart by their neighbours.
    #[error("{found} reference dots; at least {least} are needed to tell dots apart by their neighbours")]
    TooFewDots {
        /// How many there are.
        found: usize,
        /// How many are needed.
        least: usize,
    },
    /// More dots than the tracker is made for.
    #[error("{found} reference dots; at most {most} can be tracked")]
    TooManyDots {
        /// How many there are.
        found: usize,
        /// How many are possible.
        most: usize,
    },
    /// Two reference dots in the same place.
    #[error("reference dots {first} and {second} lie {apart_px:.2} px apart: they cannot be told apart")]
    Coincident {
        /// One of them.
        first: usize,
        /// The other.
        second: usize,
        /// Their distance (px).
        apart_px: f64,
    },
    /// Time that does not go on.
    #[error("a frame at {time_s} s after one at {last_s} s: frames must come in order")]
    Time {
        /// Time of the frame (s).
        time_s: f64,
        /// Time of the one before (s).
        last_s: f64,
    },
}
