//! Which parameters of a model fit some rows of some recordings best?
//!
//! Residuals are over the stated deviations, or over one hundredth of the peak. Holds are thinned evenly in the logarithm of time, so that the first
//! second counts as much as the last hour; the history is never thinned. Forces count in peaks and times
//! in durations, so that neither unit has a say.

use super::law::{Kind, Law, Scale, forces};
use super::recording::{Phase, Recording};
use crate::calib::regression::{Model, Options, Regression, derivatives, fit};
use nalgebra::{DMatrix, DVector};
use num_dual::Dual64;

/// Rows of a hold that are fitted.
const HOLD_ROWS: usize = 150;
/// Rows of a ramp that are fitted. Why so few: what a model misses of the ramp, where plates begin to touch and shapes are coarse, it misses in all
/// of its rows alike; it shall not pay for that in the hold, which tells what relaxes.
const RAMP_ROWS: usize = 20;
/// Rows of a ramp that are all fitted.
const FEW_ROWS: usize = 16;
/// Steps of a fit.
const STEPS: usize = 400;
/// How far from a minimum a fit may end, in standard deviations of the parameters.
const OFFSET: f64 = 1e-4;
/// Longest time constant over the longest time that was seen.
const BEYOND: f64 = 10.0;
/// Greatest amplitude over the peak.
const MOST: f64 = 1e3;
/// Starts: where in its window a time constant begins, and how steeply the force stiffens.
const STARTS: [(f64, f64); 2] = [(0.5, 0.5), (0.25, 2.0)];

/// Rows that a fit sees: of the ramp at most every other one, of the hold everything up to a share of its duration, thinned.
pub(super) fn rows_until(recording: &Recording, share: f64) -> Vec<usize> {
    let hold = recording.rows(Phase::Hold);
    let (first, last) = (hold[0], hold[hold.len() - 1]);
    let start = recording.time_s[first];
    let end = start + share * (recording.time_s[last] - start);
    let held: Vec<usize> = hold.into_iter().filter(|r| recording.time_s[*r] <= end + 1e-9).collect();
    let ramp: Vec<usize> = (0..first).filter(|r| recording.phase[*r] == Phase::Ramp).collect();
    let step = ramp.len().div_ceil(RAMP_ROWS).max(if ramp.len() < FEW_ROWS { 1 } else { 2 });
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

/// What a recording's residuals are over, row by row.
pub(super) fn deviations(recording: &Recording) -> Vec<f64> {
    let share = 0.01 * (recording.peak() - recording.zero()).abs();
    let stated = |row: usize| recording.force_sd.as_ref().map(|sd| sd[row]).filter(|sd| *sd > 0.0);
    (0..recording.force.len()).map(|row| stated(row).unwrap_or(share)).collect()
}

/// What a fit sees of a recording, over the scale: the whole ramp, and of the hold the rows that are fitted.
struct Seen {
    times: Vec<f64>,
    deformation: Vec<f64>,
    /// Place in the lists above, force less zero, deviation.
    fitted: Vec<(usize, f64, f64)>,
}

impl Seen {
    fn new(recording: &Recording, rows: &[usize], scale: &Scale) -> Self {
        let hold = recording.rows(Phase::Hold)[0];
        let mut kept: Vec<usize> = (0..hold).collect();
        kept.extend(rows.iter().filter(|r| **r >= hold));
        let zero = recording.zero();
        let fitted = kept.iter().enumerate().filter(|(_, r)| rows.binary_search(r).is_ok());
        let over = |force: f64| force / scale.force;
        let sd = deviations(recording);
        Self {
            fitted: fitted.map(|(at, r)| (at, over(recording.force[*r] - zero), over(sd[*r]))).collect(),
            times: kept.iter().map(|r| recording.time_s[*r] / scale.time_s).collect(),
            deformation: kept.iter().map(|r| recording.deformation[*r] / scale.deformation).collect(),
        }
    }
}

struct Fitted {
    kind: Kind,
    span: [f64; 2],
    seen: Vec<Seen>,
}

impl Fitted {
    fn left(&self, p: &[Dual64]) -> Vec<Dual64> {
        let mut list = Vec::new();
        for seen in &self.seen {
            let modelled = forces(self.kind, p, self.span, &seen.times, &seen.deformation);
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

/// The best of a kind, from several starts; none where it has no value there. Whether it is a minimum the law's termination says.
pub(super) fn search(kind: Kind, seen: &[(&Recording, Vec<usize>)]) -> Option<Law> {
    let (mut longest, mut shortest): (f64, f64) = (0.0, f64::INFINITY);
    for (recording, rows) in seen {
        let (first, last) = (rows.first()?, rows.last()?);
        longest = longest.max(recording.time_s[*last] - recording.time_s[*first]);
        let ramp = recording.rows(Phase::Hold)[0];
        shortest = shortest.min((recording.time_s[ramp] - recording.time_s[*first]) / 10.0);
    }
    let shortest = (shortest / longest).max(1e-6);
    let scale = Scale {
        deformation: seen.iter().flat_map(|(r, _)| &r.deformation).copied().fold(0.0, f64::max),
        force: seen.iter().map(|(r, _)| r.peak() - r.zero()).fold(0.0, f64::max),
        time_s: longest,
        span: [0.1 * shortest, 30.0],
    };
    let seen = seen.iter().map(|(recording, rows)| Seen::new(recording, rows, &scale)).collect();
    let model = Fitted { kind, span: scale.span, seen };
    let starts = STARTS.iter().map(|start| begin(kind, shortest, *start));
    let found = starts.filter_map(|(start, bounds)| {
        let options = Options { bounds, steps: STEPS, offset: OFFSET, ..Options::default() };
        fit(&model, &start, &options).ok().filter(|found| found.squares.is_finite())
    });
    let best = found.min_by(|a, b| a.squares.total_cmp(&b.squares))?;
    let Regression { parameters, covariance, termination, .. } = best;
    Some(Law { kind, parameters, covariance, scale, termination })
}

/// Parameters to begin with, and their bounds. `shortest`: time constant over the longest recording.
fn begin(kind: Kind, shortest: f64, (place, steep): (f64, f64)) -> (Vec<f64>, Vec<[f64; 2]>) {
    let n = kind.terms;
    let amplitude = [0.0, MOST];
    let (mut start, mut bounds) = (vec![0.3], vec![amplitude]);
    if n == 0 {
        start.extend([1.0, 0.2]);
        bounds.extend([amplitude, [-0.5, 2.0]]);
    } else {
        start.extend((0..n).map(|_| 1.0 / n as f64));
        bounds.extend((0..n).map(|_| amplitude));
        // A window of its own for each time constant: two terms that could change places leave the search no minimum.
        let (low, high) = (shortest.ln(), BEYOND.ln());
        let edge = |i: f64| low + (high - low) * i / n as f64;
        start.extend((0..n).map(|i| edge(i as f64 + place)));
        bounds.extend((0..n).map(|i| [edge(i as f64), edge(i as f64 + 1.0)]));
    }
    if kind.stiffens {
        start.push(steep);
        bounds.push([-20.0, 20.0]);
    }
    if kind.apart {
        start.push(1.0);
        bounds.push([-20.0, 20.0]);
    }
    (start, bounds)
}
