//! One thread for each stream: grab, stamp, unpack, check, hand in, until nobody wants anything any more.

use super::Pace;
use super::desk::{Buffers, Desk, Ending};
use super::feed::{Feed, Grab, Live, Stamp};
use super::files::Recording;
use super::pixels::{self, Kind, Malformed, Pictures};
use crate::clock::HostTime;
use std::sync::Arc;
use std::time::Duration;

/// So many pictures in a row that are none are no accident.
const MOST_MALFORMED: u32 = 10;

/// So many pictures at most lie in buffers when a camera is opened.
const MOST_BUFFERED: u32 = 16;

/// What a thread has to know of its stream.
#[derive(Debug, Clone)]
pub(super) struct Stream {
    pub(super) desk: Arc<Desk>,
    /// 0, or 1 for the depth pictures where they come separately.
    pub(super) number: usize,
    pub(super) kind: Kind,
    pub(super) size: [usize; 2],
    /// Nominal time between two pictures.
    pub(super) interval: Duration,
}

impl Stream {
    /// Grabs from a camera all the time, started or not, so that nothing old ever waits in its buffers.
    pub(super) fn grab_live(&self, feed: &mut Live) {
        let mut in_a_row = 0;
        // Whatever had not to be waited for had been lying in a buffer.
        let (mut drained, mut grabbed) = (false, 0_u32);
        while !self.desk.is_over() {
            let before = HostTime::now();
            let stamp = match feed.grab() {
                Grab::Picture(stamp) => stamp,
                Grab::Unreadable(said) | Grab::Gone(said) => {
                    return self.desk.end(self.number, None, Ending::Gone(said));
                }
                Grab::Over => return self.desk.end(self.number, None, Ending::Over),
            };
            grabbed = grabbed.saturating_add(1);
            drained |= stamp.host.since(before) > self.interval / 4 || grabbed > MOST_BUFFERED;
            let Some((run, buffers)) = self.desk.admit(self.number, stamp.host, drained) else { continue };
            if let Some(ending) = self.hand_in(run, stamp, self.unpack(feed, buffers), &mut in_a_row) {
                return self.desk.end(self.number, None, ending);
            }
        }
    }

    /// Plays a recording, from its beginning at each start.
    pub(super) fn play(&self, recording: &mut Recording, pace: Pace) {
        let mut run = 0;
        while let Some((next, started)) = self.desk.next_run(run) {
            run = next;
            recording.rewind(started);
            let ending = self.play_once(recording, pace, run);
            self.desk.lost(run, recording.take_lost());
            if let Some(ending) = ending {
                self.desk.end(self.number, Some(run), ending);
            }
        }
    }

    /// None when it was stopped.
    fn play_once(&self, recording: &mut Recording, pace: Pace, run: u64) -> Option<Ending> {
        let mut in_a_row = 0;
        loop {
            if pace == Pace::AsFetched && !self.desk.room(self.number, run) {
                return None;
            }
            let unreadable = |file: String| Malformed {
                found: format!("{file}, which OpenCV cannot read"),
                expected: "an image file".to_owned(),
            };
            let (stamp, unpacked) = match recording.grab() {
                Grab::Picture(stamp) => {
                    let buffers = self.desk.buffers(run)?;
                    (Some(stamp), self.unpack(recording, buffers))
                }
                Grab::Unreadable(file) => (None, Err(unreadable(file))),
                Grab::Over => return Some(Ending::Over),
                Grab::Gone(said) => return Some(Ending::Gone(said)),
            };
            self.desk.lost(run, recording.take_lost());
            let stamp = stamp.unwrap_or(NEVER);
            if pace == Pace::AsTaken && !self.desk.until(stamp.host, run) {
                return None;
            }
            if let Some(ending) = self.hand_in(run, stamp, unpacked, &mut in_a_row) {
                return Some(ending);
            }
        }
    }

    /// The pictures that were grabbed.
    pub(super) fn unpack(
        &self,
        feed: &mut dyn Feed,
        (levels, distances): Buffers,
    ) -> Result<Pictures, Malformed> {
        let capture = feed.capture().ok_or_else(|| nothing(String::new()))?;
        match self.kind {
            Kind::Grey => {
                let grey = pixels::grey(capture.retrieve(0).map_err(nothing)?, self.size, levels)?;
                Ok(Pictures { grey: Some(grey), depth: None })
            }
            Kind::Depth | Kind::DepthOrBytes => {
                let mat = capture.retrieve(0).map_err(nothing)?;
                let depth = pixels::depth(mat, self.size, self.kind == Kind::DepthOrBytes, distances)?;
                Ok(Pictures { grey: None, depth: Some(depth) })
            }
            Kind::Stacked => {
                pixels::stacked(capture.retrieve(0).map_err(nothing)?, self.size, levels, distances)
            }
            Kind::Both { grey, depth } => {
                let grey = pixels::grey(capture.retrieve(grey).map_err(nothing)?, self.size, levels)?;
                let mat = capture.retrieve(depth).map_err(nothing)?;
                let depth = pixels::depth(mat, self.size, false, distances)?;
                Ok(Pictures { grey: Some(grey), depth: Some(depth) })
            }
        }
    }

    /// How the stream ends when too many pictures in a row were none.
    fn hand_in(
        &self,
        run: u64,
        stamp: Stamp,
        unpacked: Result<Pictures, Malformed>,
        in_a_row: &mut u32,
    ) -> Option<Ending> {
        match unpacked {
            Ok(pictures) => {
                *in_a_row = 0;
                self.desk.put(run, stamp, pictures);
                None
            }
            Err(malformed) => {
                *in_a_row += 1;
                self.desk.malformed(run);
                (*in_a_row >= MOST_MALFORMED).then_some(Ending::Malformed(malformed))
            }
        }
    }
}

/// The stamp of what is no picture.
const NEVER: Stamp = Stamp { host: HostTime::from_nanos(0), number: 0, device_s: None, time_s: 0.0 };

fn nothing(said: String) -> Malformed {
    Malformed { found: format!("nothing that can be retrieved ({said})"), expected: "a picture".to_owned() }
}
