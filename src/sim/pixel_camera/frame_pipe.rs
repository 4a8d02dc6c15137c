//! Raw frames in a named pipe: the grey levels of a frame, then its depth, frame after frame without a gap.
//!
//! Grey: one byte a pixel, row by row. Depth: two bytes a pixel, the lower first, counts as in [`Depth`](crate::sim::pixels::Depth). To a
//! media pipeline that is one `gray8` picture three times as high as the camera's. Both in one pipe, since two would have to be paired by
//! the time when they come: a thread that is held up for half an interval tears such a pair apart. Times are not in the pipe: as with a
//! camera on a cable, a frame is of about the time when it comes.
//!
//! Where the reader goes, the stream ends; the next reader begins with a whole frame. One that comes back within a hundredth of a second
//! may find the old end. What waits in the pipe is less than two frames.

use super::pipe::{Pipe, Written};
use super::sink::FrameSink;
use crate::sim::pixels::{Frame, PixelError};
use rustix::event::{Timespec, poll};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

/// How long a full pipe is waited for before anything else is looked at (ms).
const PATIENCE_MS: i64 = 20;

/// Writes frames into a named pipe, which it removes in the end.
#[derive(Debug)]
pub struct FramePipe {
    pipe: Pipe,
    /// The frame on its way.
    bytes: Vec<u8>,
}

impl FramePipe {
    /// Makes the pipe, or takes the one that is there; nobody has to read yet. `size`: columns and rows of a picture.
    ///
    /// # Errors
    /// [`PixelError::Pipe`]: something else is in that place, or nothing may be.
    pub fn create(path: impl Into<PathBuf>, [width, height]: [usize; 2]) -> Result<Self, PixelError> {
        Ok(Self { pipe: Pipe::create(path.into(), 3 * width * height)?, bytes: Vec::new() })
    }

    /// Waits until more fits, or a reader may have come.
    fn wait(&self) {
        let patience = Timespec { tv_sec: 0, tv_nsec: PATIENCE_MS * 1_000_000 };
        let mut ends: Vec<_> = self.pipe.room().into_iter().collect();
        // An error shows again in the next write.
        let _ = poll(&mut ends, Some(&patience));
    }
}

impl FrameSink for FramePipe {
    fn wanted(&mut self) -> Result<bool, PixelError> {
        if self.pipe.is_left() {
            self.pipe.disconnect();
        }
        self.pipe.connect()
    }

    fn deliver(&mut self, frame: &Frame, stop: &AtomicBool) -> Result<bool, PixelError> {
        self.bytes.clone_from(&frame.grey.levels);
        match &frame.depth {
            Some(measured) => self.bytes.extend(measured.counts.iter().flat_map(|count| count.to_le_bytes())),
            None => self.bytes.resize(3 * frame.grey.levels.len(), 0),
        }
        let mut gone = 0;
        loop {
            self.pipe.connect()?;
            match self.pipe.write(&self.bytes, &mut gone)? {
                Written::Whole => return Ok(true),
                Written::Part => {}
                Written::Gone => {
                    self.pipe.disconnect();
                    return Ok(false);
                }
            }
            if stop.load(Ordering::Relaxed) {
                self.pipe.disconnect();
                return Ok(false);
            }
            self.wait();
        }
    }
}
