//! What a recorded session holds: its documents and its messages, in the order of their times.
//!
//! A session is read as it is: finished, interrupted, cut off in the middle of a byte. What no checksum vouches for is left out, and
//! said: as [`SessionError::Damaged`] where it lies between messages, by [`Session::info`] where it is the end of an interrupted session.

use super::container::{Channels, Layout, Place, load, survey};
use super::document::{Event, FORMAT, HashedText, StartDocument, StopDocument};
use super::message::{ClockProbe, Gap, Message};
use super::writer::{MANIFEST, segment_file};
use super::{SessionError, Topic};
use crate::device::{ForceRecord, MarkerFrame, StageReport};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap, VecDeque};
use std::fs::{self, File};
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A recorded session. Cloning it is cheap.
#[derive(Debug, Clone)]
pub struct Session {
    contents: Arc<Contents>,
}

#[derive(Debug)]
struct Contents {
    folder: PathBuf,
    start: StartDocument,
    manifest: Option<StartDocument>,
    segments: Vec<Arc<Segment>>,
}

/// One file of a session.
#[derive(Debug)]
pub(super) struct Segment {
    pub(super) file: PathBuf,
    pub(super) layout: Layout,
    pub(super) start: Option<StartDocument>,
    pub(super) stop: Option<StopDocument>,
}

/// A message with where it comes from.
#[derive(Debug, Clone, PartialEq)]
pub struct Recorded {
    /// The segment, from 1. Times of different segments compare only when the machine was not restarted in between.
    pub segment: u32,
    /// Its number among the messages of its topic in the segment, from 1.
    pub sequence: u32,
    /// What it says.
    pub message: Message,
}

impl Session {
    /// Opens a session. Reads documents and the places of chunks, no samples.
    ///
    /// # Errors
    /// [`SessionError`]: not a session, of another format, no readable start document, the operating system refuses.
    pub fn open(folder: impl AsRef<Path>) -> Result<Self, SessionError> {
        let folder = folder.as_ref().to_owned();
        if !segment_file(&folder, 1).is_file() {
            let bundle = folder.join("recording.toml").is_file();
            return Err(if bundle {
                SessionError::IsABundle { folder }
            } else {
                SessionError::NotASession { folder, missing: "session.mcap" }
            });
        }
        let manifest = read_manifest(&folder.join(MANIFEST));
        let segments = (1..)
            .map(|segment| segment_file(&folder, segment))
            .take_while(|file| file.is_file())
            .map(|file| Segment::open(file).map(Arc::new))
            .collect::<Result<Vec<_>, _>>()?;
        let start = segments.first().and_then(|s| s.start.clone()).or_else(|| manifest.clone());
        let start = start.ok_or_else(|| SessionError::NoStart { folder: folder.clone() })?;
        Ok(Self { contents: Arc::new(Contents { folder, start, manifest, segments }) })
    }

    /// Whether there is one in `folder`, readable or not.
    pub fn is_at(folder: &Path) -> bool {
        segment_file(folder, 1).is_file()
    }

    /// Where it lies.
    pub fn folder(&self) -> &Path {
        &self.contents.folder
    }

    /// What it began with.
    pub fn start(&self) -> &StartDocument {
        &self.contents.start
    }

    /// Refuses it where it was begun with something else than this.
    ///
    /// # Errors
    /// [`SessionError::Different`].
    pub fn begun_with(
        &self,
        name: &str,
        rig: &HashedText,
        protocol: &HashedText,
        variables: &BTreeMap<String, f64>,
    ) -> Result<(), SessionError> {
        let began = self.start();
        let listed = |values: &BTreeMap<String, f64>| {
            let each: Vec<String> = values.iter().map(|(name, value)| format!("{name} = {value}")).collect();
            if each.is_empty() { "as the protocol says".to_owned() } else { each.join(", ") }
        };
        let same = [
            ("name", began.name.clone(), name.to_owned()),
            ("rig file", began.rig.sha256.clone(), rig.sha256.clone()),
            ("protocol", began.protocol.sha256.clone(), protocol.sha256.clone()),
            ("values given to variables", listed(&began.variables), listed(variables)),
        ];
        match same.into_iter().find(|(_, recorded, given)| recorded != given) {
            None => Ok(()),
            Some((what, recorded, given)) => {
                Err(SessionError::Different { folder: self.folder().to_owned(), what, recorded, given })
            }
        }
    }

    /// What it ended with; none when it was interrupted.
    pub fn stop(&self) -> Option<&StopDocument> {
        self.contents.segments.last().and_then(|s| s.stop.as_ref())
    }

    /// Files that it consists of: one, and one more for every time that it went on after it was interrupted or stopped.
    pub fn segments(&self) -> u32 {
        self.contents.segments.len() as u32
    }

