//! Dead weights and readings → what the sensor reads under a wrench, with its uncertainty.
//!
//! r = b + ḃ (t − t̄) + b_T (T − T̄) + A w + e, for each of the six readings r: bias b, its drift with time and with temperature where the table tells
//! them, and A, a row of six sensitivities (three where all weights pull through the sensor's origin). The wrench of a weight m that pulls
//! along u on a line through l is w = (f u, l × f u), f = m g (1 − 1.2 / 8000): a weight's conventional mass is that against steel in air
//! (OIML R 111-1, 10.2.1).
//!
//! A correct sensor in the tool's axes has A = 1. On the diagonal stands the gain, beside it the cross-talk. The readings are put right by
//! w = C (r − b), C = A⁻¹. How the sensor's axes lie: the force block is A = ± P R by polar decomposition, P symmetric and positive, R the
//! rotation from the axes of the directions to those of the sensor. Why: a turn of the sensor and a skew cross-talk read alike; all that is
//! skew is taken for a turn.
//!
//! Errors: noise of the readings, of a size that the residuals show; and what several rows share, of sizes that [`Known`] states: directions,
//! levers, each weight, and the scale of them all with gravity. `least_squares` puts them together.

use super::outlier::{Judged, Misfit, misfits};
use super::{COMPONENTS, Hold, Weights};
use crate::calib::coverage::half_90;
use crate::calib::instruments::least_squares::{Estimate, generalised};
use crate::calib::instruments::{InstrumentError, doubt};
use crate::geometry::{Mat3, Vec3};
use nalgebra::{DMatrix, DVector, SMatrix};
use std::path::Path;

/// Air's share of a weight that is calibrated against steel of 8000 kg/m³: density 1.2 kg/m³ (OIML R 111-1).
const BUOYANCY: f64 = 1.2 / 8000.0;
/// A combination that the rows vary less than this share of the most varied one is not told.
const VARIED: f64 = 1e-3;
/// Times that the shared causes are worked out anew with the sensitivities found.
const ROUNDS: usize = 3;

/// What is known of the weights and their places. Standard deviations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Known {
    /// Gravity at the bench (m/s²).
    pub gravity_m_s2: f64,
    /// Of each weight, over its mass.
    pub mass_share: f64,
    /// Of all weights together with gravity, over their size.
    pub scale_share: f64,
    /// Of each direction, about each axis (rad).
    pub direction_rad: f64,
    /// Of each lever, along each axis (m).
    pub lever_m: f64,
}

impl Default for Known {
    /// Normal gravity (CGPM 1901), weights of class M2 up to some 100 g (OIML R 111-1: 1.6 × 10⁻⁴ at 100 g, taken for two deviations and a
    /// half), gravity anywhere between the poles (± 0.15 %), a spirit level and a ruler.
    fn default() -> Self {
        Self {
            gravity_m_s2: 9.806_65,
            mass_share: 1e-4,
            scale_share: 1.5e-3,
            direction_rad: 2e-3,
            lever_m: 2e-4,
        }
    }
}

/// What was found. Rows of matrices: readings; columns: wrench.
#[derive(Debug, Clone, PartialEq)]
pub struct ForceFound {
    /// Rows used.
    pub rows: usize,
    /// Components of the wrench that were told: 6, or 3 where all weights pull through the sensor's origin.
    pub told: usize,
    /// Reading without load (N, N·m).
    pub bias: [f64; 6],
    /// Standard deviation of that.
    pub bias_sd: [f64; 6],
    /// Bias per second, where the table tells the time.
    pub per_second: Option<[[f64; 2]; 6]>,
    /// Bias per kelvin, where the table tells the temperature.
    pub per_kelvin: Option<[[f64; 2]; 6]>,
    /// Sensitivities A; columns that were not told are those of the unit matrix.
    pub sensitivity: [[f64; 6]; 6],
    /// Standard deviations of that; 0 in columns that were not told.
    pub sensitivity_sd: [[f64; 6]; 6],
    /// C = A⁻¹, which puts readings right.
    pub correction: [[f64; 6]; 6],
    /// Standard deviations of that.
    pub correction_sd: [[f64; 6]; 6],
    /// Noise of one row (N, N·m).
    pub noise: [f64; 6],
    /// Half of a 90 % interval over its standard deviation.
    pub half_90: f64,
    /// Whether it reads what pulls at the tool; else the opposite.
    pub reads_pull: bool,
    /// Rotation from the axes of the directions to those of the sensor, by rows.
    pub rotation: [[f64; 3]; 3],
    /// The same as an axis times an angle (rad).
    pub turn_rad: [f64; 3],
    /// Standard deviations of that.
    pub turn_sd_rad: [f64; 3],
    /// Reading less model, a row each.
    pub residuals: Vec<[f64; 6]>,
    /// Largest force (N) and moment (N·m) that was hung.
    pub range: [f64; 2],
    /// Rows that the others contradict, worst first. They are kept.
    pub misfits: Vec<Misfit>,
}

