//! What the stage, the force sensor and the camera report of what happened.

use super::draw::{Draw, Instruments, Wander};
use super::hex_mesh::Slab;
use super::load_path::LoadPath;
use super::seed::{Use, stream};
use super::timeline::Timeline;
use crate::observation::{MarkerRow, Markers, Stage, Wrench};
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};

/// Digits after the decimal point that each instrument reports: force 10 µN, torque and length 0.1 µN·m and
/// 0.1 µm.
pub(super) const FORCE_DIGITS: i32 = 5;
pub(super) const TORQUE_DIGITS: i32 = 7;
pub(super) const LENGTH_DIGITS: i32 = 7;

/// A tip hides markers within this share of its radius.
pub(super) const SHADOW: f64 = 1.0;

/// A value as an instrument of so many decimals shows it.
pub(super) fn rounded(value: f64, digits: i32) -> f64 {
    let scale = 10_f64.powi(digits);
    // Adding zero turns −0 into 0.
    (value * scale).round() / scale + 0.0
}

pub(super) fn normal(rng: &mut impl Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// Times of an instrument's rows (s): every whole number of periods from zero to `end_s`.
pub(super) fn row_times(rate_hz: f64, end_s: f64) -> Vec<f64> {
    (0..).map(|i| f64::from(i) / rate_hz).take_while(|&t| t <= end_s + 1e-9).collect()
}

/// Three channels of a process that wanders with standard deviation one.
pub(super) struct Wanderer {
    value: [f64; 3],
    keep: f64,
}

impl Wanderer {
    /// Starts in the stationary distribution; `step_s` between rows.
    pub(super) fn new(wander: &Wander, step_s: f64, rng: &mut impl Rng) -> Self {
        Self { value: std::array::from_fn(|_| normal(rng)), keep: (-step_s / wander.time_s).exp() }
    }

    pub(super) fn step(&mut self, rng: &mut impl Rng) -> [f64; 3] {
        let fresh = (1.0 - self.keep * self.keep).sqrt();
        self.value = self.value.map(|v| self.keep * v + fresh * normal(rng));
        self.value
    }
}

/// Rows of the stage: the displacement of the tip, zero between pokes.
pub(super) fn stage(seed: u64, instruments: &Instruments, timeline: &Timeline) -> Stage {
    let mut rng = stream(seed, Use::Stage);
    let noise = instruments.noise.stage_m;
    let time_s = row_times(instruments.sensor_rate_hz, timeline.end_s);
    let rows = time_s.iter().map(|&t| {
        let (direction, depth) = match timeline.at(t) {
            Some((poke, depth)) => (timeline.pokes[poke].plan.direction, depth),
            None => ([0.0; 3], 0.0),
        };
        std::array::from_fn(|c| rounded(direction[c] * depth + noise[c] * normal(&mut rng), LENGTH_DIGITS))
    });
    let displacement_m = rows.collect();
    Stage { time_s, displacement_m }
}

/// Rows of the force sensor. A pad's traction is uniform, so its moment about the tip's centre is nothing but
/// noise.
pub(super) fn wrench(draw: &Draw, timeline: &Timeline, paths: &[LoadPath]) -> Wrench {
    let mut rng = stream(draw.seed, Use::Wrench);
    let instruments = &draw.instruments;
    let mut wanderer = instruments
        .wander
        .map(|w| (w.force_n, Wanderer::new(&w, 1.0 / instruments.sensor_rate_hz, &mut rng)));
    let mut wrench =
        Wrench { time_s: row_times(instruments.sensor_rate_hz, timeline.end_s), ..Wrench::default() };
    for &t in &wrench.time_s {
        let force = timeline.at(t).map_or([0.0; 3], |(poke, depth)| paths[poke].force(depth));
        let offset = wanderer.as_mut().map_or([0.0; 3], |(sd, w)| w.step(&mut rng).map(|x| x * *sd));
        wrench.force_n.push(std::array::from_fn(|c| {
            rounded(force[c] + offset[c] + instruments.noise.force_n[c] * normal(&mut rng), FORCE_DIGITS)
        }));
        wrench.torque_nm.push(std::array::from_fn(|c| {
            rounded(instruments.noise.torque_nm[c] * normal(&mut rng), TORQUE_DIGITS)
        }));
    }
    wrench
}

/// Markers of a draw (m).
pub(super) fn marker_sites(draw: &Draw) -> Vec<[f64; 3]> {
    scattered_sites(&draw.slab, draw.instruments.marker_spacing_m, draw.seed)
}

/// Markers on the top: a grid shaken so that no marker stands in a row with others (m).
pub(super) fn scattered_sites(slab: &Slab, spacing_m: f64, seed: u64) -> Vec<[f64; 3]> {
    let mut rng = stream(seed, Use::MarkerSites);
    let [length, width, height] = slab.size_m;
    let count = [length, width].map(|l| (l / spacing_m).round().max(1.0));
    let mut sites = Vec::with_capacity((count[0] * count[1]) as usize);
    for j in 0..count[1] as usize {
        for i in 0..count[0] as usize {
            let mut shaken = |cell: usize, count: f64, length: f64| {
                (cell as f64 + 0.5 + rng.random_range(-0.25..0.25)) * length / count
            };
            sites.push([shaken(i, count[0], length), shaken(j, count[1], width), height]);
        }
    }
    sites
}

/// Rows of the camera. Markers under a tip in contact are hidden; others are lost now and then.
pub(super) fn markers(draw: &Draw, timeline: &Timeline, paths: &[LoadPath], sites: &[[f64; 3]]) -> Markers {
    let mut rng = stream(draw.seed, Use::Camera);
    let instruments = &draw.instruments;
    let mut wanderer = instruments
        .wander
        .map(|w| (w.marker_m, Wanderer::new(&w, 1.0 / instruments.frame_rate_hz, &mut rng)));
    let frame_time_s = row_times(instruments.frame_rate_hz, timeline.end_s);
    let mut rows = Vec::with_capacity(frame_time_s.len() * sites.len());
    for (frame, &t) in (0..).zip(&frame_time_s) {
        let state = timeline.at(t);
        let offset = wanderer.as_mut().map_or([0.0; 3], |(sd, w)| w.step(&mut rng).map(|x| x * *sd));
        for (marker, site) in (0..).zip(sites) {
            let error: [f64; 3] =
                std::array::from_fn(|c| offset[c] + instruments.noise.marker_m[c] * normal(&mut rng));
            let lost = rng.random_bool(instruments.lost_share);
            let hidden = state.is_some_and(|(poke, _)| {
                let plan = &timeline.pokes[poke].plan;
                let apart = (0..3).map(|c| (site[c] - plan.site_m[c]).powi(2)).sum::<f64>().sqrt();
                apart < SHADOW * plan.radius_m
            });
            if lost || hidden {
                continue;
            }
            let moved = state.map_or([0.0; 3], |(poke, depth)| paths[poke].watched(depth, marker as usize));
            let position_m = std::array::from_fn(|c| rounded(site[c] + moved[c] + error[c], LENGTH_DIGITS));
            rows.push(MarkerRow { frame, marker, position_m });
        }
    }
    Markers { numbers: (1..=sites.len() as u32).collect(), frame_time_s, rows }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Unit variance, and a correlation of 1/e after `time_s`: over 2000 such times the estimates have standard
    /// deviations of about √(1/2000) and √(0.86/2000).
    #[test]
    fn a_wandering_error_has_its_size_and_its_memory() {
        let wander = Wander { force_n: 1.0, marker_m: 1.0, time_s: 5.0 };
        let mut rng = stream(1, Use::Wrench);
        let mut wanderer = Wanderer::new(&wander, 0.1, &mut rng);
        let values: Vec<f64> = (0..100_000).map(|_| wanderer.step(&mut rng)[0]).collect();
        let product = |lag: usize| {
            values.iter().zip(&values[lag..]).map(|(a, b)| a * b).sum::<f64>() / (values.len() - lag) as f64
        };
        assert!((product(0) - 1.0).abs() < 0.12, "variance {}", product(0));
        let memory = product(50) / product(0);
        assert!((memory - (-1.0_f64).exp()).abs() < 0.1, "correlation {memory}");
    }

    #[test]
    fn instruments_show_decimals() {
        assert_eq!(rounded(0.012_345_678, FORCE_DIGITS), 0.01235);
        assert!(rounded(-1e-9, FORCE_DIGITS).is_sign_positive());
    }
}