    /// Each of its files as a session: what was recorded between one start of the devices and their end.
    pub fn parts(&self) -> Vec<Self> {
        let of = |segment: &Arc<Segment>| {
            let (folder, manifest) = (self.contents.folder.clone(), self.contents.manifest.clone());
            let start = segment.start.clone().unwrap_or_else(|| self.contents.start.clone());
            Self {
                contents: Arc::new(Contents { folder, start, manifest, segments: vec![Arc::clone(segment)] }),
            }
        };
        self.contents.segments.iter().map(of).collect()
    }

    pub(super) fn files(&self) -> &[Arc<Segment>] {
        &self.contents.segments
    }

    /// The manifest, if it is readable.
    pub(super) fn manifest(&self) -> Option<&StartDocument> {
        self.contents.manifest.as_ref()
    }

    /// The messages of some topics, segment by segment, within each in the order of their times; a batch of force records has the
    /// time of its first.
    ///
    /// Damage comes as an error at its place; the messages behind it follow.
    pub fn messages(&self, topics: &[Topic]) -> Messages {
        Messages { session: self.clone(), topics: topics.to_vec(), next_segment: 0, reader: None }
    }

    /// All force records.
    pub fn force(&self) -> impl Iterator<Item = Result<ForceRecord, SessionError>> + use<> {
        self.messages(&[Topic::Force]).flat_map(|recorded| {
            let (batch, error) = match recorded.map(|r| r.message) {
                Ok(Message::Force(batch)) => (Some(batch), None),
                Ok(_) => (None, None),
                Err(error) => (None, Some(Err(error))),
            };
            let count = batch.map_or(0, |b| b.records().len());
            (0..count).filter_map(move |i| batch.map(|b| Ok(b.records()[i]))).chain(error)
        })
    }

    /// All reports of the stage.
    pub fn stage(&self) -> impl Iterator<Item = Result<StageReport, SessionError>> + use<> {
        self.only(Topic::Stage, |message| match message {
            Message::Stage(report) => Some(report),
            _ => None,
        })
    }

    /// All frames of marker positions.
    pub fn markers(&self) -> impl Iterator<Item = Result<MarkerFrame, SessionError>> + use<> {
        self.only(Topic::Markers, |message| match message {
            Message::Markers(frame) => Some(frame),
            _ => None,
        })
    }

    /// All probes of device clocks.
    pub fn clock_probes(&self) -> impl Iterator<Item = Result<ClockProbe, SessionError>> + use<> {
        self.only(Topic::ClockProbe, |message| match message {
            Message::ClockProbe(probe) => Some(probe),
            _ => None,
        })
    }

    /// All gaps that were noticed while recording.
    pub fn gaps(&self) -> impl Iterator<Item = Result<Gap, SessionError>> + use<> {
        self.only(Topic::Gap, |message| match message {
            Message::Gap(gap) => Some(gap),
            _ => None,
        })
    }

    /// All events.
    pub fn events(&self) -> impl Iterator<Item = Result<Event, SessionError>> + use<> {
        self.only(Topic::Event, |message| match message {
            Message::Event(event) => Some(event),
            _ => None,
        })
    }

    fn only<T, P>(&self, topic: Topic, pick: P) -> impl Iterator<Item = Result<T, SessionError>> + use<T, P>
    where
        P: Fn(Message) -> Option<T>,
    {
        self.messages(&[topic]).filter_map(move |recorded| recorded.map(|r| pick(r.message)).transpose())
    }
}

impl Segment {
    fn open(file: PathBuf) -> Result<Self, SessionError> {
        let mut source = BufReader::new(File::open(&file).map_err(SessionError::read(&file))?);
        let layout = survey(&mut source).map_err(SessionError::read(&file))?;
        let mut find = |topic: Topic, chunk: Option<&Place>| -> Result<Option<Message>, SessionError> {
            let Some(chunk) = chunk else { return Ok(None) };
            let mut records = Vec::new();
            if !load(&mut source, chunk, &mut records).map_err(SessionError::read(&file))? {
                return Ok(None);
            }
            let messages = Channels::default().messages(&records);
            let found = messages.into_iter().find(|m| m.topic == topic);
            found.map(|raw| decode_document(&file, topic, raw.payload)).transpose()
        };
        let start = match find(Topic::Start, layout.chunks.first())? {
            Some(Message::Start(start)) => Some(*start),
            _ => None,
        };
        let stop = match find(Topic::Stop, layout.chunks.last())? {
            Some(Message::Stop(stop)) => Some(*stop),
            _ => None,
        };
        Ok(Self { file, layout, start, stop })
    }

    /// Opens the file anew.
    pub(super) fn source(&self) -> Result<BufReader<File>, SessionError> {
        Ok(BufReader::new(File::open(&self.file).map_err(SessionError::read(&self.file))?))
    }
}

