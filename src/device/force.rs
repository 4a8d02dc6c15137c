//! What a six-axis force sensor is: a stream of raw records, and what their counts are worth.

use super::{ClockComparison, DeviceError};
use crate::clock::HostTime;

/// One raw record of the sensor, as it came over the wire, with the host's time of its arrival.
///
/// Two counters: `rdt_sequence` counts records of one request, `ft_sequence` is the sensor's own clock. What they say together:
/// [`SequenceTracker`](super::SequenceTracker).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ForceRecord {
    /// When the datagram that held it had arrived.
    pub host: HostTime,
    /// Number within the request, from 1.
    pub rdt_sequence: u32,
    /// The sensor's clock: advances at its internal rate and is not reset by requests.
    pub ft_sequence: u32,
    /// Status word; what a bit means depends on the product.
    pub status: u32,
    /// Fx, Fy, Fz, Tx, Ty, Tz in counts.
    pub counts: [i32; 6],
}

/// Which sensor answers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ForceIdentity {
    /// Product name, as it says.
    pub product: String,
    /// Serial number of the calibration in use.
    pub calibration: String,
    /// Name of the configuration in use.
    pub configuration: String,
    /// Address of its stream.
    pub address: String,
}

/// What the records mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForceFormat {
    /// Counts for 1 N.
    pub counts_per_newton: f64,
    /// Counts for 1 N·m.
    pub counts_per_newton_metre: f64,
    /// Records a second.
    pub rate_hz: f64,
    /// Rate of `ft_sequence` (1/s): the sensor's internal rate.
    pub tick_hz: f64,
    /// Largest wrench that the sensor is calibrated for, where it tells (N and N·m).
    pub range: Option<[f64; 6]>,
    /// Status bits on which nobody should go on: saturation, a broken gauge, a threshold, …
    pub stop_mask: u32,
}

impl ForceFormat {
    /// Steps of `ft_sequence` between two records.
    pub fn ticks_a_record(&self) -> u32 {
        (self.tick_hz / self.rate_hz).round().max(1.0) as u32
    }

    /// Force (N) and torque (N·m) in the sensor's frame.
    pub fn wrench(&self, counts: [i32; 6]) -> [f64; 6] {
        let scale = self.scale();
        std::array::from_fn(|i| f64::from(counts[i]) / scale[i])
    }

    /// Counts per newton of each force, per newton metre of each torque.
    pub fn scale(&self) -> [f64; 6] {
        std::array::from_fn(|i| if i < 3 { self.counts_per_newton } else { self.counts_per_newton_metre })
    }
}

/// What became of a stream's records, counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Losses {
    /// Records that arrived in order.
    pub received: u64,
    /// Records that never came.
    pub lost: u64,
    /// Records that came twice.
    pub duplicated: u64,
    /// Records that came after a later one.
    pub reordered: u64,
    /// Datagrams that are no records: a wrong length.
    pub malformed: u64,
}

/// A six-axis force sensor.
pub trait ForceSensor: Send {
    /// Which one answers.
    fn identity(&self) -> &ForceIdentity;

    /// What its records mean.
    fn format(&self) -> &ForceFormat;

    /// Asks for the stream and waits for its first record, asking again when the request may have been lost.
    ///
    /// # Errors
    /// [`DeviceError`]: silent, lost.
    fn start(&mut self) -> Result<(), DeviceError>;

    /// The sensor's clock at the start of the stream: its first record was taken after it was asked for. None before, and where it is not
    /// known.
    fn clock_at_start(&self) -> Option<ClockComparison>;

    /// Asks for the stream's end.
    ///
    /// # Errors
    /// [`DeviceError`]: it goes on in spite of being asked, lost.
    fn stop(&mut self) -> Result<(), DeviceError>;

    /// Has the sensor take its present reading for zero. Only when a person has agreed: what it read until then is gone.
    ///
    /// # Errors
    /// [`DeviceError::Lost`]. Nothing acknowledges the request.
    fn bias(&mut self) -> Result<(), DeviceError>;

    /// Lets go of a threshold that the sensor has latched. Only when a person has agreed: something pressed harder than it should.
    ///
    /// # Errors
    /// [`DeviceError::Lost`]. Nothing acknowledges the request; the status word of the next records shows whether it was heard.
    fn clear_latch(&mut self) -> Result<(), DeviceError>;

    /// Appends records that have arrived to `records`, after waiting until `until` at most for the first of them. Allocates nothing while
    /// `records` has room for 64 more.
    ///
    /// # Errors
    /// [`DeviceError::Lost`]. Silence is no error here: how long it may last is for the caller to say.
    fn receive(&mut self, until: HostTime, records: &mut Vec<ForceRecord>) -> Result<(), DeviceError>;

    /// What became of the stream's records so far.
    fn losses(&self) -> Losses;

    /// What came in between besides, counted, by name; nothing where nobody counts.
    fn line_counts(&self) -> Vec<(&'static str, u64)> {
        Vec::new()
    }

    /// Finds out why no records come, for people; none where that cannot be asked. May take seconds: to be asked when everything stands.
    fn why_silent(&self) -> Option<String> {
        None
    }

    /// What the bits of a status word say, for people.
    fn explain(&self, status: u32) -> Vec<&'static str>;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_become_newtons() {
        let format = ForceFormat {
            counts_per_newton: 1e6,
            counts_per_newton_metre: 2e6,
            rate_hz: 1000.0,
            tick_hz: 7000.0,
            range: None,
            stop_mask: 0,
        };
        let wrench = format.wrench([1_500_000, -250_000, 0, 2_000_000, 1, -4_000_000]);
        assert_eq!(wrench, [1.5, -0.25, 0.0, 1.0, 5e-7, -2.0]);
        assert_eq!(format.ticks_a_record(), 7);
    }
}
