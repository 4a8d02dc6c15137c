//! The sums over all draws.

use super::bins::{Bin, calibration_error, calibration_error_by_chance, reliability};
use super::judge::{Judged, Kind, Outcome};
use serde::Serialize;
use std::collections::BTreeMap;

/// Bins of the reliability table.
const CONFIDENCE_BINS: usize = 10;
/// Bins of the power curve.
const STRENGTH_BINS: usize = 6;

/// So many of so many.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Share {
    /// So many.
    pub of: usize,
    /// Out of so many.
    pub all: usize,
}

/// How often 90 % intervals hold the truth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Coverage {
    /// Of the modulus, after, where the verdict is right.
    pub modulus: Share,
    /// Of scalar parameters of entries named rightly.
    pub parameters: Share,
}

/// Median and root mean square of absolute values.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spread {
    /// How many.
    pub count: usize,
    /// Median of the absolute values.
    pub median: Option<f64>,
    /// Root mean square.
    pub rms: Option<f64>,
}

/// What one entry's draws came to.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Line {
    /// The concealed ids, joined by `+`.
    pub concealed: String,
    /// Draws by outcome.
    pub outcomes: BTreeMap<Outcome, usize>,
    /// What was named instead, how often.
    pub instead: BTreeMap<String, usize>,
}

/// From where on effects count as above the limit of detection.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Limit {
    /// Least strength.
    pub strength: f64,
    /// Least strength over the norm of the readings: elements misplace such a share.
    pub share: f64,
}

impl Limit {
    /// What is not known does not count as below.
    fn passed_by(&self, draw: &Judged) -> bool {
        draw.strength.is_none_or(|s| s >= self.strength)
            && draw.strength_share.is_none_or(|s| s >= self.share)
    }

    /// Whether each effect of a draw passes by itself; what is not known does not count as below.
    fn passed_by_each(&self, draw: &Judged) -> bool {
        draw.own_strength.iter().all(|s| *s >= self.strength)
    }
}

/// The scorecard.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Scorecard {
    /// Draws in all.
    pub draws: usize,
    /// Whether they were diagnosed quickly, which is less sure.
    pub quick: bool,
    /// The limit of detection that was stated.
    pub detection_limit: Limit,
    /// One effect of the catalogue above the limit: named right.
    pub named_right: Share,
    /// The same of all strengths.
    pub named_right_all: Share,
    /// Several effects above the limit together: all named.
    pub several_right: Share,
    /// Several effects above the limit together: some named, and nothing else.
    pub several_partly: Share,
    /// Of these, where each is above the limit beside the others: all named.
    pub each_right: Share,
    /// Of these, where each is above the limit beside the others: some named, and nothing else.
    pub each_partly: Share,
    /// Nothing concealed: a mismatch called.
    pub false_alarms: Share,
    /// Off the catalogue, above the limit: called unexplained.
    pub off_catalogue_unexplained: Share,
    /// Off the catalogue, above the limit: something named.
    pub off_catalogue_named: Share,
    /// In the catalogue, above the limit: called unexplained.
    pub abstained: Share,
    /// In the catalogue, above the limit: nothing called.
    pub missed: Share,
    /// In the catalogue, above the limit: something else named.
    pub wrong_name: Share,
    /// Ended with an error.
    pub failed: Share,
    /// Distance of places (m), where named right.
    pub place_error_m: Spread,
    /// Relative error of parameters, where named right.
    pub parameter_error: Spread,
    /// Relative error of the modulus where effects were named right, before.
    pub modulus_error_before: Spread,
    /// The same after.
    pub modulus_error_after: Spread,
    /// Relative error of the modulus where nothing was concealed.
    pub modulus_error_nothing: Spread,
    /// Held-out misfit where effects were named right, before.
    pub held_out_before: Spread,
    /// The same after.
    pub held_out_after: Spread,
    /// Confidence against share right.
    pub reliability: Vec<Bin>,
    /// Expected calibration error.
    pub calibration_error: Option<f64>,
    /// What chance alone would make of it, were every confidence right.
    pub calibration_error_by_chance: Option<f64>,
    /// Strength against share detected, effects of and off the catalogue.
    pub detected_by_strength: Vec<Bin>,
    /// Strength against share named right, effects of the catalogue.
    pub named_by_strength: Vec<Bin>,
    /// Coverage of 90 % intervals.
    pub coverage: Coverage,
    /// Mean time of a diagnosis (s).
    pub mean_seconds: f64,
    /// By what was concealed.
    pub lines: Vec<Line>,
    /// Every draw.
    pub judged: Vec<Judged>,
}

