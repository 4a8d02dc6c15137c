//! Whether a force record is the next one: lost, doubled, late and frozen records told apart by both of the sensor's counters.

use super::{ForceRecord, Losses};

/// How a record follows the one before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SequenceStep {
    /// The first record of a stream.
    First,
    /// The next one.
    Next,
    /// So many records in between never came (or come later).
    Gap(u32),
    /// It was there before.
    Duplicate,
    /// It belongs before one that was already there.
    Late,
    /// The sensor counts its records but its clock stands: it delivers one reading again and again.
    Frozen,
    /// The stream began anew, by somebody else's request or because the sensor restarted.
    Restarted,
}

/// Follows the counters of one stream. Both wrap at 2³².
#[derive(Debug, Clone)]
pub struct SequenceTracker {
    ticks_a_record: u32,
    last: Option<(u32, u32)>,
    /// Bit n: the record n before the last one has come.
    seen: u64,
    losses: Losses,
}

/// Records so far back are still told from a stream that began anew.
const WINDOW: u32 = u64::BITS;

impl SequenceTracker {
    /// For a stream whose sensor clock steps by `ticks_a_record` from one record to the next.
    pub fn new(ticks_a_record: u32) -> Self {
        Self { ticks_a_record: ticks_a_record.max(1), last: None, seen: 0, losses: Losses::default() }
    }

    /// Takes the next record as it came.
    pub fn observe(&mut self, record: &ForceRecord) -> SequenceStep {
        let (rdt, ft) = (record.rdt_sequence, record.ft_sequence);
        let Some((last_rdt, last_ft)) = self.last else {
            (self.last, self.seen) = (Some((rdt, ft)), 1);
            self.losses.received += 1;
            return SequenceStep::First;
        };
        // As signed steps: wrapping is a small step, a restart a large one.
        let (step, ticks) = (rdt.wrapping_sub(last_rdt) as i32, ft.wrapping_sub(last_ft) as i32);
        match step {
            0 if ticks == 0 => {
                self.losses.duplicated += 1;
                SequenceStep::Duplicate
            }
            1.. if ticks == 0 => {
                self.advance(rdt, ft, step as u32);
                SequenceStep::Frozen
            }
            1.. if ticks > 0 && self.agree(step, ticks) => {
                self.advance(rdt, ft, step as u32);
                if step == 1 { SequenceStep::Next } else { SequenceStep::Gap(step as u32 - 1) }
            }
            ..0 if step.unsigned_abs() < WINDOW && self.agree(step, ticks) => self.late(step.unsigned_abs()),
            _ => {
                (self.last, self.seen) = (Some((rdt, ft)), 1);
                self.losses.received += 1;
                SequenceStep::Restarted
            }
        }
    }

    /// What became of the records so far. A record that comes late after all is no longer lost.
    pub fn losses(&self) -> Losses {
        self.losses
    }

    /// Counts a datagram that is no record.
    pub fn malformed(&mut self) {
        self.losses.malformed += 1;
    }

    fn advance(&mut self, rdt: u32, ft: u32, step: u32) {
        self.last = Some((rdt, ft));
        self.seen = self.seen.checked_shl(step).unwrap_or(0) | 1;
        self.losses.received += 1;
        self.losses.lost += u64::from(step - 1);
    }

    fn late(&mut self, back: u32) -> SequenceStep {
        if self.seen >> back & 1 == 1 {
            self.losses.duplicated += 1;
            return SequenceStep::Duplicate;
        }
        self.seen |= 1 << back;
        self.losses.reordered += 1;
        self.losses.lost = self.losses.lost.saturating_sub(1);
        SequenceStep::Late
    }

    /// Whether both counters tell of the same number of records; the sensor's clock may be one tick off at rates that do not divide it.
    fn agree(&self, step: i32, ticks: i32) -> bool {
        let expected = i64::from(step) * i64::from(self.ticks_a_record);
        (i64::from(ticks) - expected).abs() <= i64::from(step.unsigned_abs())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::HostTime;

    fn record(rdt_sequence: u32, ft_sequence: u32) -> ForceRecord {
        ForceRecord { host: HostTime::from_nanos(0), rdt_sequence, ft_sequence, status: 0, counts: [0; 6] }
    }

    #[test]
    fn each_way_to_follow_is_told_apart() {
        use SequenceStep::{Duplicate, First, Frozen, Gap, Late, Next, Restarted};
        let mut tracker = SequenceTracker::new(7);
        for (rdt, ft, expected) in [
            (1, 700, First),
            (2, 707, Next),
            (3, 714, Next),
            (6, 735, Gap(2)),
            (5, 728, Late),
            (5, 728, Duplicate),
            (6, 735, Duplicate),
            (7, 742, Next),
            (8, 742, Frozen),
            (1, 2000, Restarted),
            (2, 2007, Next),
        ] {
            assert_eq!(tracker.observe(&record(rdt, ft)), expected, "{rdt} {ft}");
        }
        let losses = tracker.losses();
        assert_eq!((losses.lost, losses.duplicated, losses.reordered), (1, 2, 1));
    }

    #[test]
    fn both_counters_wrap() {
        let mut tracker = SequenceTracker::new(1);
        tracker.observe(&record(u32::MAX, u32::MAX - 1));
        assert_eq!(tracker.observe(&record(0, u32::MAX)), SequenceStep::Next);
        assert_eq!(tracker.observe(&record(2, 1)), SequenceStep::Gap(1));
    }

    /// The sensor restarts: its clock jumps while the request's numbers go on.
    #[test]
    fn a_jump_of_the_clock_alone_is_a_restart() {
        let mut tracker = SequenceTracker::new(1);
        tracker.observe(&record(10, 5000));
        assert_eq!(tracker.observe(&record(11, 3)), SequenceStep::Restarted);
        assert_eq!(tracker.losses().lost, 0);
    }
}
