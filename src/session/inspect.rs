//! What is in a session, in numbers; and whether everything that should be in it is.

use super::container::closing_checksums_agree;
use super::document::{Outcome, StartDocument};
use super::message::{Gap, GapCause};
use super::read::{Segment, Session};
use super::tally::Tally;
use super::{SessionError, Topic};
use crate::clock::HostTime;
use crate::device::Losses;
use std::collections::BTreeMap;

/// What is in a session.
#[derive(Debug, Clone, PartialEq)]
pub struct Info {
    /// Its name.
    pub name: String,
    /// How it ended; none when it was interrupted.
    pub outcome: Option<Outcome>,
    /// Files that it consists of.
    pub segments: u32,
    /// Size of the files (bytes).
    pub bytes: u64,
    /// Bytes that cannot be read.
    pub unreadable_bytes: u64,
    /// Time from the first to the last record, added up over the segments (s).
    pub duration_s: f64,
    /// What there is of each topic.
    pub topics: BTreeMap<Topic, Extent>,
    /// What the counters of the force sensor say of the records that are there.
    pub force: Losses,
    /// Gaps that were noticed while recording.
    pub gaps: Vec<Gap>,
}

/// What there is of a topic.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Extent {
    /// Messages.
    pub messages: u64,
    /// Records in them.
    pub records: u64,
    /// Records a second from the first to the last, where there are two.
    pub rate_hz: Option<f64>,
    /// Messages that were written and are not there any more, as far as that is known.
    pub lost: u64,
}

/// Something that is not as it should be.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Finding {
    /// The session has no stop document.
    #[error("the session was interrupted: it has no stop document")]
    Interrupted,
    /// A segment without a single message: its file is empty, or nothing of it can be read.
    #[error("segment {segment}: nothing is in it")]
    Empty {
        /// The segment.
        segment: u32,
    },
    /// A segment has lost the document that it begins with.
    #[error("segment {segment} does not begin with a start document")]
    NoStart {
        /// The segment.
        segment: u32,
    },
    /// Something follows the stop document.
    #[error("segment {segment} goes on after its stop document")]
    AfterStop {
        /// The segment.
        segment: u32,
    },
    /// Bytes that no checksum vouches for.
    #[error("segment {segment}: {bytes} bytes from byte {offset} on cannot be read")]
    Damaged {
        /// The segment.
        segment: u32,
        /// Where they begin (bytes from the start of the file).
        offset: u64,
        /// How many they are.
        bytes: u64,
    },
    /// The file was closed, but a checksum over all of it does not agree.
    #[error("segment {segment}: the checksums at the end of the file do not agree with it")]
    Checksum {
        /// The segment.
        segment: u32,
    },
    /// Messages that were written and are not there.
    #[error("segment {segment}: {messages} messages of {topic} were written and are not there")]
    Missing {
        /// The segment.
        segment: u32,
        /// Their topic.
        topic: Topic,
        /// How many.
        messages: u64,
    },
    /// Force records that were written and are not there.
    #[error("segment {segment}: {records} force records were written and are not there")]
    MissingForce {
        /// The segment.
        segment: u32,
        /// How many.
        records: u64,
    },
    /// The stop document states another number than the file holds.
    #[error("segment {segment}: the stop document states {stated} messages of {topic}; there are {found}")]
    Count {
        /// The segment.
        segment: u32,
        /// Their topic.
        topic: Topic,
        /// What is stated.
        stated: u64,
        /// What is there.
        found: u64,
    },
    /// Messages whose numbers do not go up.
    #[error("segment {segment}: {messages} messages of {topic} have a number that was there before")]
    Repeated {
        /// The segment.
        segment: u32,
        /// Their topic.
        topic: Topic,
        /// How many.
        messages: u64,
    },
    /// Messages that do not follow their schema.
    #[error("segment {segment}: {messages} messages of {topic} do not follow their schema")]
    Unreadable {
        /// The segment.
        segment: u32,
        /// Their topic.
        topic: Topic,
        /// How many.
        messages: u64,
    },
    /// Times that go backwards.
    #[error("segment {segment}: {records} records of {topic} are earlier than the one before")]
    Backwards {
        /// The segment.
        segment: u32,
        /// Their topic.
        topic: Topic,
        /// How many.
        records: u64,
    },
    /// Records that were dropped because the disk did not keep up.
    #[error("segment {segment}: {records} records of {topic} were dropped because the disk did not keep up")]
    Dropped {
        /// The segment.
        segment: u32,
        /// Their topic.
        topic: Topic,
        /// How many.
        records: u64,
    },
    /// The sensor's counters say that records are missing, doubled or late.
    #[error(
        "segment {segment}: of the force sensor's records {} are missing, {} came twice, {} came late",
        losses.lost, losses.duplicated, losses.reordered
    )]
    ForceLosses {
        /// The segment.
        segment: u32,
        /// What was counted.
        losses: Losses,
    },
    /// A text is not the one that was hashed.
    #[error("segment {segment}: the {what} is not the text that was hashed")]
    Hash {
        /// The segment.
        segment: u32,
        /// Which text.
        what: &'static str,
    },
    /// The manifest is not there, not readable or another one.
    #[error("the manifest does not agree with the start document in the recording")]
    Manifest,
}

