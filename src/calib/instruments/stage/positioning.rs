//! How well does an axis go where it is sent? The figures of ISO 230-2:2014, clauses 2 and 8, and scale and backlash from the same runs.
//!
//! x_ij↑ is the deviation at target i in run j, approached from below, x_ij↓ from above; n runs. For each target and side, x̄ is the mean of the runs
//! and s their standard deviation (n − 1). With the means of both sides at a target, x̄_i = ½ (x̄_i↑ + x̄_i↓), and their difference
//! B_i = x̄_i↑ − x̄_i↓:
//!
//! | | what | formula |
//! | --- | --- | --- |
//! | B | reversal value | largest size of B_i |
//! | R | repeatability from both sides | largest of 2 s_i↑ + 2 s_i↓ + size of B_i, 4 s_i↑, 4 s_i↓ |
//! | E | systematic deviation from both sides | largest less least of all x̄_i↑, x̄_i↓ |
//! | M | mean deviation from both sides | largest less least of x̄_i |
//! | A | accuracy from both sides | largest of x̄ + 2 s less least of x̄ − 2 s, over all targets and sides |
//!
//! **Scale**: slope of x̄_i over the target, by least squares over the targets; its deviation is what the targets scatter about the line, screw
//! errors and all, and the gauge's own scale. **Backlash**: mean of −B_i, with the scatter of that: a stage that lags behind stops short, from
//! both sides.
//!
//! Deviations of A, R, E, M, B: 400 repetitions of the same runs, with the means and the scatter found (parametric bootstrap, fixed seed).
//!
//! Tests: `tests/calibration/stage.rs`, against a stage of known faults and by figures worked out by hand.

use super::{Approach, StageReading, StageRuns};
use crate::calib::coverage::{Z95, half_90};
use crate::calib::instruments::least_squares::generalised;
use crate::calib::instruments::{InstrumentError, doubt};
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use statrs::distribution::{ContinuousCDF, StudentsT};

const REPETITIONS: usize = 400;
const SEED: u64 = 230;
/// Chance that a sound table has a row that is named.
const CHANCE: f64 = 0.01;

/// A figure with its standard deviation (m, or 1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Uncertain {
    /// The figure.
    pub value: f64,
    /// Its standard deviation.
    pub sd: f64,
    /// Half of its 90 % interval.
    pub half_90: f64,
}

/// What the runs say of one target (m).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct At {
    /// Where it was sent.
    pub target_m: f64,
    /// Mean deviation, from below and from above.
    pub mean_m: [f64; 2],
    /// Standard deviation of a run, from below and from above.
    pub sd_m: [f64; 2],
}

/// A row that the other runs contradict.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strange {
    /// Its line in the table.
    pub line: u64,
    /// How far off the other runs (m).
    pub off_m: f64,
    /// The same over its standard deviation.
    pub sigmas: f64,
}

/// The figures of an axis (m).
#[derive(Debug, Clone, PartialEq)]
pub struct Positioning {
    /// Name of the axis.
    pub axis: String,
    /// How many runs there were.
    pub runs: usize,
    /// Each target.
    pub at: Vec<At>,
    /// A, R, B, E, M, in this order.
    pub iso: [Uncertain; 5],
    /// Way made over way asked for, less one.
    pub scale: Uncertain,
    /// How far it stays behind when it turns round.
    pub backlash: Uncertain,
    /// Root mean square of what runs scatter.
    pub scatter_m: f64,
    /// Rows that the other runs contradict. They are kept.
    pub strange: Vec<Strange>,
}

impl Positioning {
    /// What speaks against the whole, as sentences: a way that no stage makes, with the unit that explains it, or a travel that none has.
    pub fn doubts(&self) -> Vec<String> {
        let target = |at: Option<&At>| at.map_or(0.0, |at| at.target_m);
        let range_m = [target(self.at.first()), target(self.at.last())];
        let doubts =
            [doubt::of_scale(&self.axis, 1.0 + self.scale.value), doubt::of_travel(&self.axis, range_m)];
        doubts.into_iter().flatten().collect()
    }
}

/// Names of [`Positioning::iso`].
pub const ISO: [&str; 5] = ["A", "R", "B", "E", "M"];

/// The figures of one axis. `gauge_share`: standard deviation of the gauge's scale.
///
/// # Errors
/// [`InstrumentError::Singular`]: targets that span nothing.
pub fn positioning(runs: &StageRuns, gauge_share: f64) -> Result<Positioning, InstrumentError> {
    let targets = runs.targets();
    let cell = |target: f64, approach| -> Vec<&StageReading> {
        runs.rows.iter().filter(|row| row.target_m == target && row.approach == approach).collect()
    };
    let at: Vec<At> = targets
        .iter()
        .map(|&target_m| {
            let sides = [Approach::Up, Approach::Down].map(|approach| {
                let deviations: Vec<f64> =
                    cell(target_m, approach).iter().map(|row| row.reading_m - row.target_m).collect();
                moments(&deviations)
            });
            At { target_m, mean_m: sides.map(|s| s.0), sd_m: sides.map(|s| s.1) }
        })
        .collect();
    let (m, n) = (at.len(), runs.rows.len() / (2 * at.len()));
    let scatter_m = pooled(&at);
    let x = DMatrix::from_fn(m, 2, |i, j| if j == 0 { 1.0 } else { at[i].target_m });
    let middle = DVector::from_iterator(m, at.iter().map(|a| 0.5 * (a.mean_m[0] + a.mean_m[1])));
    let line = generalised(&x, &middle, &[]).ok_or_else(|| InstrumentError::Singular {
        file: runs.file.clone(),
        what: "the targets span no way",
    })?;
    let own = line.covariance[(1, 1)].sqrt();
    let gauge_90 = Z95 * gauge_share;
    let scale = Uncertain {
        value: line.beta[1],
        sd: own.hypot(gauge_share),
        half_90: (half_90((m - 2) as f64) * own).hypot(gauge_90),
    };
    let behind: Vec<f64> = at.iter().map(|a| a.mean_m[1] - a.mean_m[0]).collect();
    let (value, spread) = moments(&behind);
    let sd = spread / (m as f64).sqrt();
    let backlash = Uncertain { value, sd, half_90: half_90((m - 1) as f64) * sd };
    Ok(Positioning {
        axis: runs.axis.clone(),
        runs: n,
        iso: uncertain_iso(&at, n),
        at,
        scale,
        backlash,
        scatter_m,
        strange: strange(runs, &targets, n),
    })
}

