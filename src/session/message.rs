//! What one message of a session says, and how it becomes the bytes of its payload and back. No input or output.

use super::cdr::{Decoder, Encoder};
use super::document::{Event, StartDocument, StopDocument, to_json};
use super::picture::{CameraFrame, Picture};
use super::{SessionError, Topic};
use crate::clock::HostTime;
use crate::device::{ForceRecord, MarkerFrame, MarkerPosition, StageReport, StageState};

/// Most force records in one message.
pub const BATCH: usize = 64;

/// Force records that were handed over together, by value: no more than [`BATCH`].
#[derive(Clone, Copy)]
pub struct ForceBatch {
    /// Force records in the file before these.
    pub(super) first_record: u64,
    len: usize,
    records: [ForceRecord; BATCH],
}

impl ForceBatch {
    const NOTHING: ForceRecord = ForceRecord {
        host: HostTime::from_nanos(0),
        rdt_sequence: 0,
        ft_sequence: 0,
        status: 0,
        counts: [0; 6],
    };

    /// An empty batch.
    pub(super) const fn new() -> Self {
        Self { first_record: 0, len: 0, records: [Self::NOTHING; BATCH] }
    }

    /// The records, as they came.
    pub fn records(&self) -> &[ForceRecord] {
        &self.records[..self.len]
    }

    /// Adds a record; `false` when there is no room.
    pub(super) fn push(&mut self, record: ForceRecord) -> bool {
        let Some(free) = self.records.get_mut(self.len) else { return false };
        *free = record;
        self.len += 1;
        true
    }

    pub(super) const fn is_full(&self) -> bool {
        self.len == BATCH
    }

    pub(super) fn clear(&mut self) {
        self.len = 0;
    }

    fn encode(&self, encoder: &mut Encoder<'_>) {
        let records = || self.records().iter();
        encoder.u64(self.first_record);
        encoder.sequence(records().map(|r| r.host.nanos().to_le_bytes()));
        encoder.sequence(records().map(|r| r.rdt_sequence.to_le_bytes()));
        encoder.sequence(records().map(|r| r.ft_sequence.to_le_bytes()));
        encoder.sequence(records().map(|r| r.status.to_le_bytes()));
        for channel in 0..6 {
            encoder.sequence(records().map(|r| r.counts[channel].to_le_bytes()));
        }
    }

    fn decode(decoder: &mut Decoder<'_>) -> Option<Self> {
        let mut batch = Self::new();
        batch.first_record = decoder.u64()?;
        let hosts = decoder.sequence()?;
        batch.len = hosts.len();
        let records = batch.records.get_mut(..batch.len)?;
        for (record, bytes) in records.iter_mut().zip(hosts) {
            record.host = HostTime::from_nanos(u64::from_le_bytes(bytes));
        }
        column(decoder, records, |record, bytes| record.rdt_sequence = u32::from_le_bytes(bytes))?;
        column(decoder, records, |record, bytes| record.ft_sequence = u32::from_le_bytes(bytes))?;
        column(decoder, records, |record, bytes| record.status = u32::from_le_bytes(bytes))?;
        for channel in 0..6 {
            column(decoder, records, |record, bytes| record.counts[channel] = i32::from_le_bytes(bytes))?;
        }
        Some(batch)
    }
}

/// Reads a column with one element for each record.
fn column<const N: usize>(
    decoder: &mut Decoder<'_>,
    records: &mut [ForceRecord],
    set: impl Fn(&mut ForceRecord, [u8; N]),
) -> Option<()> {
    let elements = decoder.sequence()?;
    if elements.len() != records.len() {
        return None;
    }
    records.iter_mut().zip(elements).for_each(|(record, bytes)| set(record, bytes));
    Some(())
}

impl std::fmt::Debug for ForceBatch {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ForceBatch")
            .field("first_record", &self.first_record)
            .field("records", &self.records())
            .finish()
    }
}

impl PartialEq for ForceBatch {
    fn eq(&self, other: &Self) -> bool {
        self.first_record == other.first_record && self.records() == other.records()
    }
}

/// One question for a device's clock and its answer. Recorded, never applied: the offset is found when the recording is read.
#[derive(Debug, Clone, PartialEq)]
pub struct ClockProbe {
    /// Whose clock.
    pub device: String,
    /// When the question was handed to the operating system.
    pub sent: HostTime,
    /// When the answer had arrived.
    pub received: HostTime,
    /// The device's counter in the answer.
    pub device_ticks: u64,
    /// Nominal rate of that counter (1/s).
    pub tick_hz: f64,
}