impl Scorecard {
    /// Counts.
    pub fn of(judged: Vec<Judged>, detection_limit: Limit) -> Self {
        let share = |among: &dyn Fn(&Judged) -> bool, hit: &dyn Fn(&Judged) -> bool| {
            let among: Vec<&Judged> = judged.iter().filter(|j| among(j)).collect();
            Share { of: among.iter().filter(|j| hit(j)).count(), all: among.len() }
        };
        let above = |j: &Judged| detection_limit.passed_by(j);
        let is = |outcome: Outcome| move |j: &Judged| j.outcome == outcome;
        let one = |j: &Judged| j.kind == Kind::One;
        let several = |j: &Judged| j.kind == Kind::Several && above(j);
        let each = |j: &Judged| several(j) && detection_limit.passed_by_each(j);
        let off = |j: &Judged| j.kind == Kind::OffCatalogue && above(j);
        let listed = |j: &Judged| matches!(j.kind, Kind::One | Kind::Several);
        let listed_above = |j: &Judged| listed(j) && above(j);
        let right = |j: &&Judged| listed(j) && j.outcome == Outcome::Right;
        let rightly = || judged.iter().filter(right);
        let confidences: Vec<(f64, bool)> =
            judged.iter().filter_map(|j| Some((j.confidence?, j.outcome == Outcome::Right))).collect();
        let by_strength = |among: &dyn Fn(&Judged) -> bool, hit: &dyn Fn(&Judged) -> bool| {
            let pairs: Vec<(f64, bool)> =
                judged.iter().filter(|j| among(j)).filter_map(|j| Some((j.strength?, hit(j)))).collect();
            reliability(&pairs, STRENGTH_BINS)
        };
        let reliability = reliability(&confidences, CONFIDENCE_BINS);
        let nothing = |j: &Judged| j.kind == Kind::Nothing;
        let covered = |intervals: Vec<bool>| Share {
            of: intervals.iter().filter(|c| **c).count(),
            all: intervals.len(),
        };
        Self {
            draws: judged.len(),
            quick: false,
            detection_limit,
            named_right: share(&|j| one(j) && above(j), &is(Outcome::Right)),
            named_right_all: share(&one, &is(Outcome::Right)),
            several_right: share(&several, &is(Outcome::Right)),
            several_partly: share(&several, &is(Outcome::Partly)),
            each_right: share(&each, &is(Outcome::Right)),
            each_partly: share(&each, &is(Outcome::Partly)),
            false_alarms: share(&nothing, &is(Outcome::FalseAlarm)),
            off_catalogue_unexplained: share(&off, &is(Outcome::Right)),
            off_catalogue_named: share(&off, &is(Outcome::WrongName)),
            abstained: share(&listed_above, &is(Outcome::Abstained)),
            missed: share(&listed_above, &is(Outcome::Missed)),
            wrong_name: share(&listed_above, &is(Outcome::WrongName)),
            failed: share(&|_| true, &is(Outcome::Failed)),
            place_error_m: spread(rightly().filter_map(|j| j.place_error_m)),
            parameter_error: spread(rightly().flat_map(|j| &j.parameters).map(|p| p.relative)),
            modulus_error_before: spread(rightly().filter_map(|j| j.modulus_error[0])),
            modulus_error_after: spread(rightly().filter_map(|j| j.modulus_error[1])),
            modulus_error_nothing: spread(
                judged.iter().filter(|j| nothing(j)).filter_map(|j| j.modulus_error[0]),
            ),
            held_out_before: spread(rightly().filter_map(|j| j.held_out[0])),
            held_out_after: spread(rightly().filter_map(|j| j.held_out[1])),
            calibration_error: calibration_error(&reliability),
            calibration_error_by_chance: calibration_error_by_chance(
                &confidences.iter().map(|(confidence, _)| *confidence).collect::<Vec<_>>(),
                CONFIDENCE_BINS,
            ),
            reliability,
            detected_by_strength: by_strength(&|j| j.kind != Kind::Nothing, &|j| j.detected),
            named_by_strength: by_strength(&listed, &is(Outcome::Right)),
            coverage: Coverage {
                modulus: covered(
                    judged
                        .iter()
                        .filter(|j| j.outcome == Outcome::Right && j.kind != Kind::OffCatalogue)
                        .filter_map(|j| j.modulus_covered)
                        .collect(),
                ),
                parameters: covered(
                    rightly().flat_map(|j| &j.parameters).filter_map(|p| p.covered).collect(),
                ),
            },
            mean_seconds: judged.iter().map(|j| j.seconds).sum::<f64>() / judged.len().max(1) as f64,
            lines: lines(&judged),
            judged,
        }
    }
}

