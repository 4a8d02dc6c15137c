//! Which share of the force relaxes, after a step, between the end of a fast ramp and the end of the hold?
//!
//! 1 − G(t₂)/G(t₁), G the force after a step ([`Law::after_step`]), t₁ the duration of the ramp, t₂ that of the hold. Terms of a sum are seldom told
//! apart, their sum between two times that the recording resolves is: what relaxes faster is over at t₁, what relaxes slower has not begun at
//! t₂, whatever terms stand for it. The value is the mean over the models that predict about as well; the deviation is made of theirs from their
//! fits, of how they differ, of the zero, and of an assumed scatter of specimens.

use super::RelaxationError;
use super::choose::Choice;
use super::law::Law;
use super::recording::{Phase, Recording};

/// Standard deviation from specimen to specimen, relative, where one material was tried on one: an assumption.
const SCATTER: f64 = 0.05;
/// Durations of the ramp that a hold must last.
const LONGER: f64 = 2.0;
/// Rows at the end of the hold.
const END_ROWS: usize = 5;
/// How well a zero is known, over the peak: with a rest before the ramp, and without one.
const ZERO: [f64; 2] = [0.002, 0.01];

/// The share, with how it was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lost {
    /// Share of the force that relaxes between the two times.
    pub fraction: f64,
    /// Its standard uncertainty.
    pub sd: f64,
    /// Share of the peak that the force itself falls by over the hold.
    pub measured: f64,
    /// Times after a step (s): the ramp's duration, and the hold's.
    pub window_s: [f64; 2],
    /// Of which recording: the one with the fastest ramp.
    pub of: usize,
    /// Models that it is the mean of.
    pub models: usize,
    /// Assumed standard deviation from specimen to specimen, relative.
    pub assumed_scatter: f64,
}

/// The share that relaxes, of the fastest ramp.
///
/// # Errors
/// [`RelaxationError::NoShare`]: no hold outlasts its ramp.
pub fn lost(choice: &Choice, recordings: &[Recording]) -> Result<Lost, RelaxationError> {
    let window = |r: &Recording| {
        let (ramp, hold) = (r.rows(Phase::Ramp), r.rows(Phase::Hold));
        let begin = ramp.first().map_or(r.time_s[hold[0]], |row| r.time_s[*row]);
        [r.time_s[hold[0]] - begin, r.time_s[hold[hold.len() - 1]] - r.time_s[hold[0]]]
    };
    let resolved = |of: &usize| {
        let [ramp, hold] = window(&recordings[*of]);
        hold >= LONGER * ramp
    };
    let fastest = (0..recordings.len())
        .filter(resolved)
        .min_by(|a, b| window(&recordings[*a])[0].total_cmp(&window(&recordings[*b])[0]));
    let Some(of) = fastest else {
        let each = recordings.iter().map(|r| (r.label.clone(), window(r))).collect();
        return Err(RelaxationError::NoShare { each, longer: LONGER });
    };
    let recording = &recordings[of];
    let window_s = window(recording);
    let laws: Vec<&Law> = std::iter::once(&choice.law).chain(&choice.others).collect();
    let shares: Vec<(f64, f64)> = laws.iter().map(|law| law.relaxed(window_s)).collect();
    let count = shares.len() as f64;
    let mean = |of: &dyn Fn(&(f64, f64)) -> f64| shares.iter().map(of).sum::<f64>() / count;
    let fraction = mean(&|s| s.0);
    let own = mean(&|s| s.1.powi(2)).sqrt();
    let apart = mean(&|s| (s.0 - fraction).powi(2)).sqrt();
    let hold = recording.rows(Phase::Hold);
    let end: Vec<f64> = hold.iter().rev().take(END_ROWS).map(|r| recording.force[*r]).collect();
    let peak = recording.peak() - recording.zero();
    let measured = (recording.peak() - end.iter().sum::<f64>() / end.len() as f64) / peak;
    // A zero that is off by z counts in G(t₁) and G(t₂) alike: the share changes by z/G(t₁) of itself.
    let zero = ZERO[usize::from(recording.rows(Phase::Rest).is_empty())] * peak;
    let zero = fraction * zero / choice.law.after_step(window_s[0]);
    let parts = [own, apart, zero, SCATTER * fraction];
    let sd = parts.iter().map(|p| p * p).sum::<f64>().sqrt();
    Ok(Lost { fraction, sd, measured, window_s, of, models: laws.len(), assumed_scatter: SCATTER })
}
