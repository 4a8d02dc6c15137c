//! Where does a frame begin and end, and is it whole? Bytes in, checked frames out, and the reverse.
//!
//! Inside a frame: major, kind, sequence, session, tick, payload, CRC-32C over all of these; the whole
//! COBS-coded (Cheshire and Baker, 1999) and closed by 0x00. `protocol.md` has the byte table.

use cobs::{DecodeResult, DecoderState};
use crc::{CRC_32_ISCSI, Crc};

use crate::table::Field;
use crate::wire::{Reader, Wire, Writer};

/// Version of the frame and of the messages that every version keeps (HELLO, QUERY, STOP and their answers).
pub const MAJOR: u8 = 1;

/// Longest frame on the wire, bytes, delimiter included.
pub const MAX_FRAME: usize = 96;

/// Bytes before the payload.
pub const HEADER_BYTES: usize = 11;

/// Bytes of the checksum.
pub const CHECKSUM_BYTES: usize = 4;

/// Longest inside of a frame: without the delimiter and COBS's one code byte (one suffices below 254 bytes).
const MAX_INSIDE: usize = MAX_FRAME - 2;

/// Longest payload, bytes.
pub const MAX_PAYLOAD: usize = MAX_INSIDE - HEADER_BYTES - CHECKSUM_BYTES;

/// CRC-32C (Castagnoli; the catalogue of parametrised CRCs lists it as CRC-32/ISCSI, check value e3069283).
static CHECKSUM: Crc<u32> = Crc::<u32>::new(&CRC_32_ISCSI);

macro_rules! header {
    ($($field:literal $type:ty, $unit:literal, $meaning:literal;)+) => {
        /// The header's fields, in the order of the wire.
        pub const HEADER: &[Field] = &[$(Field {
            name: $field,
            kind: <$type as Wire>::NAME,
            bytes: <$type as Wire>::SIZE,
            unit: $unit,
            meaning: $meaning,
        }),+];
        const _: () = assert!(HEADER_BYTES == 0 $(+ <$type as Wire>::SIZE)+);
    };
}

header! {
    "major" u8, "–", " Version of frame and protocol, today 1.";
    "kind" u8, "–", " Which message; the top bit is set in what the device sends.";
    "sequence" u8, "–", " Number of the request, repeated in its answer; 0 in streamed frames.";
    "session" u32, "–", " Nonce of the session; an answer repeats the request's, a streamed frame has the device's.";
    "tick_us" u32, "µs", " Sender's free-running clock when the frame was made; wraps every 71.6 minutes.";
}

/// What a frame says besides its message.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stamp {
    /// Number of the request, repeated in its answer.
    pub sequence: u8,
    /// Session nonce, 0 for none.
    pub session: u32,
    /// Sender's free-running clock, µs; wraps.
    pub tick_us: u32,
}

/// A frame that arrived whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame<'a> {
    /// Version that the sender speaks.
    pub major: u8,
    /// Which message.
    pub kind: u8,
    /// Sequence, session and tick.
    pub stamp: Stamp,
    /// The message's fields.
    pub payload: &'a [u8],
}

/// Why a whole frame holds no message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Undecodable {
    /// The table has no such message in this direction.
    UnknownKind {
        /// Kind byte received.
        kind: u8,
    },
    /// The length differs from the table's, or a code list has no such code.
    BadPayload {
        /// Kind byte received.
        kind: u8,
        /// Bytes received as payload.
        bytes: usize,
    },
}

/// A frame ready for the wire, delimiter included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Encoded {
    bytes: [u8; MAX_FRAME],
    length: u8,
}

impl Encoded {
    /// No bytes.
    pub(crate) const EMPTY: Self = Self { bytes: [0; MAX_FRAME], length: 0 };

    /// Frames any payload; the messages' own `encode` is what drivers want. A payload longer than
    /// [`MAX_PAYLOAD`] gives no bytes.
    #[must_use]
    pub fn of(major: u8, kind: u8, stamp: Stamp, payload: &[u8]) -> Self {
        if payload.len() > MAX_PAYLOAD {
            return Self::EMPTY;
        }
        let mut inside = [0; MAX_INSIDE];
        let mut to = Writer::new(&mut inside);
        to.bytes(&[major, kind, stamp.sequence]);
        stamp.session.put(&mut to);
        stamp.tick_us.put(&mut to);
        to.bytes(payload);
        let end = to.length();
        let checksum = CHECKSUM.checksum(&inside[..end]);
        let end = end + CHECKSUM_BYTES;
        inside[end - CHECKSUM_BYTES..end].copy_from_slice(&checksum.to_le_bytes());
        let mut frame = Self::EMPTY;
        if let Ok(length) = cobs::try_encode(&inside[..end], &mut frame.bytes) {
            frame.length = length as u8 + 1;
        }
        frame
    }

