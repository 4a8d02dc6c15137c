//! How does the sensor's zero wander, by itself and with its temperature?
//!
//! A log of readings without load. Two views of it, each for every reading:
//!
//! - **Trend.** r = a + ḃ t + b_T T by least squares on the means of up to 24 stretches of the log, which are nearly independent where single
//!   readings are not. p by Student's t, two-sided, times the number of trends that are looked at (Bonferroni). What moves a reading by less
//!   than one step of its numbers over the whole log is no trend: a log cannot tell it.
//! - **Allan deviation** (Allan 1966; IEEE Std 952, annex C): σ²(τ) = ½ ⟨(r̄ₖ₊₁ − r̄ₖ)²⟩ of means over successive spans τ. White noise falls like
//!   1/√τ; where σ stops falling, a longer mean tells no more, and a zero older than that is worth no more than σ there.

use super::COMPONENTS;
use crate::calib::instruments::InstrumentError;
use crate::calib::instruments::least_squares::generalised;
use crate::calib::instruments::sheet::{FORCE, Sheet, TEMPERATURE, TIME, TORQUE};
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, StudentsT};
use std::path::{Path, PathBuf};

/// Stretches at most.
const STRETCHES: usize = 24;
/// Rows at least.
const FEWEST: usize = 12;
/// Chance that a log without trends is said to have one.
const CHANCE: f64 = 0.01;
/// Time and temperature that go together so closely are one.
const TOGETHER: f64 = 0.98;
/// Share of the greatest reading below which a difference comes from rounding.
const ROUNDING: f64 = 1e-12;
/// Pairs of spans below which an Allan deviation says too little.
const PAIRS: usize = 3;

/// Readings without load. SI, degrees Celsius.
#[derive(Debug, Clone, PartialEq)]
pub struct DriftLog {
    /// Its file.
    pub file: PathBuf,
    /// When (s).
    pub time_s: Vec<f64>,
    /// How warm the sensor was (°C), where the log tells.
    pub temperature_c: Option<Vec<f64>>,
    /// What it read (N, N·m).
    pub readings: Vec<[f64; 6]>,
}

/// A slope of the zero.
#[derive(Debug, Clone, PartialEq)]
pub struct Trend {
    /// Which reading.
    pub component: &'static str,
    /// Against `s` or `K`.
    pub per: &'static str,
    /// Reading per second or per kelvin.
    pub slope: f64,
    /// Its standard deviation.
    pub sd: f64,
    /// Chance of such a slope, in any of the trends, where there is none.
    pub p: f64,
}

impl Trend {
    /// Whether it is there.
    pub fn is_there(&self) -> bool {
        self.p < CHANCE
    }
}

/// What a log says.
#[derive(Debug, Clone, PartialEq)]
pub struct Drift {
    /// Length of the log (s).
    pub length_s: f64,
    /// Slopes, for each reading against time and, where it can be told apart, against temperature.
    pub trends: Vec<Trend>,
    /// Why there is no slope against temperature, where the log has one.
    pub not_apart: bool,
    /// Spans (s) of the Allan deviations.
    pub span_s: Vec<f64>,
    /// Allan deviation of each reading for each span.
    pub allan: [Vec<f64>; 6],
    /// For each reading: the span (s) after which a longer mean tells no more, and the Allan deviation there.
    pub best: [[f64; 2]; 6],
}

impl DriftLog {
    /// Reads and checks a log: columns `time_s`, `temperature_c` (may be missing), `fx_n` … `tz_nm`.
    ///
    /// # Errors
    /// [`InstrumentError`] with line and column.
    pub fn read(file: &Path) -> Result<Self, InstrumentError> {
        let sheet = Sheet::read(file, FEWEST)?;
        let time_s = sheet.times(sheet.need("time", TIME)?)?;
        let temperature_c =
            sheet.find("temperature", TEMPERATURE)?.map(|column| sheet.numbers(column)).transpose()?;
        let mut readings = vec![[0.0; 6]; sheet.len()];
        for (c, name) in ["fx", "fy", "fz", "tx", "ty", "tz"].into_iter().enumerate() {
            let column = sheet.need(name, if c < 3 { FORCE } else { TORQUE })?;
            for (row, value) in readings.iter_mut().zip(sheet.numbers(column)?) {
                row[c] = value;
            }
        }
        Ok(Self { file: file.to_owned(), time_s, temperature_c, readings })
    }
}

