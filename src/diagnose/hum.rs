//! A hum: lines in the spectrum of the force sensor while nothing touches the tip, of a pump, a fan, or mains that rows of the recording
//! alias.
//!
//! No entry of the catalogue is periodic in time, and what nothing touches no phantom moves. Means over a part of a poke
//! average a hum away, so that it would pass for noise that is larger than stated; taken off, it leaves that noise.
//!
//! The periodogram (Lomb 1976, least squares at every frequency, summed over the three axes) is held against its own
//! median round about: a zero that wanders or drifts raises all of a neighbourhood, a hum one place in it.

use super::diagnosis::{Channel, Diagnosis, Phase};
use crate::geometry::Vec3;
use crate::inverse::{SETTLED_S, force_at_rest};
use crate::observation::Recording;
use std::borrow::Cow;
use std::f64::consts::TAU;

/// One line: `F(t) = in_phase cos ωt + in_quadrature sin ωt`, time counted as in the recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Hum {
    /// Frequency (Hz).
    frequency_hz: f64,
    /// Probability that noise alone makes such a line anywhere.
    p_value: f64,
    in_phase_n: Vec3,
    in_quadrature_n: Vec3,
}

/// Slower than this (Hz) a hum is not told from a zero that wanders.
const SLOWEST_HZ: f64 = 0.25;
/// Faster than this (Hz) none is looked for, whatever the rate of the rows: mains are.
const FASTEST_HZ: f64 = 65.0;
/// Half the width of the neighbourhood that a line is held against: a share of its frequency, and at least so much (Hz).
const ROUND_ABOUT: f64 = 0.4;
const ROUND_ABOUT_HZ: f64 = 0.15;
/// Frequencies tried within the resolution of the time that is looked at.
const OVERSAMPLING: f64 = 4.0;
/// Time (s) that is looked at; in longer recordings the frequency is then followed on.
const LOOKED_AT_S: f64 = 120.0;
/// Fewer rows at rest than this say nothing.
const FEWEST: usize = 100;
/// A line is called where chance makes one in so many recordings.
const CHANCE: f64 = 1e-4;
/// Most lines that are looked for: a hum and its overtones.
const MOST: usize = 4;
/// Median of the sum of squares of three axes over its scale: of a gamma distribution of shape 3.
const MEDIAN: f64 = 2.674;

/// The hums of a recording, the plainest first.
pub(super) fn hums(recording: &Recording) -> Vec<Hum> {
    // What the phantom still does to a tip that has just left comes back with every poke.
    let parted = |t: f64| recording.pokes.iter().all(|p| t < p.end_s || t > p.end_s + SETTLED_S);
    let mut rows = force_at_rest(recording);
    rows.retain(|(t, _)| parted(*t));
    let mut found = Vec::new();
    while found.len() < MOST {
        straighten(&mut rows);
        let Some(hum) = plainest(&rows) else { break };
        rows.iter_mut().for_each(|(t, f)| *f -= hum.at(*t));
        found.push(hum);
    }
    found
}

/// The recording with the hums taken off its forces.
pub(super) fn without<'a>(recording: &'a Recording, hums: &[Hum]) -> Cow<'a, Recording> {
    if hums.is_empty() {
        return Cow::Borrowed(recording);
    }
    let mut quiet = recording.clone();
    for (t, force) in quiet.wrench.time_s.iter().zip(&mut quiet.wrench.force_n) {
        let hum: Vec3 = hums.iter().map(|hum| hum.at(*t)).sum();
        *force = (Vec3::from(*force) - hum).into();
    }
    Cow::Owned(quiet)
}

/// Puts hums into a diagnosis of the recording without them.
pub(super) fn tell(diagnosis: &mut Diagnosis, hums: &[Hum]) {
    let Some(plainest) = hums.first() else { return };
    let mismatch = &mut diagnosis.mismatch;
    mismatch.detected = true;
    mismatch.p_value = mismatch.p_value.min(plainest.p_value);
    for channel in [Channel::ForceAlong, Channel::ForceAcross] {
        if !mismatch.channels.contains(&channel) {
            mismatch.channels.push(channel);
        }
    }
    if !mismatch.phases.contains(&Phase::Rest) {
        mismatch.phases.push(Phase::Rest);
    }
    mismatch.properties.extend(hums.iter().map(Hum::in_words));
    diagnosis.remarks.push("the hum was taken off before anything else was looked at".to_owned());
    let verdict = &mut diagnosis.verdict;
    if verdict.physics.is_empty() && !verdict.unexplained {
        verdict.unexplained = true;
        verdict.confidence = HEARD;
        diagnosis.next_poke = None;
    }
}

/// Confidence that a line stands for something that the catalogue does not list.
const HEARD: f64 = 0.95;

impl Hum {
    /// Force (N) at a time (s).
    fn at(&self, time_s: f64) -> Vec3 {
        let (sin, cos) = (TAU * self.frequency_hz * time_s).sin_cos();
        self.in_phase_n * cos + self.in_quadrature_n * sin
    }

