//! What the force sensor reads with nothing at the tip: the zero that limits and results count from. The sensor itself is not told.

use crate::acquire::AcquireError;
use crate::clock::HostTime;
use crate::device::{ForceRecord, ForceSensor};
use std::time::Duration;

/// How long the sensor is read.
const SPAN: Duration = Duration::from_millis(500);
/// Longest wait for it.
const BUDGET: Duration = Duration::from_secs(3);

/// The sensor at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Zero {
    /// Mean reading (counts).
    pub mean: [f64; 6],
    /// Standard deviation of single readings (counts).
    pub sd: [f64; 6],
    /// How many readings.
    pub records: usize,
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
    let n = all.len() as f64;
    let mean: [f64; 6] = std::array::from_fn(|a| all.iter().map(|c| f64::from(c[a])).sum::<f64>() / n);
    let spread = |a: usize| all.iter().map(|c| (f64::from(c[a]) - mean[a]).powi(2)).sum::<f64>();
    Ok(Zero {
        mean,
        sd: std::array::from_fn(|a| (spread(a) / (n - 1.0).max(1.0)).sqrt()),
        records: all.len(),
    })
}
