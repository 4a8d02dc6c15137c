//! What the force is now: shared between the thread that watches it and those that show it or wait for it.

use std::sync::atomic::{AtomicI32, AtomicU64, Ordering};
use std::time::Duration;

/// The latest reading, a running mean and the farthest one, in counts of the sensor less its zero.
#[derive(Debug)]
pub struct LiveForce {
    zero: [i32; 6],
    latest: [AtomicI32; 6],
    /// Exponential mean, as bits.
    mean: [AtomicU64; 6],
    /// Weight of a new reading in it.
    weight: f64,
    farthest: [AtomicI32; 6],
    /// The farthest reading since the run was stopped.
    after_stop: [AtomicI32; 6],
    records: AtomicU64,
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
            latest: Default::default(),
            mean: Default::default(),
            weight: 1.0 / (MEAN.as_secs_f64() * rate_hz).max(1.0),
            farthest: Default::default(),
            after_stop: Default::default(),
            records: AtomicU64::new(0),
        }
    }

    /// Takes the next reading (counts); `stopped`: the run was stopped at it or before. Only one thread may do so.
    pub(super) fn see(&self, counts: [i32; 6], stopped: bool) {
        for (axis, count) in counts.into_iter().enumerate() {
            let value = count.saturating_sub(self.zero[axis]);
            self.latest[axis].store(value, Ordering::Relaxed);
            let mean = f64::from_bits(self.mean[axis].load(Ordering::Relaxed));
            let mean = mean + self.weight * (f64::from(value) - mean);
            self.mean[axis].store(mean.to_bits(), Ordering::Relaxed);
            // Whoever takes the farthest reading in between takes it a record early: no harm.
            farther(&self.farthest[axis], value);
            if stopped {
                farther(&self.after_stop[axis], value);
            }
        }
        self.records.fetch_add(1, Ordering::Release);
    }

    /// The mean of the latest readings (counts less zero), over some 10 ms: a single one is noise in good part.
    pub(super) fn mean(&self) -> [f64; 6] {
        std::array::from_fn(|axis| f64::from_bits(self.mean[axis].load(Ordering::Relaxed)))
    }

    /// The reading farthest from zero on each axis since the run was stopped (counts less zero).
    pub(super) fn farthest_after_stop(&self) -> [i32; 6] {
        std::array::from_fn(|axis| self.after_stop[axis].load(Ordering::Relaxed))
    }

    /// The latest reading (counts less zero) and how many there were. Axes may belong to neighbouring records.
    pub fn latest(&self) -> ([i32; 6], u64) {
        let records = self.records.load(Ordering::Acquire);
        (std::array::from_fn(|axis| self.latest[axis].load(Ordering::Relaxed)), records)
    }

    /// The reading farthest from zero on each axis since this was last called (counts less zero).
    pub fn take_farthest(&self) -> [i32; 6] {
        std::array::from_fn(|axis| self.farthest[axis].swap(0, Ordering::Relaxed))
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
        assert_eq!((live.latest().0[0], live.farthest_after_stop()), (1100, [0; 6]));
        live.see([60, -7, 0, 0, 0, 0], true);
        assert_eq!(live.farthest_after_stop(), [50, -7, 0, 0, 0, 0]);
        assert_eq!(live.take_farthest()[0], 1100);
    }
}
