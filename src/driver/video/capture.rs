//! One `VideoCapture`, and the picture that it gave last. All of its calls block.

use super::backend::Backend;
use opencv::core::{Mat, Vector};
use opencv::prelude::*;
use opencv::videoio::{
    CAP_PROP_FPS, CAP_PROP_FRAME_HEIGHT, CAP_PROP_FRAME_WIDTH, CAP_PROP_POS_MSEC, VideoCapture,
};
use std::path::Path;

/// What is opened: a device by its number, or whatever else by its text.
pub(super) enum Opened<'a> {
    Index(u32),
    Text(&'a str),
    Path(&'a Path),
}

pub(super) struct Capture {
    capture: VideoCapture,
    picture: Mat,
}

impl Capture {
    /// `properties`: numbers of OpenCV's `CAP_PROP_…`, each with its value.
    ///
    /// # Errors
    /// What OpenCV says; nothing where it says nothing.
    pub(super) fn open(backend: Backend, what: &Opened<'_>, properties: &[[i32; 2]]) -> Result<Self, String> {
        let properties: Vector<i32> = properties.iter().copied().flatten().collect();
        let capture = match *what {
            Opened::Index(index) => {
                let index = i32::try_from(index).map_err(|error| error.to_string())?;
                VideoCapture::new_with_params(index, backend.api, &properties)
            }
            Opened::Text(text) => VideoCapture::from_file_with_params(text, backend.api, &properties),
            Opened::Path(path) => VideoCapture::from_file_with_params(path, backend.api, &properties),
        };
        let capture = capture.map_err(|error| error.message)?;
        if !capture.is_opened().map_err(|error| error.message)? {
            return Err(String::new());
        }
        Ok(Self { capture, picture: Mat::default() })
    }

    /// Waits for the next picture; false when there is none any more.
    pub(super) fn grab(&mut self) -> Result<bool, String> {
        self.capture.grab().map_err(|error| error.message)
    }

    /// Unpacks what was grabbed. `channel`: which of the pictures that were grabbed together, 0 where there is one.
    pub(super) fn retrieve(&mut self, channel: i32) -> Result<&Mat, String> {
        match self.capture.retrieve(&mut self.picture, channel) {
            Ok(true) => Ok(&self.picture),
            Ok(false) => Err("nothing".to_owned()),
            Err(error) => Err(error.message),
        }
    }

    /// When the grabbed picture was taken by the backend's own clock (s).
    pub(super) fn position_s(&self) -> Option<f64> {
        self.capture.get(CAP_PROP_POS_MSEC).ok().map(|ms| 1e-3 * ms).filter(|s| s.is_finite())
    }

    /// What it says of itself.
    pub(super) fn description(&self) -> String {
        let property = |id| self.capture.get(id).unwrap_or(0.0);
        let name = self.capture.get_backend_name().unwrap_or_default();
        format!(
            "{name} {} × {} at {} frames/s",
            property(CAP_PROP_FRAME_WIDTH),
            property(CAP_PROP_FRAME_HEIGHT),
            property(CAP_PROP_FPS)
        )
    }
}
