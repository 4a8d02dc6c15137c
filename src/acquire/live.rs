//! What the force is now: shared between the thread that watches it and those that show it or wait for it.

use std::sync::atomic::{AtomicI32, AtomicU64, Ordering};

/// The latest reading and the farthest one, in counts of the sensor less its zero.
#[derive(Debug)]
pub struct LiveForce {
    zero: [i32; 6],
    latest: [AtomicI32; 6],
    farthest: [AtomicI32; 6],
    records: AtomicU64,
}

impl LiveForce {
    /// Nothing read yet; `zero` is the reading with nothing at the tip (counts).
    pub fn new(zero: [i32; 6]) -> Self {
        Self { zero, latest: Default::default(), farthest: Default::default(), records: AtomicU64::new(0) }
    }

    /// Takes the next reading (counts).
    pub(super) fn see(&self, counts: [i32; 6]) {
        let cells = self.latest.iter().zip(&self.farthest);
        for ((count, zero), (latest, farthest)) in counts.into_iter().zip(self.zero).zip(cells) {
            let value = count.saturating_sub(zero);
            latest.store(value, Ordering::Relaxed);
            // Whoever takes the farthest reading in between takes it a record early: no harm.
            if value.unsigned_abs() > farthest.load(Ordering::Relaxed).unsigned_abs() {
                farthest.store(value, Ordering::Relaxed);
            }
        }
        self.records.fetch_add(1, Ordering::Release);
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
