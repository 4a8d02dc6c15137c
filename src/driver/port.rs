//! How a driver reaches a serial port: bytes in with a time-out, bytes out, and a second way in for whoever has to stop the device.
//!
//! Drivers know the trait only, so that they can be tested on bytes without a port.

use super::DriverError;
use std::io;
use std::time::Duration;

/// A line of bytes to a device.
pub(super) trait BytePort: Send {
    /// Reads what has arrived, after waiting for it no longer than `wait`; 0 when nothing came.
    ///
    /// # Errors
    /// The port is gone, or the operating system says no.
    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> io::Result<usize>;

    /// Hands all bytes to the operating system.
    ///
    /// # Errors
    /// The port is gone, or does not take them for [`WRITE_WAIT`].
    fn write(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// The same line once more, to be used from another thread.
    ///
    /// # Errors
    /// What the operating system says.
    fn second(&self) -> io::Result<Box<dyn BytePort>>;
}

/// How long the operating system may refuse bytes. A line to a stage is shorter than any buffer in between.
const WRITE_WAIT: Duration = Duration::from_millis(100);

/// Opens a serial port for this process alone: 8 data bits, no parity, 1 stop bit, no flow control, DTR asserted.
///
/// Boards that are wired to do so reset when DTR is asserted.
///
/// # Errors
/// [`DriverError::Open`].
pub(super) fn open(path: &str, baud: u32) -> Result<Box<dyn BytePort>, DriverError> {
    let port = serialport::new(path, baud)
        .exclusive(true)
        .timeout(WRITE_WAIT)
        .open()
        .map_err(|source| DriverError::Open { port: path.to_owned(), source })?;
    Ok(Box::new(Serial { port }))
}

struct Serial {
    port: Box<dyn serialport::SerialPort>,
}

impl BytePort for Serial {
    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> io::Result<usize> {
        self.port.set_timeout(wait)?;
        match self.port.read(buffer) {
            // A serial port has no end; a pseudo-terminal whose other side has gone says so with 0.
            Ok(0) => Err(io::ErrorKind::BrokenPipe.into()),
            Ok(count) => Ok(count),
            Err(e) if matches!(e.kind(), io::ErrorKind::TimedOut | io::ErrorKind::Interrupted) => Ok(0),
            Err(e) => Err(e),
        }
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.port.set_timeout(WRITE_WAIT)?;
        self.port.write_all(bytes)
    }

    fn second(&self) -> io::Result<Box<dyn BytePort>> {
        let mut port = self.port.try_clone()?;
        port.set_timeout(WRITE_WAIT)?;
        Ok(Box::new(Self { port }))
    }
}
