//! How requests and records of the Net F/T's raw data transfer (RDT) look on the wire: 8 bytes there, 36 bytes back, big endian.
//!
//! Sources: ATI 9620-05 (Net F/T) chapter 10 and 9610-05 (Ethernet Axia) pp. 45 and 81. A datagram of the buffered mode holds up to
//! 40 records one after another.

use crate::clock::HostTime;
use crate::device::ForceRecord;

/// Bytes of a record.
pub(super) const RECORD_BYTES: usize = 36;

/// Most records that the sensor puts into one datagram.
pub(super) const MOST_RECORDS: usize = 40;

/// The first word of every request.
const HEADER: u16 = 0x1234;

/// What the sensor can be asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Command {
    /// End the stream.
    Stop,
    /// A stream with one record a datagram.
    Realtime,
    /// A stream with several records a datagram.
    Buffered,
    /// Let go of a latched threshold.
    ResetLatch,
    /// Take the present reading for zero.
    Bias,
}

/// The bytes of a request. Streams have no end: a sample count of 0.
pub(super) fn request(command: Command) -> [u8; 8] {
    let code: u16 = match command {
        Command::Stop => 0x0000,
        Command::Realtime => 0x0002,
        Command::Buffered => 0x0003,
        Command::ResetLatch => 0x0041,
        Command::Bias => 0x0042,
    };
    let ([a, b], [c, d]) = (HEADER.to_be_bytes(), code.to_be_bytes());
    [a, b, c, d, 0, 0, 0, 0]
}

/// The records of a datagram that arrived at `host`, or none when its length is not that of 1 to 40 records.
pub(super) fn records(datagram: &[u8], host: HostTime) -> Option<impl Iterator<Item = ForceRecord>> {
    let (records, rest) = datagram.as_chunks::<RECORD_BYTES>();
    let sound = rest.is_empty() && (1..=MOST_RECORDS).contains(&records.len());
    sound.then(|| records.iter().map(move |bytes| record(bytes, host)))
}

fn record(bytes: &[u8; RECORD_BYTES], host: HostTime) -> ForceRecord {
    let (words, _) = bytes.as_chunks::<4>();
    let word = |n: usize| u32::from_be_bytes(words[n]);
    ForceRecord {
        host,
        rdt_sequence: word(0),
        ft_sequence: word(1),
        status: word(2),
        counts: std::array::from_fn(|axis| word(3 + axis).cast_signed()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const HOST: HostTime = HostTime::from_nanos(7);

    /// Commands of ATI 9620-05, table 10.1.
    #[test]
    fn requests_have_the_published_bytes() {
        assert_eq!(request(Command::Stop), [0x12, 0x34, 0, 0, 0, 0, 0, 0]);
        assert_eq!(request(Command::Realtime), [0x12, 0x34, 0, 2, 0, 0, 0, 0]);
        assert_eq!(request(Command::Buffered), [0x12, 0x34, 0, 3, 0, 0, 0, 0]);
        assert_eq!(request(Command::ResetLatch), [0x12, 0x34, 0, 0x41, 0, 0, 0, 0]);
        assert_eq!(request(Command::Bias), [0x12, 0x34, 0, 0x42, 0, 0, 0, 0]);
    }

    /// A record by the layout of ATI 9620-05, section 10.1: three unsigned words, then six signed ones.
    #[rustfmt::skip]
    const GOLDEN: [u8; RECORD_BYTES] = [
        0x00, 0x00, 0x00, 0x01,
        0xff, 0xff, 0xff, 0xfe,
        0x80, 0x01, 0x00, 0x00,
        0x00, 0x0f, 0x42, 0x40,
        0xff, 0xf0, 0xbd, 0xc0,
        0x7f, 0xff, 0xff, 0xff,
        0x80, 0x00, 0x00, 0x00,
        0x00, 0x00, 0x00, 0x00,
        0xff, 0xff, 0xff, 0xff,
    ];

    fn expected() -> ForceRecord {
        ForceRecord {
            host: HOST,
            rdt_sequence: 1,
            ft_sequence: u32::MAX - 1,
            status: 0x8001_0000,
            counts: [1_000_000, -1_000_000, i32::MAX, i32::MIN, 0, -1],
        }
    }

    #[test]
    fn a_record_is_read_from_the_published_bytes() {
        let read: Vec<_> = records(&GOLDEN, HOST).expect("one record").collect();
        assert_eq!(read, [expected()]);
    }

    #[test]
    fn a_buffered_datagram_holds_its_records_in_order() {
        let mut datagram = GOLDEN.repeat(MOST_RECORDS);
        datagram[39 * RECORD_BYTES + 3] = 40;
        let read: Vec<_> = records(&datagram, HOST).expect("forty records").collect();
        assert_eq!(read.len(), 40);
        assert_eq!(read[0], expected());
        assert_eq!(read[39], ForceRecord { rdt_sequence: 40, ..expected() });
    }

    #[test]
    fn any_other_length_is_no_datagram() {
        let long = GOLDEN.repeat(MOST_RECORDS + 1);
        for length in 0..=long.len() {
            let sound = length % RECORD_BYTES == 0 && (1..=MOST_RECORDS).contains(&(length / RECORD_BYTES));
            assert_eq!(records(&long[..length], HOST).is_some(), sound, "{length} bytes");
        }
    }

    proptest! {
        #[test]
        fn what_was_sent_is_what_is_read(words in prop::collection::vec(any::<[u32; 9]>(), 1..=MOST_RECORDS)) {
            let datagram: Vec<u8> = words.iter().flatten().flat_map(|w| w.to_be_bytes()).collect();
            let read: Vec<_> = records(&datagram, HOST).expect("a sound length").collect();
            prop_assert_eq!(read.len(), words.len());
            for (record, sent) in read.iter().zip(&words) {
                prop_assert_eq!([record.rdt_sequence, record.ft_sequence, record.status], [sent[0], sent[1], sent[2]]);
                prop_assert_eq!(record.counts.map(i32::cast_unsigned), [sent[3], sent[4], sent[5], sent[6], sent[7], sent[8]]);
            }
        }
    }
}
