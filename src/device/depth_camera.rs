//! What a depth camera is: a stream of pairs of pictures, grey levels and distances, of the same view, and what their values are worth.

use super::DeviceError;
use crate::clock::HostTime;

/// Grey levels, 0 is black; row after row, from the upper left pixel.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct GreyPicture {
    /// Pixels a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width` × `height` levels.
    pub pixels: Vec<u8>,
}

/// Distances along the optical axis in units of [`DepthCameraFormat::metres_per_unit`], 0 where there is none; row after row, from the
/// upper left pixel.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct DepthPicture {
    /// Pixels a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width` × `height` distances.
    pub values: Vec<u16>,
}

/// Both pictures of one instant, and when that was.
#[derive(Debug, Clone, PartialEq)]
pub struct DepthFrame {
    /// When the grey picture was grabbed, before anything was unpacked; of a recording, when that would have been had it been live.
    pub host: HostTime,
    /// The source's own number of the grey picture; a gap is a frame that was lost.
    pub number: u32,
    /// The source's own time of the grey picture (s); none where it tells none.
    pub device_s: Option<f64>,
    /// What the dots are found in.
    pub grey: GreyPicture,
    /// How far away everything is.
    pub depth: DepthPicture,
}

/// Which camera it is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DepthCameraIdentity {
    /// What drives it, such as `GSTREAMER`.
    pub backend: String,
    /// Where its pictures come from: devices, pipelines or files.
    pub source: String,
    /// What it says of itself.
    pub description: String,
}

/// What its pictures are worth. Both pictures of a frame have this size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthCameraFormat {
    /// Pixels a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Nominal rate (frames a second).
    pub rate_hz: f64,
    /// One unit of a depth picture (m).
    pub metres_per_unit: f64,
}

/// What became of a camera's pictures, counted since its stream was last started.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FrameLosses {
    /// Frames that came whole.
    pub received: u64,
    /// Frames that came whole while nobody fetched the earlier ones, and were thrown away.
    pub dropped: u64,
    /// Pictures whose partner never came.
    pub unpaired: u64,
    /// Pictures from before the stream was started; ignored.
    pub stale: u64,
    /// Pictures that are empty, or of another kind or size than the format says.
    pub malformed: u64,
    /// Pictures that are missing by the source's own numbers, where it has any.
    pub lost: u64,
}

/// A camera that sees grey levels and distances.
pub trait DepthCamera: Send {
    /// Which one it is.
    fn identity(&self) -> &DepthCameraIdentity;

    /// What its pictures are worth.
    fn format(&self) -> &DepthCameraFormat;

    /// Begins the stream: of what is grabbed from here on, all is passed on; a recording begins anew. Counts begin anew too.
    ///
    /// # Errors
    /// [`DeviceError`]: the camera is lost.
    fn start(&mut self) -> Result<(), DeviceError>;

    /// The next frame, or none when there was none until `until`. Frames that came before the camera was lost are handed over first.
    ///
    /// # Errors
    /// [`DeviceError`]: lost, silent for longer than its budget, only pictures that are none; [`DeviceError::Ended`] after the last frame
    /// of a recording.
    fn frame(&mut self, until: HostTime) -> Result<Option<DepthFrame>, DeviceError>;

    /// Gives a frame's memory back for those to come. Nobody has to.
    fn recycle(&mut self, frame: DepthFrame) {
        drop(frame);
    }

    /// What became of its pictures so far.
    fn losses(&self) -> FrameLosses;

    /// Ends the stream; frames that were not fetched are gone.
    ///
    /// # Errors
    /// [`DeviceError`]: the camera is lost.
    fn stop(&mut self) -> Result<(), DeviceError>;
}