fn spread(values: impl Iterator<Item = f64>) -> Spread {
    let mut sizes: Vec<f64> = values.map(f64::abs).collect();
    sizes.sort_by(f64::total_cmp);
    let count = sizes.len();
    let median = (count > 0).then(|| 0.5 * (sizes[(count - 1) / 2] + sizes[count / 2]));
    let rms = (count > 0).then(|| (sizes.iter().map(|v| v * v).sum::<f64>() / count as f64).sqrt());
    Spread { count, median, rms }
}

/// One line for each set of concealed ids, in the order of their names.
fn lines(judged: &[Judged]) -> Vec<Line> {
    let mut lines: BTreeMap<String, Line> = BTreeMap::new();
    for draw in judged {
        let mut ids = draw.concealed.clone();
        ids.sort();
        let concealed = if ids.is_empty() { "nothing".to_owned() } else { ids.join(" + ") };
        let line = lines.entry(concealed.clone()).or_insert_with(|| Line {
            concealed,
            outcomes: BTreeMap::new(),
            instead: BTreeMap::new(),
        });
        *line.outcomes.entry(draw.outcome).or_default() += 1;
        if !matches!(draw.outcome, Outcome::Right | Outcome::Failed | Outcome::Missed) {
            *line.instead.entry(draw.named.join(" + ")).or_default() += 1;
        }
    }
    lines.into_values().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judged(kind: Kind, outcome: Outcome, confidence: f64, strength: Option<f64>) -> Judged {
        Judged {
            name: "draw".to_owned(),
            kind,
            concealed: match kind {
                Kind::Nothing => Vec::new(),
                Kind::One => vec!["drying".to_owned()],
                Kind::Several => vec!["inclusion".to_owned(), "drying".to_owned()],
                Kind::OffCatalogue => vec!["unexplained".to_owned()],
            },
            named: vec!["tip-slip".to_owned()],
            ambiguous_with: Vec::new(),
            outcome,
            detected: outcome != Outcome::Missed,
            p_value: None,
            confidence: Some(confidence),
            evidence: None,
            strength,
            own_strength: Vec::new(),
            strength_share: None,
            place_error_m: None,
            parameters: Vec::new(),
            modulus_error: [Some(0.1), Some(-0.02)],
            modulus_covered: Some(true),
            held_out: [Some(9.0), Some(1.0)],
            seconds: 4.0,
            error: None,
        }
    }

    #[test]
    fn each_draw_counts_where_it_belongs() {
        let card = Scorecard::of(
            vec![
                judged(Kind::One, Outcome::Right, 0.9, Some(30.0)),
                judged(Kind::One, Outcome::Missed, 0.6, Some(2.0)),
                judged(Kind::One, Outcome::WrongName, 0.7, Some(20.0)),
                judged(Kind::One, Outcome::Abstained, 0.7, None),
                judged(Kind::Several, Outcome::Partly, 0.5, Some(50.0)),
                judged(Kind::Nothing, Outcome::Right, 0.98, None),
                judged(Kind::Nothing, Outcome::FalseAlarm, 0.4, None),
                judged(Kind::OffCatalogue, Outcome::Right, 0.8, Some(40.0)),
                judged(Kind::OffCatalogue, Outcome::WrongName, 0.8, Some(5.0)),
            ],
            Limit { strength: 10.0, share: 0.0 },
        );
        let share = |of, all| Share { of, all };
        assert_eq!(card.draws, 9);
        assert_eq!(card.named_right, share(1, 3), "the weak one is below the limit");
        assert_eq!(card.named_right_all, share(1, 4));
        assert_eq!((card.several_right, card.several_partly), (share(0, 1), share(1, 1)));
        assert_eq!(card.false_alarms, share(1, 2));
        assert_eq!(card.off_catalogue_unexplained, share(1, 1));
        assert_eq!(card.off_catalogue_named, share(0, 1));
        assert_eq!((card.abstained, card.missed, card.wrong_name), (share(1, 4), share(0, 4), share(1, 4)));
        assert_eq!(card.modulus_error_after.median, Some(0.02));
        assert_eq!(card.held_out_before.rms, Some(9.0));
        assert_eq!(card.coverage.modulus, share(2, 2));
        assert_eq!(card.reliability.iter().map(|b| b.count).sum::<usize>(), 9);
        assert_eq!(card.detected_by_strength.iter().map(|b| b.count).sum::<usize>(), 6);
        assert_eq!(card.mean_seconds, 4.0);
        let names: Vec<&str> = card.lines.iter().map(|l| l.concealed.as_str()).collect();
        assert_eq!(names, ["drying", "drying + inclusion", "nothing", "unexplained"]);
        assert_eq!(card.lines[0].instead.get("tip-slip"), Some(&2));
    }

    #[test]
    fn of_several_each_must_pass_the_limit_by_itself() {
        let with = |outcome, own: &[f64]| {
            let draw = judged(Kind::Several, outcome, 0.9, Some(50.0));
            Judged { own_strength: own.to_vec(), ..draw }
        };
        let draws = vec![
            with(Outcome::Right, &[40.0, 12.0]),
            with(Outcome::Right, &[49.0, 9.0]),
            with(Outcome::Partly, &[49.0, 3.0]),
            with(Outcome::Partly, &[]),
        ];
        let card = Scorecard::of(draws, Limit { strength: 10.0, share: 0.0 });
        let share = |of, all| Share { of, all };
        assert_eq!((card.each_right, card.each_partly), (share(1, 2), share(1, 2)), "unknown is not below");
        assert_eq!((card.several_right, card.several_partly), (share(2, 4), share(2, 4)));
    }

    #[test]
    fn an_effect_must_pass_both_limits() {
        let limit = Limit { strength: 10.0, share: 0.005 };
        let passed = |strength, share| {
            let draw = judged(Kind::One, Outcome::Right, 0.9, Some(strength));
            limit.passed_by(&Judged { strength_share: share, ..draw })
        };
        let all = [(20.0, Some(0.01)), (20.0, Some(0.001)), (5.0, Some(0.01)), (20.0, None)];
        assert_eq!(all.map(|(strength, share)| passed(strength, share)), [true, false, false, true]);
    }

    #[test]
    fn no_draws_make_an_empty_card() {
        let card = Scorecard::of(Vec::new(), Limit::default());
        assert_eq!((card.draws, card.calibration_error, card.mean_seconds), (0, None, 0.0));
        assert_eq!(card.place_error_m, Spread { count: 0, median: None, rms: None });
    }
}
