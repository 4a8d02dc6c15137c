//! What is sent to Grbl: the real-time bytes, and a motion as a jog.
//!
//! Metres and seconds → millimetres and minutes.
//!
//! Why a jog (`$J=`) and not `G1`: it can be cancelled, it leaves the modal state of the controller alone, a target outside the
//! travel is answered with an error instead of an alarm, and feed overrides do not change its speed. `G53` makes the target machine
//! coordinates whatever offset somebody has set, and `G21` and `G90` hold for the one line.

use crate::device::AXES;
use std::fmt::Write;

/// Real-time bytes: taken from the stream as they arrive, never queued, never acknowledged.
pub(super) const RESET: u8 = 0x18;
pub(super) const STATUS: u8 = b'?';
/// A status report with everything in it; grblHAL only, others ignore it.
pub(super) const FULL_STATUS: u8 = 0x87;
pub(super) const SAFETY_DOOR: u8 = 0x84;
pub(super) const JOG_CANCEL: u8 = 0x85;

/// Slower feeds (mm/min) are raised to this by both firmwares without a word.
pub(super) const SLOWEST_MM_MIN: f64 = 1.0;

/// A feed (mm/min) of a speed (m/s).
pub(super) fn feed_mm_min(speed_m_s: f64) -> f64 {
    speed_m_s * 60e3
}

/// The line for a motion along both axes.
pub(super) fn jog(
    letters: [char; AXES],
    target_m: [f64; AXES],
    decimals: [usize; AXES],
    speed_m_s: f64,
) -> String {
    let mut line = String::from("$J=G53G21G90");
    for axis in 0..AXES {
        // Writing to a String cannot fail.
        let _ = write!(line, "{}{:.*}", letters[axis], decimals[axis], target_m[axis] * 1e3);
    }
    let _ = writeln!(line, "F{:.3}", feed_mm_min(speed_m_s));
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motion_is_one_line_in_machine_coordinates() {
        let line = jog(['X', 'Z'], [-0.0123456, -0.003], [4, 3], 0.005);
        assert_eq!(line, "$J=G53G21G90X-12.3456Z-3.000F300.000\n");
        // gnea/grbl, config.h: a line has room for 80 characters with its end.
        assert!(jog(['X', 'Z'], [-9.99999999; 2], [5; 2], 9.999).len() < 80);
    }
}