    /// The bytes to send.
    #[must_use]
    pub fn as_bytes(&self) -> &[u8] {
        &self.bytes[..usize::from(self.length)]
    }
}

/// How many frames a decoder dropped, by cause. The counts stop at their largest value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dropped {
    /// No delimiter within the longest frame.
    pub too_long: u32,
    /// The delimiter came where COBS announced more bytes.
    pub cut_short: u32,
    /// Fewer bytes than header and checksum need.
    pub too_short: u32,
    /// The checksum disagrees.
    pub checksum: u32,
}

impl Dropped {
    /// All causes together.
    #[must_use]
    pub const fn total(&self) -> u32 {
        self.too_long
            .saturating_add(self.cut_short)
            .saturating_add(self.too_short)
            .saturating_add(self.checksum)
    }
}

/// Finds frames in a stream of bytes. Every 0x00 brings it back to a frame's beginning, whatever came before.
#[derive(Debug)]
pub struct Decoder {
    cobs: DecoderState,
    inside: [u8; MAX_INSIDE],
    length: usize,
    overflowed: bool,
    dropped: Dropped,
}

impl Default for Decoder {
    fn default() -> Self {
        Self::new()
    }
}

impl Decoder {
    /// A decoder at the beginning of a frame.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            cobs: DecoderState::Idle,
            inside: [0; MAX_INSIDE],
            length: 0,
            overflowed: false,
            dropped: Dropped { too_long: 0, cut_short: 0, too_short: 0, checksum: 0 },
        }
    }

    /// What was dropped so far.
    #[must_use]
    pub const fn dropped(&self) -> Dropped {
        self.dropped
    }

    /// Forgets the frame under way, if any, and keeps the counts.
    fn restart(&mut self) {
        self.cobs = DecoderState::Idle;
        self.length = 0;
        self.overflowed = false;
    }

    /// Takes one byte; gives the frame that it completes, if it completes one.
    pub fn feed(&mut self, byte: u8) -> Option<Frame<'_>> {
        match self.cobs.feed(byte) {
            Ok(DecodeResult::DataComplete) => {
                let length = core::mem::take(&mut self.length);
                if core::mem::take(&mut self.overflowed) {
                    self.dropped.too_long = self.dropped.too_long.saturating_add(1);
                    return None;
                }
                self.check(length)
            }
            Ok(DecodeResult::DataContinue(value)) => {
                match self.inside.get_mut(self.length) {
                    Some(place) => {
                        *place = value;
                        self.length += 1;
                    }
                    None => self.overflowed = true,
                }
                None
            }
            Ok(DecodeResult::NoData | DecodeResult::DataStart) => None,
            Err(_) => {
                let cause =
                    if self.overflowed { &mut self.dropped.too_long } else { &mut self.dropped.cut_short };
                *cause = cause.saturating_add(1);
                self.restart();
                None
            }
        }
    }

    fn check(&mut self, length: usize) -> Option<Frame<'_>> {
        let Some((covered, sum)) = self.inside[..length]
            .split_last_chunk::<CHECKSUM_BYTES>()
            .filter(|(covered, _)| covered.len() >= HEADER_BYTES)
        else {
            self.dropped.too_short = self.dropped.too_short.saturating_add(1);
            return None;
        };
        if CHECKSUM.checksum(covered) != u32::from_le_bytes(*sum) {
            self.dropped.checksum = self.dropped.checksum.saturating_add(1);
            return None;
        }
        let (header, payload) = covered.split_at(HEADER_BYTES);
        let mut from = Reader::new(header);
        let [major, kind, sequence] = from.array()?;
        let stamp = Stamp { sequence, session: u32::get(&mut from)?, tick_us: u32::get(&mut from)? };
        Some(Frame { major, kind, stamp, payload })
    }
}
