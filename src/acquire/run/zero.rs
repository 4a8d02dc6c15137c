//! What the force sensor reads with nothing at the tip: the zero that limits and results count from. The sensor itself is not told.

use crate::acquire::AcquireError;
use crate::clock::HostTime;
use crate::device::{ForceRecord, ForceSensor};
use std::time::Duration;

/// How long the sensor is read.
const SPAN: Duration = Duration::from_millis(500);
/// Longest wait for it.
const BUDGET: Duration = Duration::from_secs(3);
/// Parts of the reading that are compared with each other.
const PARTS: usize = 10;
/// The reading rests where its parts differ by less than this share of the axis's limit, and what so many standard errors of a part allow.
const RESTS: f64 = 0.01;
const ERRORS: f64 = 6.0;

/// The sensor at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Zero {
    /// Mean reading (counts).
    pub mean: [f64; 6],
    /// Standard deviation of single readings (counts).
    pub sd: [f64; 6],
    /// By how much the means of tenths of the time differ at most (counts).
    pub moved: [f64; 6],
    /// How many readings.
    pub records: usize,
}

impl Zero {
    /// Of at least two readings (counts), in the order in which they came.
    fn of(all: &[[i32; 6]]) -> Self {
        let mean_of = |some: &[[i32; 6]], axis: usize| {
            some.iter().map(|c| f64::from(c[axis])).sum::<f64>() / some.len() as f64
        };
        let mean = std::array::from_fn(|axis| mean_of(all, axis));
        let spread = |axis: usize| all.iter().map(|c| (f64::from(c[axis]) - mean[axis]).powi(2)).sum::<f64>();
        let moved = |axis: usize| {
            let parts = all.chunks_exact((all.len() / PARTS).max(1)).map(|part| mean_of(part, axis));
            let [low, high] =
                parts.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], m| [low.min(m), high.max(m)]);
            high - low
        };
        Self {
            mean,
            sd: std::array::from_fn(|axis| (spread(axis) / (all.len() as f64 - 1.0).max(1.0)).sqrt()),
            moved: std::array::from_fn(moved),
            records: all.len(),
        }
    }

    /// The first axis that did not rest while it was read, for limits in counts.
    pub(super) fn restless(&self, limits: [f64; 6]) -> Option<usize> {
        let part = (self.records / PARTS).max(1) as f64;
        (0..6).find(|&axis| self.moved[axis] > RESTS * limits[axis] + ERRORS * self.sd[axis] / part.sqrt())
    }
}

/// Reads the sensor for half a second; `hand` is given all records.
///
/// # Errors
/// [`AcquireError`]: the sensor is lost or silent, or says that it is not to be trusted.
pub(super) fn zero(
    sensor: &mut dyn ForceSensor,
    mut hand: impl FnMut(&[ForceRecord]),
) -> Result<Zero, AcquireError> {
    let started = HostTime::now();
    let (mut all, mut some) = (Vec::new(), Vec::with_capacity(4096));
    let wanted = SPAN.as_secs_f64() * sensor.format().rate_hz;
    while (all.len() as f64) < wanted {
        some.clear();
        sensor.receive(HostTime::now() + Duration::from_millis(20), &mut some)?;
        hand(&some);
        if let Some(record) = some.iter().find(|r| r.status & sensor.format().stop_mask != 0) {
            return Err(AcquireError::SensorUnsound {
                status: record.status,
                meaning: sensor.explain(record.status),
            });
        }
        all.extend(some.iter().map(|r| r.counts));
        if HostTime::now().since(started) > BUDGET {
            return Err(AcquireError::TooFewRecords {
                records: all.len(),
                wanted: wanted as usize,
                budget: BUDGET,
            });
        }
    }
    Ok(Zero::of(&all))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 7000 readings a second of 1e6 counts/N with 0.07 N of noise, and what is added to the first axis (N) at a time (s).
    fn read(added: impl Fn(f64) -> f64) -> Zero {
        use rand::{RngExt, SeedableRng};
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let all: Vec<[i32; 6]> = (0..3500)
            .map(|n| {
                let [u, v]: [f64; 2] = std::array::from_fn(|_| random.random::<f64>());
                let noise = 0.07 * (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos();
                [((noise + added(f64::from(n) / 7000.0)) * 1e6) as i32, 0, 0, 0, 0, 0]
            })
            .collect();
        Zero::of(&all)
    }

    #[test]
    fn noise_rests_and_a_hand_on_the_tip_does_not() {
        let limits = [3e6, 3e6, 5e6, 3e5, 3e5, 3e5];
        let still = read(|_| 0.4);
        assert!((still.mean[0] - 4e5).abs() < 4e3 && (still.sd[0] - 7e4).abs() < 3e3, "{still:?}");
        assert_eq!(still.restless(limits), None);
        // A slow creep of 40 mN/s is the sensor's own; a touch in the middle, a tip that sinks in, a bench that sways are not.
        assert_eq!(read(|t| 0.04 * t).restless(limits), None);
        assert_eq!(read(|t| if t > 0.3 { 0.1 } else { 0.0 }).restless(limits), Some(0));
        assert_eq!(read(|t| 0.4 * t).restless(limits), Some(0));
        assert_eq!(read(|t| 0.1 * (20.0 * t).sin()).restless(limits), Some(0));
    }
}
