//! What the force is now: shared between the thread that watches it and those that show it or wait for it.

use crate::device::Losses;
use std::sync::atomic::{AtomicI32, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// A running mean, the farthest reading after a stop, in counts of the sensor less its zero, and what became of the records.
#[derive(Debug)]
pub struct LiveForce {
    zero: [i32; 6],
    /// Exponential mean, as bits.
    mean: [AtomicU64; 6],
    /// Weight of a new reading in it.
    weight: f64,
    /// The farthest reading since the run was stopped.
    after_stop: [AtomicI32; 6],
    losses: Mutex<Losses>,
}

/// Time constant of the running mean.
const MEAN: Duration = Duration::from_millis(10);

impl LiveForce {
    /// Time over which [`mean`](Self::mean) looks back.
    pub(super) const MEAN: Duration = MEAN;

    /// Nothing read yet; `zero` is the reading with nothing at the tip (counts), `rate_hz` how often it is read.
    pub fn new(zero: [i32; 6], rate_hz: f64) -> Self {
        Self {
            zero,
            mean: Default::default(),
            weight: 1.0 / (MEAN.as_secs_f64() * rate_hz).max(1.0),
            after_stop: Default::default(),
            losses: Mutex::default(),
        }
    }

    /// Takes the next reading (counts); `stopped`: the run was stopped at it or before. Only one thread may do so.
    pub(super) fn see(&self, counts: [i32; 6], stopped: bool) {
        for (axis, count) in counts.into_iter().enumerate() {
            let value = count.saturating_sub(self.zero[axis]);
            let mean = f64::from_bits(self.mean[axis].load(Ordering::Relaxed));
            let mean = mean + self.weight * (f64::from(value) - mean);
            self.mean[axis].store(mean.to_bits(), Ordering::Relaxed);
            if stopped {
                farther(&self.after_stop[axis], value);
            }
        }
    }

    /// Takes what became of the records so far. Whoever looks at it just then sees what was before: this waits for nobody.
    pub(super) fn count(&self, losses: Losses) {
        if let Ok(mut last) = self.losses.try_lock() {
            *last = losses;
        }
    }

    /// What became of the records, a moment ago.
    pub(super) fn losses(&self) -> Losses {
        *self.losses.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The mean of the latest readings (counts less zero), over some 10 ms: a single one is noise in good part.
    pub(super) fn mean(&self) -> [f64; 6] {
        std::array::from_fn(|axis| f64::from_bits(self.mean[axis].load(Ordering::Relaxed)))
    }

    /// The reading farthest from zero on each axis since the run was stopped (counts less zero).
    pub(super) fn farthest_after_stop(&self) -> [i32; 6] {
        std::array::from_fn(|axis| self.after_stop[axis].load(Ordering::Relaxed))
    }
}

fn farther(cell: &AtomicI32, value: i32) {
    if value.unsigned_abs() > cell.load(Ordering::Relaxed).unsigned_abs() {
        cell.store(value, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 1000 readings a second: the mean forgets within some 10 ms, and single outliers hardly move it.
    #[test]
    fn the_mean_follows_and_what_came_after_a_stop_is_kept_apart() {
        let live = LiveForce::new([10, 0, 0, 0, 0, 0], 1000.0);
        for _ in 0..200 {
            live.see([110, -5, 0, 0, 0, 0], false);
        }
        assert!((live.mean()[0] - 100.0).abs() < 1e-3 && (live.mean()[1] + 5.0).abs() < 1e-3);
        live.see([1110, -5, 0, 0, 0, 0], false);
        assert!(live.mean()[0] < 201.0, "{:?}", live.mean());
        assert_eq!(live.farthest_after_stop(), [0; 6]);
        live.see([60, -7, 0, 0, 0, 0], true);
        assert_eq!(live.farthest_after_stop(), [50, -7, 0, 0, 0, 0]);
    }
}
