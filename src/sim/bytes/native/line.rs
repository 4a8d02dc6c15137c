//! What becomes of bytes on one direction of a serial line: they take their time, and some arrive otherwise than they were sent.

use super::faults::NativeStageFaults;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::collections::VecDeque;

/// Longest delay of a late copy (µs).
const LATEST_US: u64 = 1_000_000;

/// One direction of a line.
#[derive(Debug)]
pub(super) struct Line {
    rng: ChaCha8Rng,
    /// As many as come, if none.
    bytes_s: Option<f64>,
    /// Parts of a byte that the line has had time for.
    credit: f64,
    under_way: VecDeque<u8>,
    now_us: u64,
    /// Copies of frames, with the time when each sets out.
    late: Vec<(u64, Vec<u8>)>,
}

impl Line {
    pub(super) fn new(rng: ChaCha8Rng, bytes_s: Option<f64>) -> Self {
        Self { rng, bytes_s, credit: 0.0, under_way: VecDeque::new(), now_us: 0, late: Vec::new() }
    }

    /// Whether nothing is under way.
    pub(super) fn is_idle(&self) -> bool {
        self.under_way.is_empty()
    }

    /// Sends bytes. Frames are told apart by their delimiters, within what is sent at one go.
    pub(super) fn send(&mut self, bytes: &[u8], faults: &NativeStageFaults) {
        for frame in bytes.split_inclusive(|byte| *byte == 0) {
            if self.happens(faults.late_frame_share) {
                let sets_out_us = self.now_us + self.rng.random_range(1..LATEST_US);
                self.late.push((sets_out_us, frame.to_vec()));
            }
            if self.happens(faults.drop_frame_share) {
                continue;
            }
            for _ in 0..self.times(faults.duplicate_frame_share) {
                for byte in frame {
                    self.send_byte(*byte, faults);
                }
            }
        }
    }

    /// Bytes that have arrived after so much more time.
    pub(super) fn arrived(&mut self, elapsed_us: u32, into: &mut Vec<u8>) {
        let count = match self.bytes_s {
            Some(bytes_s) if !self.is_idle() => {
                self.credit += bytes_s * f64::from(elapsed_us) / 1e6;
                (self.credit as usize).min(self.under_way.len())
            }
            Some(_) => 0,
            None => self.under_way.len(),
        };
        into.extend(self.under_way.drain(..count));
        // An idle line saves no time up.
        self.credit = if self.is_idle() { 0.0 } else { self.credit - count as f64 };
        self.now_us += u64::from(elapsed_us);
        let now_us = self.now_us;
        for (_, copy) in self.late.extract_if(.., |(sets_out_us, _)| *sets_out_us <= now_us) {
            self.under_way.extend(copy);
        }
    }

    fn send_byte(&mut self, byte: u8, faults: &NativeStageFaults) {
        if self.happens(faults.drop_share) {
            return;
        }
        let byte =
            if self.happens(faults.corrupt_share) { byte ^ self.rng.random_range(1..=u8::MAX) } else { byte };
        for _ in 0..self.times(faults.duplicate_share) {
            self.under_way.push_back(byte);
        }
    }

    fn times(&mut self, share_twice: f64) -> usize {
        1 + usize::from(self.happens(share_twice))
    }

    fn happens(&mut self, share: f64) -> bool {
        share > 0.0 && self.rng.random_bool(share.min(1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    const NONE: NativeStageFaults = NativeStageFaults {
        corrupt_share: 0.0,
        drop_share: 0.0,
        duplicate_share: 0.0,
        drop_frame_share: 0.0,
        duplicate_frame_share: 0.0,
        late_frame_share: 0.0,
        deaf: false,
        mute: false,
        stuck: [[None; 2]; 2],
    };

    fn line(bytes_s: Option<f64>) -> Line {
        Line::new(ChaCha8Rng::seed_from_u64(7), bytes_s)
    }

    fn carried(faults: &NativeStageFaults) -> Vec<u8> {
        let mut line = line(None);
        let mut arrived = Vec::new();
        for _ in 0..10_000 {
            line.send(&[1, 2, 3, 0], faults);
            line.arrived(1, &mut arrived);
        }
        arrived
    }

    #[test]
    fn bytes_take_their_time_and_idle_time_is_not_saved() {
        let (mut line, mut arrived) = (line(Some(10_000.0)), Vec::new());
        line.arrived(1_000_000, &mut arrived);
        line.send(&[1; 30], &NONE);
        line.arrived(1050, &mut arrived);
        assert_eq!(arrived.len(), 10);
        line.arrived(950, &mut arrived);
        assert_eq!(arrived.len(), 20);
        line.arrived(1_000_000, &mut arrived);
        assert_eq!((arrived.len(), line.is_idle()), (30, true));
    }

    #[test]
    fn a_late_copy_comes_once_and_late() {
        let (mut line, mut arrived) = (line(None), Vec::new());
        line.send(&[1, 2, 0], &NativeStageFaults { late_frame_share: 1.0, ..NONE });
        line.arrived(0, &mut arrived);
        assert_eq!(arrived, [1, 2, 0]);
        for _ in 0..2000 {
            line.arrived(1000, &mut arrived);
        }
        assert_eq!(arrived, [1, 2, 0, 1, 2, 0]);
    }

    /// Binomial counts: 5 standard deviations of √(n p (1 − p)) either side.
    #[test]
    fn shares_are_what_they_say() {
        assert_eq!(carried(&NONE).len(), 40_000);
        let near =
            |count: usize, n: f64, p: f64| (count as f64 - n * p).abs() < 5.0 * (n * p * (1.0 - p)).sqrt();
        let wrong = carried(&NativeStageFaults { corrupt_share: 0.01, ..NONE });
        let sent = [1, 2, 3, 0].into_iter().cycle();
        assert!(near(wrong.iter().zip(sent).filter(|(a, b)| **a != *b).count(), 4e4, 0.01));
        assert!(near(40_000 - carried(&NativeStageFaults { drop_share: 0.02, ..NONE }).len(), 4e4, 0.02));
        let twice = carried(&NativeStageFaults { duplicate_share: 0.02, ..NONE });
        assert!(near(twice.len() - 40_000, 4e4, 0.02));
        let frames = carried(&NativeStageFaults { drop_frame_share: 0.1, ..NONE });
        assert!(frames.len().is_multiple_of(4) && near((40_000 - frames.len()) / 4, 1e4, 0.1));
        let frames = carried(&NativeStageFaults { duplicate_frame_share: 0.1, ..NONE });
        assert!(frames.len().is_multiple_of(4) && near((frames.len() - 40_000) / 4, 1e4, 0.1));
    }
}
