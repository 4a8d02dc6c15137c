//! One named pipe, written to without ever waiting for its reader in a call.

use crate::sim::pixels::PixelError;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{CWD, Mode, OFlags, mkfifoat, open};
use rustix::io::Errno;
use rustix::pipe::fcntl_setpipe_size;
use std::fs::File;
use std::io::{ErrorKind, Write};
use std::os::unix::fs::FileTypeExt;
use std::path::PathBuf;

/// How far a write has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Written {
    /// All of it.
    Whole,
    /// The pipe is full, or nobody has opened it yet.
    Part,
    /// The reader has gone.
    Gone,
}

/// The writing end of a named pipe.
#[derive(Debug)]
pub(super) struct Pipe {
    path: PathBuf,
    /// Once a reader is there.
    file: Option<File>,
    /// Bytes that it should hold.
    size: usize,
    /// Whether its last reader has still to reach the end.
    ending: bool,
}

impl Pipe {
    /// Makes the pipe at `path`, or takes the one that is there. It should hold `size` bytes, if the system lets it.
    pub(super) fn create(path: PathBuf, size: usize) -> Result<Self, PixelError> {
        let failed = |source| PixelError::Pipe { path: path.clone(), source };
        match mkfifoat(CWD, &path, Mode::RUSR | Mode::WUSR) {
            Ok(()) => {}
            Err(Errno::EXIST) if path.metadata().is_ok_and(|m| m.file_type().is_fifo()) => {}
            Err(error) => return Err(failed(error.into())),
        }
        Ok(Self { path, file: None, size, ending: false })
    }

    /// Whether a reader is there; it counts as soon as it waits for a writer.
    pub(super) fn connect(&mut self) -> Result<bool, PixelError> {
        if self.file.is_some() {
            return Ok(true);
        }
        match open(&self.path, OFlags::WRONLY | OFlags::NONBLOCK | OFlags::CLOEXEC, Mode::empty()) {
            // The last reader; it shall find the end before anything begins anew.
            Ok(_) if self.ending => Ok(false),
            Ok(end) => {
                // A pipe that stays small costs more switches between threads, nothing else.
                let _ = fcntl_setpipe_size(&end, self.size);
                self.file = Some(end.into());
                Ok(true)
            }
            Err(Errno::NXIO) => {
                self.ending = false;
                Ok(false)
            }
            Err(Errno::INTR) => Ok(false),
            Err(error) => Err(self.failed(error.into())),
        }
    }

    /// Whether the reader has gone. What it has left in the pipe would else be the next reader's.
    pub(super) fn is_left(&self) -> bool {
        let none = Timespec { tv_sec: 0, tv_nsec: 0 };
        self.room().is_some_and(|end| {
            let mut end = [end];
            poll(&mut end, Some(&none)).is_ok() && end[0].revents().contains(PollFlags::ERR)
        })
    }

    /// Leaves the reader, which reaches the end of its stream.
    pub(super) fn disconnect(&mut self) {
        self.ending |= self.file.take().is_some();
    }

    /// Writes what fits of `bytes` from `from` on.
    pub(super) fn write(&mut self, bytes: &[u8], from: &mut usize) -> Result<Written, PixelError> {
        let Some(file) = &mut self.file else { return Ok(Written::Part) };
        while *from < bytes.len() {
            match file.write(&bytes[*from..]) {
                Ok(count) => *from += count,
                Err(error) => match error.kind() {
                    ErrorKind::Interrupted => {}
                    ErrorKind::WouldBlock => return Ok(Written::Part),
                    ErrorKind::BrokenPipe => return Ok(Written::Gone),
                    _ => return Err(self.failed(error)),
                },
            }
        }
        Ok(Written::Whole)
    }

    /// To wait until more fits.
    pub(super) fn room(&self) -> Option<PollFd<'_>> {
        self.file.as_ref().map(|file| PollFd::new(file, PollFlags::OUT))
    }

    fn failed(&self, source: std::io::Error) -> PixelError {
        PixelError::Pipe { path: self.path.clone(), source }
    }
}

impl Drop for Pipe {
    fn drop(&mut self) {
        // Gone already, or somebody else's by now: nothing to be done about it.
        let _ = std::fs::remove_file(&self.path);
    }
}
