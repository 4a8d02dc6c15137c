//! Where the chunks of an MCAP file lie, also of one that was cut off or damaged, and what is in a chunk.
//!
//! Reads the frame of the file only: records with their lengths, chunks with their checksums. A chunk counts when its three lengths
//! agree and it fits into the file; it is believed when its checksum agrees, which is seen when it is loaded. Where the frame breaks,
//! the next chunk whose checksum agrees is looked for byte by byte. Nothing that no checksum vouches for is ever handed out.
//!
//! Why not the reader of the `mcap` crate: it ends at the first damage, and what it makes of arbitrary bytes is not this room's to
//! promise. Format: the MCAP specification (mcap.dev/spec), version 0.

use super::Topic;
use super::scribe::LARGEST_MESSAGE;
use std::io::{self, Read, Seek, SeekFrom};

const MAGIC: [u8; 8] = *b"\x89MCAP0\r\n";

const HEADER: u8 = 0x01;
const FOOTER: u8 = 0x02;
const CHANNEL: u8 = 0x04;
const MESSAGE: u8 = 0x05;
const CHUNK: u8 = 0x06;
const MESSAGE_INDEX: u8 = 0x07;
const ATTACHMENT: u8 = 0x09;
const METADATA: u8 = 0x0C;
const DATA_END: u8 = 0x0F;

/// Opcode and length of a record.
const FRAME: u64 = 9;

/// A chunk's header: first and last time, length, checksum, compression (none), length again.
const CHUNK_HEADER: u64 = 8 + 8 + 8 + 4 + 4 + 8;

/// Largest chunk that is believed (bytes): twice what this program writes at most.
const LARGEST_CHUNK: u64 = 2 * (LARGEST_MESSAGE as u64 + (1 << 20));

/// Bytes that are looked through at once for a chunk.
const WINDOW: u64 = 1 << 18;

/// Where the records of a chunk lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Place {
    /// Where they begin (bytes from the start of the file).
    pub(super) offset: u64,
    /// How many bytes they are.
    pub(super) bytes: u64,
    crc: u32,
    /// Earliest time in it, as its header says (ns).
    pub(super) start: u64,
    /// What lies between the chunk before and this one and cannot be read.
    pub(super) hole: Option<Hole>,
}

impl Place {
    /// The whole chunk, when it cannot be read.
    pub(super) fn hole_of_chunk(&self) -> Hole {
        Hole { offset: self.offset - CHUNK_HEADER - FRAME, bytes: self.bytes + CHUNK_HEADER + FRAME }
    }
}

/// Bytes that cannot be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Hole {
    /// Where they begin (bytes from the start of the file).
    pub(super) offset: u64,
    /// How many they are.
    pub(super) bytes: u64,
}

/// The frame of a file.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Layout {
    /// Chunks in the order of the file.
    pub(super) chunks: Vec<Place>,
    /// What cannot be read at the end of the file.
    pub(super) tail: Option<Hole>,
    /// Where its footer begins, when it has one with the end mark behind it.
    pub(super) footer: Option<u64>,
    /// Where the record begins that ends the data.
    data_end: Option<u64>,
    /// Length of the file (bytes).
    pub(super) bytes: u64,
}

/// Finds the chunks of a file.
pub(super) fn survey<R: Read + Seek>(source: &mut R) -> io::Result<Layout> {
    let bytes = source.seek(SeekFrom::End(0))?;
    let mut layout = Layout { bytes, ..Layout::default() };
    source.rewind()?;
    let has_magic = bytes >= MAGIC.len() as u64 && read_array(source)? == MAGIC;
    let (mut at, mut broken) = if has_magic { (MAGIC.len() as u64, None) } else { (0, Some(0)) };
    // Where the last chunk ended: a record after it whose length lies must not hide what follows.
    let mut behind_chunk = at;
    while at < bytes {
        let next = match broken {
            None => next_record(source, at, bytes, layout.data_end.is_some())?,
            Some(_) => find_chunk(source, behind_chunk, bytes)?.map_or(Next::Broken, Next::Chunk),
        };
        match next {
            Next::Chunk(place) => {
                let begins = place.offset - CHUNK_HEADER - FRAME;
                let hole = broken.take().map(|from| {
                    let offset = if from < begins { from } else { behind_chunk };
                    Hole { offset, bytes: begins - offset }
                });
                at = place.offset + place.bytes;
                behind_chunk = at;
                layout.chunks.push(Place { hole, ..place });
            }
            Next::Other(end) => at = end,
            Next::DataEnd(end) => {
                layout.data_end = Some(at);
                at = end;
            }
            Next::Footer => {
                layout.footer = Some(at);
                return Ok(layout);
            }
            Next::Broken if broken.is_none() => broken = Some(at),
            Next::Broken => break,
        }
    }
    let offset = broken.unwrap_or(at);
    layout.tail = (offset < bytes).then_some(Hole { offset, bytes: bytes - offset });
    Ok(layout)
}

