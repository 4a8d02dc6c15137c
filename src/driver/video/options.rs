//! Where a depth camera's pictures come from, and what they should be.

use super::super::DriverError;
use std::fmt;
use std::path::PathBuf;
use std::time::Duration;

/// Where the pictures come from.
#[derive(Debug, Clone, PartialEq)]
pub enum VideoSource {
    /// Two devices of Video4Linux. Times are the kernel's, where it tells them on the host's clock.
    V4l2 {
        /// Grey levels, or colours.
        grey: V4l2Stream,
        /// Distances: 16 bits in one channel (`Y16 `), or the bytes of such a picture in one row (`Z16 `).
        depth: V4l2Stream,
    },
    /// Two pipelines of GStreamer, each ending in an `appsink`. `sync=false` has it hand over what there is at once, `max-buffers=4` lets
    /// some wait; with `drop=true` pictures go missing uncounted. Of a program that writes into pipes: [`VideoSource::pipes`].
    GStreamer {
        /// `GRAY8`, or `BGR`.
        grey: String,
        /// `GRAY16_LE`.
        depth: String,
    },
    /// One pipeline of GStreamer for both pictures, which cannot be paired wrongly: `GRAY8` of the width of the pictures and three times
    /// their height. The upper third are the grey levels; below are the distances, two bytes each, the lower one first. Of a program that
    /// writes into a pipe: [`VideoSource::stacked_pipe`].
    Stacked {
        /// The pipeline.
        pipeline: String,
    },
    /// A camera behind OpenNI 2, where OpenCV was built with it.
    OpenNi2 {
        /// Which one, from 0.
        index: u32,
    },
    /// A camera by Orbbec, where OpenCV was built with its backend (4.7 and later).
    Obsensor {
        /// Which one, from 0.
        index: u32,
    },
    /// Numbered image files.
    Files {
        /// Grey levels, or colours.
        grey: ImageFiles,
        /// Distances: 16 bits in one channel.
        depth: ImageFiles,
        /// How fast they come.
        pace: Pace,
    },
}

/// One device of Video4Linux.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct V4l2Stream {
    /// Such as `/dev/video0`, or a name below `/dev/v4l/by-id` that stays.
    pub device: PathBuf,
    /// The pixel format to ask for, four letters such as `Y16 `; the device's own where none is given.
    pub four_cc: Option<[char; 4]>,
}

/// Image files of one stream. A gap in their numbers is a gap in the stream, counted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ImageFiles {
    /// Their names, such as `grey_%05d.png`, with no other digits in the name: OpenCV takes the first ones for the number.
    pub pattern: PathBuf,
    /// When each was taken: CSV with the columns `frame` and `time_s`, both rising.
    pub times: PathBuf,
}

/// How fast files come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pace {
    /// As they were taken: who does not fetch them in time loses some, as of a live camera.
    AsTaken,
    /// As they are fetched: none is lost. Their host times are the same as at the other pace, so that they may lie ahead.
    AsFetched,
}

/// What to capture.
#[derive(Debug, Clone, PartialEq)]
pub struct VideoOptions {
    /// Where the pictures come from.
    pub source: VideoSource,
    /// Width and height that every picture must have (px).
    pub size: [usize; 2],
    /// Nominal rate (frames a second). Pictures more than half its interval apart are no pair.
    pub rate_hz: f64,
    /// One unit of a depth picture (m).
    pub metres_per_unit: f64,
    /// Frames that wait until they are fetched, at most.
    pub queue: usize,
    /// How long a started camera may send nothing before it counts as dead.
    pub silence: Duration,
    /// How long it may take to open it and to get its first picture.
    pub patience: Duration,
}

impl VideoOptions {
    /// Distances in millimetres, a quarter of a second of frames may wait, silent for 0.8 s is dead (or three intervals of a slower camera),
    /// 10 s to open.
    pub fn new(source: VideoSource, size: [usize; 2], rate_hz: f64) -> Self {
        Self {
            source,
            size,
            rate_hz,
            metres_per_unit: 1e-3,
            queue: 2 + (0.25 * rate_hz) as usize,
            silence: Duration::from_secs_f64((3.0 / rate_hz).clamp(0.8, 60.0)),
            patience: Duration::from_secs(10),
        }
    }

    /// # Errors
    /// [`DriverError::VideoSetting`]: a value that makes no sense.
    pub(super) fn check(&self) -> Result<(), DriverError> {
        let wrong = |name, value: String, expected| Err(DriverError::VideoSetting { name, value, expected });
        let [width, height] = self.size;
        if !(1..=MOST_PIXELS).contains(&width) || !(1..=MOST_PIXELS).contains(&height) {
            return wrong("size", format!("{width} × {height}"), "1 to 16384 pixels each way");
        }
        if !(0.1..=1000.0).contains(&self.rate_hz) {
            return wrong("rate_hz", self.rate_hz.to_string(), "0.1 to 1000 frames a second");
        }
        if !(1e-7..=0.1).contains(&self.metres_per_unit) {
            return wrong("metres_per_unit", self.metres_per_unit.to_string(), "metres: 1e-7 to 0.1");
        }
        if !(1..=1000).contains(&self.queue) {
            return wrong("queue", self.queue.to_string(), "1 to 1000 frames");
        }
        if self.silence.as_secs_f64() * self.rate_hz < 2.0 {
            return wrong(
                "silence",
                format!("{} ms", self.silence.as_millis()),
                "at least two intervals of frames",
            );
        }
        let pipelines = match &self.source {
            VideoSource::GStreamer { grey, depth } => vec![grey, depth],
            VideoSource::Stacked { pipeline } => vec![pipeline],
            _ => Vec::new(),
        };
        match pipelines.into_iter().find(|text| !text.contains("appsink")) {
            Some(text) => wrong("pipeline", format!("{text:?}"), "a pipeline that ends in an appsink"),
            None => Ok(()),
        }
    }

    /// Time between two frames (s).
    #[cfg(feature = "opencv")]
    pub(super) fn interval_s(&self) -> f64 {
        1.0 / self.rate_hz
    }
}

/// Wider than any camera.
const MOST_PIXELS: usize = 16_384;

impl fmt::Display for VideoSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::V4l2 { grey, depth } => {
                write!(f, "{} and {}", grey.device.display(), depth.device.display())
            }
            Self::GStreamer { grey, depth } => write!(f, "{grey} and {depth}"),
            Self::Stacked { pipeline } => f.write_str(pipeline),
            Self::OpenNi2 { index } => write!(f, "OpenNI 2 camera {index}"),
            Self::Obsensor { index } => write!(f, "Orbbec camera {index}"),
            Self::Files { grey, depth, .. } => {
                write!(f, "{} and {}", grey.pattern.display(), depth.pattern.display())
            }
        }
    }
}
