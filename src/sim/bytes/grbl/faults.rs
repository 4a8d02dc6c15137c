//! What goes wrong between the emulated controller and whoever talks to it, switched from outside while it runs.

use rand::{Rng, RngExt};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// What is wrong now.
#[derive(Debug, Clone, Default)]
pub(super) struct Wrong {
    pub(super) corrupted: f64,
    pub(super) dropped: f64,
    pub(super) silent: bool,
    pub(super) deaf: bool,
    pub(super) withheld_oks: u32,
    pub(super) reset: bool,
    pub(super) hit_limit: bool,
    pub(super) break_switches: bool,
    pub(super) unplugged: bool,
}

/// Switches for faults of an emulated Grbl controller. Clones switch the same one.
#[derive(Debug, Clone, Default)]
pub struct GrblFaults {
    wrong: Arc<Mutex<Wrong>>,
}

impl GrblFaults {
    /// This share of the bytes that it sends is replaced by others.
    pub fn corrupt(&self, share: f64) {
        self.lock().corrupted = share;
    }

    /// This share of the lines that it sends is lost.
    pub fn drop_lines(&self, share: f64) {
        self.lock().dropped = share;
    }

    /// Whether all that it sends is lost.
    pub fn silence(&self, silent: bool) {
        self.lock().silent = silent;
    }

    /// Whether all that is sent to it is lost.
    pub fn deafen(&self, deaf: bool) {
        self.lock().deaf = deaf;
    }

    /// So many acknowledgements from now on are lost.
    pub fn withhold_oks(&self, count: u32) {
        self.lock().withheld_oks = count;
    }

    /// Power fails for a moment.
    pub fn reset(&self) {
        self.lock().reset = true;
    }

    /// A limit switch trips.
    pub fn hit_limit(&self) {
        self.lock().hit_limit = true;
    }

    /// From now on no limit switch trips.
    pub fn break_switches(&self) {
        self.lock().break_switches = true;
    }

    /// The cable is pulled.
    pub fn unplug(&self) {
        self.lock().unplugged = true;
    }

    /// What is wrong now; what happens once is taken as having happened.
    pub(super) fn take(&self) -> Wrong {
        let mut wrong = self.lock();
        let now = wrong.clone();
        wrong.reset = false;
        wrong.hit_limit = false;
        wrong.break_switches = false;
        now
    }

    /// What of its output comes through.
    pub(super) fn pass(&self, output: &str, rng: &mut impl Rng) -> Vec<u8> {
        let mut wrong = self.lock();
        let mut passed = Vec::new();
        for line in output.split_inclusive('\n') {
            let ok = line.trim_end() == "ok";
            if ok && wrong.withheld_oks > 0 {
                wrong.withheld_oks -= 1;
            } else if !wrong.silent && !rng.random_bool(wrong.dropped) {
                passed.extend_from_slice(line.as_bytes());
            }
        }
        for byte in &mut passed {
            if rng.random_bool(wrong.corrupted) {
                *byte = rng.random();
            }
        }
        passed
    }

    fn lock(&self) -> MutexGuard<'_, Wrong> {
        self.wrong.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
