//! What goes wrong with the emulated stage, and how a test or a person switches it while it runs.

use crate::device::AXES;
use firmware_proto::ResetCause;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Faults that last until they are changed; by default none. Shares are from 0 to 1, in each direction.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct NativeStageFaults {
    /// Share of bytes that become others.
    pub corrupt_share: f64,
    /// Share of bytes that are lost.
    pub drop_share: f64,
    /// Share of bytes that come twice.
    pub duplicate_share: f64,
    /// Share of frames that are lost.
    pub drop_frame_share: f64,
    /// Share of frames that come twice.
    pub duplicate_frame_share: f64,
    /// Share of frames of which a second copy comes up to a second later.
    pub late_frame_share: f64,
    /// Nothing that is sent to it arrives.
    pub deaf: bool,
    /// Nothing that it sends arrives.
    pub mute: bool,
    /// Limit switches, low and high, that show this whatever is pressed.
    pub stuck: [[Option<bool>; 2]; AXES],
}

/// What happens once.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Events {
    pub(super) reset: Option<ResetCause>,
    /// Steps by which the motors slip.
    pub(super) slip: [i32; AXES],
    pub(super) unplug: bool,
}

#[derive(Debug, Default)]
struct State {
    faults: NativeStageFaults,
    events: Events,
}

/// A handle on the faults of a running emulator.
#[derive(Debug, Clone, Default)]
pub struct NativeStageFaultSwitch {
    state: Arc<Mutex<State>>,
}

impl NativeStageFaultSwitch {
    /// The faults as they are now.
    pub fn now(&self) -> NativeStageFaults {
        self.lock().faults
    }

    /// Changes the faults from the next byte on.
    pub fn change(&self, change: impl FnOnce(&mut NativeStageFaults)) {
        change(&mut self.lock().faults);
    }

    /// Resets the controller: it forgets everything and stops its motors dead.
    pub fn reset(&self, cause: ResetCause) {
        self.lock().events.reset = Some(cause);
    }

    /// Has the motors lose steps: the stage jumps by so many, and the controller knows nothing of it.
    pub fn slip(&self, steps: [i32; AXES]) {
        let events = &mut self.lock().events;
        for (sum, steps) in events.slip.iter_mut().zip(steps) {
            *sum = sum.saturating_add(steps);
        }
    }

    /// Takes the cable off, for good. The controller goes on with what it was doing.
    pub fn unplug(&self) {
        self.lock().events.unplug = true;
    }

    /// What has happened since this was last called.
    pub(super) fn take_events(&self) -> Events {
        std::mem::take(&mut self.lock().events)
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