enum Next {
    Chunk(Place),
    /// Some other record; where it ends.
    Other(u64),
    /// The record that ends the data; where it ends.
    DataEnd(u64),
    /// The footer, with the end mark behind it.
    Footer,
    Broken,
}

/// The record that begins at `at`. What a record of the data may be is told narrowly, so that a chunk whose opcode is damaged is not
/// passed over as something else.
fn next_record<R: Read + Seek>(source: &mut R, at: u64, bytes: u64, in_summary: bool) -> io::Result<Next> {
    if bytes - at < FRAME {
        return Ok(Next::Broken);
    }
    source.seek(SeekFrom::Start(at))?;
    let frame: [u8; FRAME as usize] = read_array(source)?;
    let (opcode, length) = (frame[0], u64_at(&frame, 1));
    if length > bytes - at - FRAME {
        return Ok(Next::Broken);
    }
    let end = at + FRAME + length;
    Ok(match opcode {
        CHUNK if length >= CHUNK_HEADER => {
            let header: [u8; CHUNK_HEADER as usize] = read_array(source)?;
            place(at, length, &header, bytes).map_or(Next::Broken, Next::Chunk)
        }
        MESSAGE_INDEX if length >= 6 => {
            // Channel, then the length of what is left.
            let header: [u8; 6] = read_array(source)?;
            let left = u32::from_le_bytes([header[2], header[3], header[4], header[5]]);
            if u64::from(left) == length - 6 { Next::Other(end) } else { Next::Broken }
        }
        DATA_END if length == 4 => Next::DataEnd(end),
        FOOTER => {
            source.seek(SeekFrom::Start(end))?;
            let is_end = bytes - end == MAGIC.len() as u64 && read_array(source)? == MAGIC;
            if is_end { Next::Footer } else { Next::Broken }
        }
        HEADER if at == MAGIC.len() as u64 => Next::Other(end),
        ATTACHMENT | METADATA => Next::Other(end),
        HEADER..DATA_END if in_summary => Next::Other(end),
        _ => Next::Broken,
    })
}

/// The chunk whose record begins at `at`, if its lengths agree with each other and with the file.
fn place(at: u64, length: u64, header: &[u8; CHUNK_HEADER as usize], bytes: u64) -> Option<Place> {
    let (start, end, size) = (u64_at(header, 0), u64_at(header, 8), u64_at(header, 16));
    let crc = u32::from_le_bytes(header[24..28].try_into().ok()?);
    let is_uncompressed = header[28..32] == [0; 4];
    let (records, offset) = (u64_at(header, 32), at + FRAME + CHUNK_HEADER);
    let agree = is_uncompressed
        && records == size
        && Some(length) == records.checked_add(CHUNK_HEADER)
        && start <= end
        && records <= LARGEST_CHUNK
        && records <= bytes.saturating_sub(offset);
    agree.then_some(Place { offset, bytes: records, crc, start, hole: None })
}

/// The first chunk from `from` on whose checksum agrees.
fn find_chunk<R: Read + Seek>(source: &mut R, from: u64, bytes: u64) -> io::Result<Option<Place>> {
    const NEEDED: usize = (FRAME + CHUNK_HEADER) as usize;
    let mut window = Vec::new();
    let mut records = Vec::new();
    let mut at = from;
    while bytes.saturating_sub(at) >= NEEDED as u64 {
        source.seek(SeekFrom::Start(at))?;
        window.clear();
        source.by_ref().take(WINDOW).read_to_end(&mut window)?;
        if window.len() < NEEDED {
            break;
        }
        for (i, candidate) in window.windows(NEEDED).enumerate() {
            if candidate[0] != CHUNK {
                continue;
            }
            let Ok(header) = candidate[FRAME as usize..].try_into() else { continue };
            let found = place(at + i as u64, u64_at(candidate, 1), header, bytes);
            if let Some(found) = found
                && load(source, &found, &mut records)?
            {
                return Ok(Some(found));
            }
        }
        at += (window.len() - NEEDED + 1) as u64;
    }
    Ok(None)
}

/// Loads the records of a chunk; whether its checksum agrees. Without a checksum (0) it does not.
pub(super) fn load<R: Read + Seek>(source: &mut R, place: &Place, records: &mut Vec<u8>) -> io::Result<bool> {
    records.clear();
    source.seek(SeekFrom::Start(place.offset))?;
    source.by_ref().take(place.bytes).read_to_end(records)?;
    Ok(place.crc != 0 && records.len() as u64 == place.bytes && crc32fast::hash(records) == place.crc)
}

/// Whether the checksums at the end of a closed file agree: over all data with its indexes, and over the summary. Together with the end
/// mark they cover every byte.
pub(super) fn closing_checksums_agree<R: Read + Seek>(source: &mut R, layout: &Layout) -> io::Result<bool> {
    let (Some(data_end), Some(footer)) = (layout.data_end, layout.footer) else { return Ok(false) };
    let data = checksum(source, 0, data_end)?;
    source.seek(SeekFrom::Start(data_end + FRAME))?;
    let stated_data = u32::from_le_bytes(read_array(source)?);
    // The footer: where the summary begins, where its offsets do, the checksum up to here.
    source.seek(SeekFrom::Start(footer + FRAME))?;
    let summary_start = u64::from_le_bytes(read_array(source)?);
    source.seek_relative(8)?;
    let stated_summary = u32::from_le_bytes(read_array(source)?);
    let checked_until = footer + FRAME + 16;
    if summary_start != data_end + FRAME + 4 {
        return Ok(false);
    }
    let summary = checksum(source, summary_start, checked_until)?;
    Ok(data == stated_data && summary == stated_summary)
}