/// A document that its checksum vouches for: when it is not readable, another program wrote it.
fn decode_document(file: &Path, topic: Topic, payload: &[u8]) -> Result<Message, SessionError> {
    if topic == Topic::Start {
        check_format(file, payload)?;
    }
    Message::decode(topic, payload).ok_or_else(|| SessionError::Payload {
        file: file.to_owned(),
        topic,
        sequence: 1,
    })
}

fn check_format(file: &Path, text: &[u8]) -> Result<(), SessionError> {
    #[derive(serde::Deserialize)]
    struct Format {
        format: String,
    }
    match serde_json::from_slice::<Format>(text) {
        Ok(Format { format }) if format != FORMAT => {
            Err(SessionError::Format { file: file.to_owned(), found: format, expected: FORMAT })
        }
        _ => Ok(()),
    }
}

/// The manifest; none when it is not there or not readable. No checksum vouches for it: the start document in the recording goes first.
fn read_manifest(file: &Path) -> Option<StartDocument> {
    let start: StartDocument = serde_json::from_slice(&fs::read(file).ok()?).ok()?;
    (start.format == FORMAT).then_some(start)
}

/// The messages of a session: see [`Session::messages`].
#[derive(Debug)]
pub struct Messages {
    session: Session,
    topics: Vec<Topic>,
    next_segment: usize,
    reader: Option<SegmentReader>,
}

impl Iterator for Messages {
    type Item = Result<Recorded, SessionError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Some(reader) = &mut self.reader {
                let segment = self.next_segment as u32;
                match reader.next(&self.topics) {
                    Ok(Some(held)) => return Some(reader.decode(segment, &held)),
                    Ok(None) => self.reader = None,
                    Err(error) => return Some(Err(error)),
                }
            }
            let segment = self.session.files().get(self.next_segment)?;
            self.next_segment += 1;
            match SegmentReader::new(segment) {
                Ok(reader) => self.reader = Some(reader),
                Err(error) => return Some(Err(error)),
            }
        }
    }
}

/// A message that was read before its turn. Ordered by time, then by its place in the file.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Held {
    log_time: u64,
    /// Where its chunk begins in the file, and its number there.
    place: (u64, usize),
    topic: Topic,
    sequence: u32,
    payload: Vec<u8>,
}

/// Merges the chunks of one file: a message is handed out once no chunk that is still to come begins before it.
#[derive(Debug)]
struct SegmentReader {
    file: PathBuf,
    source: BufReader<File>,
    chunks: VecDeque<Place>,
    channels: Channels,
    held: BinaryHeap<Reverse<Held>>,
    records: Vec<u8>,
}

impl SegmentReader {
    fn new(segment: &Segment) -> Result<Self, SessionError> {
        let mut chunks: Vec<Place> = segment.layout.chunks.clone();
        chunks.sort_by_key(|chunk| chunk.start);
        Ok(Self {
            file: segment.file.clone(),
            source: segment.source()?,
            chunks: chunks.into(),
            channels: Channels::default(),
            held: BinaryHeap::new(),
            records: Vec::new(),
        })
    }

    fn next(&mut self, topics: &[Topic]) -> Result<Option<Held>, SessionError> {
        loop {
            let earliest = self.held.peek().map(|Reverse(held)| held.log_time);
            match self.chunks.front_mut() {
                Some(chunk) if earliest.is_none_or(|time| chunk.start <= time) => {
                    if let Some(hole) = chunk.hole.take() {
                        return Err(self.damaged(hole.offset, hole.bytes));
                    }
                }
                _ => return Ok(self.held.pop().map(|Reverse(held)| held)),
            }
            let Some(chunk) = self.chunks.pop_front() else { continue };
            let is_sound =
                load(&mut self.source, &chunk, &mut self.records).map_err(SessionError::read(&self.file))?;
            if !is_sound {
                let hole = chunk.hole_of_chunk();
                return Err(self.damaged(hole.offset, hole.bytes));
            }
            for (number, raw) in self.channels.messages(&self.records).into_iter().enumerate() {
                if topics.contains(&raw.topic) {
                    self.held.push(Reverse(Held {
                        log_time: raw.log_time,
                        place: (chunk.offset, number),
                        topic: raw.topic,
                        sequence: raw.sequence,
                        payload: raw.payload.to_vec(),
                    }));
                }
            }
        }
    }

    fn decode(&self, segment: u32, held: &Held) -> Result<Recorded, SessionError> {
        let Held { topic, sequence, .. } = *held;
        let message = Message::decode(topic, &held.payload);
        let message =
            message.ok_or_else(|| SessionError::Payload { file: self.file.clone(), topic, sequence })?;
        Ok(Recorded { segment, sequence, message })
    }

    fn damaged(&self, offset: u64, bytes: u64) -> SessionError {
        SessionError::Damaged { file: self.file.clone(), offset, bytes }
    }
}
