//! Raw frames that another program writes into named pipes, as pipelines of GStreamer.
//!
//! Three things of OpenCV 4.6 and GStreamer 1.22 decide how such a pipeline looks (each met here, and tried):
//! - OpenCV does not look how long a buffer is: one that is too short, because the writer died within a frame, is read past its end and
//!   ends the program. `rawvideoparse` passes on whole frames only.
//! - `rawvideoparse` behind a `filesrc` asks a pipe for its size and finds no frame in it. A `queue` between them has it take what comes.
//! - OpenCV asks for `GRAY8` or `BGR` unless the element before the `appsink` can give neither: the format is said there once more.

use super::VideoSource;
use std::path::Path;

impl VideoSource {
    /// Two pipes: of grey levels, a byte each, and of distances, two bytes each, the lower one first. `size`: width and height (px).
    pub fn pipes(grey: &Path, depth: &Path, size: [usize; 2], rate_hz: f64) -> Self {
        Self::GStreamer {
            grey: raw(grey, ["gray8", "GRAY8"], size, 1, rate_hz),
            depth: raw(depth, ["gray16-le", "GRAY16_LE"], size, 2, rate_hz),
        }
    }

    /// One pipe for both: for each frame all grey levels, then all distances, written as for [`pipes`](Self::pipes). `size`: width and
    /// height of a picture (px).
    pub fn stacked_pipe(both: &Path, [width, height]: [usize; 2], rate_hz: f64) -> Self {
        Self::Stacked { pipeline: raw(both, ["gray8", "GRAY8"], [width, 3 * height], 1, rate_hz) }
    }
}

/// `formats`: as `rawvideoparse` calls it, and as others do.
fn raw(path: &Path, formats: [&str; 2], [width, height]: [usize; 2], bytes: usize, rate_hz: f64) -> String {
    let location = path.to_string_lossy().replace('\\', "\\\\").replace('"', "\\\"");
    let (frame, millihertz) = (width * height * bytes, (1e3 * rate_hz).round());
    let [parsed, passed] = formats;
    format!(
        "filesrc location=\"{location}\" blocksize={frame} ! queue max-size-buffers=2 max-size-bytes=0 ! rawvideoparse width={width} \
         height={height} format={parsed} framerate={millihertz}/1000 ! video/x-raw,format={passed} ! appsink sync=false max-buffers=4"
    )
}