fn checksum<R: Read + Seek>(source: &mut R, from: u64, until: u64) -> io::Result<u32> {
    let mut hasher = crc32fast::Hasher::new();
    source.seek(SeekFrom::Start(from))?;
    let mut rest = source.by_ref().take(until - from);
    let mut window = vec![0; WINDOW as usize];
    loop {
        match rest.read(&mut window)? {
            0 => return Ok(hasher.finalize()),
            count => hasher.update(&window[..count]),
        }
    }
}

/// A message as it lies in a chunk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct RawMessage<'a> {
    pub(super) topic: Topic,
    pub(super) sequence: u32,
    pub(super) log_time: u64,
    pub(super) payload: &'a [u8],
}

/// What lies in a file, part by part, in its order.
pub(super) enum Part<'a> {
    /// The messages of a chunk whose checksum agrees.
    Messages(Vec<RawMessage<'a>>),
    /// Bytes that cannot be read.
    Damaged(Hole),
}

/// Goes through a file.
pub(super) fn walk<R, E>(
    source: &mut R,
    layout: &Layout,
    mut visit: impl FnMut(Part<'_>) -> Result<(), E>,
) -> Result<(), E>
where
    R: Read + Seek,
    E: From<io::Error>,
{
    let (mut records, mut channels) = (Vec::new(), Channels::default());
    for place in &layout.chunks {
        if let Some(hole) = place.hole {
            visit(Part::Damaged(hole))?;
        }
        if load(source, place, &mut records)? {
            visit(Part::Messages(channels.messages(&records)))?;
        } else {
            visit(Part::Damaged(place.hole_of_chunk()))?;
        }
    }
    layout.tail.map_or(Ok(()), |tail| visit(Part::Damaged(tail)))
}

/// Which topic a channel number stands for.
#[derive(Debug, Clone)]
pub(super) struct Channels(Vec<(u16, Topic)>);

impl Default for Channels {
    /// The numbers that this program writes; they hold until the file says otherwise.
    fn default() -> Self {
        Self(Topic::ALL.map(|t| (t.channel(), t)).to_vec())
    }
}

impl Channels {
    fn topic(&self, channel: u16) -> Option<Topic> {
        self.0.iter().find(|(number, _)| *number == channel).map(|&(_, topic)| topic)
    }

    fn learn(&mut self, channel: u16, name: &str) {
        self.0.retain(|(number, _)| *number != channel);
        self.0.extend(Topic::named(name).map(|topic| (channel, topic)));
    }

    /// The messages among the records of a chunk. Records that say nothing to this program are passed over.
    pub(super) fn messages<'a>(&mut self, mut records: &'a [u8]) -> Vec<RawMessage<'a>> {
        let mut messages = Vec::new();
        while let Some((frame, rest)) = records.split_at_checked(FRAME as usize) {
            let length = usize::try_from(u64_at(frame, 1)).unwrap_or(usize::MAX);
            let Some((body, rest)) = rest.split_at_checked(length) else { break };
            records = rest;
            match frame[0] {
                CHANNEL => {
                    if let Some((channel, name)) = channel(body) {
                        self.learn(channel, name);
                    }
                }
                MESSAGE => messages.extend(self.message(body)),
                _ => {}
            }
        }
        messages
    }

    fn message<'a>(&self, body: &'a [u8]) -> Option<RawMessage<'a>> {
        let (header, payload) = body.split_at_checked(22)?;
        let topic = self.topic(u16::from_le_bytes(header[..2].try_into().ok()?))?;
        let sequence = u32::from_le_bytes(header[2..6].try_into().ok()?);
        Some(RawMessage { topic, sequence, log_time: u64_at(header, 6), payload })
    }
}

/// Number and topic of a channel record.
fn channel(body: &[u8]) -> Option<(u16, &str)> {
    let number = u16::from_le_bytes(body.get(..2)?.try_into().ok()?);
    let length = u32::from_le_bytes(body.get(4..8)?.try_into().ok()?) as usize;
    Some((number, std::str::from_utf8(body.get(8..8_usize.checked_add(length)?)?).ok()?))
}

fn read_array<const N: usize>(source: &mut impl Read) -> io::Result<[u8; N]> {
    let mut bytes = [0; N];
    source.read_exact(&mut bytes)?;
    Ok(bytes)
}

/// The number at `at`; the caller knows that there are eight bytes.
fn u64_at(bytes: &[u8], at: usize) -> u64 {
    let mut number = [0; 8];
    number.copy_from_slice(&bytes[at..at + 8]);
    u64::from_le_bytes(number)
}