/// Why records are missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum GapCause {
    /// They were handed over faster than the disk took them.
    QueueFull,
    /// The device counted them, but they never came.
    NotReceived,
}

/// Records that are known to be missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Gap {
    /// Of which topic.
    pub topic: Topic,
    /// Why.
    pub cause: GapCause,
    /// How many.
    pub records: u64,
    /// Time of the first missing record, or of the one before it.
    pub first: HostTime,
    /// Time of the last missing record, or of the one after it.
    pub last: HostTime,
}

/// What one message says.
#[derive(Debug, Clone, PartialEq)]
#[expect(
    clippy::large_enum_variant,
    reason = "force goes by value, so that handing it over allocates nothing"
)]
pub enum Message {
    /// The session begins.
    Start(Box<StartDocument>),
    /// Force records.
    Force(ForceBatch),
    /// A report of the stage.
    Stage(StageReport),
    /// A frame of marker positions.
    Markers(MarkerFrame),
    /// A probe of a device's clock.
    ClockProbe(ClockProbe),
    /// Missing records.
    Gap(Gap),
    /// Something happened.
    Event(Event),
    /// The session ends.
    Stop(Box<StopDocument>),
    /// A frame of the depth camera.
    Frame(CameraFrame),
    /// Its grey picture.
    Grey(Picture),
    /// Its depth picture.
    Depth(Picture),
}

impl Message {
    /// What it is about.
    pub const fn topic(&self) -> Topic {
        match self {
            Self::Start(_) => Topic::Start,
            Self::Force(_) => Topic::Force,
            Self::Stage(_) => Topic::Stage,
            Self::Markers(_) => Topic::Markers,
            Self::ClockProbe(_) => Topic::ClockProbe,
            Self::Gap(_) => Topic::Gap,
            Self::Event(_) => Topic::Event,
            Self::Stop(_) => Topic::Stop,
            Self::Frame(_) => Topic::Frame,
            Self::Grey(_) => Topic::Grey,
            Self::Depth(_) => Topic::Depth,
        }
    }

    /// When it happened, on the host's monotonic clock; of a batch, its first record.
    pub fn host(&self) -> HostTime {
        match self {
            Self::Start(start) => HostTime::from_nanos(start.started_host_ns),
            Self::Force(batch) => batch.records().first().map_or(HostTime::from_nanos(0), |r| r.host),
            Self::Stage(report) => report.host,
            Self::Markers(frame) => frame.host,
            Self::ClockProbe(probe) => probe.received,
            Self::Gap(gap) => gap.last,
            Self::Event(event) => HostTime::from_nanos(event.host_ns),
            Self::Stop(stop) => HostTime::from_nanos(stop.stopped_host_ns),
            Self::Frame(frame) => frame.host,
            Self::Grey(picture) | Self::Depth(picture) => picture.host,
        }
    }

    /// Records in it: those of a batch, otherwise one.
    pub fn records(&self) -> u64 {
        match self {
            Self::Force(batch) => batch.len as u64,
            _ => 1,
        }
    }

    /// Writes the payload into `bytes`, whose room is used again.
    ///
    /// # Errors
    /// [`SessionError::Unwritable`]: a document holds a value that is not finite.
    pub(super) fn encode(&self, bytes: &mut Vec<u8>) -> Result<(), SessionError> {
        let mut encoder = Encoder::new(bytes);
        match self {
            Self::Force(batch) => batch.encode(&mut encoder),
            Self::Stage(report) => encode_stage(report, &mut encoder),
            Self::Markers(frame) => encode_markers(frame, &mut encoder),
            Self::ClockProbe(probe) => {
                encoder.string(&probe.device);
                encoder.u64(probe.sent.nanos());
                encoder.u64(probe.received.nanos());
                encoder.u64(probe.device_ticks);
                encoder.f64(probe.tick_hz);
            }
            Self::Gap(gap) => {
                encoder.string(gap.topic.name());
                encoder.u8(match gap.cause {
                    GapCause::QueueFull => 0,
                    GapCause::NotReceived => 1,
                });
                encoder.u64(gap.records);
                encoder.u64(gap.first.nanos());
                encoder.u64(gap.last.nanos());
            }
            Self::Frame(frame) => frame.write(&mut encoder),
            Self::Grey(picture) | Self::Depth(picture) => picture.write(&mut encoder),
            Self::Start(start) => *bytes = to_json("start document", start.as_ref())?,
            Self::Event(event) => *bytes = to_json("event", event)?,
            Self::Stop(stop) => *bytes = to_json("stop document", stop.as_ref())?,
        }
        Ok(())
    }

