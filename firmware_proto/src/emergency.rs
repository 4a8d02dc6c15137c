//! Which bytes mean "stop now", whatever else is on the line?
//!
//! Eight bytes, looked for in the raw stream before any decoding, so that an interrupt handler can do it and
//! a decoder in whatever state cannot hide them. The pattern is four pairs of 0x00 and a byte above 0x5F.
//! A frame has at most 96 bytes, so that the byte after a delimiter, which is COBS's count of bytes to the
//! next zero, is 0x00 (idle) or at most 0x5F. **No such pair occurs in any stream of valid frames**, and each
//! of the four needs at least one flipped bit: any valid stream is at least 4 bits away from the pattern.
//!
//! * Bits flipped independently with probability p: for what was sent exactly one set of ≥ 4 flips makes the
//!   pattern at a given place, hence at most p⁴ a byte. At 11 520 B/s (115 200 baud) and p = 10⁻⁵ that is
//!   1.2·10⁻¹⁶ a second, less than once in 10⁸ years.
//! * A line of uniformly random bytes: 2⁻⁶⁴ a byte, 6·10⁻¹⁶ a second, once in 5·10⁷ years.
//!
//! Why not one byte as Grbl has: with one byte a single wrong byte would stop a run, or frames would have to
//! escape it. Why the second bytes differ: a wrong baud rate or a hum makes periodic bytes.

use crate::frame::MAX_FRAME;

/// Sent raw, at any moment, also in the middle of a frame (which is then lost).
pub const EMERGENCY_STOP: [u8; 8] = [0x00, 0xE7, 0x00, 0xF9, 0x00, 0xEE, 0x00, 0xF3];

/// Largest COBS count in a valid frame: from the code byte to the delimiter of the longest frame.
const LARGEST_CODE: u8 = (MAX_FRAME - 1) as u8;

const _: () = {
    let mut pair = 0;
    while pair < EMERGENCY_STOP.len() {
        assert!(EMERGENCY_STOP[pair] == 0 && EMERGENCY_STOP[pair + 1] > LARGEST_CODE);
        pair += 2;
    }
};

/// Looks for [`EMERGENCY_STOP`] in a stream of bytes; eight bytes of state, no loop.
#[derive(Clone, Copy, Debug)]
pub struct EmergencyWatch {
    last_eight: u64,
}

impl Default for EmergencyWatch {
    fn default() -> Self {
        Self::new()
    }
}

impl EmergencyWatch {
    /// Nothing seen yet.
    #[must_use]
    pub const fn new() -> Self {
        // Not zero: the pattern begins with a zero that must have been received.
        Self { last_eight: u64::MAX }
    }

    /// Takes one byte; true when it completes the pattern.
    pub fn feed(&mut self, byte: u8) -> bool {
        self.last_eight = self.last_eight << 8 | u64::from(byte);
        self.last_eight == u64::from_be_bytes(EMERGENCY_STOP)
    }
}
