//! How much later one signal comes than another that it follows: pictures against force, as a check of the clocks.
//!
//! `y(t) = a + Σ bₖ xₖ(t − τ)`, x₀ the signal that is followed and the others what may come along with it: the best τ of a scan, then
//! Gauss–Newton. What is left is no white noise (memory of the phantom, drift), so that its correlation from one sample to the next widens
//! the deviation: n samples that follow one another with correlation ρ are worth n (1 − ρ)/(1 + ρ) (Bartlett 1935, J. R. Stat. Soc. 98, 536).

use super::CalibError;
use nalgebra::{DMatrix, DVector};

/// Values at times that go up (s).
#[derive(Debug, Clone, Copy)]
pub struct Track<'a> {
    /// Times (s).
    pub time_s: &'a [f64],
    /// Values, in any unit.
    pub value: &'a [f64],
}

/// How much later a signal comes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lag {
    /// Positive when it comes later than the one that it follows (s).
    pub lag_s: f64,
    /// Standard deviation of that (s).
    pub sd_s: f64,
    /// Share of its variance that the other explains.
    pub explained: f64,
    /// Samples used.
    pub samples: usize,
}

/// Step of the scan (s): no signal that a 30 Hz camera sees changes within it.
const SCAN_S: f64 = 2e-3;
/// Less of the variance explained is no likeness.
const LIKE: f64 = 0.5;
const STEPS: usize = 12;
/// Share of a column's squares that those before it must leave.
const TOLD: f64 = 1e-12;

