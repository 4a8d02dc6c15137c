//! Pulls of one material → its Young's modulus with an interval.
//!
//! Rows of the strain window, above the preload → model by evidence → E of each specimen, its slack taken off → the median over
//! specimens (ISO 37 reports medians) → uncertainty by parts.

use super::DumbbellError;
use super::elastic::Elastic;
use super::evidence::{Points, Score, Start, choose, fit_one, median};
use super::interval::{Budget, Tolerances};
use super::pull::Pull;
use crate::calib::coverage::uniform;
use crate::units::pascals;

/// Rows that a window must have.
const LEAST_ROWS: usize = 8;

/// What may be set.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Strains that are fitted.
    pub window: [f64; 2],
    /// Preload over the stress at the window's upper end: rows below it are toe.
    pub preload: f64,
    /// Only this model; none: by evidence.
    pub model: Option<Elastic>,
    /// What sizes and instruments may be off by.
    pub tolerances: Tolerances,
}

impl Default for Settings {
    fn default() -> Self {
        Self { window: [0.0, 0.5], preload: 0.02, model: None, tolerances: Tolerances::default() }
    }
}

/// One specimen.
#[derive(Debug, Clone, PartialEq)]
pub struct OfOne {
    /// File and specimen.
    pub label: String,
    /// E (Pa).
    pub modulus_pa: f64,
    /// Its standard deviation from the fit alone (Pa).
    pub sd_pa: f64,
    /// Strain that was slack.
    pub slack: f64,
    /// E where the start is read as a tare instead (Pa).
    pub modulus_with_tare_pa: Option<f64>,
    /// All parameters of the model, the slack last.
    pub parameters: Vec<f64>,
    /// Rows that were fitted.
    pub rows: Vec<usize>,
    /// Lowest and highest strain of the pull inside the window, the toe too.
    pub reach: [f64; 2],
    /// Root mean square of what is left (Pa).
    pub left_pa: f64,
}

/// What is known.
#[derive(Debug, Clone, PartialEq)]
pub struct Modulus {
    /// E: median over specimens (Pa).
    pub modulus_pa: f64,
    /// Standard uncertainty (Pa).
    pub sd_pa: f64,
    /// 90 % interval (Pa).
    pub interval_90: [f64; 2],
    /// Chosen model.
    pub model: Elastic,
    /// Evidence.
    pub scores: Vec<Score>,
    /// Parts of the uncertainty.
    pub budget: Budget,
    /// Each specimen.
    pub specimens: Vec<OfOne>,
    /// What a reader must know.
    pub remarks: Vec<String>,
}

/// Relative standard deviation from specimen to specimen that no batch has: silicones and gels of one batch scatter by a few per cent.
const MIXED: f64 = 0.25;
/// How far one specimen may be off the median of the others, and by how many of their standard deviations.
const APART: f64 = 0.15;
const APART_SIGMAS: f64 = 5.0;

/// Share of a window beyond a pull's end that is said: a row or two are missing at the end of any. And the share that makes it another window.
const TOLD_EMPTY: f64 = 0.02;
const MOST_EMPTY: f64 = 0.1;

impl Modulus {
    /// Why these are not specimens of one material; none where they may be.
    pub fn is_mixed(&self) -> Option<String> {
        let moduli: Vec<f64> = self.specimens.iter().map(|s| s.modulus_pa).collect();
        let scatter = sd(&moduli) / self.modulus_pa;
        let of = |of: fn(f64, f64) -> f64| pascals(moduli.iter().copied().reduce(of).unwrap_or(f64::NAN));
        (moduli.len() > 1 && scatter > MIXED).then(|| {
            format!(
                "not one material: moduli from {} to {} scatter by {:.0} %, no batch by more than {:.0} %",
                of(f64::min),
                of(f64::max),
                100.0 * scatter,
                100.0 * MIXED
            )
        })
    }

