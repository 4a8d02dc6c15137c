//! Where the dots on the phantom are, frame by frame, from whoever can tell: a camera with a tracker, a recording, a simulated bench.

use super::{DepthCameraFormat, DepthCameraIdentity, DepthFrame, DeviceError, FrameLosses};
use crate::clock::HostTime;

/// One marker in one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MarkerPosition {
    /// Its number.
    pub marker: u32,
    /// Position in the phantom frame (m).
    pub position_m: [f64; 3],
}

/// All markers that were seen at one time. One that was not seen is not in it.
#[derive(Debug, Clone, PartialEq)]
pub struct MarkerFrame {
    /// When the frame was grabbed.
    pub host: HostTime,
    /// Number of the frame, from 0; a gap is a frame that was lost.
    pub number: u32,
    /// What was seen, ascending by number.
    pub markers: Vec<MarkerPosition>,
}

/// What is known of a dot in a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sight {
    /// Which one it is, and where it is in space.
    Certain,
    /// Something is there, but which dot it is, or where in space, is not certain.
    Uncertain,
    /// Nothing was seen of it.
    Lost,
    /// It looks like a dot, and is none of those that are followed.
    New,
}

/// Where a dot is in a grey picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DotInPicture {
    /// Its number among those that are followed; none of one that is not.
    pub number: Option<u32>,
    /// Centre (px), from the centre of the upper left pixel; where it was last, if the picture does not show it.
    pub centre_px: [f64; 2],
    /// Radius (px).
    pub radius_px: f64,
    /// What is known of it.
    pub sight: Sight,
}

/// A source of marker positions.
pub trait MarkerSource: Send {
    /// Frames a second.
    fn rate_hz(&self) -> f64;

    /// The next frame, or none when there was none until `until`.
    ///
    /// # Errors
    /// [`DeviceError`]: lost, silent for longer than its budget.
    fn frame(&mut self, until: HostTime) -> Result<Option<MarkerFrame>, DeviceError>;

    /// The pictures in which the last frame was seen, once; none where it was not seen in pictures.
    fn pictures(&mut self) -> Option<DepthFrame> {
        None
    }

    /// The dots in the grey picture of the last frame, those that are followed first; none where it was not seen in pictures.
    fn dots(&self) -> &[DotInPicture] {
        &[]
    }

    /// Gives the memory of pictures back for those to come. Nobody has to.
    fn recycle(&mut self, pictures: DepthFrame) {
        drop(pictures);
    }

    /// The camera behind it and what its pictures are worth, if there is one.
    fn camera(&self) -> Option<(&DepthCameraIdentity, &DepthCameraFormat)> {
        None
    }

    /// What became of the camera's pictures so far, if there is one.
    fn losses(&self) -> Option<FrameLosses> {
        None
    }
}
