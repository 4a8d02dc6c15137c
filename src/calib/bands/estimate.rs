//! A band's test → slack, slope and what it depends on; the slope at the pull that the band has on the rig.
//!
//! The bend is chosen on blocks of extension that a fit did not see, on the loading of the last cycle: bands are soft the first time (Mullins) and then
//! repeat. All branches are fitted with it, so that hysteresis and cycles show as numbers.

use super::BandError;
use super::line::{Bend, Line};
use super::stretching::{Branch, Stretching};
use crate::calib::coverage::{Z95, uniform};

/// Blocks of a branch.
const BLOCKS: usize = 5;
/// How much better a line with more parameters must predict.
const BETTER: f64 = 0.9;
/// Share of the greatest force below which nothing is missed.
const EXACT: f64 = 1e-6;
/// How much the slopes of both ways must differ for it to be said that the rubber remembers.
const REMEMBERS: f64 = 0.01;
/// Share of the greatest force that rows in the slack carry at most: what a corner that is rounded hides of a straight line.
const LOADED: f64 = 0.1;
/// Steps in which the extension of a pull is looked for.
const STEPS: usize = 2_000;

/// What may be set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Pull on the rig (N), less the tare; none: the middle of what was measured.
    pub pretension_n: Option<f64>,
    /// Bands side by side.
    pub parallel: u32,
    /// Load cell, relative half-width. ISO 7500-1, class 0.5.
    pub load_cell: f64,
    /// Extension, relative half-width.
    pub extension: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { pretension_n: None, parallel: 1, load_cell: 0.005, extension: 0.005 }
    }
}

/// One branch.
#[derive(Debug, Clone, PartialEq)]
pub struct OfBranch {
    /// Which.
    pub branch: Branch,
    /// Its line.
    pub line: Line,
    /// Slope at the pull (N/m).
    pub slope_at_pull_n_per_m: Option<f64>,
    /// Work swallowed over work put in, of a loading with its way back.
    pub swallowed: Option<f64>,
}

/// What is known of the bands together. SI.
#[derive(Debug, Clone, PartialEq)]
pub struct Stiffness {
    /// Slope at the pull (N/m), loading, last cycle.
    pub stiffness_n_per_m: f64,
    /// Its standard uncertainty: fit, load cell, extension, and how loading and unloading differ.
    pub sd_n_per_m: f64,
    /// 90 % interval (N/m).
    pub interval_90: [f64; 2],
    /// The pull (N).
    pub pretension_n: f64,
    /// Pull at which the loading begins (N), where the one asked for lies below: the slope is that at the beginning.
    pub begins_at_n: Option<f64>,
    /// Bands side by side.
    pub parallel: u32,
    /// Bends with what they missed in unseen blocks (N).
    pub tried: Vec<(Bend, Option<f64>)>,
    /// All branches.
    pub branches: Vec<OfBranch>,
    /// The one that the stiffness is of.
    pub chosen: usize,
    /// What a reader must know.
    pub remarks: Vec<String>,
}

impl Stiffness {
    /// Of one band (N/m).
    pub fn of_one_n_per_m(&self) -> f64 {
        self.stiffness_n_per_m / f64::from(self.parallel)
    }
}

