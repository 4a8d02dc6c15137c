//! When something that happens at equal intervals happened, from arrivals that come late by varying times.
//!
//! A camera takes its pictures by a quartz of its own, and each arrives after a way whose time varies. The interval is the one at which the
//! arrivals' resultant |Σ exp(2πi t/p)| is longest (periodogram of Schuster 1898, for events; Rayleigh's statistic): missing pictures and a
//! few late ones do not shift it. Nothing arrives early, so that an arrival belongs to the last beat before it.

use std::f64::consts::TAU;

/// Beats at equal intervals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beat {
    /// From one to the next (s).
    interval_s: f64,
    /// Time of one of them (s), as late as arrivals usually are.
    first_s: f64,
}

/// So many arrivals say nothing yet.
const FEW: usize = 16;
/// The median difference is off by this share of itself at most.
const FIRST_GUESS: f64 = 0.1;
/// Steps of the search: so many to one width of the periodogram's peak, which is interval² / span.
const STEPS_A_PEAK: f64 = 8.0;
/// An arrival within this share of the interval from its beat is punctual.
const PUNCTUAL: f64 = 0.2;
/// Of each tenth of the arrivals more than this share is punctual where there is a beat.
const MOST: f64 = 0.75;
/// Arrivals come before the usual one by this share of the interval at most.
const EARLY: f64 = 0.3;

impl Beat {
    /// The beat of arrivals (s, ascending). None where there are fewer than 16, or where some stretch of them does not keep it.
    pub fn of(arrivals_s: &[f64]) -> Option<Self> {
        if arrivals_s.len() < FEW {
            return None;
        }
        let mut steps: Vec<f64> = arrivals_s.windows(2).map(|t| t[1] - t[0]).collect();
        let middle = steps.len() / 2;
        let mut interval_s = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
        if interval_s <= 0.0 || !interval_s.is_finite() {
            return None;
        }
        // From a short span to the whole: each tells the interval well enough to search the next.
        let whole_s = arrivals_s[arrivals_s.len() - 1] - arrivals_s[0];
        let (mut span_s, mut width_s) = (FEW as f64 * interval_s, FIRST_GUESS * interval_s);
        loop {
            let count = arrivals_s.partition_point(|t| t - arrivals_s[0] <= span_s);
            interval_s = strongest(&arrivals_s[..count], interval_s, width_s, span_s);
            if span_s >= whole_s {
                break;
            }
            // A quarter of the peak's width, and what follows is twice as narrow.
            width_s = interval_s.powi(2) / (4.0 * span_s);
            span_s *= 2.0;
        }
        let beat = Self { interval_s, first_s: phase(arrivals_s, interval_s) }.drawn_through(arrivals_s)?;
        let kept = |part: &[f64]| {
            let punctual = part.iter().filter(|t| beat.off(**t).abs() < PUNCTUAL).count();
            punctual as f64 > MOST * part.len() as f64
        };
        let stretch = arrivals_s.len().div_ceil(10).max(FEW);
        arrivals_s.chunks_exact(stretch).all(kept).then_some(beat)
    }

    /// The number of the beat that an arrival belongs to, and its time (s).
    pub fn before(&self, arrival_s: f64) -> (i64, f64) {
        let number = ((arrival_s - self.first_s) / self.interval_s + EARLY).floor();
        (number as i64, self.first_s + number * self.interval_s)
    }

    /// Beats from the first to the last of these arrivals (s, ascending) for which none arrived. One that came so late that it arrived
    /// with the next is not missing.
    pub fn missing(&self, arrivals_s: &[f64]) -> u64 {
        let [Some(first), Some(last)] = [arrivals_s.first(), arrivals_s.last()] else { return 0 };
        let beats = self.before(*last).0 - self.before(*first).0 + 1;
        u64::try_from(beats).unwrap_or(0).saturating_sub(arrivals_s.len() as u64)
    }

    /// From one beat to the next (s).
    pub fn interval_s(&self) -> f64 {
        self.interval_s
    }

    /// From the nearest beat to an arrival, in intervals.
    fn off(&self, arrival_s: f64) -> f64 {
        let beats = (arrival_s - self.first_s) / self.interval_s;
        beats - beats.round()
    }

    /// The straight line through the punctual arrivals.
    fn drawn_through(self, arrivals_s: &[f64]) -> Option<Self> {
        let punctual: Vec<[f64; 2]> = (arrivals_s.iter())
            .filter(|t| self.off(**t).abs() < PUNCTUAL)
            .map(|&t| [((t - self.first_s) / self.interval_s).round(), t])
            .collect();
        let count = punctual.len() as f64;
        let mean = [0, 1].map(|i| punctual.iter().map(|p| p[i]).sum::<f64>() / count);
        let sum = |a: usize, b: usize| -> f64 {
            punctual.iter().map(|p| (p[a] - mean[a]) * (p[b] - mean[b])).sum()
        };
        let interval_s = sum(0, 1) / sum(0, 0);
        interval_s.is_finite().then(|| Self { interval_s, first_s: mean[1] - interval_s * mean[0] })
    }
}

