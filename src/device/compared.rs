//! A device's clock asked for its reading.

use crate::clock::HostTime;

/// One question and its answer: the device's reading was taken between the two times of the host.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClockComparison {
    /// Before the question was handed to the operating system.
    pub sent: HostTime,
    /// When the answer had arrived.
    pub received: HostTime,
    /// The device's counter (wraps at 2³²).
    pub ticks: u32,
    /// Nominal rate of that counter (1/s).
    pub tick_hz: f64,
}