/// Finds how much later `follows` is than `leads`, between −`most_s` and `most_s`. `besides`: signals that may come along with the one that
/// leads, each in an unknown measure (the slow share of an answer that is not at once).
///
/// # Errors
/// [`CalibError`]: fewer than ten samples in common, a signal that does not change, or two that are not alike.
pub fn lag_between(
    leads: Track<'_>,
    besides: &[Track<'_>],
    follows: Track<'_>,
    most_s: f64,
) -> Result<Lag, CalibError> {
    let (Some(first), Some(last)) = (leads.time_s.first(), leads.time_s.last()) else {
        return Err(CalibError::TooFew { what: "samples", found: 0, needed: 10 });
    };
    // As wide as the other signal is sampled: narrower changes it cannot show.
    let interval_s = follows.time_s.windows(2).map(|t| t[1] - t[0]).fold(f64::INFINITY, f64::min);
    let width_s = interval_s.clamp(1e-4, most_s.max(1e-4));
    // The same samples at every lag.
    let inside = |t: f64| t - most_s - width_s >= *first && t + most_s + width_s <= *last;
    let samples: Vec<(f64, f64)> = follows
        .time_s
        .iter()
        .copied()
        .zip(follows.value.iter().copied())
        .filter(|(t, _)| inside(*t))
        .collect();
    if samples.len() < 10 {
        return Err(CalibError::TooFew { what: "samples in common", found: samples.len(), needed: 10 });
    }
    let leads: Vec<Smooth<'_>> =
        std::iter::once(&leads).chain(besides).map(|track| Smooth::new(*track, width_s)).collect();
    let flat = CalibError::Silent { what: "a signal does not change: its lag cannot be told" };
    let count = (most_s / SCAN_S).ceil() as i64;
    let start = (-count..=count)
        .map(|i| i as f64 * SCAN_S)
        .filter_map(|lag_s| Some((lag_s, Answer::at(&leads, &samples, lag_s)?)))
        .min_by(|a, b| a.1.left.total_cmp(&b.1.left));
    let Some((mut lag_s, Answer { mut measures, .. })) = start else { return Err(flat) };
    let mut variance = 0.0;
    for _ in 0..STEPS {
        let mut normal = Normal::new(leads.len() + 2);
        for (t, y) in &samples {
            let (values, slope) = row(&leads, &measures, t - lag_s);
            normal.add(values.iter().copied().chain([-slope]), y - inner(&values, &measures));
        }
        let Some((step, inverse)) = normal.solved() else { return Err(flat) };
        variance = inverse[(leads.len() + 1, leads.len() + 1)];
        measures.iter_mut().zip(step.iter()).for_each(|(measure, step)| *measure += step);
        // Never further than the scan resolves, so that the valley is not left.
        lag_s += step[leads.len() + 1].clamp(-SCAN_S, SCAN_S);
    }
    let left: Vec<f64> =
        samples.iter().map(|(t, y)| y - inner(&row(&leads, &measures, t - lag_s).0, &measures)).collect();
    let sum: f64 = left.iter().map(|r| r * r).sum();
    let mean = samples.iter().map(|s| s.1).sum::<f64>() / samples.len() as f64;
    let total: f64 = samples.iter().map(|s| (s.1 - mean).powi(2)).sum();
    let explained = 1.0 - sum / total;
    if explained.is_nan() || explained < LIKE {
        return Err(CalibError::Silent { what: "the signals are not alike: their lag cannot be told" });
    }
    let rho = left.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / sum;
    let rho = if rho.is_finite() { rho.clamp(0.0, 0.99) } else { 0.0 };
    let freedom = samples.len().saturating_sub(leads.len() + 2).max(1);
    variance *= sum / freedom as f64 * (1.0 + rho) / (1.0 - rho);
    Ok(Lag { lag_s, sd_s: variance.sqrt(), explained, samples: samples.len() })
}

/// One, and the signals at a time; and how fast they change together, in the measures (of the constant, then of each signal).
fn row(leads: &[Smooth<'_>], measures: &[f64], time_s: f64) -> (Vec<f64>, f64) {
    let (mut values, mut slope) = (vec![1.0], 0.0);
    for (lead, measure) in leads.iter().zip(&measures[1..]) {
        let (value, rate) = lead.at(time_s);
        values.push(value);
        slope += measure * rate;
    }
    (values, slope)
}

fn inner(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The measures that fit best at a lag, and the sum of squares that they leave.
struct Answer {
    measures: Vec<f64>,
    left: f64,
}

impl Answer {
    /// None where nothing changes.
    fn at(leads: &[Smooth<'_>], samples: &[(f64, f64)], lag_s: f64) -> Option<Self> {
        let none = vec![0.0; leads.len() + 1];
        let mut normal = Normal::new(leads.len() + 1);
        for (t, y) in samples {
            normal.add(row(leads, &none, t - lag_s).0, *y);
        }
        let (measures, _) = normal.solved()?;
        let left = normal.squares - measures.dot(&normal.right);
        Some(Self { measures: measures.iter().copied().collect(), left })
    }
}

/// Normal equations.
struct Normal {
    matrix: DMatrix<f64>,
    right: DVector<f64>,
    squares: f64,
}

impl Normal {
    fn new(columns: usize) -> Self {
        Self { matrix: DMatrix::zeros(columns, columns), right: DVector::zeros(columns), squares: 0.0 }
    }

    fn add(&mut self, row: impl IntoIterator<Item = f64>, value: f64) {
        let row = DVector::from_iterator(self.right.len(), row);
        self.matrix.ger(1.0, &row, &row, 1.0);
        self.right.axpy(value, &row, 1.0);
        self.squares += value * value;
    }

    /// The solution and the inverse of the matrix; none where a column is all but made of others.
    fn solved(&self) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let factor = self.matrix.clone().cholesky()?;
        let own = factor.l_dirty().diagonal();
        let told = (0..own.len()).all(|k| own[k].powi(2) > TOLD * self.matrix[(k, k)]);
        told.then(|| (factor.solve(&self.right), factor.inverse()))
    }
}

/// A signal averaged with a triangle of weights that reaches `width_s` to either side: noise from sample to sample would otherwise pass for
/// slope. By integrals of the straight lines between samples, which a mean over the triangle is a second difference of.
struct Smooth<'a> {
    track: Track<'a>,
    /// Integrals up to each sample, once and twice.
    integrals: Vec<[f64; 2]>,
    width_s: f64,
}

impl<'a> Smooth<'a> {
    fn new(track: Track<'a>, width_s: f64) -> Self {
        let mut integrals = Vec::with_capacity(track.time_s.len());
        let mut sum = [0.0, 0.0];
        integrals.push(sum);
        for (t, v) in track.time_s.windows(2).zip(track.value.windows(2)) {
            let step = t[1] - t[0];
            sum[1] += step * (sum[0] + step * (2.0 * v[0] + v[1]) / 6.0);
            sum[0] += 0.5 * step * (v[0] + v[1]);
            integrals.push(sum);
        }
        Self { track, integrals, width_s }
    }

    /// Value and slope at a time.
    fn at(&self, time_s: f64) -> (f64, f64) {
        let [before, now, after] = [-self.width_s, 0.0, self.width_s].map(|d| self.integral(time_s + d));
        let second = |k: usize| (after[k] - 2.0 * now[k] + before[k]) / self.width_s.powi(2);
        (second(1), second(0))
    }

    fn integral(&self, time_s: f64) -> [f64; 2] {
        let (times, values) = (self.track.time_s, self.track.value);
        let next = times.partition_point(|t| *t <= time_s).clamp(1, times.len() - 1);
        let (step, whole) = (time_s - times[next - 1], times[next] - times[next - 1]);
        let slope = if whole > 0.0 { (values[next] - values[next - 1]) / whole } else { 0.0 };
        let ([once, twice], value) = (self.integrals[next - 1], values[next - 1]);
        [
            once + step * (value + 0.5 * step * slope),
            twice + step * (once + step * (0.5 * value + step * slope / 6.0)),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    /// Three pokes of two seconds.
    fn force(t: f64) -> f64 {
        let u = t % 4.0;
        if u < 1.0 {
            u
        } else if u < 2.0 {
            1.0
        } else if u < 2.5 {
            1.0 - 2.0 * (u - 2.0)
        } else {
            0.0
        }
    }

    /// What follows the force with a time constant of a second, every millisecond.
    fn slow_force() -> Vec<f64> {
        let decay = f64::exp(-1e-3);
        let mut slow = 0.0;
        let at = |i: u32| force(1e-3 * f64::from(i));
        (0..12_000)
            .map(|i| {
                slow = slow * decay + at(i) * (1.0 - decay);
                slow
            })
            .collect()
    }

    /// Of what follows, `share` follows slowly, if it is known that it may.
    fn draw(rng: &mut ChaCha8Rng, lag_s: f64, slowly: Option<(&[f64], f64)>) -> Result<Lag, CalibError> {
        let times: Vec<f64> = (0..12_000).map(|i| 1e-3 * f64::from(i)).collect();
        let slow = |t: f64| {
            slowly
                .map_or(0.0, |(slow, share)| share * slow[((1e3 * t).round().max(0.0) as usize).min(11_999)])
        };
        let mut noise = |sd: f64| sd * rng.sample::<f64, _>(StandardNormal);
        let leads: Vec<f64> = times.iter().map(|&t| force(t) + noise(0.01)).collect();
        let frames: Vec<f64> = (0..360).map(|i| f64::from(i) / 30.0).collect();
        let follows: Vec<f64> =
            frames.iter().map(|&t| 0.3 - 0.8 * force(t - lag_s) + slow(t - lag_s) + noise(0.02)).collect();
        let besides: Vec<Track<'_>> =
            slowly.iter().map(|(slow, _)| Track { time_s: &times, value: slow }).collect();
        let (leads, follows) =
            (Track { time_s: &times, value: &leads }, Track { time_s: &frames, value: &follows });
        lag_between(leads, &besides, follows, 0.3)
    }

    #[test]
    fn a_lag_is_found_within_its_deviation() {
        const DRAWS: usize = 40;
        let slow = slow_force();
        for slowly in [None, Some((&*slow, 0.1))] {
            let mut rng = ChaCha8Rng::seed_from_u64(9);
            let (mut chi2, mut sd) = (0.0, 0.0);
            for i in 0..DRAWS {
                let truth = 0.005 * i as f64 - 0.1;
                let found = draw(&mut rng, truth, slowly).expect("alike");
                assert!(found.explained > 0.98, "{found:?}");
                chi2 += ((found.lag_s - truth) / found.sd_s).powi(2);
                sd += found.sd_s / DRAWS as f64;
            }
            // Standard deviation of the mean √(2/40) = 0.22.
            let mean = chi2 / DRAWS as f64;
            assert!((0.3..1.8).contains(&mean), "mean χ² {mean}, mean deviation {sd}");
            assert!(sd < 3e-3, "{sd}");
        }
    }

    #[test]
    fn what_is_not_alike_has_no_lag() {
        let times: Vec<f64> = (0..1000).map(|i| 0.01 * f64::from(i)).collect();
        let still = vec![0.0; 1000];
        let wave: Vec<f64> = times.iter().map(|t| (7.0 * t).sin()).collect();
        let other: Vec<f64> = times.iter().map(|t| (1.9 * t * t).cos()).collect();
        let track = |value| Track { time_s: &times, value };
        let between = |leads, follows| lag_between(track(leads), &[], track(follows), 0.2);
        for [leads, follows] in [[&wave, &still], [&still, &wave], [&wave, &other]] {
            assert!(matches!(between(leads, follows), Err(CalibError::Silent { .. })));
        }
        let few = Track { time_s: &times[..5], value: &wave[..5] };
        assert!(matches!(lag_between(track(&wave), &[], few, 0.2), Err(CalibError::TooFew { .. })));
    }
}
