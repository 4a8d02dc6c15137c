//! Which share of the force relaxes between the end of a fast ramp and the end of the hold?
//!
//! Terms of a sum are seldom told apart, their sum over a span of times is: Σ a_i over the terms between a third of the ramp and the hold, over
//! those and all slower ones. Faster terms have relaxed when the ramp ends, slower ones count as lasting, which is what a poke of that speed would
//! find. What the force itself loses from its peak to the end of the hold is less by what relaxed on the ramp, and more by the ends of the span:
//! half a uniform distribution over their difference is part of the uncertainty.

use super::choose::Choice;
use super::recording::{Phase, Recording};
use crate::calib::coverage::uniform;

/// Standard deviation from specimen to specimen, relative, where one material was tried on one: an assumption.
const SCATTER: f64 = 0.05;
/// Time constants that a ramp leaves, over its duration.
const LEFT: f64 = 1.0 / 3.0;
/// Rows at the end of the hold.
const END_ROWS: usize = 5;

/// The share, with how it was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lost {
    /// Share of the force that relaxes, by the model.
    pub fraction: f64,
    /// Its standard uncertainty.
    pub sd: f64,
    /// Share of the peak that the force falls by.
    pub measured: f64,
    /// Time constants that count: shortest and longest (s).
    pub window_s: [f64; 2],
    /// Of which recording: the one with the fastest ramp.
    pub of: usize,
    /// Assumed standard deviation from specimen to specimen, relative.
    pub assumed_scatter: f64,
}

/// The share that relaxes, of the fastest ramp.
pub fn lost(choice: &Choice, recordings: &[Recording]) -> Lost {
    let span = |r: &Recording| {
        let (ramp, hold) = (r.rows(Phase::Ramp), r.rows(Phase::Hold));
        let begin = ramp.first().map_or(r.time_s[hold[0]], |row| r.time_s[*row]);
        [LEFT * (r.time_s[hold[0]] - begin), r.time_s[hold[hold.len() - 1]] - r.time_s[hold[0]]]
    };
    let of =
        (0..recordings.len()).min_by(|a, b| span(&recordings[*a])[0].total_cmp(&span(&recordings[*b])[0]));
    let of = of.unwrap_or(0);
    let recording = &recordings[of];
    let window_s = span(recording);
    let (mut relaxes, mut stays) = (0.0, choice.law.lasting());
    for term in choice.law.terms() {
        if term.time_s > window_s[1] {
            stays += term.amplitude;
        } else if term.time_s >= window_s[0] {
            relaxes += term.amplitude;
        }
    }
    let fraction = relaxes / (relaxes + stays);
    let hold = recording.rows(Phase::Hold);
    let end: Vec<f64> = hold.iter().rev().take(END_ROWS).map(|r| recording.force[*r]).collect();
    let peak = recording.peak() - recording.zero();
    let measured = (recording.peak() - end.iter().sum::<f64>() / end.len() as f64) / peak;
    // A zero that is off counts in the peak and at the end: no rest, no better than a hundredth of the peak.
    let zero = if recording.rows(Phase::Rest).is_empty() { 0.01 } else { 0.002 };
    let parts = [uniform(fraction - measured), zero * (1.0 - measured), SCATTER * fraction];
    let sd = parts.iter().map(|p| p * p).sum::<f64>().sqrt();
    Lost { fraction, sd, measured, window_s, of, assumed_scatter: SCATTER }
}
