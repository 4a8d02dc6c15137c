//! Which parameters of a model fit some rows of some recordings best?
//!
//! Residuals are over the stated deviations, or over one hundredth of the peak. Holds are thinned evenly in the logarithm of time, so that the first
//! second counts as much as the last hour; the history is never thinned.

use super::law::{Kind, Law, forces};
use super::recording::{Phase, Recording};
use crate::calib::regression::{Model, Options, derivatives, fit};
use nalgebra::{DMatrix, DVector};
use num_dual::Dual64;

/// Rows of a hold that are fitted.
const HOLD_ROWS: usize = 150;
/// Rows of a ramp that are fitted.
const RAMP_ROWS: usize = 60;
/// Steps of a fit.
const STEPS: usize = 120;
/// Longest time constant over the longest time that was seen.
const BEYOND: f64 = 10.0;
/// Least amplitude over the peak: a smaller one is none.
const LEAST: f64 = 1e-4;

/// Rows that a fit sees: everything up to a share of the hold's duration.
pub(super) fn rows_until(recording: &Recording, share: f64) -> Vec<usize> {
    let hold = recording.rows(Phase::Hold);
    let (first, last) = (hold[0], hold[hold.len() - 1]);
    let start = recording.time_s[first];
    let end = start + share * (recording.time_s[last] - start);
    let held: Vec<usize> = hold.into_iter().filter(|r| recording.time_s[*r] <= end + 1e-9).collect();
    let ramp: Vec<usize> = (0..first).filter(|r| recording.phase[*r] == Phase::Ramp).collect();
    let step = ramp.len().div_ceil(RAMP_ROWS).max(1);
    let mut rows: Vec<usize> = ramp.into_iter().step_by(step).collect();
    let shortest = (recording.time_s[(first + 1).min(last)] - start).max(1e-9);
    let mut next = 0.0;
    let ratio = ((end - start).max(shortest) / shortest).ln() / HOLD_ROWS as f64;
    for row in held {
        let elapsed = (recording.time_s[row] - start).max(shortest);
        if (elapsed / shortest).ln() >= next {
            rows.push(row);
            next = (elapsed / shortest).ln() + ratio;
        }
    }
    rows
}

/// What a recording's residuals are over.
pub(super) fn deviation(recording: &Recording, row: usize) -> f64 {
    let sd = recording.force_sd.as_ref().map(|sd| sd[row]).filter(|sd| *sd > 0.0);
    sd.unwrap_or(0.01 * (recording.peak() - recording.zero()).abs())
}

/// What a fit sees of a recording: the whole ramp, and of the hold the rows that are fitted.
struct Seen {
    time_s: Vec<f64>,
    deformation: Vec<f64>,
    /// Place in the lists above, force less zero, deviation.
    fitted: Vec<(usize, f64, f64)>,
}

impl Seen {
    fn new(recording: &Recording, rows: &[usize]) -> Self {
        let hold = recording.rows(Phase::Hold)[0];
        let mut kept: Vec<usize> = (0..hold).collect();
        kept.extend(rows.iter().filter(|r| **r >= hold));
        let zero = recording.zero();
        let fitted = kept.iter().enumerate().filter(|(_, r)| rows.contains(r));
        Self {
            fitted: fitted
                .map(|(at, r)| (at, recording.force[*r] - zero, deviation(recording, *r)))
                .collect(),
            time_s: kept.iter().map(|r| recording.time_s[*r]).collect(),
            deformation: kept.iter().map(|r| recording.deformation[*r]).collect(),
        }
    }
}

struct Fitted {
    kind: Kind,
    greatest: f64,
    span_s: [f64; 2],
    seen: Vec<Seen>,
}

impl Fitted {
    fn left(&self, p: &[Dual64]) -> Vec<Dual64> {
        let mut list = Vec::new();
        for seen in &self.seen {
            let modelled = forces(self.kind, p, self.greatest, self.span_s, &seen.time_s, &seen.deformation);
            list.extend(seen.fitted.iter().map(|(at, force, sd)| (-modelled[*at] + *force) / *sd));
        }
        list
    }
}

impl Model for Fitted {
    fn residuals(&self, parameters: &[f64]) -> Option<DVector<f64>> {
        let plain: Vec<Dual64> = parameters.iter().map(|p| Dual64::from(*p)).collect();
        Some(DVector::from_vec(self.left(&plain).into_iter().map(|d| d.re).collect()))
    }

    fn jacobian(&self, parameters: &[f64]) -> Option<DMatrix<f64>> {
        Some(derivatives(parameters, |p| self.left(p)))
    }
}

/// The best of a kind; none where it has no value at its start. Whether it is a minimum the law's termination says.
pub(super) fn search(kind: Kind, seen: &[(&Recording, Vec<usize>)]) -> Option<Law> {
    let greatest = seen.iter().flat_map(|(r, _)| &r.deformation).copied().fold(0.0, f64::max);
    let peak = seen.iter().map(|(r, _)| r.peak() - r.zero()).fold(0.0, f64::max);
    let mut longest: f64 = 0.0;
    let mut shortest = f64::INFINITY;
    for (recording, rows) in seen {
        let (first, last) = (rows.first()?, rows.last()?);
        longest = longest.max(recording.time_s[*last] - recording.time_s[*first]);
        let ramp = recording.rows(Phase::Hold)[0];
        shortest = shortest.min((recording.time_s[ramp] - recording.time_s[*first]) / 10.0);
    }
    let shortest = shortest.max(1e-6 * longest);
    let span_s = [0.1 * shortest, 30.0 * longest];
    let amplitude = [(LEAST * peak).ln(), (1e3 * peak).ln()];
    let n = kind.terms;
    let (mut start, mut bounds) = (vec![(0.3 * peak).ln()], vec![amplitude]);
    if n == 0 {
        start.extend([peak.ln(), 0.2]);
        bounds.extend([amplitude, [-0.5, 2.0]]);
    } else {
        start.extend((0..n).map(|_| (peak / n as f64).ln()));
        bounds.extend((0..n).map(|_| amplitude));
        // A window of its own for each time constant: two terms that could change places leave the search no minimum.
        let (low, high) = (shortest.ln(), (BEYOND * longest).ln());
        let edge = |i: usize| low + (high - low) * i as f64 / n as f64;
        start.extend((0..n).map(|i| 0.5 * (edge(i) + edge(i + 1))));
        bounds.extend((0..n).map(|i| [edge(i), edge(i + 1)]));
    }
    if kind.stiffens {
        start.push(0.5);
        bounds.push([-20.0, 20.0]);
    }
    if kind.apart {
        start.push(1.0);
        bounds.push([-20.0, 20.0]);
    }
    let seen = seen.iter().map(|(recording, rows)| Seen::new(recording, rows)).collect();
    let model = Fitted { kind, greatest, span_s, seen };
    let found = fit(&model, &start, &Options { bounds, steps: STEPS, ..Options::default() }).ok()?;
    found.squares.is_finite().then_some(Law {
        kind,
        parameters: found.parameters,
        greatest,
        span_s,
        termination: found.termination,
    })
}