    /// Specimens whose pull ends before the window does, as sentences.
    pub fn short(&self, window: [f64; 2]) -> Vec<String> {
        let short = self.specimens.iter().filter(|s| s.empty(window) > TOLD_EMPTY);
        let say = |s: &OfOne| {
            let [low, high, to] = [window[0], window[1], s.reach[1]].map(figure);
            format!(
                "{}: strains of {low} to {high} were asked for, and the pull ends at {to}: it is fitted up to there",
                s.label
            )
        };
        short.map(say).collect()
    }

    /// Whether so much of the window is empty that the modulus is one of other strains than were asked for.
    pub fn is_short(&self, window: [f64; 2]) -> bool {
        self.specimens.iter().any(|s| s.empty(window) > MOST_EMPTY)
    }

    /// The window up to where every pull reaches.
    pub fn reached(&self, [low, high]: [f64; 2]) -> [f64; 2] {
        [low, self.specimens.iter().map(|s| s.reach[1]).fold(high, f64::min)]
    }

    /// Specimens that lie apart from all others, as sentences: of at least four, so that three tell their scatter.
    pub fn apart(&self) -> Vec<String> {
        let say = |of: usize| {
            let others =
                self.specimens.iter().enumerate().filter(|(i, _)| *i != of).map(|(_, s)| s.modulus_pa);
            let others: Vec<f64> = others.collect();
            let middle = median(&others);
            let off = self.specimens[of].modulus_pa / middle - 1.0;
            let far = off.abs() > APART && off.abs() * middle > APART_SIGMAS * sd(&others);
            (others.len() > 2 && far).then(|| {
                format!(
                    "{}: its modulus is {:+.0} % off the median of the others: another batch, or a size or a force that is wrong",
                    self.specimens[of].label,
                    100.0 * off
                )
            })
        };
        (0..self.specimens.len()).filter_map(say).collect()
    }
}

impl OfOne {
    /// Share of the window that lies beyond the pull's end. Where a pull begins is the file's beginning, which every file has.
    fn empty(&self, [low, high]: [f64; 2]) -> f64 {
        (high - self.reach[1]) / (high - low)
    }
}

/// A strain with three digits that count.
fn figure(strain: f64) -> f64 {
    format!("{strain:.2e}").parse().unwrap_or(strain)
}

/// Standard deviation of values about their mean; zero of fewer than two.
fn sd(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    if values.len() < 2 { 0.0 } else { (squares / (n - 1.0)).sqrt() }
}

/// Estimates.
///
/// # Errors
/// [`DumbbellError`]: nothing given, too few rows, a specimen that slipped, no minimum.
pub fn estimate(pulls: &[Pull], settings: &Settings) -> Result<Modulus, DumbbellError> {
    let mut all: Vec<(Vec<usize>, Points)> = Vec::new();
    for pull in pulls {
        let rows = rows(pull, settings)?;
        let points = rows.iter().map(|r| (pull.strain[*r], pull.stress[*r])).collect();
        all.push((rows, points));
    }
    let first = pulls.first().ok_or(DumbbellError::None)?;
    let points: Vec<Points> = all.iter().map(|(_, p)| p.clone()).collect();
    let (scores, best) = choose(&points);
    let no_model = |label: &str| DumbbellError::NoModel { label: label.to_owned() };
    let model = settings.model.or(best).ok_or_else(|| no_model(&first.label))?;
    let mut specimens = Vec::new();
    for (pull, (rows, points)) in pulls.iter().zip(&all) {
        let found = fit_one(model, Start::Slack, points).ok_or_else(|| no_model(&pull.label))?;
        let scale = points.last().map_or(1.0, |p| p.1.abs().max(1.0));
        specimens.push(OfOne {
            label: pull.label.clone(),
            modulus_pa: found.parameters[0],
            sd_pa: found.sd[0],
            slack: found.parameters.last().copied().unwrap_or(0.0),
            modulus_with_tare_pa: fit_one(model, Start::Tare, points).map(|f| f.parameters[0]),
            left_pa: scale * (found.squares / found.values as f64).sqrt(),
            parameters: found.parameters,
            rows: rows.clone(),
            reach: reach(pull, settings.window),
        });
    }
    let moduli: Vec<f64> = specimens.iter().map(|s| s.modulus_pa).collect();
    let modulus_pa = median(&moduli);
    let budget = budget(first, &specimens, modulus_pa, &settings.tolerances);
    Ok(Modulus {
        modulus_pa,
        sd_pa: budget.total * modulus_pa,
        interval_90: budget.interval(modulus_pa),
        model,
        scores,
        budget,
        remarks: remarks(pulls, settings),
        specimens,
    })
}