    /// Reads the payload of a message of `topic`; `None` when it does not follow its schema to the last byte.
    pub(super) fn decode(topic: Topic, payload: &[u8]) -> Option<Self> {
        match topic {
            Topic::Start => return serde_json::from_slice(payload).ok().map(Self::Start),
            Topic::Event => return serde_json::from_slice(payload).ok().map(Self::Event),
            Topic::Stop => return serde_json::from_slice(payload).ok().map(Self::Stop),
            _ => {}
        }
        let mut decoder = Decoder::new(payload)?;
        let message = match topic {
            Topic::Force => Self::Force(ForceBatch::decode(&mut decoder)?),
            Topic::Stage => Self::Stage(decode_stage(&mut decoder)?),
            Topic::Markers => Self::Markers(decode_markers(&mut decoder)?),
            Topic::Frame => Self::Frame(CameraFrame::read(&mut decoder)?),
            Topic::Grey => Self::Grey(Picture::read(&mut decoder)?),
            Topic::Depth => Self::Depth(Picture::read(&mut decoder)?),
            Topic::ClockProbe => Self::ClockProbe(ClockProbe {
                device: decoder.string()?,
                sent: HostTime::from_nanos(decoder.u64()?),
                received: HostTime::from_nanos(decoder.u64()?),
                device_ticks: decoder.u64()?,
                tick_hz: decoder.f64()?,
            }),
            _ => Self::Gap(Gap {
                topic: Topic::named(&decoder.string()?)?,
                cause: match decoder.u8()? {
                    0 => GapCause::QueueFull,
                    1 => GapCause::NotReceived,
                    _ => return None,
                },
                records: decoder.u64()?,
                first: HostTime::from_nanos(decoder.u64()?),
                last: HostTime::from_nanos(decoder.u64()?),
            }),
        };
        decoder.end()?;
        Some(message)
    }
}

fn encode_stage(report: &StageReport, encoder: &mut Encoder<'_>) {
    let (state, fault_code) = match report.state {
        StageState::Idle => (0, 0),
        StageState::Moving => (1, 0),
        StageState::Homing => (2, 0),
        StageState::Fault { code } => (3, code),
    };
    encoder.u64(report.host.nanos());
    encoder.bool(report.tick_us.is_some());
    encoder.u32(report.tick_us.unwrap_or(0));
    report.position_m.iter().for_each(|&x| encoder.f64(x));
    encoder.u8(state);
    encoder.u8(fault_code);
    encoder.bool(report.homed);
}

fn decode_stage(decoder: &mut Decoder<'_>) -> Option<StageReport> {
    let host = HostTime::from_nanos(decoder.u64()?);
    let (has_tick, tick_us) = (decoder.bool()?, decoder.u32()?);
    let position_m = [decoder.f64()?, decoder.f64()?];
    let state = match (decoder.u8()?, decoder.u8()?) {
        (0, 0) => StageState::Idle,
        (1, 0) => StageState::Moving,
        (2, 0) => StageState::Homing,
        (3, code) => StageState::Fault { code },
        _ => return None,
    };
    Some(StageReport {
        host,
        tick_us: has_tick.then_some(tick_us),
        position_m,
        state,
        homed: decoder.bool()?,
    })
}

fn encode_markers(frame: &MarkerFrame, encoder: &mut Encoder<'_>) {
    encoder.u64(frame.host.nanos());
    encoder.u32(frame.number);
    encoder.sequence(frame.markers.iter().map(|m| m.marker.to_le_bytes()));
    for axis in 0..3 {
        encoder.sequence(frame.markers.iter().map(|m| m.position_m[axis].to_le_bytes()));
    }
}

fn decode_markers(decoder: &mut Decoder<'_>) -> Option<MarkerFrame> {
    let (host, number) = (HostTime::from_nanos(decoder.u64()?), decoder.u32()?);
    let mut markers: Vec<MarkerPosition> = decoder
        .sequence()?
        .map(|bytes| MarkerPosition { marker: u32::from_le_bytes(bytes), position_m: [0.0; 3] })
        .collect();
    for axis in 0..3 {
        let elements = decoder.sequence()?;
        if elements.len() != markers.len() {
            return None;
        }
        for (marker, bytes) in markers.iter_mut().zip(elements) {
            marker.position_m[axis] = f64::from_le_bytes(bytes);
        }
    }
    Some(MarkerFrame { host, number, markers })
}
