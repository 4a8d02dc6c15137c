//! What is in one file of a session and what is missing from it, counted message by message in the order of the file.

use super::Topic;
use super::container::{Hole, Layout, Part, RawMessage, walk};
use super::document::StopDocument;
use super::message::{Gap, Message};
use crate::clock::HostTime;
use crate::device::{Losses, SequenceTracker};
use std::io::{self, Read, Seek};

const TOPICS: usize = Topic::ALL.len();

/// What was counted of one topic.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Count {
    pub(super) messages: u64,
    pub(super) records: u64,
    /// Messages that are missing between those that are there, by their numbers.
    pub(super) missing: u64,
    /// Messages whose number is not above the one before.
    pub(super) repeated: u64,
    /// Records earlier than the one before.
    pub(super) backwards: u64,
    /// Messages that do not follow their schema.
    pub(super) unreadable: u64,
    pub(super) first: Option<HostTime>,
    pub(super) last: Option<HostTime>,
    sequence: u32,
}

/// What was counted in one file.
#[derive(Debug)]
pub(super) struct Tally {
    pub(super) topics: [Count; TOPICS],
    /// Force records missing between those that are there, by the numbers of their batches.
    pub(super) missing_force: u64,
    next_force: u64,
    tracker: SequenceTracker,
    pub(super) gaps: Vec<Gap>,
    pub(super) damage: Vec<Hole>,
    /// Seconds between the last record before damage and the first one behind it, added up.
    pub(super) damaged_s: f64,
    /// Time of the last record before damage, until something follows.
    before_damage: Option<HostTime>,
    last: Option<HostTime>,
    pub(super) first_topic: Option<Topic>,
    pub(super) last_topic: Option<Topic>,
}

impl Tally {
    /// For a sensor whose clock steps by `ticks_a_record`.
    pub(super) fn new(ticks_a_record: u32) -> Self {
        Self {
            topics: [Count::default(); TOPICS],
            missing_force: 0,
            next_force: 0,
            tracker: SequenceTracker::new(ticks_a_record),
            gaps: Vec::new(),
            damage: Vec::new(),
            damaged_s: 0.0,
            before_damage: None,
            last: None,
            first_topic: None,
            last_topic: None,
        }
    }

    /// Counts a whole file.
    pub(super) fn of<R: Read + Seek>(
        source: &mut R,
        layout: &Layout,
        ticks_a_record: u32,
    ) -> io::Result<Self> {
        let mut tally = Self::new(ticks_a_record);
        walk(source, layout, |part| {
            match part {
                Part::Messages(messages) => messages.iter().for_each(|raw| tally.message(raw)),
                Part::Damaged(hole) => tally.damaged(hole),
            }
            Ok::<_, io::Error>(())
        })?;
        Ok(tally)
    }

    pub(super) fn count(&self, topic: Topic) -> &Count {
        &self.topics[topic.index()]
    }

    /// What the sensor's counters say of the records that are there.
    pub(super) fn losses(&self) -> Losses {
        self.tracker.losses()
    }

    pub(super) fn damaged(&mut self, hole: Hole) {
        self.damage.push(hole);
        self.before_damage = self.before_damage.or(self.last);
    }

    pub(super) fn message(&mut self, raw: &RawMessage<'_>) {
        self.first_topic.get_or_insert(raw.topic);
        self.last_topic = Some(raw.topic);
        let count = &mut self.topics[raw.topic.index()];
        count.messages += 1;
        match raw.sequence.wrapping_sub(count.sequence) as i32 {
            step @ 1.. => {
                count.missing += u64::from(step.unsigned_abs() - 1);
                count.sequence = raw.sequence;
            }
            _ => count.repeated += 1,
        }
        let Some(message) = Message::decode(raw.topic, raw.payload) else {
            count.unreadable += 1;
            return;
        };
        match &message {
            Message::Force(batch) => {
                // Numbers behind a checksum that agrees may still be anybody's.
                let missing = batch.first_record.saturating_sub(self.next_force);
                self.missing_force = self.missing_force.saturating_add(missing);
                self.next_force = batch.first_record.saturating_add(batch.records().len() as u64);
                for record in batch.records() {
                    self.tracker.observe(record);
                    self.record(raw.topic, record.host);
                }
            }
            Message::Gap(gap) => {
                self.gaps.push(*gap);
                self.record(raw.topic, gap.last);
            }
            _ => self.record(raw.topic, message.host()),
        }
    }

    fn record(&mut self, topic: Topic, host: HostTime) {
        let count = &mut self.topics[topic.index()];
        count.records += 1;
        count.backwards += u64::from(count.last.is_some_and(|last| host < last));
        count.first.get_or_insert(host);
        count.last = Some(host);
        if let Some(before) = self.before_damage.take() {
            self.damaged_s += host.since(before).as_secs_f64();
        }
        self.last = self.last.max(Some(host));
    }

    /// Messages of a topic that were written and are not there: exactly when the stop document says how many there were, otherwise
    /// those between two that are there.
    pub(super) fn lost_messages(&self, topic: Topic, stop: Option<&StopDocument>) -> u64 {
        let count = self.count(topic);
        match stop {
            Some(stop) if topic != Topic::Stop => {
                stop.messages.get(topic.name()).map_or(0, |&stated| stated.saturating_sub(count.messages))
            }
            _ => count.missing,
        }
    }

    /// Force records that were written and are not there, likewise.
    pub(super) fn lost_force(&self, stop: Option<&StopDocument>) -> u64 {
        stop.map_or(self.missing_force, |stop| {
            stop.force_records.saturating_sub(self.count(Topic::Force).records)
        })
    }
}
