//! The device's end of a serial cable that is not there: a pseudo-terminal, whose other end a driver opens by its path.

use serialport::{SerialPort, TTYPort};
use std::io::{self, Read, Write};
use std::thread;
use std::time::Duration;

/// How long a driver that does not read may hold up the device.
const WRITE_WAIT: Duration = Duration::from_millis(50);

/// What came down the cable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Heard {
    /// Nobody has the port open.
    Nobody,
    /// Nothing, although the port is open.
    Nothing,
    /// So many bytes.
    Bytes(usize),
}

/// The device's end. Dropping it pulls the plug.
pub(super) struct SerialEnd {
    port: TTYPort,
    path: String,
}

impl SerialEnd {
    /// Makes a cable whose other end nobody has opened.
    ///
    /// # Errors
    /// What the operating system says.
    pub(super) fn new() -> io::Result<Self> {
        // Nobody holds the driver's end, so that its being opened and closed can be seen from here.
        let (port, other) = TTYPort::pair()?;
        let path = other.name().ok_or(io::ErrorKind::NotFound)?;
        Ok(Self { port, path })
    }

    /// Path of the port that a driver opens.
    pub(super) fn path(&self) -> &str {
        &self.path
    }

    /// Reads what has come, after waiting for it no longer than `wait`.
    ///
    /// # Errors
    /// What the operating system says, but for an end that nobody has open.
    pub(super) fn read(&mut self, buffer: &mut [u8], wait: Duration) -> io::Result<Heard> {
        self.port.set_timeout(wait)?;
        match self.port.read(buffer) {
            Ok(0) => {}
            Ok(count) => return Ok(Heard::Bytes(count)),
            Err(e) if matches!(e.kind(), io::ErrorKind::TimedOut | io::ErrorKind::Interrupted) => {
                return Ok(Heard::Nothing);
            }
            // A hang-up, or EIO, which serialport has no kind for: the other end is closed.
            Err(e) if matches!(e.kind(), io::ErrorKind::BrokenPipe | io::ErrorKind::Other) => {}
            Err(e) => return Err(e),
        }
        thread::sleep(wait);
        Ok(Heard::Nobody)
    }

    /// Sends bytes; what an end that nobody reads does not take is lost, as on a cable.
    ///
    /// # Errors
    /// What the operating system says.
    pub(super) fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.port.set_timeout(WRITE_WAIT)?;
        match self.port.write_all(bytes) {
            Err(e)
                if matches!(
                    e.kind(),
                    io::ErrorKind::TimedOut | io::ErrorKind::BrokenPipe | io::ErrorKind::Other
                ) =>
            {
                Ok(())
            }
            other => other,
        }
    }
}