    fn in_words(&self) -> String {
        let [x, y, z] =
            [0, 1, 2].map(|axis: usize| 1e3 * self.in_phase_n[axis].hypot(self.in_quadrature_n[axis]));
        format!(
            "the force sensor hums at {:.2} Hz by {x:.1}, {y:.1} and {z:.1} mN along x, y and z, also while nothing is touched",
            self.frequency_hz
        )
    }
}

/// Takes a constant and a slope in time off every axis.
fn straighten(rows: &mut [(f64, Vec3)]) {
    let n = rows.len() as f64;
    let middle = rows.iter().map(|(t, _)| t).sum::<f64>() / n;
    let mean = rows.iter().map(|(_, f)| f).sum::<Vec3>() / n;
    let spread: f64 = rows.iter().map(|(t, _)| (t - middle).powi(2)).sum();
    let slope = rows.iter().map(|(t, f)| f * (t - middle)).sum::<Vec3>() / spread.max(f64::MIN_POSITIVE);
    rows.iter_mut().for_each(|(t, f)| *f -= mean + slope * (*t - middle));
}

/// The plainest line, if chance does not make it.
fn plainest(rows: &[(f64, Vec3)]) -> Option<Hum> {
    let begin = rows.first()?.0;
    let seen = &rows[..rows.partition_point(|(t, _)| t - begin < LOOKED_AT_S)];
    if seen.len() < FEWEST {
        return None;
    }
    let span = seen[seen.len() - 1].0 - begin;
    let step_hz = 1.0 / (OVERSAMPLING * span);
    let mut apart: Vec<f64> = seen.windows(2).map(|w| w[1].0 - w[0].0).collect();
    apart.sort_by(f64::total_cmp);
    let fastest_hz = (0.5 / apart[apart.len() / 2]).min(FASTEST_HZ);
    let count = (fastest_hz / step_hz) as usize;
    let power = periodogram(seen, step_hz, count);
    let tried = count as f64 / OVERSAMPLING;
    let mut best: Option<(usize, f64)> = None;
    let first = (SLOWEST_HZ / step_hz).ceil() as usize;
    for i in first..count {
        let half = ((ROUND_ABOUT * i as f64 * step_hz).max(ROUND_ABOUT_HZ) / step_hz) as usize;
        // Beside a higher place a line is not at its frequency.
        if power[i] < power[i - 1] || power.get(i + 1).is_some_and(|next| power[i] < *next) {
            continue;
        }
        let mut round_about = power[i.saturating_sub(half).max(1)..(i + half).min(count)].to_vec();
        let middle = round_about.len() / 2;
        let median = *round_about.select_nth_unstable_by(middle, f64::total_cmp).1;
        let size = power[i] * MEDIAN / median.max(f64::MIN_POSITIVE);
        let p_value = tried * (-size).exp() * (1.0 + size + 0.5 * size * size);
        // Pauses repeat, and with them a line, less strongly, where the background may be lower.
        if p_value <= CHANCE && best.is_none_or(|(at, _)| power[i] > power[at]) {
            best = Some((i, p_value));
        }
    }
    let (at, p_value) = best?;
    let frequency_hz = followed(rows, at as f64 * step_hz, span);
    let [in_phase_n, in_quadrature_n] = amplitudes(rows, frequency_hz);
    Some(Hum { frequency_hz, p_value: p_value.max(f64::MIN_POSITIVE), in_phase_n, in_quadrature_n })
}

/// Sum over the axes of the squared Fourier sums at multiples of a frequency, per row.
fn periodogram(rows: &[(f64, Vec3)], step_hz: f64, count: usize) -> Vec<f64> {
    let begin = rows[0].0;
    let mut sums = vec![[Vec3::zeros(); 2]; count];
    for (t, f) in rows {
        // Turned on from one frequency to the next: a sine a row, not one a frequency.
        let (sin, cos) = (TAU * step_hz * (t - begin)).sin_cos();
        let mut phase = (1.0, 0.0);
        for [in_phase, in_quadrature] in &mut sums {
            *in_phase += f * phase.0;
            *in_quadrature += f * phase.1;
            phase = (phase.0 * cos - phase.1 * sin, phase.1 * cos + phase.0 * sin);
        }
    }
    let n = rows.len() as f64;
    sums.iter().map(|[c, s]| (c.norm_squared() + s.norm_squared()) / n).collect()
}

/// The frequency of most power near `frequency_hz`, over ever longer spans up to all of the recording.
fn followed(rows: &[(f64, Vec3)], mut frequency_hz: f64, mut span_s: f64) -> f64 {
    let begin = rows[0].0;
    let all = rows[rows.len() - 1].0 - begin;
    loop {
        let seen = &rows[..rows.partition_point(|(t, _)| t - begin <= span_s)];
        let power = |hz: f64| {
            let [c, s] = amplitudes(seen, hz);
            c.norm_squared() + s.norm_squared()
        };
        let mut step = 0.5 / (OVERSAMPLING * span_s);
        for _ in 0..BISECTIONS {
            let near = [frequency_hz - step, frequency_hz, frequency_hz + step];
            frequency_hz =
                near.into_iter().max_by(|a, b| power(*a).total_cmp(&power(*b))).unwrap_or(frequency_hz);
            step *= 0.5;
        }
        if span_s >= all {
            return frequency_hz;
        }
        span_s = (2.0 * span_s).min(all);
    }
}

