//! Which model, with how many terms? The one that best predicts what its fit did not see.
//!
//! One recording: models are fitted to the ramp and the first part of the hold, compared on the next part, refitted to both, and the winner's
//! error is taken on the last part, which neither saw. Several recordings: each is predicted from the others; the score is the mean over them. At last the
//! winner, and what predicts about as well, is fitted to everything. A model with more parameters must be better by a tenth, or the simpler one stays (one-standard-error rule in spirit: Hastie, Tibshirani and
//! Friedman 2009, The Elements of Statistical Learning, 7.10).

use super::RelaxationError;
use super::law::{Kind, Law};
use super::recording::{Phase, Recording};
use super::search::{deviations, rows_until, search};

/// What may be set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Share of the hold that models are fitted to when they are compared.
    pub compared_to: f64,
    /// Share of the hold that the chosen model is fitted to; it is tested on the rest.
    pub fitted_to: f64,
    /// Free terms at most.
    pub most_terms: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self { compared_to: 0.35, fitted_to: 0.6, most_terms: 6 }
    }
}

/// How much better a model with more parameters must predict.
const BETTER: f64 = 0.9;
/// A model that misses so much more than the best is out.
const WORSE: f64 = 1.25;

/// A model that was tried.
#[derive(Debug, Clone, PartialEq)]
pub struct Tried {
    /// Which.
    pub kind: Kind,
    /// Root mean square of what it missed in data that it had not seen, over their deviations (one hundredth of the peak where none are
    /// stated); none where it had no value.
    pub score: Option<f64>,
}

/// Rows that a fit did not see, with measured less predicted (N or Pa).
pub type Unseen = Vec<(usize, f64)>;

/// The model that was chosen.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// Fitted to everything.
    pub law: Law,
    /// Those that predict about as well, fitted to everything.
    pub others: Vec<Law>,
    /// All that were tried.
    pub tried: Vec<Tried>,
    /// For each recording, what it misses in rows that its fit did not see.
    pub unseen: Vec<Unseen>,
}

impl Choice {
    /// Greatest of what is missed in unseen rows over the peak, by recording.
    pub fn worst_share(&self, recordings: &[Recording]) -> Vec<f64> {
        let share = |(r, rows): (&Recording, &Unseen)| {
            rows.iter().fold(0.0, |m: f64, (_, left)| m.max(left.abs())) / (r.peak() - r.zero())
        };
        recordings.iter().zip(&self.unseen).map(share).collect()
    }

    /// Share of unseen rows within two stated deviations, by recording.
    pub fn within_two_sd(&self, recordings: &[Recording]) -> Vec<f64> {
        let share = |(r, rows): (&Recording, &Unseen)| {
            let sd = deviations(r);
            let within = rows.iter().filter(|(row, left)| left.abs() <= 2.0 * sd[*row]).count();
            within as f64 / rows.len().max(1) as f64
        };
        recordings.iter().zip(&self.unseen).map(share).collect()
    }
}

/// Chooses.
///
/// # Errors
/// [`RelaxationError::NoModel`].
pub fn choose(recordings: &[Recording], settings: &Settings) -> Result<Choice, RelaxationError> {
    let kinds = kinds(settings.most_terms);
    let mut tried: Vec<Tried> = Vec::new();
    // Place in `tried`, score, and, of several recordings, what each is missed by from the others.
    let mut best: Option<(usize, f64, Vec<Unseen>)> = None;
    for (at, kind) in kinds.iter().enumerate() {
        let (score, unseen) = match recordings {
            [one] => (later(*kind, one, settings), Vec::new()),
            several => {
                across(*kind, several).map_or((None, Vec::new()), |all| (Some(rms(several, &all)), all))
            }
        };
        tried.push(Tried { kind: *kind, score });
        let Some(score) = score.filter(|s| s.is_finite()) else { continue };
        if best.as_ref().is_none_or(|(_, least, _)| score < BETTER * least) {
            best = Some((at, score, unseen));
        }
    }
    let none = RelaxationError::NoModel { tried: kinds.len() };
    let Some((at, _, across)) = best else { return Err(none) };
    let seen_to = if recordings.len() == 1 { settings.fitted_to } else { 1.0 };
    let seen: Vec<_> = recordings.iter().map(|r| (r, rows_until(r, seen_to))).collect();
    let unseen = match recordings {
        [one] => match search(kinds[at], &seen) {
            Some(law) => vec![left_of(&law, one, seen_to, 1.0)],
            None => return Err(none),
        },
        _ => across,
    };
    let all: Vec<_> = recordings.iter().map(|r| (r, rows_until(r, 1.0))).collect();
    let least = tried.iter().filter_map(|t| t.score).fold(f64::INFINITY, f64::min);
    let close = |t: &&Tried| t.kind != kinds[at] && t.score.is_some_and(|s| s <= WORSE * least);
    let others = tried.iter().filter(close).filter_map(|t| search(t.kind, &all)).collect();
    let Some(law) = search(kinds[at], &all) else { return Err(none) };
    Ok(Choice { law, others, tried, unseen })
}

/// From few parameters to many.
fn kinds(most_terms: usize) -> Vec<Kind> {
    let mut kinds = Vec::new();
    for (stiffens, apart) in [(false, false), (true, false), (true, true)] {
        kinds.extend((0..=most_terms).map(|terms| Kind { terms, stiffens, apart }));
    }
    kinds.sort_by_key(Kind::parameters);
    kinds
}

fn left_of(law: &Law, recording: &Recording, from: f64, to: f64) -> Unseen {
    let hold = recording.rows(Phase::Hold);
    let (start, end) = (recording.time_s[hold[0]], recording.time_s[hold[hold.len() - 1]]);
    let modelled = law.force(recording);
    let inside = |r: &usize| {
        let share = (recording.time_s[*r] - start) / (end - start);
        share > from && share <= to
    };
    hold.into_iter().filter(inside).map(|r| (r, recording.force[r] - modelled[r])).collect()
}

/// Root mean square over the part of the hold that follows what was fitted.
fn later(kind: Kind, recording: &Recording, settings: &Settings) -> Option<f64> {
    let law = search(kind, &[(recording, rows_until(recording, settings.compared_to))])?;
    let follows = left_of(&law, recording, settings.compared_to, settings.fitted_to);
    Some(rms(std::slice::from_ref(recording), &[follows]))
}

/// Each recording predicted from the others.
fn across(kind: Kind, recordings: &[Recording]) -> Option<Vec<Unseen>> {
    (0..recordings.len())
        .map(|out| {
            let seen: Vec<_> = recordings
                .iter()
                .enumerate()
                .filter(|(i, _)| *i != out)
                .map(|(_, r)| (r, rows_until(r, 1.0)))
                .collect();
            let law = search(kind, &seen)?;
            let modelled = law.force(&recordings[out]);
            let known = |r: &usize| recordings[out].phase[*r] != Phase::Unloading;
            let rows = (0..modelled.len()).filter(known);
            Some(rows.map(|r| (r, recordings[out].force[r] - modelled[r])).collect())
        })
        .collect()
}

fn rms(recordings: &[Recording], left: &[Unseen]) -> f64 {
    let squares = recordings.iter().zip(left).flat_map(|(recording, rows)| {
        let sd = deviations(recording);
        rows.iter().map(move |(row, left)| (left / sd[*row]).powi(2))
    });
    let all: Vec<f64> = squares.collect();
    (all.iter().sum::<f64>() / all.len().max(1) as f64).sqrt()
}
