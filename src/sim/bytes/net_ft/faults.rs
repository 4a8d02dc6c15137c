//! What goes wrong with the emulated sensor, and how a test or a person switches it while it runs.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// What the configuration page shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum NetFtPageFault {
    /// What the sensor is.
    #[default]
    None,
    /// Name and code of the unit of force contradict each other.
    UnitsContradict,
    /// The page of the calibration.
    CalibrationPage,
    /// An internal error of the web server.
    Unavailable,
}

/// Faults; by default none. Shares are of datagrams, from 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct NetFtFaults {
    /// Share that is lost.
    pub drop_share: f64,
    /// Share that arrives twice.
    pub duplicate_share: f64,
    /// Share that arrives after the one behind it.
    pub reorder_share: f64,
    /// Nothing is sent, though everything is counted.
    pub stalled: bool,
    /// Records are numbered and sent, but the sensor's clock and reading stand.
    pub frozen: bool,
    /// The sensor's clock has jumped ahead by so many ticks; its records are numbered as before.
    pub clock_ahead: u32,
    /// Every component reads its range, with the status bits of saturation.
    pub saturated: bool,
    /// Status bits that are set besides; the summary bit follows.
    pub status_bits: u32,
    /// What the configuration page shows.
    pub page: NetFtPageFault,
    /// So many requests for a stream will be lost.
    pub lose_starts: u32,
    /// So many requests to end it will be lost.
    pub lose_stops: u32,
}

#[derive(Debug, Default)]
struct State {
    faults: NetFtFaults,
    taken_over: bool,
}

/// A handle on the faults of a running emulator.
#[derive(Debug, Clone, Default)]
pub struct NetFtFaultSwitch {
    state: Arc<Mutex<State>>,
}

impl NetFtFaultSwitch {
    /// The faults as they are now.
    pub fn now(&self) -> NetFtFaults {
        self.lock().faults
    }

    /// Changes the faults from the next datagram on.
    pub fn change(&self, change: impl FnOnce(&mut NetFtFaults)) {
        change(&mut self.lock().faults);
    }

    /// A second client asks for the stream: from now on it goes there, and begins anew.
    pub fn take_over(&self) {
        self.lock().taken_over = true;
    }

    /// Whether a second client has asked since this was last called.
    pub(super) fn taken_over(&self) -> bool {
        std::mem::take(&mut self.lock().taken_over)
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