/// How the zero wanders.
///
/// # Errors
/// [`InstrumentError::Singular`]: no time passes.
pub fn drift(log: &DriftLog) -> Result<Drift, InstrumentError> {
    let n = log.time_s.len();
    let length_s = log.time_s[n - 1] - log.time_s[0];
    let singular = |what| InstrumentError::Singular { file: log.file.clone(), what };
    if length_s <= 0.0 {
        return Err(singular("no time passes in the log"));
    }
    let stretches = STRETCHES.min(n / 2);
    let mean = |of: &dyn Fn(usize) -> f64, k: usize| {
        let range = k * n / stretches..(k + 1) * n / stretches;
        let count = range.len() as f64;
        range.map(of).sum::<f64>() / count
    };
    let column = |of: &dyn Fn(usize) -> f64| -> Vec<f64> { (0..stretches).map(|k| mean(of, k)).collect() };
    let mut causes = vec![("s", column(&|i| log.time_s[i] - log.time_s[0]))];
    let mut not_apart = false;
    if let Some(warmth) = &log.temperature_c {
        let warmth = column(&|i| warmth[i] - warmth[0]);
        not_apart = together(&causes[0].1, &warmth);
        if !not_apart && warmth.iter().any(|t| *t != warmth[0]) {
            causes.push(("K", warmth));
        }
    }
    let x =
        DMatrix::from_fn(stretches, 1 + causes.len(), |i, j| if j == 0 { 1.0 } else { causes[j - 1].1[i] });
    let looked_at = 6 * causes.len();
    let student =
        StudentsT::new(0.0, 1.0, (stretches - x.ncols()) as f64).map_err(|_| singular("too few rows"))?;
    let mut trends = Vec::with_capacity(looked_at);
    for (c, component) in COMPONENTS.into_iter().enumerate() {
        let y = DVector::from_vec(column(&|i| log.readings[i][c]));
        let found = generalised(&x, &y, &[]).ok_or_else(|| singular("time and temperature stand still"))?;
        let step = step(log.readings.iter().map(|reading| reading[c]));
        for (k, (per, of_cause)) in causes.iter().enumerate() {
            let (slope, sd) = (found.beta[k + 1], found.covariance[(k + 1, k + 1)].sqrt());
            let told = (slope * range(of_cause)).abs() >= step;
            let p = if told { 2.0 * student.sf((slope / sd).abs()) * looked_at as f64 } else { 1.0 };
            let p = p.min(1.0);
            trends.push(Trend { component, per, slope, sd, p });
        }
    }
    let (span_s, allan) = allan(log, length_s);
    let best = std::array::from_fn(|c| {
        let least = (0..span_s.len()).min_by(|&a, &b| allan[c][a].total_cmp(&allan[c][b]));
        least.map_or([0.0; 2], |k| [span_s[k], allan[c][k]])
    });
    Ok(Drift { length_s, trends, not_apart, span_s, allan, best })
}

/// Least difference between two readings that are not the same; without end where all are. Differences of rounding are none.
fn step(readings: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = readings.collect();
    sorted.sort_by(f64::total_cmp);
    let greatest = sorted.iter().fold(0.0, |most: f64, reading| most.max(reading.abs()));
    let differences = sorted.windows(2).map(|pair| pair[1] - pair[0]);
    differences.filter(|d| *d > ROUNDING * greatest).fold(f64::INFINITY, f64::min)
}

/// Greatest less least.
fn range(values: &[f64]) -> f64 {
    let (low, high) =
        values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    high - low
}

fn together(a: &[f64], b: &[f64]) -> bool {
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let (ma, mb) = (mean(a), mean(b));
    let sum = |f: &dyn Fn(usize) -> f64| (0..a.len()).map(f).sum::<f64>();
    let ab = sum(&|i| (a[i] - ma) * (b[i] - mb));
    let (aa, bb) = (sum(&|i| (a[i] - ma).powi(2)), sum(&|i| (b[i] - mb).powi(2)));
    bb > 0.0 && ab.abs() > TOGETHER * (aa * bb).sqrt()
}

/// Spans of 1, 2, 4, … rows, and the deviations of means over them.
fn allan(log: &DriftLog, length_s: f64) -> (Vec<f64>, [Vec<f64>; 6]) {
    let n = log.readings.len();
    let step_s = length_s / (n - 1) as f64;
    let (mut spans, mut deviations) = (Vec::new(), [const { Vec::new() }; 6]);
    let mut rows = 1;
    while n / rows > PAIRS {
        spans.push(step_s * rows as f64);
        for (c, of_component) in deviations.iter_mut().enumerate() {
            let means: Vec<f64> = log
                .readings
                .chunks_exact(rows)
                .map(|chunk| chunk.iter().map(|r| r[c]).sum::<f64>() / rows as f64)
                .collect();
            let squares: f64 = means.windows(2).map(|pair| (pair[1] - pair[0]).powi(2)).sum();
            of_component.push((0.5 * squares / (means.len() - 1) as f64).sqrt());
        }
        rows *= 2;
    }
    (spans, deviations)
}
