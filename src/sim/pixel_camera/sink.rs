//! Where frames go.

use crate::sim::pixels::{Frame, FrameFolder, PixelError};
use std::sync::atomic::AtomicBool;

/// Takes frames, one after the other.
pub trait FrameSink: Send {
    /// Whether anybody takes frames; asked before each, so that none is made in vain.
    ///
    /// # Errors
    /// [`PixelError`]: it will never be.
    fn wanted(&mut self) -> Result<bool, PixelError>;

    /// Hands a frame over and returns when it is gone, or when `stop` is set. False where it did not arrive.
    ///
    /// # Errors
    /// [`PixelError`]: no other frame will arrive either.
    fn deliver(&mut self, frame: &Frame, stop: &AtomicBool) -> Result<bool, PixelError>;
}

impl FrameSink for FrameFolder {
    fn wanted(&mut self) -> Result<bool, PixelError> {
        Ok(true)
    }

    fn deliver(&mut self, frame: &Frame, _stop: &AtomicBool) -> Result<bool, PixelError> {
        self.add(frame).map(|()| true)
    }
}
