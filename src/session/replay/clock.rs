//! Where a replay stands in its recording, for all its devices together.
//!
//! Recorded times of all segments lie on one line: the time into the replay (ns), each segment following the one before at once.

use crate::clock::HostTime;
use crate::session::message::Message;
use crate::session::{Session, SessionError, Topic};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Duration;

/// How fast a recording is replayed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Speed {
    /// So many times as fast as it was recorded.
    Times(f64),
    /// As fast as it is read. Nobody waits: a call that would have to wait answers that there was nothing. The devices keep in step by
    /// the order of the recorded times: none hands out anything while another one in use still has something earlier.
    AsFastAsPossible,
}

/// The devices of a replay.
#[derive(Debug, Clone, Copy)]
pub(super) enum Seat {
    Stage,
    Force,
    Markers,
}

/// Shared by the devices of one replay.
#[derive(Debug)]
pub(super) struct ReplayClock {
    speed: Speed,
    /// When the first device was asked for something.
    began: OnceLock<HostTime>,
    /// Time into the replay of what each device in use hands out next (ns).
    next: Mutex<[Option<u64>; 3]>,
}

impl ReplayClock {
    pub(super) fn new(speed: Speed) -> Result<Self, SessionError> {
        match speed {
            Speed::Times(times) if !(times > 0.0 && times.is_finite()) => Err(SessionError::Speed { times }),
            _ => Ok(Self { speed, began: OnceLock::new(), next: Mutex::new([None; 3]) }),
        }
    }

    /// Says what a device hands out next; none when it is not in use.
    pub(super) fn announce(&self, seat: Seat, next: Option<u64>) {
        self.seats()[seat as usize] = next;
    }

    /// Whether it is time for what is due at `due`; waits for that until `until` at most.
    pub(super) fn is_time(&self, seat: Seat, due: u64, until: HostTime) -> bool {
        match self.speed {
            Speed::AsFastAsPossible => {
                let is_first = {
                    let mut seats = self.seats();
                    seats[seat as usize] = Some(due);
                    seats.iter().flatten().all(|&other| due <= other)
                };
                if !is_first {
                    std::thread::yield_now();
                }
                is_first
            }
            Speed::Times(times) => {
                let began = *self.began.get_or_init(HostTime::now);
                let at = began + Duration::from_secs_f64((due as f64 * 1e-9 / times).min(1e9));
                std::thread::sleep(at.min(until).remaining());
                at <= until.max(HostTime::now())
            }
        }
    }

    /// Waits for nothing until `until`.
    pub(super) fn idle(&self, until: HostTime) {
        if let Speed::Times(_) = self.speed {
            std::thread::sleep(until.remaining());
        }
    }

    fn seats(&self) -> MutexGuard<'_, [Option<u64>; 3]> {
        // Each seat is a plain number: whole whatever became of the thread that last wrote one.
        self.next.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Puts recorded times on the line of the replay.
#[derive(Debug, Clone)]
pub(super) struct Line {
    /// Of each segment: its first recorded time, and the time into the replay at which it begins (ns).
    segments: Vec<(u64, u64)>,
}

impl Line {
    /// Reads all messages of `topics` once.
    ///
    /// # Errors
    /// [`SessionError`]: the recording is damaged.
    pub(super) fn new(session: &Session, topics: &[Topic]) -> Result<Self, SessionError> {
        let mut extents = vec![None; session.segments() as usize];
        for recorded in session.messages(topics) {
            let recorded = recorded?;
            let (first, last) = (recorded.message.host().nanos(), complete_at(&recorded.message).nanos());
            if let Some(extent) = extents.get_mut(recorded.segment as usize - 1) {
                let (earliest, latest) = extent.unwrap_or((first, last));
                *extent = Some((first.min(earliest), last.max(latest)));
            }
        }
        let mut begins = 0_u64;
        let segments = extents.into_iter().map(|extent| {
            let (first, last): (u64, u64) = extent.unwrap_or_default();
            let segment = (first, begins);
            begins = (last - first).saturating_add(begins);
            segment
        });
        Ok(Self { segments: segments.collect() })
    }

    /// Time into the replay at which a message of a segment (from 1) was complete (ns).
    pub(super) fn due(&self, segment: u32, message: &Message) -> u64 {
        let place = (segment as usize).checked_sub(1).and_then(|i| self.segments.get(i));
        let host = complete_at(message).nanos();
        place.map_or(0, |&(first, begins)| host.saturating_sub(first).saturating_add(begins))
    }
}

/// When a message was complete: with its last record.
fn complete_at(message: &Message) -> HostTime {
    match message {
        Message::Force(batch) => batch.records().last().map_or(message.host(), |record| record.host),
        _ => message.host(),
    }
}
