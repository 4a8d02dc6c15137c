//! What can be saved of a damaged session: every message that a checksum vouches for, byte for byte, in a new session; and what is lost.

use super::container::{Layout, Part, walk};
use super::document::StopDocument;
use super::read::{Segment, Session};
use super::scribe::Scribe;
use super::tally::Tally;
use super::writer::{MANIFEST, seal, segment_file};
use super::{SessionError, Topic};
use serde::Serialize;
use std::collections::BTreeMap;
use std::fs::{self, OpenOptions};
use std::io::{self, Read, Seek, Write};
use std::path::Path;
use std::sync::Arc;

/// What was lost of one segment.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Loss {
    /// Bytes that no checksum vouches for.
    pub bytes: u64,
    /// Messages saved, by topic.
    pub saved: BTreeMap<&'static str, u64>,
    /// Force records saved.
    pub saved_force_records: u64,
    /// Messages known to be lost, by topic.
    pub lost: BTreeMap<&'static str, u64>,
    /// Force records known to be lost.
    pub lost_force_records: u64,
    /// Time between what was saved before damage and what was saved behind it, added up (s).
    pub lost_s: f64,
    /// Whether the stop document was saved. Without it nobody knows what came after the last message that was saved.
    pub end_is_known: bool,
}

impl Loss {
    /// Whether everything that was recorded is there, as far as the file tells.
    pub fn is_none(&self) -> bool {
        self.bytes == 0 && self.lost.is_empty() && self.lost_force_records == 0 && self.end_is_known
    }
}

/// What was lost, segment by segment. Also in the new session, as `recovery.json`.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Recovery {
    /// Of each segment.
    pub segments: Vec<Loss>,
}

/// Saves what is readable of the session in `folder` into a new one, `into`. Nothing is invented: a session that was interrupted stays
/// so, messages keep their numbers, times and bytes. The old session stays as it is.
///
/// # Errors
/// [`SessionError`]: not a session, no readable start document at all, `into` exists, the operating system refuses.
pub fn recover(folder: &Path, into: &Path) -> Result<Recovery, SessionError> {
    let session = Session::open(folder)?;
    fs::create_dir(into).map_err(|error| match error.kind() {
        io::ErrorKind::AlreadyExists => SessionError::Exists { path: into.to_owned() },
        _ => SessionError::write(into)(error),
    })?;
    let ticks = session.start().force.as_ref().map_or(1, |force| force.format().ticks_a_record());
    let manifest = session.manifest().unwrap_or_else(|| session.start());
    write_json(&into.join(MANIFEST), manifest)?;
    let mut recovery = Recovery::default();
    for (number, segment) in (1..).zip(session.files()) {
        recovery.segments.push(save(segment, &segment_file(into, number), ticks)?);
    }
    write_json(&into.join("recovery.json"), &recovery)?;
    copy_others(folder, into)?;
    if session.stop().is_some() {
        seal(into)?;
    }
    Ok(recovery)
}

/// What others have put beside the recording, a mesh for instance.
fn copy_others(folder: &Path, into: &Path) -> Result<(), SessionError> {
    for entry in fs::read_dir(folder).map_err(SessionError::read(folder))? {
        let from = entry.map_err(SessionError::read(folder))?.path();
        let Some(name) = from.file_name().filter(|_| from.is_file()) else { continue };
        let to = into.join(name);
        let is_recording = from.extension().is_some_and(|extension| extension == "mcap");
        if !is_recording && !to.exists() {
            fs::copy(&from, &to).map_err(SessionError::write(&to))?;
        }
    }
    Ok(())
}

fn save(segment: &Segment, to: &Path, ticks_a_record: u32) -> Result<Loss, SessionError> {
    let file = OpenOptions::new().write(true).create_new(true).open(to).map_err(SessionError::write(to))?;
    let scribe = Scribe::begin(file, to)?;
    let mut source = segment.source()?;
    let (file, loss) = salvage(&mut source, &segment.layout, segment.stop.as_ref(), scribe, ticks_a_record)
        .map_err(|failure| match failure {
        Failure::Read(source) => SessionError::Read { file: segment.file.clone(), source: Arc::new(source) },
        Failure::Write(error) => error,
    })?;
    file.sync_all().map_err(SessionError::write(to))?;
    Ok(loss)
}

#[derive(Debug)]
pub(super) enum Failure {
    /// The old session cannot be read.
    Read(io::Error),
    /// The new one cannot be written.
    Write(SessionError),
}

impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        Self::Read(error)
    }
}

/// Copies what a checksum vouches for.
pub(super) fn salvage<R: Read + Seek, W: Write>(
    source: &mut R,
    layout: &Layout,
    stop: Option<&StopDocument>,
    mut scribe: Scribe<W>,
    ticks_a_record: u32,
) -> Result<(W, Loss), Failure> {
    let mut tally = Tally::new(ticks_a_record);
    walk(source, layout, |part| {
        match part {
            Part::Messages(messages) => {
                for raw in messages {
                    tally.message(&raw);
                    scribe
                        .copy(raw.topic, raw.log_time, raw.sequence, raw.payload)
                        .map_err(Failure::Write)?;
                }
            }
            Part::Damaged(hole) => tally.damaged(hole),
        }
        Ok::<(), Failure>(())
    })?;
    let sink = scribe.finish().map_err(Failure::Write)?;
    let by_topic = |count: &dyn Fn(Topic) -> u64| {
        Topic::ALL.into_iter().map(|t| (t.name(), count(t))).filter(|&(_, n)| n > 0).collect()
    };
    let loss = Loss {
        bytes: tally.damage.iter().map(|hole| hole.bytes).sum(),
        saved: by_topic(&|topic| tally.count(topic).messages),
        saved_force_records: tally.count(Topic::Force).records,
        lost: by_topic(&|topic| tally.lost_messages(topic, stop)),
        lost_force_records: tally.lost_force(stop),
        lost_s: tally.damaged_s,
        end_is_known: stop.is_some(),
    };
    Ok((sink, loss))
}

fn write_json(file: &Path, document: &impl Serialize) -> Result<(), SessionError> {
    let text = serde_json::to_vec_pretty(document).map_err(|e| SessionError::write(file)(e.into()))?;
    fs::write(file, text).map_err(SessionError::write(file))
}