impl Session {
    /// Counts what is in it. Reads the whole session.
    ///
    /// # Errors
    /// [`SessionError::Read`].
    pub fn info(&self) -> Result<Info, SessionError> {
        let mut info = Info {
            name: self.start().name.clone(),
            outcome: self.stop().map(|stop| stop.outcome.clone()),
            segments: self.segments(),
            bytes: 0,
            unreadable_bytes: 0,
            duration_s: 0.0,
            topics: BTreeMap::new(),
            force: Losses::default(),
            gaps: Vec::new(),
        };
        // Of each topic: seconds, and intervals between records in them.
        let mut intervals: BTreeMap<Topic, (f64, u64)> = BTreeMap::new();
        for segment in self.files() {
            let tally = self.tally(segment)?;
            info.bytes += segment.layout.bytes;
            info.unreadable_bytes += tally.damage.iter().map(|hole| hole.bytes).sum::<u64>();
            info.duration_s += span_s(
                tally.topics.iter().filter_map(|c| c.first).min(),
                tally.topics.iter().filter_map(|c| c.last).max(),
            );
            let Losses { received, lost, duplicated, reordered, malformed } = tally.losses();
            info.force.received += received;
            info.force.lost += lost;
            info.force.duplicated += duplicated;
            info.force.reordered += reordered;
            info.force.malformed += malformed;
            for topic in Topic::ALL {
                let count = tally.count(topic);
                let extent = info.topics.entry(topic).or_default();
                extent.messages += count.messages;
                extent.records += count.records;
                extent.lost = extent.lost.saturating_add(tally.lost_messages(topic, segment.stop.as_ref()));
                let (seconds, number) = intervals.entry(topic).or_default();
                *seconds += span_s(count.first, count.last);
                *number += count.records.saturating_sub(1);
            }
            info.gaps.extend(tally.gaps);
        }
        for (topic, (seconds, number)) in intervals {
            if let Some(extent) = info.topics.get_mut(&topic) {
                extent.rate_hz = (seconds > 0.0).then(|| number as f64 / seconds);
            }
        }
        Ok(info)
    }