/// The interval within `width_s` of another at which arrivals of a span agree best.
fn strongest(arrivals_s: &[f64], about_s: f64, width_s: f64, span_s: f64) -> f64 {
    let step_s = about_s.powi(2) / (STEPS_A_PEAK * span_s);
    let count = (width_s / step_s).ceil();
    let strength = |interval_s: f64| {
        let [x, y] = resultant(arrivals_s, interval_s);
        x.hypot(y)
    };
    let tried = (0..=2 * count as i64).map(|i| about_s + (i as f64 - count) * step_s);
    tried.map(|p| (p, strength(p))).max_by(|a, b| a.1.total_cmp(&b.1)).map_or(about_s, |best| best.0)
}

/// Σ exp(2πi t/p), times from the first.
fn resultant(arrivals_s: &[f64], interval_s: f64) -> [f64; 2] {
    arrivals_s.iter().fold([0.0; 2], |[x, y], t| {
        let (sin, cos) = (TAU * (t - arrivals_s[0]) / interval_s).sin_cos();
        [x + cos, y + sin]
    })
}

/// When one beat is (s).
fn phase(arrivals_s: &[f64], interval_s: f64) -> f64 {
    let [x, y] = resultant(arrivals_s, interval_s);
    arrivals_s[0] + interval_s * y.atan2(x) / TAU
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    const INTERVAL_S: f64 = 1.0 / 29.97;

    /// Numbers of pictures and when they arrive: some are missing, some take up to 8 ms longer than usual, one in fifty 12 ms.
    fn arrivals(count: u32) -> Vec<(u32, f64)> {
        (0..count)
            .filter(|n| n * 7919 % 23 > 2)
            .map(|n| {
                let late_s = 8e-3 * (f64::from(n * 104_729 % 1000) / 1000.0).powi(4);
                let held_s = if n % 50 == 7 { 0.012 } else { 0.0 };
                (n, 17.0 + f64::from(n) * INTERVAL_S + late_s + held_s)
            })
            .collect()
    }

    #[test]
    fn beats_are_found_under_late_and_missing_arrivals() {
        for count in [40, 400, 20_000] {
            let arrivals = arrivals(count);
            let times: Vec<f64> = arrivals.iter().map(|a| a.1).collect();
            let beat = Beat::of(&times).expect("a beat");
            let offset = beat.before(times[0]).0 - i64::from(arrivals[0].0);
            for (n, t) in &arrivals {
                let (number, time_s) = beat.before(*t);
                assert_eq!(number - offset, i64::from(*n));
                // As late as usual, which is some 1 ms on average.
                let off_s = time_s - 17.0 - f64::from(*n) * INTERVAL_S;
                assert!((0.0..3e-3).contains(&off_s), "picture {n} of {count}: {off_s} s");
            }
            if count > 100 {
                assert!((beat.interval_s() - INTERVAL_S).abs() < 1e-3 / f64::from(count));
            }
        }
    }

    /// Those between the first and the last that were left out are missing, and none that waited for the next.
    #[test]
    fn beats_without_an_arrival_are_counted() {
        let arrivals = arrivals(400);
        let mut times: Vec<f64> = arrivals.iter().map(|a| a.1).collect();
        let beat = Beat::of(&times).expect("a beat");
        let left_out = u64::from(arrivals[arrivals.len() - 1].0 - arrivals[0].0 + 1) - times.len() as u64;
        assert!(left_out > 40, "{left_out}");
        assert_eq!(beat.missing(&times), left_out);
        times[100] = times[101] - 1e-4;
        assert_eq!(beat.missing(&times), left_out);
        times.remove(100);
        assert_eq!(beat.missing(&times), left_out + 1);
        assert_eq!(beat.missing(&[]), 0);
    }

    /// Pictures taken when somebody asks, a camera that slips by half an interval, two rates: no beat.
    #[test]
    fn what_keeps_no_time_has_no_beat() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(4);
        let uneven: Vec<f64> =
            (0..500).map(|n| 0.033 * f64::from(n) + random.random_range(0.0..0.03)).collect();
        assert_eq!(Beat::of(&uneven), None);
        let slips: Vec<f64> =
            (0..500).map(|n| f64::from(n) * 0.033 + if n > 200 { 0.0165 } else { 0.0 }).collect();
        assert_eq!(Beat::of(&slips), None);
        let slower: Vec<f64> =
            (0..500).map(|n| 0.033 * f64::from(n) + 0.002 * f64::from((n - 250).max(0))).collect();
        assert_eq!(Beat::of(&slower), None);
        assert_eq!(Beat::of(&[0.0; 40]), None);
        assert_eq!(Beat::of(&[0.0, 0.1, 0.2]), None);
    }
}
