//! A depth camera whose pictures come through OpenCV.

use super::desk::{Desk, Ending, Trouble};
use crate::clock::HostTime;
use crate::device::{
    DepthCamera, DepthCameraFormat, DepthCameraIdentity, DepthFrame, DeviceError, FrameLosses,
};
use std::io;
use std::sync::Arc;

/// The end of it that is not in the threads that grab.
#[derive(Debug)]
pub(super) struct VideoCamera {
    pub(super) desk: Arc<Desk>,
    pub(super) identity: DepthCameraIdentity,
    pub(super) format: DepthCameraFormat,
    /// Files can begin anew, cameras cannot.
    pub(super) recorded: bool,
}

impl VideoCamera {
    fn device(&self) -> String {
        format!("depth camera at {}", self.identity.source)
    }

    fn ended(&self, ending: Ending) -> DeviceError {
        let device = self.device();
        match ending {
            Ending::Over => DeviceError::Ended { device, frames: self.losses().received },
            Ending::Gone(said) => {
                DeviceError::Lost { device, source: io::Error::new(io::ErrorKind::UnexpectedEof, said) }
            }
            Ending::Malformed(malformed) => DeviceError::Nonsense {
                device,
                said: format!("{}, not {}", malformed.found, malformed.expected),
                expected: "pictures like the first one",
            },
        }
    }
}

impl DepthCamera for VideoCamera {
    fn identity(&self) -> &DepthCameraIdentity {
        &self.identity
    }

    fn format(&self) -> &DepthCameraFormat {
        &self.format
    }

    fn start(&mut self) -> Result<(), DeviceError> {
        self.desk.start(self.recorded).map_err(|ending| self.ended(ending))
    }

    fn frame(&mut self, until: HostTime) -> Result<Option<DepthFrame>, DeviceError> {
        self.desk.take(until).map_err(|trouble| match trouble {
            Trouble::Ended(ending) => self.ended(ending),
            Trouble::Silent(waited) => {
                DeviceError::Silent { device: self.device(), waited, during: "being asked for pictures" }
            }
        })
    }

    fn recycle(&mut self, frame: DepthFrame) {
        self.desk.recycle(frame);
    }

    fn losses(&self) -> FrameLosses {
        self.desk.losses()
    }

    fn stop(&mut self) -> Result<(), DeviceError> {
        self.desk.stop();
        Ok(())
    }
}

impl Drop for VideoCamera {
    fn drop(&mut self) {
        self.desk.close();
    }
}
