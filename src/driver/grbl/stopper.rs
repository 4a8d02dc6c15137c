//! How a Grbl stage is stopped from any thread.
//!
//! One byte on a handle of its own: 0x84, the safety door. Why this one, of the four that stop something (gnea/grbl,
//! doc/markdown/commands.md):
//!
//! | byte | moving | standing | position | queued and unread lines |
//! | --- | --- | --- | --- | --- |
//! | 0x85 jog cancel | decelerates, is idle | nothing | kept | Grbl runs a jog that it has not read yet |
//! | `!` feed hold | a jog: like 0x85 | holds | kept | like 0x85 |
//! | 0x18 reset | stops dead | nothing | lost | dropped, but one that arrives later runs |
//! | 0x84 safety door | decelerates, is suspended | is suspended | kept | dropped or never read until a reset |
//!
//! So only 0x84 latches whatever the stage is doing, a jog included that another thread writes at the same moment. Its price is way:
//! at speed v and acceleration a the stage goes v·d + v²/2a farther, with d up to 50 ms on Grbl and 90 ms on grblHAL
//! ([`GrblStage::braking_delay`](super::GrblStage::braking_delay)); 0x18 would stop within fractions of a millimetre and lose the
//! position. A plan has to allow for that way before it moves. The latch is kept by the controller and,
//! in case the byte gets lost, by the host: [`Latch`]. `clear` resets the controller, which drops what it has not read. When the
//! program ends, the controller's is what is left: whoever connects next finds it, unless opening the port resets the board.
//!
//! grblHAL (seen with build 20260817) comes to rest in the same way but goes on calling itself `Jog`, so that the reset in `clear`
//! is one in motion to it: it raises alarm 3, and the stage has to home again. A machine set up to park at an open door would move:
//! it gets 0x18.

use crate::clock::HostTime;
use crate::device::Stopper;
use crate::driver::port::BytePort;
use std::io;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// How often a stage was told to stop, shared with its stoppers. It is latched while there are stops that nobody has cleared.
#[derive(Debug, Default)]
pub(super) struct Latch {
    stops: AtomicU32,
}

impl Latch {
    pub(super) fn stops(&self) -> u32 {
        self.stops.load(Ordering::Acquire)
    }

    pub(super) fn stop(&self) {
        self.stops.fetch_add(1, Ordering::AcqRel);
    }
}

/// See the module. The lock is that of the stoppers among themselves: whoever waits for replies holds another handle.
pub(super) struct GrblStopper {
    pub(super) port: Mutex<Box<dyn BytePort>>,
    pub(super) latch: Arc<Latch>,
    pub(super) byte: u8,
}

impl Stopper for GrblStopper {
    fn stop_now(&self) -> io::Result<HostTime> {
        // First, so that no motion is started after this whatever becomes of the byte.
        self.latch.stop();
        self.port.lock().unwrap_or_else(PoisonError::into_inner).write(&[self.byte])?;
        Ok(HostTime::now())
    }
}