fn moments(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let sum: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    (mean, (sum / (n - 1.0).max(1.0)).sqrt())
}

fn pooled(at: &[At]) -> f64 {
    let squares: f64 = at.iter().flat_map(|a| a.sd_m).map(|s| s * s).sum();
    (squares / (2 * at.len()) as f64).sqrt()
}

/// A, R, B, E, M.
pub(super) fn iso(at: &[At]) -> [f64; 5] {
    let range = |values: &dyn Fn(&At) -> [f64; 2]| {
        let all = at.iter().flat_map(values);
        let (low, high) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        high - low
    };
    let most = |value: &dyn Fn(&At) -> f64| at.iter().map(value).fold(0.0, f64::max);
    let reversal = |a: &At| (a.mean_m[0] - a.mean_m[1]).abs();
    let high = at.iter().flat_map(|a| [0, 1].map(|k| a.mean_m[k] + 2.0 * a.sd_m[k])).fold(f64::MIN, f64::max);
    let low = at.iter().flat_map(|a| [0, 1].map(|k| a.mean_m[k] - 2.0 * a.sd_m[k])).fold(f64::MAX, f64::min);
    [
        high - low,
        most(&|a| {
            let [up, down] = a.sd_m;
            (2.0 * up + 2.0 * down + reversal(a)).max(4.0 * up).max(4.0 * down)
        }),
        most(&reversal),
        range(&|a| a.mean_m),
        range(&|a| [0.5 * (a.mean_m[0] + a.mean_m[1]); 2]),
    ]
}

fn uncertain_iso(at: &[At], n: usize) -> [Uncertain; 5] {
    let found = iso(at);
    let scatter = pooled(at);
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    let mut again: [Vec<f64>; 5] = [const { Vec::new() }; 5];
    for _ in 0..REPETITIONS {
        let drawn: Vec<At> = at
            .iter()
            .map(|a| {
                let sides = a.mean_m.map(|mean| {
                    let run = |_| -> f64 {
                        mean + scatter
                            * <StandardNormal as Distribution<f64>>::sample(&StandardNormal, &mut random)
                    };
                    moments(&(0..n).map(run).collect::<Vec<f64>>())
                });
                At { target_m: a.target_m, mean_m: sides.map(|s| s.0), sd_m: sides.map(|s| s.1) }
            })
            .collect();
        for (list, value) in again.iter_mut().zip(iso(&drawn)) {
            list.push(value);
        }
    }
    std::array::from_fn(|k| {
        let sd = moments(&again[k]).1;
        Uncertain { value: found[k], sd, half_90: Z95 * sd }
    })
}

/// Rows that are farther from the other runs than all the scatter explains, worst first.
fn strange(runs: &StageRuns, targets: &[f64], n: usize) -> Vec<Strange> {
    if n < 3 {
        return Vec::new();
    }
    let cells: Vec<Vec<&StageReading>> = targets
        .iter()
        .flat_map(|&t| [Approach::Up, Approach::Down].map(|a| (t, a)))
        .map(|(t, a)| runs.rows.iter().filter(|row| row.target_m == t && row.approach == a).collect())
        .collect();
    let count = runs.rows.len() as f64;
    let freedom = count - cells.len() as f64 - 1.0;
    let sum: f64 = cells
        .iter()
        .map(|cell| moments(&cell.iter().map(|r| r.reading_m).collect::<Vec<_>>()).1.powi(2) * (n - 1) as f64)
        .sum();
    let Ok(student) = StudentsT::new(0.0, 1.0, freedom.max(1.0)) else { return Vec::new() };
    let mut named = Vec::new();
    for row in cells.iter().flatten() {
        let others: Vec<f64> = runs
            .rows
            .iter()
            .filter(|o| o.target_m == row.target_m && o.approach == row.approach && o.line != row.line)
            .map(|o| o.reading_m)
            .collect();
        let k = others.len() as f64;
        let off_m = row.reading_m - others.iter().sum::<f64>() / k;
        // Without the row its cell loses off² k / (k + 1).
        let without = (sum - off_m * off_m * k / (k + 1.0)).max(1e-12 * sum);
        let sigmas = off_m.abs() / (without / freedom.max(1.0) * (k + 1.0) / k).sqrt();
        if sigmas.is_finite() && 2.0 * student.sf(sigmas) * count < CHANCE {
            named.push(Strange { line: row.line, off_m, sigmas });
        }
    }
    named.sort_by(|a, b| b.sigmas.total_cmp(&a.sigmas));
    named
}
