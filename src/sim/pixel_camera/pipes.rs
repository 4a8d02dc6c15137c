//! Raw frames in two named pipes: grey levels in one, depth in the other, frame after frame without a gap.
//!
//! Grey: one byte a pixel, row by row. Depth: two bytes a pixel, the lower first, counts as in [`Depth`](crate::sim::pixels::Depth). To a
//! media pipeline these are `gray8` and `gray16-le` pictures of the camera's size. Times are not in the pipes: as with a camera on
//! a cable, a frame is of about the time when it comes.
//!
//! Frames go in pairs: the next is begun when both parts of the last are gone, so that the nth picture of one pipe belongs to the nth of the
//! other. Either reader may come first, and gets the first part of its pair at once; so the first pair may be as old as the other made it
//! wait. Where a reader goes, both streams end, and begin anew when both readers have gone: one that comes back within a hundredth of a
//! second may find the old end. What waits in a pipe is less than two frames.

use super::pipe::{Pipe, Written};
use super::sink::FrameSink;
use crate::sim::pixels::{Frame, PixelError};
use rustix::event::{PollFd, Timespec, poll};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

/// How long a full pipe is waited for before anything else is looked at (ms).
const PATIENCE_MS: i64 = 20;

/// Writes frames into two named pipes, which it removes in the end.
#[derive(Debug)]
pub struct FramePipes {
    pipes: [Pipe; 2],
    /// What is to be written of a frame.
    bytes: [Vec<u8>; 2],
}

impl FramePipes {
    /// Makes the pipes, or takes those that are there; nobody has to read yet. `size`: columns and rows of the pictures.
    ///
    /// # Errors
    /// [`PixelError::Pipe`]: something else is in that place, or nothing may be.
    pub fn create(
        grey: impl Into<PathBuf>,
        depth: impl Into<PathBuf>,
        [width, height]: [usize; 2],
    ) -> Result<Self, PixelError> {
        let pixels = width * height;
        let pipes = [Pipe::create(grey.into(), pixels)?, Pipe::create(depth.into(), 2 * pixels)?];
        Ok(Self { pipes, bytes: [Vec::new(), Vec::new()] })
    }

    /// Ends both streams.
    fn end(&mut self) {
        self.pipes.iter_mut().for_each(Pipe::disconnect);
    }

    /// Waits until more fits into one of those pipes that are not done, or a reader may have come.
    fn wait_for(&self, left: [bool; 2]) {
        let patience = Timespec { tv_sec: 0, tv_nsec: PATIENCE_MS * 1_000_000 };
        let of_those = self.pipes.iter().zip(left).filter(|(_, left)| *left);
        let mut ends: Vec<PollFd> = of_those.filter_map(|(pipe, _)| pipe.room()).collect();
        // An error shows again in the next write.
        let _ = poll(&mut ends, Some(&patience));
    }
}

impl FrameSink for FramePipes {
    fn wanted(&mut self) -> Result<bool, PixelError> {
        if self.pipes.iter().any(Pipe::is_left) {
            self.end();
        }
        let [grey, depth] = &mut self.pipes;
        // Both are asked: who waits for a writer shall not wait for the other's reader.
        Ok(grey.connect()? | depth.connect()?)
    }

    fn deliver(&mut self, frame: &Frame, stop: &AtomicBool) -> Result<bool, PixelError> {
        let [grey, depth] = &mut self.bytes;
        grey.clone_from(&frame.grey.levels);
        depth.clear();
        match &frame.depth {
            Some(measured) => depth.extend(measured.counts.iter().flat_map(|count| count.to_le_bytes())),
            None => depth.resize(2 * grey.len(), 0),
        }
        let (mut gone, mut left) = ([0; 2], [true; 2]);
        while left != [false; 2] {
            for (i, pipe) in self.pipes.iter_mut().enumerate() {
                if !left[i] {
                    continue;
                }
                pipe.connect()?;
                match pipe.write(&self.bytes[i], &mut gone[i])? {
                    Written::Whole => left[i] = false,
                    Written::Part => {}
                    Written::Gone => {
                        self.end();
                        return Ok(false);
                    }
                }
            }
            if stop.load(Ordering::Relaxed) {
                self.end();
                return Ok(left == [false; 2]);
            }
            if left != [false; 2] {
                self.wait_for(left);
            }
        }
        Ok(true)
    }
}
