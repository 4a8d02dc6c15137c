//! How a stage with the rig's own firmware is stopped from any thread.
//!
//! The emergency pattern, raw, on a handle of its own: the controller looks for it before decoding, also in the middle of a frame, and
//! it needs no session, so it works whoever else is talking. It is written twice in one go: a wrong byte in the first copy leaves the
//! second. After that the thread that holds the stage sends it again, whenever it is in one of the stage's methods, until the
//! controller has acknowledged it.

use super::connect::NativeOptions;
use crate::clock::HostTime;
use crate::device::Stopper;
use crate::driver::DriverError;
use crate::driver::port::{self, BytePort};
use firmware_proto::EMERGENCY_STOP;
use std::io;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

const PATTERN: usize = EMERGENCY_STOP.len();

/// The pattern and the pattern again.
const TWICE: [u8; 2 * PATTERN] = {
    let mut bytes = [0; 2 * PATTERN];
    let mut at = 0;
    while at < bytes.len() {
        bytes[at] = EMERGENCY_STOP[at % PATTERN];
        at += 1;
    }
    bytes
};

/// How often a stage was told to stop at once, shared with its stoppers.
#[derive(Debug, Default)]
pub(super) struct Latch {
    stops: AtomicU32,
}

impl Latch {
    pub(super) fn stops(&self) -> u32 {
        self.stops.load(Ordering::Acquire)
    }
}

/// Stops a stage that runs the rig's own firmware.
pub struct NativeStopper {
    // A lock of the stoppers among themselves: whoever waits for answers holds another handle.
    port: Mutex<Box<dyn BytePort>>,
    latch: Arc<Latch>,
}

impl NativeStopper {
    /// A stopper for a controller that nobody talks to, whatever its firmware's version.
    ///
    /// # Errors
    /// [`DriverError::Open`].
    pub fn open(options: &NativeOptions) -> Result<Self, DriverError> {
        Ok(Self::new(port::open(&options.port, options.baud)?, Arc::default()))
    }

    pub(super) fn new(port: Box<dyn BytePort>, latch: Arc<Latch>) -> Self {
        Self { port: Mutex::new(port), latch }
    }
}

impl Stopper for NativeStopper {
    fn stop_now(&self) -> io::Result<HostTime> {
        // First, so that no motion is started after this whatever becomes of the bytes.
        self.latch.stops.fetch_add(1, Ordering::AcqRel);
        self.port.lock().unwrap_or_else(PoisonError::into_inner).write(&TWICE)?;
        Ok(HostTime::now())
    }
}