/// Halvings of the step: to a thousandth of the resolution.
const BISECTIONS: usize = 10;

/// Least squares of a cosine and a sine.
fn amplitudes(rows: &[(f64, Vec3)], frequency_hz: f64) -> [Vec3; 2] {
    let (mut cc, mut cs, mut ss) = (0.0, 0.0, 0.0);
    let (mut c_f, mut s_f) = (Vec3::zeros(), Vec3::zeros());
    for (t, f) in rows {
        let (sin, cos) = (TAU * frequency_hz * t).sin_cos();
        cc += cos * cos;
        cs += cos * sin;
        ss += sin * sin;
        c_f += f * cos;
        s_f += f * sin;
    }
    let determinant = (cc * ss - cs * cs).max(f64::MIN_POSITIVE);
    [(c_f * ss - s_f * cs) / determinant, (s_f * cc - c_f * cs) / determinant]
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    const SD: f64 = 0.006;

    /// Rows at rest, one second of every six, of a sensor whose zero wanders and drifts and which hums along x and z.
    fn rest(seed: u64, wander: (f64, f64), rate: f64, hum: (f64, f64)) -> Vec<(f64, Vec3)> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let keep = (-0.02 / wander.1).exp();
        let mut zero = Vec3::from_fn(|_, _| wander.0 * normal());
        let mut rows = Vec::new();
        for i in 0..2_500 {
            let t = 0.02 * f64::from(i);
            zero = keep * zero + Vec3::from_fn(|_, _| (1.0 - keep * keep).sqrt() * wander.0 * normal());
            if i % 300 < 50 {
                let sine = hum.0 * (TAU * hum.1 * t + 0.7).sin();
                let noise = Vec3::from_fn(|_, _| SD * normal());
                rows.push((t, zero + noise + Vec3::y() * rate * t + Vec3::new(sine, 0.0, -sine)));
            }
        }
        straighten(&mut rows);
        rows
    }

    #[test]
    fn a_hum_is_heard_and_measured() {
        for (seed, hz) in [(1, 0.43), (2, 3.1), (3, 11.7), (4, 24.1)] {
            let hum = plainest(&rest(seed, (0.002, 5.0), 0.0, (0.004, hz))).expect("a line");
            assert!((hum.frequency_hz - hz).abs() < 2e-3, "{hz}: {}", hum.frequency_hz);
            let size = hum.in_phase_n.x.hypot(hum.in_quadrature_n.x);
            assert!((size - 0.004).abs() < 1.2e-3, "{hz}: {size}");
        }
    }

    /// A zero that wanders fast has more power at low frequencies than a hum has at its own.
    #[test]
    fn a_hum_is_heard_beside_a_zero_that_wanders_more() {
        for seed in 0..10 {
            let hum = plainest(&rest(seed, (0.02, 1.0), 0.0, (0.004, 11.7))).expect("a line");
            assert!((hum.frequency_hz - 11.7).abs() < 5e-3, "{}", hum.frequency_hz);
        }
    }

    /// Noise, a zero that wanders, fast or slowly, and one that drifts: of 240 recordings none hums.
    #[test]
    fn what_wanders_does_not_hum() {
        for (i, time_s) in [0.3, 1.0, 5.0, 20.0].into_iter().enumerate() {
            for seed in 0..30 {
                let seed = 100 * i as u64 + seed;
                for (wander, rate) in [(0.004, 0.0), (0.001, 3e-3)] {
                    let heard = plainest(&rest(seed, (wander, time_s), rate, (0.0, 1.0)));
                    assert_eq!(heard, None, "seed {seed}, {time_s} s");
                }
            }
        }
    }

    /// Beyond what is looked at first the frequency is followed: after ten minutes its phase is still right.
    #[test]
    fn a_long_hum_is_followed() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let hz = 7.123_45;
        let row = |i: usize| {
            let t = 0.02 * i as f64;
            (t, Vec3::from_fn(|_, _| SD * normal()) + Vec3::z() * 0.005 * (TAU * hz * t).cos())
        };
        let rows: Vec<(f64, Vec3)> = (0..30_000).filter(|i| i % 300 < 50).map(row).collect();
        let hum = plainest(&rows).expect("a line");
        assert!((hum.frequency_hz - hz).abs() < 1e-4, "{}", hum.frequency_hz);
        assert!((hum.at(590.0).z - 0.005 * (TAU * hz * 590.0).cos()).abs() < 1.5e-3);
    }
}
