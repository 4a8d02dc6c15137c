//! A quantity that stays as it usually is for most of the time, measured in every frame with noise: has it changed, and to what?
//!
//! To take off what each frame says would add its noise to every place. So the quantity is averaged over the last frames, anew after a
//! change that is no noise, and only what differs from the usual by more than noise is told.

use nalgebra::{SMatrix, SVector};

/// Frames at first whose mean is the usual.
const FIRST: f64 = 20.0;
/// Share of a frame in the average, once that is over many.
const SHARE: f64 = 0.05;
/// A difference whose square is this many times its variance is none of noise: 1 of 3000 for two numbers (χ²).
const CHANGED: f64 = 16.0;

/// Averages of a vector of `N` numbers.
#[derive(Debug, Clone, Copy)]
pub(super) struct Slow<const N: usize> {
    usual: SVector<f64, N>,
    /// Frames in it.
    frames: f64,
    lately: SVector<f64, N>,
    /// Variance of `lately` over that of one frame; without end after a gap.
    weight: f64,
}

impl<const N: usize> Slow<N> {
    pub(super) fn new() -> Self {
        Self { usual: SVector::zeros(), frames: 0.0, lately: SVector::zeros(), weight: f64::INFINITY }
    }

    /// How far the quantity is from the usual after a frame in which it was measured so, and the variance of that over that of one frame;
    /// none where that may be noise.
    pub(super) fn change(
        &mut self,
        value: SVector<f64, N>,
        covariance: &SMatrix<f64, N, N>,
    ) -> Option<(SVector<f64, N>, f64)> {
        let precision = covariance.try_inverse()?;
        let exceeds = |off: &SVector<f64, N>, weight: f64| off.dot(&(precision * off)) > CHANGED * weight;
        let step = value - self.lately;
        if self.weight.is_infinite() || exceeds(&step, 1.0 + self.weight) {
            (self.lately, self.weight) = (value, 1.0);
        } else {
            let share = (self.weight / (1.0 + self.weight)).max(SHARE);
            self.lately += step * share;
            self.weight = self.weight * (1.0 - share).powi(2) + share * share;
        }
        if self.frames < FIRST {
            self.frames += 1.0;
            self.usual += (value - self.usual) / self.frames;
            return None;
        }
        let (off, weight) = (self.lately - self.usual, self.weight + 1.0 / self.frames);
        exceeds(&off, weight).then_some((off, weight))
    }

    /// Frames follow in which it was not measured.
    pub(super) fn interrupt(&mut self) {
        self.weight = f64::INFINITY;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::tests::random::Noise;
    use nalgebra::{Matrix1, Vector1};

    fn told(slow: &mut Slow<1>, value: f64) -> Option<f64> {
        slow.change(Vector1::new(value), &Matrix1::new(1.0)).map(|(off, _)| off.x)
    }

    /// Noise of one: a change of two is told within a second or so of a camera and to a third, one of six at once, none without a change.
    #[test]
    fn changes_are_told_and_noise_is_not() {
        let mut random = Noise::seeded(3);
        let (mut false_alarms, mut late, mut squares, mut count) = (0, 0, 0.0, 0.0);
        for _ in 0..100 {
            let mut slow = Slow::<1>::new();
            for _ in 0..220 {
                false_alarms += i32::from(told(&mut slow, 5.0 + random.normal()).is_some());
            }
            for frame in 0..200 {
                let off = told(&mut slow, 7.0 + random.normal());
                if frame >= 60 {
                    late += i32::from(off.is_none());
                    squares += off.map_or(4.0, |off| (off - 2.0).powi(2));
                    count += 1.0;
                }
            }
        }
        let rms = f64::sqrt(squares / count);
        println!("{false_alarms} false of 20000, {late} of {count} missed, off by {rms:.2}");
        assert!(
            false_alarms < 100 && f64::from(late) < 0.02 * count && rms < 0.35,
            "{false_alarms} {late} {rms}"
        );

        let mut slow = Slow::<1>::new();
        (0..40).for_each(|_| _ = told(&mut slow, random.normal()));
        assert!((told(&mut slow, 8.0).expect("a jump") - 8.0).abs() < 1.5);
        slow.interrupt();
        assert_eq!(told(&mut slow, 0.1), None);
    }
}
