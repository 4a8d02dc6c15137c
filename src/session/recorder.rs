//! How a device's thread hands over what it has read: at once, without waiting, and for force without allocating.
//!
//! Every thread has a [`Recorder`] of its own. They share a bounded queue of [`CAPACITY`] messages to the thread that writes. What does
//! not fit is dropped, counted, and put down as a [`Gap`] in front of the next message of that topic that fits.

use super::message::{ForceBatch, Gap, GapCause, Message};
use super::picture::{CameraFrame, Picture};
use super::{ClockProbe, Event, SessionError, Topic};
use crate::clock::HostTime;
use crate::device::{ForceRecord, MarkerFrame, StageReport};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{SyncSender, TrySendError};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::Duration;

/// Messages that wait for the writing thread at most: with force at 7000 Hz (110 batches a second), 100 reports and 30 frames a second,
/// four seconds. Their room, about 3 MiB, is taken when the session begins.
pub const CAPACITY: usize = 1024;

/// Time from the first to the last record of a batch, at most.
const BATCH_SPAN: Duration = Duration::from_millis(10);

/// Pictures that wait for the writing thread at most: those of a second of a camera with 30 frames a second.
const WAITING_PICTURES: usize = 60;

/// What waits in the queue.
#[expect(
    clippy::large_enum_variant,
    reason = "force goes by value, so that handing it over allocates nothing"
)]
pub(super) enum Entry {
    /// A message, and what is missing in front of it.
    Message { missing: Option<Gap>, message: Message },
    /// The session ends with this.
    Finish(Box<super::StopDocument>),
}

/// What the threads of a session know of each other.
#[derive(Debug, Default)]
pub(super) struct Shared {
    /// Records dropped, by topic.
    dropped: [AtomicU64; Topic::ALL.len()],
    /// Pictures in the queue.
    pictures: AtomicUsize,
    /// The owner has left without finishing.
    pub(super) abandoned: AtomicBool,
    failure: OnceLock<SessionError>,
    /// What recorders that are gone could not put down any more.
    unsaid: Mutex<Vec<Gap>>,
}

impl Shared {
    pub(super) fn failure(&self) -> Option<&SessionError> {
        self.failure.get()
    }

    /// Notes why nothing more is written; the first cause stays.
    pub(super) fn fail(&self, error: SessionError) {
        let _ = self.failure.set(error);
    }

