//! Which elastic model? The one that best predicts what its fit did not see.
//!
//! Several specimens: each is left out, and predicted from the medians of the others' parameters with its own slack. One specimen: its window is
//! cut into blocks of strain, and each is predicted from the rest. A model with more parameters must be better by a tenth.

use super::elastic::Elastic;
use crate::calib::regression::{Model, Options, Regression, Termination, derivatives, fit};
use nalgebra::{DMatrix, DVector};
use num_dual::{Dual64, DualNum};

/// Blocks of a window.
const BLOCKS: usize = 5;
/// How much better a model with more parameters must predict.
const BETTER: f64 = 0.9;
/// Share of the greatest stress below which nothing is left: no load cell shows it.
const EXACT: f64 = 1e-6;

/// A model with what it missed in unseen data.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Score {
    /// Which.
    pub model: Elastic,
    /// Root mean square (Pa); none where it came to no minimum.
    pub missed_pa: Option<f64>,
}

/// How the start is told: by a length that was slack, or by a force that was there before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Start {
    /// λ = (1 + ε)/(1 + slack).
    Slack,
    /// P = model + tare.
    Tare,
}

/// Points of one specimen: strain, stress.
pub(super) type Points = Vec<(f64, f64)>;

struct Curve<'a> {
    model: Elastic,
    start: Start,
    points: &'a [(f64, f64)],
    scale: f64,
}

fn modelled(model: Elastic, start: Start, p: &[Dual64], strain: f64) -> Dual64 {
    let last = p[p.len() - 1];
    match start {
        Start::Slack => model.stress(p, (last + 1.0).recip() * (1.0 + strain)),
        Start::Tare => model.stress(p, Dual64::from(1.0 + strain)) + last * p[0],
    }
}

impl Curve<'_> {
    fn left(&self, p: &[Dual64]) -> Vec<Dual64> {
        let one = |(e, s): &(f64, f64)| (-modelled(self.model, self.start, p, *e) + *s) / self.scale;
        self.points.iter().map(one).collect()
    }
}

impl Model for Curve<'_> {
    fn residuals(&self, parameters: &[f64]) -> Option<DVector<f64>> {
        let plain: Vec<Dual64> = parameters.iter().map(|p| Dual64::from(*p)).collect();
        Some(DVector::from_vec(self.left(&plain).into_iter().map(|d| d.re).collect()))
    }

    fn jacobian(&self, parameters: &[f64]) -> Option<DMatrix<f64>> {
        Some(derivatives(parameters, |p| self.left(p)))
    }
}

/// Fits one specimen: E, the second parameter where there is one, slack (or tare over E).
pub(super) fn fit_one(model: Elastic, start: Start, points: &[(f64, f64)]) -> Option<Regression> {
    let (low, high) = (points.first()?, points.last()?);
    let slope = ((high.1 - low.1) / (high.0 - low.0)).abs().max(1.0);
    let mut first = vec![slope];
    first.extend(model.second());
    first.push(0.0);
    let found =
        fit(&Curve { model, start, points, scale: high.1.abs().max(1.0) }, &first, &Options::default())
            .ok()?;
    // A slack of nearly zero has no last digits: of a curve without noise the search finds it, and cannot tell that it did.
    let exact =
        found.termination == Termination::Stagnated && found.squares <= EXACT * EXACT * points.len() as f64;
    ((found.termination.is_answer() || exact) && found.parameters[0] > 0.0).then_some(found)
}

fn predicted(model: Elastic, p: &[f64], strain: f64) -> f64 {
    let plain: Vec<Dual64> = p.iter().map(|v| Dual64::from(*v)).collect();
    modelled(model, Start::Slack, &plain, strain).re
}

/// Middle value; the mean of the two middle ones.
pub(super) fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    if n == 0 { f64::NAN } else { 0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]) }
}

fn score(model: Elastic, specimens: &[Points]) -> Option<f64> {
    let mut squares = Vec::new();
    if let [one] = specimens {
        for block in 0..BLOCKS {
            let inside = |i: usize| i * BLOCKS / one.len() == block;
            let seen: Points = (0..one.len()).filter(|i| !inside(*i)).map(|i| one[i]).collect();
            let found = fit_one(model, Start::Slack, &seen)?;
            let unseen = (0..one.len()).filter(|i| inside(*i)).map(|i| one[i]);
            squares.extend(unseen.map(|(e, s)| (s - predicted(model, &found.parameters, e)).powi(2)));
        }
    } else {
        let fits: Option<Vec<Regression>> =
            specimens.iter().map(|points| fit_one(model, Start::Slack, points)).collect();
        let fits = fits?;
        for (out, points) in specimens.iter().enumerate() {
            let others = |k: usize| -> Vec<f64> {
                (0..fits.len()).filter(|i| *i != out).map(|i| fits[i].parameters[k]).collect()
            };
            let count = fits[out].parameters.len();
            let mut p: Vec<f64> = (0..count - 1).map(|k| median(&others(k))).collect();
            p.push(fits[out].parameters[count - 1]);
            squares.extend(points.iter().map(|(e, s)| (s - predicted(model, &p, *e)).powi(2)));
        }
    }
    Some((squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
}

/// All scores, and the model that they speak for.
pub(super) fn choose(specimens: &[Points]) -> (Vec<Score>, Option<Elastic>) {
    let scores: Vec<Score> =
        Elastic::ALL.iter().map(|m| Score { model: *m, missed_pa: score(*m, specimens) }).collect();
    // Models that miss nothing are equal, whatever rounding leaves.
    let greatest = specimens.iter().flatten().map(|p| p.1.abs()).fold(0.0, f64::max);
    let mut best: Option<(Elastic, f64)> = None;
    for Score { model, missed_pa } in &scores {
        let Some(missed) = missed_pa.filter(|m| m.is_finite()) else { continue };
        let missed = missed.max(EXACT * greatest);
        let handicap = if model.second().is_some() { BETTER } else { 1.0 };
        if best.is_none_or(|(_, least)| missed < handicap * least) {
            best = Some((*model, missed));
        }
    }
    (scores, best.map(|(model, _)| model))
}