impl ForceFound {
    /// What speaks against the whole, as sentences: gains that no sensor has, with the unit that explains them.
    pub fn doubts(&self) -> Vec<String> {
        doubt::of_sensitivities(&self.sensitivity, self.told)
    }
}

/// The wrench of a weight.
pub(super) fn wrench(hold: &Hold, known: &Known) -> [f64; 6] {
    let force = hold.direction * (hold.mass_kg * known.gravity_m_s2 * (1.0 - BUOYANCY));
    let moment = hold.lever_m.cross(&force);
    [force.x, force.y, force.z, moment.x, moment.y, moment.z]
}

/// Columns of the design with their names.
struct Design {
    x: DMatrix<f64>,
    /// Where the columns of the wrench begin.
    first: usize,
    told: usize,
    time: Option<usize>,
    warmth: Option<usize>,
}

/// Calibrates.
///
/// # Errors
/// [`InstrumentError`]: rows that leave something open, sensitivities that cannot be inverted.
pub fn calibrate_force(weights: &Weights, known: &Known) -> Result<ForceFound, InstrumentError> {
    let holds = &weights.holds;
    let wrenches: Vec<[f64; 6]> = holds.iter().map(|hold| wrench(hold, known)).collect();
    let design = design(&weights.file, holds, &wrenches)?;
    let n = holds.len();
    let singular = |what| InstrumentError::Singular { file: weights.file.clone(), what };
    let reading = |c: usize| DVector::from_iterator(n, holds.iter().map(|hold| hold.reading[c]));
    let mut channels: Vec<Estimate> = (0..6)
        .map(|c| generalised(&design.x, &reading(c), &[]))
        .collect::<Option<_>>()
        .ok_or_else(|| singular("the rows do not determine the readings"))?;
    let plain = channels.clone();
    for _ in 0..ROUNDS {
        let a = sensitivities(&channels, &design);
        channels = (0..6)
            .map(|c| generalised(&design.x, &reading(c), &shared(holds, &wrenches, known, &a.row(c).into())))
            .collect::<Option<_>>()
            .ok_or_else(|| singular("the rows do not determine the readings"))?;
    }
    let a = sensitivities(&plain, &design);
    let (x, first) = (&design.x, design.first);
    let misfits = misfits(&Judged { holds, wrenches: &wrenches, known, x, first, a: &a });
    found(weights, &design, &channels, misfits, &wrenches)
        .ok_or_else(|| singular("the sensitivities cannot be inverted: a reading that answers to nothing"))
}

fn design(file: &Path, holds: &[Hold], wrenches: &[[f64; 6]]) -> Result<Design, InstrumentError> {
    let n = holds.len();
    let largest = |range: std::ops::Range<usize>| {
        wrenches.iter().flat_map(|w| w[range.clone()].to_vec()).fold(0.0, |m: f64, x| m.max(x.abs()))
    };
    let told = if largest(3..6) > 1e-9 * largest(0..3) { 6 } else { 3 };
    let mut columns: Vec<(String, Vec<f64>)> = Vec::new();
    let varied = |values: Option<Vec<f64>>| values.filter(|v| v.iter().any(|x| x != &v[0]));
    let mut extra = |name: &str, values: Option<Vec<f64>>| {
        let values = varied(values)?;
        let mean = values.iter().sum::<f64>() / n as f64;
        columns.push((name.to_owned(), values.iter().map(|v| v - mean).collect()));
        Some(columns.len())
    };
    let time = extra("the drift with time", holds.iter().map(|hold| hold.time_s).collect());
    let warmth = extra("the drift with temperature", holds.iter().map(|hold| hold.temperature_c).collect());
    let first = columns.len() + 1;
    for (component, name) in COMPONENTS.iter().enumerate().take(told) {
        columns.push(((*name).to_owned(), wrenches.iter().map(|w| w[component]).collect()));
    }
    let x = DMatrix::from_fn(n, columns.len() + 1, |i, j| if j == 0 { 1.0 } else { columns[j - 1].1[i] });
    let parts = untold(&columns, first - 1, n);
    if !parts.is_empty() || n <= columns.len() + 1 {
        let parts = if parts.is_empty() {
            vec![format!("all of {} unknowns a reading and of their errors", columns.len() + 1)]
        } else {
            parts
        };
        return Err(InstrumentError::Unobservable { file: file.to_owned(), rows: n, parts });
    }
    Ok(Design { x, first, told, time, warmth })
}

