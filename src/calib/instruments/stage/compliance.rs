//! How far do stage, sensor and frame yield to a force? The tip is pressed on a block that does not.
//!
//! With the stage's position z along the press and contact at z₀, F = F₀ + k ⟨z − z₀⟩₊: the zero of the force before contact, then a straight line.
//! z₀ is found by the least sum of squares, first on a grid, then by Gauss–Newton; covariance s² (JᵀJ)⁻¹. Compliance of everything but the tip:
//! c = 1/k − c_tip, u²(c) = u²(k)/k⁴ + u²(c_tip).
//!
//! A contact that stiffens (a soft tip, dirt) bends the line: a quadratic term above contact is tried, and said where it is significant
//! at 1 %.

use crate::calib::coverage::{Z95, half_90};
use crate::calib::instruments::least_squares::generalised;
use crate::calib::instruments::sheet::{FORCE, LENGTH, Sheet, TIME};
use crate::calib::instruments::{InstrumentError, doubt};
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, StudentsT};
use std::path::{Path, PathBuf};

/// Rows before contact, and in contact, at least.
const SIDE: usize = 4;
/// Places of contact that are tried between two rows.
const BETWEEN: usize = 4;
const STEPS: usize = 20;
/// Chance that a straight line is called bent.
const CHANCE: f64 = 0.01;
/// A contact is one where the force rises by so many times its noise.
const RISE: f64 = 10.0;

/// Share of the slope in contact, and standard deviations, from which the first rows are in contact already: a drift of the zero rises more
/// slowly, and noise alone does so in one press of a thousand.
const AT_ONCE: f64 = 0.1;
const AT_ONCE_SIGMAS: f64 = 3.0;

/// A press on the block (m, N).
#[derive(Debug, Clone, PartialEq)]
pub struct BlockPress {
    /// The file.
    pub file: PathBuf,
    /// Where the stage was, along the press.
    pub position_m: Vec<f64>,
    /// Force that presses, positive.
    pub force_n: Vec<f64>,
}

/// What the tip itself yields (m/N), with its standard deviation.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TipCompliance {
    /// Compliance.
    pub m_per_n: f64,
    /// Its standard deviation.
    pub sd_m_per_n: f64,
}

/// What was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Compliance {
    /// Yielding of everything but the tip (m/N).
    pub m_per_n: f64,
    /// Its standard deviation.
    pub sd_m_per_n: f64,
    /// Half of its 90 % interval.
    pub half_90_m_per_n: f64,
    /// Slope of force over position, the tip's own yielding in it (N/m).
    pub slope_n_per_m: f64,
    /// Its standard deviation.
    pub slope_sd_n_per_m: f64,
    /// Where contact begins (m).
    pub contact_m: f64,
    /// Its standard deviation.
    pub contact_sd_m: f64,
    /// Zero of the force (N).
    pub zero_n: f64,
    /// Noise of the force about the line (N).
    pub noise_n: f64,
    /// Chance of as much bending where the line is straight.
    pub bent_p: f64,
    /// Force less line (N), a row each.
    pub residuals_n: Vec<f64>,
}

impl Compliance {
    /// Whether the line bends.
    pub fn is_bent(&self) -> bool {
        self.bent_p < CHANCE
    }
}

impl BlockPress {
    /// Reads and checks a table: `position_mm`, `force_n`, and `time_s` where there is one.
    ///
    /// # Errors
    /// [`InstrumentError`] with line and column.
    pub fn read(file: &Path) -> Result<Self, InstrumentError> {
        let sheet = Sheet::read(file, 2 * SIDE)?;
        let position_m = sheet.numbers(sheet.need("position", LENGTH)?)?;
        let force_n = sheet.numbers(sheet.need("force", FORCE)?)?;
        if let Some(time) = sheet.find("time", TIME)? {
            sheet.times(time)?;
        }
        Ok(Self { file: file.to_owned(), position_m, force_n })
    }

    /// What speaks against the whole, as a sentence: a way in steps that no press has.
    pub fn doubt(&self) -> Option<String> {
        let (low, high) = self
            .position_m
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), z| (l.min(*z), h.max(*z)));
        doubt::of_press(high - low)
    }
}