    /// Looks for whatever is not as it should be: checksums, numbers, the sensor's counters, times, hashes, counts. Reads the whole
    /// session. Nothing found: it is sound.
    ///
    /// # Errors
    /// [`SessionError::Read`].
    pub fn verify(&self) -> Result<Vec<Finding>, SessionError> {
        let mut findings = Vec::new();
        if self.stop().is_none() {
            findings.push(Finding::Interrupted);
        }
        let first = self.files().first().and_then(|s| s.start.as_ref());
        if self.manifest().is_none() || first.is_some_and(|start| self.manifest() != Some(start)) {
            findings.push(Finding::Manifest);
        }
        for (number, segment) in (1..).zip(self.files()) {
            let tally = self.tally(segment)?;
            check_documents(number, segment, self.start(), &tally, &mut findings);
            findings.extend(tally.damage.iter().map(|hole| Finding::Damaged {
                segment: number,
                offset: hole.offset,
                bytes: hole.bytes,
            }));
            let is_closed = segment.layout.footer.is_some();
            if (is_closed || segment.stop.is_some())
                && !closing_checksums_agree(&mut segment.source()?, &segment.layout)
                    .map_err(SessionError::read(&segment.file))?
            {
                findings.push(Finding::Checksum { segment: number });
            }
            for topic in Topic::ALL {
                check_topic(number, segment, &tally, topic, &mut findings);
            }
            let records = tally.lost_force(segment.stop.as_ref());
            if records > 0 {
                findings.push(Finding::MissingForce { segment: number, records });
            }
            let losses = tally.losses();
            if losses.lost + losses.duplicated + losses.reordered > 0 {
                findings.push(Finding::ForceLosses { segment: number, losses });
            }
        }
        Ok(findings)
    }

    fn tally(&self, segment: &Segment) -> Result<Tally, SessionError> {
        let ticks = self.start().force.as_ref().map_or(1, |force| force.format().ticks_a_record());
        Tally::of(&mut segment.source()?, &segment.layout, ticks).map_err(SessionError::read(&segment.file))
    }
}

fn span_s(first: Option<HostTime>, last: Option<HostTime>) -> f64 {
    first.zip(last).map_or(0.0, |(first, last)| last.since(first).as_secs_f64())
}

fn check_documents(
    number: u32,
    segment: &Segment,
    session: &StartDocument,
    tally: &Tally,
    findings: &mut Vec<Finding>,
) {
    if tally.first_topic.is_none() {
        findings.push(Finding::Empty { segment: number });
    } else if tally.first_topic != Some(Topic::Start) {
        findings.push(Finding::NoStart { segment: number });
    }
    if tally.count(Topic::Stop).messages > 0 && tally.last_topic != Some(Topic::Stop) {
        findings.push(Finding::AfterStop { segment: number });
    }
    let start = segment.start.as_ref().unwrap_or(session);
    for (what, text) in [("rig file", &start.rig), ("protocol", &start.protocol)] {
        if !text.is_intact() {
            findings.push(Finding::Hash { segment: number, what });
        }
    }
}

fn check_topic(number: u32, segment: &Segment, tally: &Tally, topic: Topic, findings: &mut Vec<Finding>) {
    let (count, stop) = (tally.count(topic), segment.stop.as_ref());
    let mut found = |amount: u64, finding: Finding| {
        if amount > 0 {
            findings.push(finding);
        }
    };
    let messages = tally.lost_messages(topic, stop);
    found(messages, Finding::Missing { segment: number, topic, messages });
    if let Some(stop) = stop.filter(|_| topic != Topic::Stop) {
        let stated = stop.messages.get(topic.name()).copied().unwrap_or(0);
        let too_many = count.messages.saturating_sub(stated);
        found(too_many, Finding::Count { segment: number, topic, stated, found: count.messages });
    }
    found(count.repeated, Finding::Repeated { segment: number, topic, messages: count.repeated });
    found(count.unreadable, Finding::Unreadable { segment: number, topic, messages: count.unreadable });
    found(count.backwards, Finding::Backwards { segment: number, topic, records: count.backwards });
    let noticed = tally.gaps.iter().filter(|g| g.topic == topic && g.cause == GapCause::QueueFull);
    let stated = stop.and_then(|s| s.dropped.get(topic.name()).copied());
    let records = stated.unwrap_or_else(|| noticed.fold(0, |sum: u64, g| sum.saturating_add(g.records)));
    found(records, Finding::Dropped { segment: number, topic, records });
}