/// Lowest and highest strain of a pull inside the window.
fn reach(pull: &Pull, [low, high]: [f64; 2]) -> [f64; 2] {
    let strains = pull.window(low, high).into_iter().map(|row| pull.strain[row]);
    strains.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], e| [l.min(e), h.max(e)])
}

/// Rows of the window from where the stress stays above the preload.
fn rows(pull: &Pull, settings: &Settings) -> Result<Vec<usize>, DumbbellError> {
    let [low, high] = settings.window;
    let rows = pull.window(low, high);
    let top = rows.last().map_or(0.0, |r| pull.stress[*r]);
    let threshold = settings.preload * top;
    let toe = rows.iter().rposition(|r| pull.stress[*r] < threshold).map_or(0, |i| i + 1);
    let rows = rows[toe..].to_vec();
    if rows.len() < LEAST_ROWS {
        let label = pull.label.clone();
        return Err(DumbbellError::Window { label, rows: rows.len(), low, high, needed: LEAST_ROWS });
    }
    pull.refuse_slip(&rows)?;
    Ok(rows)
}

fn budget(first: &Pull, specimens: &[OfOne], modulus: f64, tolerances: &Tolerances) -> Budget {
    let n = specimens.len() as f64;
    let over = |half: f64, size: Option<f64>| size.map_or(0.0, |s| uniform(half / s));
    // Two readings of the start bound what it leaves open.
    let apart: Vec<f64> =
        specimens.iter().filter_map(|s| Some((s.modulus_with_tare_pa? - s.modulus_pa) / modulus)).collect();
    let start = uniform(median(&apart).abs());
    let shared = [
        over(tolerances.width_m, first.width_m),
        over(tolerances.gauge_length_m, first.gauge_length_m),
        uniform(tolerances.load_cell),
        if start.is_finite() { start } else { 0.0 },
    ];
    let squares: f64 = specimens.iter().map(|s| (s.modulus_pa / modulus - 1.0).powi(2)).sum();
    let mean = specimens.iter().map(|s| s.modulus_pa / modulus - 1.0).sum::<f64>() / n;
    let scatter = if specimens.len() > 1 {
        ((squares - n * mean * mean).max(0.0) / (n - 1.0)).sqrt()
    } else {
        tolerances.assumed_scatter
    };
    let own = [uniform(tolerances.thickness), specimens.first().map_or(0.0, |s| s.sd_pa / modulus)];
    Budget::new(shared, own, scatter, specimens.len())
}

fn remarks(pulls: &[Pull], settings: &Settings) -> Vec<String> {
    use crate::calib::export::StrainSource;
    let mut list = Vec::new();
    if pulls.iter().any(|p| p.source != Some(StrainSource::Extensometer)) {
        let said = pulls.iter().any(|p| p.source == Some(StrainSource::Crosshead));
        let how =
            if said { "is derived from the crosshead" } else { "has a source that the file does not say" };
        list.push(format!(
            "the strain {how}: what grips, shoulders and machine give way is in it, and E may be read too low"
        ));
    }
    if let [one] = pulls {
        let assumed = 100.0 * settings.tolerances.assumed_scatter;
        list.push(format!(
            "{}: one specimen; its scatter is assumed to be {assumed} %, not measured; ISO 37 asks for three",
            one.label
        ));
    }
    if pulls.iter().any(|p| p.width_m.is_none() || p.gauge_length_m.is_none()) {
        list.push("width or gauge length is not said: the interval leaves its tolerance out".to_owned());
    }
    list
}