/// Finds the compliance.
///
/// # Errors
/// [`InstrumentError::Singular`]: no contact, or a stage that yields less than its tip. [`InstrumentError::InContact`]: contact from the first row on.
pub fn compliance(press: &BlockPress, tip: TipCompliance) -> Result<Compliance, InstrumentError> {
    let singular = |what| InstrumentError::Singular { file: press.file.clone(), what };
    let no_contact =
        "no contact: at least 4 rows before it and 4 in it, with a force that rises above its noise";
    let (z, f) = (&press.position_m, DVector::from_column_slice(&press.force_n));
    let mut sorted = z.clone();
    sorted.sort_by(f64::total_cmp);
    sorted.dedup();
    if sorted.len() < 2 * SIDE {
        return Err(singular(no_contact));
    }
    let fit = |contact: f64| {
        let x = DMatrix::from_fn(z.len(), 2, |i, j| if j == 0 { 1.0 } else { (z[i] - contact).max(0.0) });
        generalised(&x, &f, &[])
    };
    let mut best: Option<(f64, f64)> = None;
    for pair in sorted[SIDE - 1..=sorted.len() - SIDE].windows(2) {
        for step in 0..BETWEEN {
            let contact = pair[0] + (pair[1] - pair[0]) * (step as f64 + 0.5) / BETWEEN as f64;
            let Some(found) = fit(contact) else { continue };
            let sum = found.residuals.norm_squared();
            if best.is_none_or(|(least, _)| sum < least) {
                best = Some((sum, contact));
            }
        }
    }
    let (mut sum, mut contact) = best.ok_or_else(|| singular(no_contact))?;
    for _ in 0..STEPS {
        let Some(found) = fit(contact) else { break };
        let slope = found.beta[1];
        let x = design(z, contact, slope);
        let Some(step) = generalised(&x, &found.residuals, &[]) else { break };
        let next = contact + step.beta[2];
        let Some(better) = fit(next).map(|n| n.residuals.norm_squared()).filter(|s| *s < sum) else { break };
        (sum, contact) = (better, next);
    }
    let found = fit(contact).ok_or_else(|| singular(no_contact))?;
    let slope = found.beta[1];
    let freedom = z.len() as f64 - 3.0;
    let noise_n = (sum / freedom).sqrt();
    let rise_n = rises_at_once(press, contact, slope, noise_n);
    if let Some(rise_n) = rise_n.filter(|_| slope > 0.0) {
        let file = press.file.clone();
        return Err(InstrumentError::InContact { file, rise_n, slope_n_per_m: slope });
    }
    let x = design(z, contact, slope);
    let covariance =
        (x.transpose() * &x).cholesky().ok_or_else(|| singular(no_contact))?.inverse() * noise_n.powi(2);
    let deepest = sorted[sorted.len() - 1] - contact;
    if !(slope > 0.0 && slope * deepest > RISE * noise_n) {
        return Err(singular(no_contact));
    }
    let slope_sd = covariance[(1, 1)].sqrt();
    let own = slope_sd / slope.powi(2);
    let m_per_n = 1.0 / slope - tip.m_per_n;
    if m_per_n + 3.0 * own.hypot(tip.sd_m_per_n) < 0.0 {
        return Err(singular("all together yields less than the tip alone: look at the tip's compliance"));
    }
    Ok(Compliance {
        m_per_n,
        sd_m_per_n: own.hypot(tip.sd_m_per_n),
        half_90_m_per_n: (half_90(freedom) * own).hypot(Z95 * tip.sd_m_per_n),
        slope_n_per_m: slope,
        slope_sd_n_per_m: slope_sd,
        contact_m: contact,
        contact_sd_m: covariance[(2, 2)].sqrt(),
        zero_n: found.beta[0],
        noise_n,
        bent_p: bent(z, &f, contact, slope),
        residuals_n: found.residuals.iter().copied().collect(),
    })
}

/// By how much the force rises over the first rows (N), where that is no noise and no small share of the slope in contact: they are in contact
/// already. First is the half of what lies before contact that is farther from it, which a contact that stiffens does not reach.
fn rises_at_once(press: &BlockPress, contact: f64, slope: f64, noise_n: f64) -> Option<f64> {
    let mut rows: Vec<(f64, f64)> =
        press.position_m.iter().copied().zip(press.force_n.iter().copied()).collect();
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    let before = rows.iter().filter(|row| row.0 < contact).count();
    let first = &rows[..(before / 2).max(SIDE).min(rows.len())];
    let mean = first.iter().map(|row| row.0).sum::<f64>() / first.len() as f64;
    let squares: f64 = first.iter().map(|row| (row.0 - mean).powi(2)).sum();
    let of_first = first.iter().map(|row| (row.0 - mean) * row.1).sum::<f64>() / squares;
    let rises = of_first > AT_ONCE * slope && of_first > AT_ONCE_SIGMAS * noise_n / squares.sqrt();
    rises.then(|| of_first * (first[first.len() - 1].0 - first[0].0))
}

/// Derivatives by zero, slope and place of contact.
fn design(z: &[f64], contact: f64, slope: f64) -> DMatrix<f64> {
    DMatrix::from_fn(z.len(), 3, |i, j| match (j, z[i] > contact) {
        (0, _) => 1.0,
        (1, true) => z[i] - contact,
        (2, true) => -slope,
        _ => 0.0,
    })
}

/// Chance of such a quadratic term where there is none; the place of contact may give way to it.
fn bent(z: &[f64], f: &DVector<f64>, contact: f64, slope: f64) -> f64 {
    let line = design(z, contact, slope);
    let x =
        DMatrix::from_fn(
            z.len(),
            4,
            |i, j| if j < 3 { line[(i, j)] } else { (z[i] - contact).max(0.0).powi(2) },
        );
    let Some(found) = generalised(&x, f, &[]) else { return 1.0 };
    let t = found.beta[3].abs() / found.covariance[(3, 3)].sqrt();
    let student = StudentsT::new(0.0, 1.0, (z.len() as f64 - 4.0).max(1.0));
    student.map_or(1.0, |s| if t.is_finite() { 2.0 * s.sf(t) } else { 1.0 })
}