/// Estimates.
///
/// # Errors
/// [`BandError`]: nothing stretched, a pull beyond what was measured, load in what seems slack, no answer.
pub fn estimate(stretching: &Stretching, settings: &Settings) -> Result<Stiffness, BandError> {
    if settings.parallel == 0 {
        return Err(BandError::Count { count: settings.parallel });
    }
    let label = stretching.label.clone();
    let no_model = || BandError::NoModel { label: label.clone() };
    let loading = stretching.branches.iter().rfind(|b| b.loading).ok_or_else(no_model)?;
    let points = stretching.points(loading);
    let tried: Vec<(Bend, Option<f64>)> = Bend::ALL.iter().map(|b| (*b, missed(*b, &points))).collect();
    // Lines that miss nothing are equal, whatever rounding leaves.
    let greatest = points.iter().map(|p| p.1.abs()).fold(0.0, f64::max);
    let mut best: Option<(Bend, f64)> = None;
    for (bend, score) in &tried {
        let score = score.map(|s| s.max(EXACT * greatest));
        if let Some(score) = score
            && best.is_none_or(|(_, least)| score < BETTER * least)
        {
            best = Some((*bend, score));
        }
    }
    let (bend, _) = best.ok_or_else(no_model)?;
    let main = Line::fit(bend, &points).ok_or_else(no_model)?;
    let top = points.iter().map(|p| p.1).fold(f64::NEG_INFINITY, f64::max) - main.tare_n;
    let carried = carried(&main, &points);
    if carried > LOADED * top {
        return Err(BandError::LoadedSlack { label, slack_m: main.slack_m, carried, top });
    }
    let pull = settings.pretension_n.unwrap_or(0.5 * top);
    if !(pull > 0.0 && pull <= top) {
        return Err(BandError::Pretension { label, wanted: pull, low: 0.0, high: top });
    }
    let mut branches = Vec::new();
    for branch in &stretching.branches {
        let points = stretching.points(branch);
        let Some(line) = Line::fit(bend, &points) else { continue };
        branches.push(OfBranch {
            branch: *branch,
            slope_at_pull_n_per_m: place_of(&line, pull, &points).map(|x| line.slope(x)),
            swallowed: branch.loading.then(|| stretching.swallowed(branch)).flatten(),
            line,
        });
    }
    let chosen = branches.iter().position(|b| b.branch == *loading).ok_or_else(no_model)?;
    let at = place_of(&main, pull, &points).ok_or_else(no_model)?;
    let slope = main.slope(at);
    let own = main.slope_sd(at) / slope;
    if !own.is_finite() {
        return Err(BandError::Open { label, pull, extension_m: at });
    }
    // Loading and unloading bound what a still band does: half their difference, uniform.
    let back = branches.iter().find(|b| !b.branch.loading && b.branch.cycle == loading.cycle);
    let back = back.and_then(|b| b.slope_at_pull_n_per_m);
    let sides = back.map_or(0.0, |b| uniform(0.5 * (b / slope - 1.0).abs()));
    let parts = [own, uniform(settings.load_cell), uniform(settings.extension), sides];
    let sd = slope * parts.iter().map(|p| p * p).sum::<f64>().sqrt();
    let mut remarks = Vec::new();
    if !main.is_minimum {
        remarks.push(
            "the search is stuck at a corner of the line, between two rows: its deviations are rough"
                .to_owned(),
        );
    }
    if main.slack_m <= points[0].0 {
        remarks.push(
            "no row lies in the slack: its length is extrapolated, and the machine's zero is trusted"
                .to_owned(),
        );
    }
    // Of a band that hangs slack at first every pull is measured.
    let begins = points[0].1 - main.tare_n;
    let begins_at_n = (main.slack_m <= points[0].0 && begins > pull).then_some(begins);
    if let Some(begins) = begins_at_n {
        remarks.push(format!(
            "a pull of {pull:.2} N was not measured: the loading begins at {begins:.2} N, and the slope is that there; begin with a slack band"
        ));
    }
    if let Some(back) = back {
        let remembers = (back / slope - 1.0).abs() > REMEMBERS;
        let why = if remembers { ": the rubber remembers" } else { ", as on the way out" };
        remarks.push(format!("unloading, the slope at that pull is {back:.1} N/m{why}"));
    }
    if stretching.branches.iter().filter(|b| b.loading).count() == 1 {
        remarks.push("one cycle: whether the bands soften with cycles can't be told".to_owned());
    }
    Ok(Stiffness {
        stiffness_n_per_m: slope,
        sd_n_per_m: sd,
        interval_90: [slope - Z95 * sd, slope + Z95 * sd],
        pretension_n: pull,
        begins_at_n,
        parallel: settings.parallel,
        tried,
        branches,
        chosen,
        remarks,
    })
}

/// Greatest force over the tare in what the line calls slack (N): the middle one of three rows, so that one that stands out alone is none.
fn carried(line: &Line, points: &[(f64, f64)]) -> f64 {
    let slack: Vec<f64> =
        points.iter().filter(|p| p.0 < line.slack_m).map(|p| (p.1 - line.tare_n).abs()).collect();
    let middle = |three: &[f64]| {
        let mut sorted = three.to_vec();
        sorted.sort_by(f64::total_cmp);
        sorted[1]
    };
    slack.windows(3).map(middle).fold(0.0, f64::max)
}

/// Root mean square of blocks predicted from the rest (N). The lowest and the highest are never left out: they would be extrapolated.
fn missed(bend: Bend, points: &[(f64, f64)]) -> Option<f64> {
    let mut squares = Vec::new();
    for block in 1..2 * BLOCKS - 1 {
        let inside = |i: usize| i * 2 * BLOCKS / points.len() == block;
        let seen: Vec<(f64, f64)> = (0..points.len()).filter(|i| !inside(*i)).map(|i| points[i]).collect();
        let line = Line::fit(bend, &seen)?;
        let unseen = (0..points.len()).filter(|i| inside(*i)).map(|i| points[i]);
        squares.extend(unseen.map(|(x, f)| (f - line.force(x)).powi(2)));
    }
    Some((squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt())
}

/// Extension at which the line pulls that much.
fn place_of(line: &Line, pull: f64, points: &[(f64, f64)]) -> Option<f64> {
    let (low, high) = (points.first()?.0, points.last()?.0);
    let at = |i: usize| low + (high - low) * i as f64 / STEPS as f64;
    (0..=STEPS).map(at).find(|x| line.force(*x) - line.tare_n >= pull)
}