/// Combinations of the columns that the rows do not vary, in words. Forces share one scale and moments another, so that a direction in
/// which nothing pulled is seen as what it is.
fn untold(columns: &[(String, Vec<f64>)], first: usize, n: usize) -> Vec<String> {
    let centred = |values: &[f64]| {
        let mean = values.iter().sum::<f64>() / n as f64;
        values.iter().map(|v| v - mean).collect::<Vec<_>>()
    };
    let columns: Vec<(&str, Vec<f64>)> =
        columns.iter().map(|(name, values)| (name.as_str(), centred(values))).collect();
    let norm = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>().sqrt();
    let scale = |range: std::ops::Range<usize>| {
        columns.get(range).map_or(0.0, |c| c.iter().map(|(_, v)| norm(v)).fold(0.0, f64::max))
    };
    let (force, moment) = (scale(first..first + 3), scale(first + 3..first + 6));
    let of = |j: usize| match j.checked_sub(first) {
        None => norm(&columns[j].1),
        Some(0..=2) => force,
        Some(_) => moment,
    };
    let positive = |s: f64| if s > 0.0 { s } else { 1.0 };
    let scaled = DMatrix::from_fn(n, columns.len(), |i, j| columns[j].1[i] / positive(of(j)));
    let eigen = (scaled.transpose() * &scaled).symmetric_eigen();
    let most = eigen.eigenvalues.max();
    let mut parts = Vec::new();
    for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if *value > VARIED * VARIED * most {
            continue;
        }
        let lead = vector[vector.icamax()].signum();
        let terms: Vec<String> = (vector.iter().zip(&columns))
            .filter(|(share, _)| share.abs() > 0.05)
            .map(|(share, (name, _))| {
                let share = share * lead;
                if share > 0.995 { (*name).to_owned() } else { format!("{share:+.2} {name}") }
            })
            .collect();
        parts.push(terms.join(" "));
    }
    parts
}

/// The sensitivities of all readings, a row each.
fn sensitivities(channels: &[Estimate], design: &Design) -> SMatrix<f64, 6, 6> {
    SMatrix::from_fn(|c, j| {
        if j < design.told { channels[c].beta[design.first + j] } else { f64::from(u8::from(c == j)) }
    })
}

/// What rows share, for a reading with the sensitivities `a`: each vector is a cause of one standard deviation.
pub(super) fn shared(
    holds: &[Hold],
    wrenches: &[[f64; 6]],
    known: &Known,
    a: &SMatrix<f64, 1, 6>,
) -> Vec<DVector<f64>> {
    let n = holds.len();
    let answer =
        |force: Vec3, moment: Vec3| (0..3).map(|k| a[k] * force[k] + a[3 + k] * moment[k]).sum::<f64>();
    let parts = |i: usize| {
        let w = wrenches[i];
        (Vec3::new(w[0], w[1], w[2]), Vec3::new(w[3], w[4], w[5]))
    };
    let mut causes = Vec::new();
    let mut cause = |sd: f64, effect: &dyn Fn(usize) -> f64| {
        let vector = DVector::from_fn(n, |i, _| sd * effect(i));
        if vector.iter().any(|x| *x != 0.0) {
            causes.push(vector);
        }
    };
    cause(known.scale_share, &|i| answer(parts(i).0, parts(i).1));
    let mut masses: Vec<f64> = holds.iter().map(|h| h.mass_kg).filter(|m| *m > 0.0).collect();
    masses.sort_by(f64::total_cmp);
    masses.dedup();
    for mass in masses {
        cause(known.mass_share, &|i| {
            if holds[i].mass_kg == mass { answer(parts(i).0, parts(i).1) } else { 0.0 }
        });
    }
    let mut places: Vec<(Vec3, Vec3)> = Vec::new();
    for hold in holds {
        let place = (hold.direction, hold.lever_m);
        if hold.mass_kg > 0.0 && !places.contains(&place) {
            places.push(place);
        }
    }
    for place in places {
        let here = |i: usize| (holds[i].direction, holds[i].lever_m) == place;
        for axis in 0..3 {
            let e = Vec3::ith(axis, 1.0);
            // The string turns about the point that it is tied to.
            cause(known.direction_rad, &|i| {
                let turned = e.cross(&parts(i).0);
                if here(i) { answer(turned, place.1.cross(&turned)) } else { 0.0 }
            });
            cause(known.lever_m, &|i| {
                if here(i) { answer(Vec3::zeros(), e.cross(&parts(i).0)) } else { 0.0 }
            });
        }
    }
    causes
}

