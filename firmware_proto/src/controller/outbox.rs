//! Which frame leaves next? Emergency first, then faults, answers in their order, telemetry last.

use crate::frame::{Encoded, Stamp};
use crate::message::Response;

/// Answers that can wait for the line.
const WAITING: usize = 4;

#[derive(Debug)]
pub(super) struct Outbox {
    answers: [Option<(Stamp, Response)>; WAITING],
    /// Answers dropped because too many waited; the host asks again.
    pub(super) overflowed: u32,
    pub(super) emergency: bool,
    pub(super) fault: bool,
    telemetry: bool,
    counter: u32,
    leaving: Encoded,
    left: usize,
}

/// A frame that is still to be filled with the state of the moment.
pub(super) enum Next {
    Answer(Stamp, Response),
    Emergency(u32),
    Fault(u32),
    Telemetry(u32),
}

impl Outbox {
    pub(super) const EMPTY: Self = Self {
        answers: [None; WAITING],
        overflowed: 0,
        emergency: false,
        fault: false,
        telemetry: false,
        counter: 0,
        leaving: Encoded::EMPTY,
        left: 0,
    };

    pub(super) fn answer(&mut self, stamp: Stamp, response: Response) {
        match self.answers.iter_mut().find(|place| place.is_none()) {
            Some(place) => *place = Some((stamp, response)),
            None => self.overflowed = self.overflowed.saturating_add(1),
        }
    }

    /// Telemetry is due so many times over; what was due before and has not left is counted as lost.
    pub(super) fn telemetry(&mut self, times: u32) {
        self.counter = self.counter.wrapping_add(times - u32::from(!self.telemetry));
        self.telemetry = true;
    }

    pub(super) fn forget_telemetry(&mut self) {
        self.telemetry = false;
    }

    /// Moves bytes of the frame under way; false when none is.
    pub(super) fn drain(&mut self, into: &mut [u8], filled: &mut usize) -> bool {
        let rest = &self.leaving.as_bytes()[self.left..];
        let room = into.get_mut(*filled..).unwrap_or_default();
        let count = rest.len().min(room.len());
        room[..count].copy_from_slice(&rest[..count]);
        *filled += count;
        self.left += count;
        self.left < self.leaving.as_bytes().len()
    }

    /// Begins a frame; the one before must have left.
    pub(super) fn begin(&mut self, frame: Encoded) {
        self.leaving = frame;
        self.left = 0;
    }

    pub(super) fn next(&mut self) -> Option<Next> {
        if core::mem::take(&mut self.emergency) {
            return Some(Next::Emergency(self.count()));
        }
        if core::mem::take(&mut self.fault) {
            return Some(Next::Fault(self.count()));
        }
        if let Some((stamp, response)) = self.answers[0].take() {
            self.answers.rotate_left(1);
            return Some(Next::Answer(stamp, response));
        }
        core::mem::take(&mut self.telemetry).then(|| Next::Telemetry(self.count()))
    }

    fn count(&mut self) -> u32 {
        self.counter = self.counter.wrapping_add(1);
        self.counter
    }
}
