//! Was this request already answered, is it too old, or is it new? And which motions have been named already?

use crate::message::Refusal;

/// Answers kept for requests that arrive again.
pub const ANSWERS_KEPT: usize = 8;

/// What became of a request: the number of the motion concerned (0 for none), or the refusal.
pub(super) type Answer = Result<u32, Refusal>;

/// What to do with a request.
pub(super) enum Arrival {
    New,
    /// Answered before, with the same sequence and kind.
    Again(Answer),
    /// Behind the newest sequence, answer not kept.
    Stale,
}

#[derive(Clone, Copy, Debug)]
struct Kept {
    sequence: u8,
    kind: u8,
    answer: Answer,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Session {
    /// 0 before the first HELLO of a boot.
    pub(super) nonce: u32,
    pub(super) same_schema: bool,
    /// Newest sequence seen.
    pub(super) newest: u8,
    /// Highest motion seen, accepted or not.
    motion: u32,
    kept: [Option<Kept>; ANSWERS_KEPT],
}

impl Session {
    pub(super) const NONE: Self =
        Self { nonce: 0, same_schema: false, newest: 0, motion: 0, kept: [None; ANSWERS_KEPT] };

    pub(super) fn open(nonce: u32, sequence: u8, same_schema: bool) -> Self {
        Self { nonce, newest: sequence, same_schema, ..Self::NONE }
    }

    /// Sorts a request and remembers its sequence as seen.
    ///
    /// A sequence 1 to 127 ahead of the newest is new, everything else is behind. A request delayed by more
    /// than that is taken for new again; the numbers of motions and faults catch it.
    pub(super) fn arrive(&mut self, sequence: u8, kind: u8) -> Arrival {
        if (1..=127).contains(&sequence.wrapping_sub(self.newest)) {
            self.newest = sequence;
            // What is left of the previous time round would answer for new requests. Steps of at most 127 cannot
            // pass an answer without finding it more than 127 behind.
            for kept in &mut self.kept {
                if kept.is_some_and(|kept| self.newest.wrapping_sub(kept.sequence) > 127) {
                    *kept = None;
                }
            }
            return Arrival::New;
        }
        let found = self.kept.iter().flatten().find(|kept| kept.sequence == sequence && kept.kind == kind);
        found.map_or(Arrival::Stale, |kept| Arrival::Again(kept.answer))
    }

    /// Keeps an answer, in the place of the oldest.
    pub(super) fn keep(&mut self, sequence: u8, kind: u8, answer: Answer) {
        self.kept.rotate_right(1);
        self.kept[0] = Some(Kept { sequence, kind, answer });
    }

    /// Whether the number is new; the highest one seen if it is not.
    pub(super) fn name_motion(&mut self, motion: u32) -> Result<(), u32> {
        if motion <= self.motion {
            return Err(self.motion);
        }
        self.motion = motion;
        Ok(())
    }
}