    /// Gaps that nobody has put down yet.
    pub(super) fn unsaid(&self) -> Vec<Gap> {
        // A list of plain values: whole whatever became of the thread that last added to it.
        std::mem::take(&mut *self.unsaid.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// The writing thread has taken a message out of the queue.
    pub(super) fn taken(&self, message: &Message) {
        if is_picture(message) {
            self.pictures.fetch_sub(1, Ordering::Relaxed);
        }
    }

    pub(super) fn dropped(&self, topic: Topic) -> u64 {
        self.dropped[topic.index()].load(Ordering::Relaxed)
    }
}

/// How recording is going, for whoever has to stop when it does not: asked from any thread, without waiting.
#[derive(Debug, Clone)]
pub struct Health(pub(super) Arc<Shared>);

impl Health {
    /// Why nothing is written any more, if so.
    pub fn failure(&self) -> Option<&SessionError> {
        self.0.failure()
    }

    /// Records of a topic that were handed over but not written.
    pub fn dropped(&self, topic: Topic) -> u64 {
        self.0.dropped(topic)
    }
}

/// One thread's way into a session. Each answer `false` means that something was dropped, which is counted and will be put down.
pub struct Recorder {
    queue: SyncSender<Entry>,
    shared: Arc<Shared>,
    batch: ForceBatch,
    missing: [Option<Gap>; Topic::ALL.len()],
    /// Whether it waits for room.
    patient: bool,
}

impl Recorder {
    pub(super) fn new(queue: SyncSender<Entry>, shared: Arc<Shared>) -> Self {
        Self { queue, shared, batch: ForceBatch::new(), missing: [None; Topic::ALL.len()], patient: false }
    }

    /// The same, but it waits for room instead of dropping: for whoever copies what was recorded before. No device waits.
    pub fn patient(mut self) -> Self {
        self.patient = true;
        self
    }

    /// Hands over force records, in the order in which they came. Call it also when none came: records are collected for 10 ms at most,
    /// which have passed when `now` says so.
    ///
    /// What makes up a batch depends on the records alone: at most [`BATCH`](super::BATCH), and less than 10 ms from the first to
    /// the last.
    pub fn force(&mut self, records: &[ForceRecord], now: HostTime) -> bool {
        let mut complete = true;
        for &record in records {
            if self.is_due(record.host) {
                complete &= self.hand_batch();
            }
            self.batch.push(record);
            if self.batch.is_full() {
                complete &= self.hand_batch();
            }
        }
        if self.is_due(now) {
            complete &= self.hand_batch();
        }
        complete
    }

    /// Hands over a report of the stage.
    pub fn stage(&mut self, report: StageReport) -> bool {
        self.hand(Message::Stage(report))
    }

    /// Hands over a frame of marker positions.
    pub fn markers(&mut self, frame: MarkerFrame) -> bool {
        self.hand(Message::Markers(frame))
    }

    /// Hands over a frame of the depth camera.
    pub fn frame(&mut self, frame: CameraFrame) -> bool {
        self.hand(Message::Frame(frame))
    }

    /// Hands over the grey picture of a frame.
    pub fn grey(&mut self, picture: Picture) -> bool {
        self.hand(Message::Grey(picture))
    }

    /// Hands over the depth picture of a frame.
    pub fn depth(&mut self, picture: Picture) -> bool {
        self.hand(Message::Depth(picture))
    }

    /// Hands over a probe of a device's clock.
    pub fn clock_probe(&mut self, probe: ClockProbe) -> bool {
        self.hand(Message::ClockProbe(probe))
    }

    /// Hands over an event.
    pub fn event(&mut self, event: Event) -> bool {
        self.hand(Message::Event(event))
    }

    /// Says that `records` of a topic never came to this machine.
    pub fn not_received(&mut self, topic: Topic, records: u64, first: HostTime, last: HostTime) -> bool {
        self.hand(Message::Gap(Gap { topic, cause: GapCause::NotReceived, records, first, last }))
    }

    /// Whether the batch has lasted long enough at that time.
    fn is_due(&self, time: HostTime) -> bool {
        self.batch.records().first().is_some_and(|first| time.since(first.host) >= BATCH_SPAN)
    }

    fn hand_batch(&mut self) -> bool {
        let batch = self.batch;
        self.batch.clear();
        self.hand(Message::Force(batch))
    }

    fn hand(&mut self, message: Message) -> bool {
        let missing = self.missing[message.topic().index()].take();
        let waits = is_picture(&message);
        if waits {
            let before = self.shared.pictures.fetch_add(1, Ordering::Relaxed);
            if before >= WAITING_PICTURES && !self.patient {
                self.shared.pictures.fetch_sub(1, Ordering::Relaxed);
                self.dropped(Entry::Message { missing, message });
                return false;
            }
        }
        let entry = Entry::Message { missing, message };
        let handed = if self.patient {
            self.queue.send(entry).map_err(|error| TrySendError::Disconnected(error.0))
        } else {
            self.queue.try_send(entry)
        };
        match handed {
            Ok(()) => true,
            Err(TrySendError::Full(entry) | TrySendError::Disconnected(entry)) => {
                self.shared.pictures.fetch_sub(usize::from(waits), Ordering::Relaxed);
                self.dropped(entry);
                false
            }
        }
    }

    fn dropped(&mut self, entry: Entry) {
        let Entry::Message { missing, message } = entry else { return };
        let (topic, records) = (message.topic(), message.records());
        self.shared.dropped[topic.index()].fetch_add(records, Ordering::Relaxed);
        let last = match &message {
            Message::Force(batch) => batch.records().last().map_or(message.host(), |r| r.host),
            _ => message.host(),
        };
        self.missing[topic.index()] = Some(Gap {
            topic,
            cause: GapCause::QueueFull,
            records: records + missing.map_or(0, |gap| gap.records),
            first: missing.map_or(message.host(), |gap| gap.first),
            last,
        });
    }
}

fn is_picture(message: &Message) -> bool {
    matches!(message, Message::Grey(_) | Message::Depth(_))
}

impl Drop for Recorder {
    /// Hands over what was collected, and leaves behind what is missing at the end.
    fn drop(&mut self) {
        if !self.batch.records().is_empty() {
            self.hand_batch();
        }
        let unsaid = self.missing.into_iter().flatten();
        self.shared.unsaid.lock().unwrap_or_else(PoisonError::into_inner).extend(unsaid);
    }
}