fn found(
    weights: &Weights,
    design: &Design,
    channels: &[Estimate],
    misfits: Vec<Misfit>,
    wrenches: &[[f64; 6]],
) -> Option<ForceFound> {
    let a = sensitivities(channels, design);
    let c = a.try_inverse()?;
    let first = design.first;
    let covariance = |channel: usize, i: usize, j: usize| {
        let told = i < design.told && j < design.told;
        if told { channels[channel].covariance[(first + i, first + j)] } else { 0.0 }
    };
    let deviation = |channel: usize, k: usize| channels[channel].covariance[(k, k)].sqrt();
    // dC = −C dA C, the readings' errors taken for independent of each other.
    let correction_sd = |i: usize, j: usize| {
        let of = |channel: usize| -> f64 {
            let inner: f64 = (0..6)
                .map(|k| (0..6).map(|l| c[(k, j)] * covariance(channel, k, l) * c[(l, j)]).sum::<f64>())
                .sum();
            c[(i, channel)].powi(2) * inner
        };
        (0..6).map(of).sum::<f64>().sqrt()
    };
    let block = Mat3::from_fn(|i, j| a[(i, j)]);
    let reads_pull = block.determinant() > 0.0;
    let svd = (block * if reads_pull { 1.0 } else { -1.0 }).svd(true, true);
    let rotation = svd.u? * svd.v_t?;
    let turn = nalgebra::Rotation3::from_matrix_unchecked(rotation).scaled_axis();
    // A small turn about axis k is the skew part of the block, (A_ij − A_ji) / 2.
    let turn_sd = |k: usize| {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        0.5 * (covariance(i, j, j) + covariance(j, i, i)).sqrt()
    };
    let trend = |column: Option<usize>| {
        column.map(|k| std::array::from_fn(|channel| [channels[channel].beta[k], deviation(channel, k)]))
    };
    let size = |from: usize| {
        let norm = |w: &[f64; 6]| Vec3::new(w[from], w[from + 1], w[from + 2]).norm();
        wrenches.iter().map(norm).fold(0.0, f64::max)
    };
    let rows = weights.holds.len();
    Some(ForceFound {
        rows,
        told: design.told,
        bias: std::array::from_fn(|k| channels[k].beta[0]),
        bias_sd: std::array::from_fn(|k| deviation(k, 0)),
        per_second: trend(design.time),
        per_kelvin: trend(design.warmth),
        sensitivity: std::array::from_fn(|i| std::array::from_fn(|j| a[(i, j)])),
        sensitivity_sd: std::array::from_fn(|i| std::array::from_fn(|j| covariance(i, j, j).sqrt())),
        correction: std::array::from_fn(|i| std::array::from_fn(|j| c[(i, j)])),
        correction_sd: std::array::from_fn(|i| std::array::from_fn(|j| correction_sd(i, j))),
        noise: std::array::from_fn(|k| channels[k].noise),
        half_90: half_90((rows - design.x.ncols()) as f64),
        reads_pull,
        rotation: std::array::from_fn(|i| std::array::from_fn(|j| rotation[(i, j)])),
        turn_rad: turn.into(),
        turn_sd_rad: std::array::from_fn(turn_sd),
        residuals: (0..rows).map(|i| std::array::from_fn(|k| channels[k].residuals[i])).collect(),
        range: [size(0), size(3)],
        misfits,
    })
}
