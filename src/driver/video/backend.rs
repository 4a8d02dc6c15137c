//! Which of its backends the OpenCV that is installed was built with.

use super::super::DriverError;
use super::VideoSource;
use opencv::{core, videoio};
use std::sync::Once;

/// `CAP_OBSENSOR` of OpenCV's `videoio.hpp`, which has it from 4.7 on: earlier headers, and bindings made from them, do not.
const CAP_OBSENSOR: i32 = 2600;

/// A backend by its name and number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Backend {
    /// As OpenCV calls it.
    pub(super) name: &'static str,
    /// Its number in OpenCV.
    pub(super) api: i32,
}

impl Backend {
    /// What drives a source. Named to OpenCV each time: left to choose, it takes one that turns 16 bits into 8.
    pub(super) fn of(source: &VideoSource) -> Self {
        let (name, api) = match source {
            VideoSource::V4l2 { .. } => ("V4L2", videoio::CAP_V4L2),
            VideoSource::GStreamer { .. } | VideoSource::Stacked { .. } => {
                ("GSTREAMER", videoio::CAP_GSTREAMER)
            }
            VideoSource::OpenNi2 { .. } => ("OPENNI2", videoio::CAP_OPENNI2),
            VideoSource::Obsensor { .. } => ("OBSENSOR", CAP_OBSENSOR),
            VideoSource::Files { .. } => ("CV_IMAGES", videoio::CAP_IMAGES),
        };
        Self { name, api }
    }

    /// # Errors
    /// [`DriverError::VideoBackend`]: OpenCV was built without it.
    pub(super) fn check(self) -> Result<(), DriverError> {
        quieten();
        let refused = |installed| DriverError::VideoBackend { asked: self.name, installed };
        let list = videoio::get_backends().map_err(|error| refused(error.message))?;
        if list.iter().any(|api| api as i32 == self.api) {
            return Ok(());
        }
        let names: Vec<String> = list.iter().filter_map(|api| videoio::get_backend_name(api).ok()).collect();
        Err(refused(names.join(", ")))
    }
}

/// OpenCV's own words go to the terminal, across whatever stands there: only for who asks for them.
fn quieten() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        if std::env::var_os("OPENCV_LOG_LEVEL").is_none() {
            // It stays as loud as it was.
            let _ = core::set_log_level_1(core::CV_LOG_LEVEL_SILENT);
        }
    });
}
