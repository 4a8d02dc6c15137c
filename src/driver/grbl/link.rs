//! How lines go to a Grbl controller and come back, each with the host's time of its arrival.
//!
//! Owns the port; knows what a line says but not what it means for the stage.

use super::line::{Line, Lines};
use crate::clock::HostTime;
use crate::device::DeviceError;
use crate::driver::port::BytePort;
use std::collections::VecDeque;
use std::time::Duration;

/// One wait for bytes. Short, so that whoever waits can look at other things in between.
const READ_WAIT: Duration = Duration::from_millis(10);
/// Characters of a senseless line that a message quotes.
const QUOTED: usize = 60;

/// A port with a Grbl controller behind it.
pub(super) struct Link {
    port: Box<dyn BytePort>,
    device: String,
    lines: Lines,
    read: VecDeque<(HostTime, Line)>,
    nonsense: u64,
    last_nonsense: Option<String>,
}

impl Link {
    /// `device`: which device and where, for messages.
    pub(super) fn new(port: Box<dyn BytePort>, device: String) -> Self {
        let (lines, read) = (Lines::default(), VecDeque::new());
        Self { port, device, lines, read, nonsense: 0, last_nonsense: None }
    }

    pub(super) fn device(&self) -> String {
        self.device.clone()
    }

    pub(super) fn rename(&mut self, device: String) {
        self.device = device;
    }

    /// Lines that made no sense so far.
    pub(super) fn nonsense(&self) -> u64 {
        self.nonsense
    }

    /// Counts a line that can be read but cannot be true.
    pub(super) fn count_nonsense(&mut self, said: String) {
        self.nonsense += 1;
        self.last_nonsense = Some(said);
    }

    /// Forgets what made no sense: a sensible answer has come.
    pub(super) fn made_sense(&mut self) {
        self.last_nonsense = None;
    }

    pub(super) fn send(&mut self, bytes: &[u8]) -> Result<(), DeviceError> {
        self.port.write(bytes).map_err(|source| DeviceError::Lost { device: self.device.clone(), source })
    }

    /// The next line, or none when there was none until `until`.
    pub(super) fn next(&mut self, until: HostTime) -> Result<Option<(HostTime, Line)>, DeviceError> {
        let mut buffer = [0; 256];
        loop {
            if let Some(line) = self.read.pop_front() {
                return Ok(Some(line));
            }
            let remaining = until.remaining();
            let count = self
                .port
                .read(&mut buffer, remaining.min(READ_WAIT))
                .map_err(|source| DeviceError::Lost { device: self.device.clone(), source })?;
            let arrived = HostTime::now();
            let (read, nonsense, last) = (&mut self.read, &mut self.nonsense, &mut self.last_nonsense);
            self.lines.feed(&buffer[..count], |line| match line.and_then(Line::parse) {
                Some(line) => read.push_back((arrived, line)),
                None => {
                    *nonsense += 1;
                    *last = Some(line.map(quote).unwrap_or_default());
                }
            });
            // Whether or not more bytes come: noise without end must not keep anybody here.
            if remaining.is_zero() {
                return Ok(self.read.pop_front());
            }
        }
    }

    /// Whether every line that was read has been taken.
    pub(super) fn is_drained(&self) -> bool {
        self.read.is_empty()
    }

    /// Nobody has answered for `waited` while `during`: what to say of it, silence or what came instead.
    pub(super) fn unanswered(
        &self,
        waited: Duration,
        during: &'static str,
        expected: &'static str,
    ) -> DeviceError {
        let partial = (!self.lines.partial().is_empty()).then(|| quote(self.lines.partial()));
        match self.last_nonsense.clone().or(partial) {
            Some(said) => DeviceError::Nonsense { device: self.device.clone(), said, expected },
            None => DeviceError::Silent { device: self.device.clone(), waited, during },
        }
    }

    /// The same port once more.
    pub(super) fn second(&self) -> Result<Box<dyn BytePort>, DeviceError> {
        self.port.second().map_err(|source| DeviceError::Lost { device: self.device.clone(), source })
    }
}

fn quote(line: &[u8]) -> String {
    String::from_utf8_lossy(&line[..line.len().min(QUOTED)]).trim_end().to_owned()
}
