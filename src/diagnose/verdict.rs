//! What is said.

use super::beyond::Beyond;
use super::bulk::BulkKnob;
use super::confidence::{LEAST_CONFIDENCE, NEAR, PLAIN_SD, confidence, nothing_left_out, unlisted};
use super::diagnosis::{Estimate, Evidence, Phase, Verdict};
use super::extra::Shelf;
use super::in_step::{self, blamed, lag_in_step};
use super::knob::Knob;
use super::left::{Left, Mean};
use super::model::Model;
use super::nearest::{Nearest, nearest};
use super::physics::Physics;
use super::refit::{End, Fitted};
use super::rivals::{Rival, rivals, without};
use super::select::{Selection, Tried, least};
use super::{sticky, uneven};

/// The verdict with what led to it.
#[derive(Debug, Clone)]
pub(super) struct Judged {
    /// Whether there is a mismatch.
    pub detected: bool,
    /// Probability of a misfit as large by chance.
    pub p_value: f64,
    /// What is to blame.
    pub verdict: Verdict,
    /// What the missing thing must be like.
    pub properties: Vec<String>,
    /// What the recording cannot tell.
    pub remarks: Vec<String>,
    /// Index of the reading with what may act besides what is blamed, and is doubted.
    pub whole: Option<usize>,
    /// Index of the reading from which the one that comes closest is hardly told, where that was given up before it came to rest.
    pub given_up: Option<usize>,
    /// Indices of readings that are told from the one that comes closest by pokes that their fits have not seen, and by nothing else.
    pub mispredict: Vec<usize>,
    /// Where nothing is called, what comes so near to what is asked of it that it may act weakly.
    pub near: Option<Nearest>,
}

/// Readings whose sums of squares differ by less than this, or by this share of the gain, are not told apart.
const ALIKE: f64 = 25.0;
pub(super) const ALIKE_SHARE: f64 = 0.03;

/// By how much less a reading may explain that is not told apart from one with this gain.
pub(super) fn alike(gain: f64) -> f64 {
    ALIKE.max(ALIKE_SHARE * gain)
}

/// A reading that removes less than this share of what was left beyond noise does not explain the recording.
pub(super) const EXPLAINS: f64 = 0.8;

/// What gains so many times what is asked of it neither elements nor a zero that wanders have left, even where no mean shows it. Where nothing
/// acts the most that was seen is 1.5 (drying, for a zero that wandered through a session).
const BEYOND_CHANCE: f64 = 2.0;

/// Whether something acts beyond chance: one effect that does is enough, however little another adds.
pub(super) fn beyond_chance(earned: &[f64]) -> bool {
    earned.iter().any(|gain| *gain >= BEYOND_CHANCE)
}

/// The chosen reading, where it leaves less than the baseline: that may have another restraint, which serves it better than any effect does
/// with this one.
fn explaining(selection: &Selection, plain: f64) -> Option<&Tried> {
    selection.chosen.map(|i| &selection.tried[i]).filter(|chosen| chosen.fitted.cost < plain)
}

/// What explains more than the reading that is `chosen`, and plainly so, though it earns less than is asked of it: the chosen one with
/// something besides is no such thing.
fn disbelieved<'s>(selection: &'s Selection, chosen: &Tried) -> Option<&'s Tried> {
    let cost = chosen.fitted.cost;
    let plainly = alike(selection.base.cost - cost);
    let other = |t: &&Tried| !chosen.physics.iter().all(|p| t.physics.contains(p));
    let more = selection.tried.iter().filter(other).filter(|t| cost - t.fitted.cost > plainly);
    more.min_by(|a, b| a.fitted.cost.total_cmp(&b.fitted.cost))
}

/// What is said of a reading that is doubted, and of one that explains more.
fn doubts(selection: &Selection, chosen: &Tried, named: &[Physics], but: &str) -> Vec<String> {
    let closest = format!("{} comes closest of what can be believed, but {but}", names(named));
    let more = disbelieved(selection, chosen).map(|more| {
        let more = names(&more.physics);
        format!("{more} would explain more, but not enough to be told from what elements get wrong")
    });
    [closest].into_iter().chain(more).collect()
}

/// Judges a selection by what is left before and after it. `plain` is the sum of squares of the baseline with a restraint found for itself.
pub(super) fn judge(
    model: &Model<'_>,
    selection: &Selection,
    plain: f64,
    before: &Left,
    after: &Left,
    false_alarm: f64,
) -> Judged {
    let (before_noise, after_noise) = (Beyond::noise(before), Beyond::noise(after));
    let reading = explaining(selection, plain);
    let named = reading.map_or_else(Vec::new, |reading| blamed(reading, model.base()));
    // What a clock that is in step leaves is judged as if that were the baseline.
    let chosen = reading.filter(|_| !named.is_empty());
    let unblamed = if reading.is_some() && chosen.is_none() { &after_noise } else { &before_noise };
    let p_value = unblamed.p_value();
    let shows = p_value < false_alarm / 2.0;
    let mut detected = chosen.is_some() || shows;
    // Beside a lag that is not blamed, what entries explain of the baseline is that lag.
    let asked = |physics| least(model, &selection.base, physics);
    let near = reading.is_none().then(|| nearest(selection, plain, model.base(), asked)).flatten();
    let mut verdict = Verdict {
        physics: Vec::new(),
        unexplained: false,
        explained_by: Vec::new(),
        confidence: nothing_left_out(p_value, near.map_or(0.0, |near| near.share)),
        ambiguous_with: Vec::new(),
        evidence: None,
    };
    let (mut given_up, mut mispredict) = (None, Vec::new());
    let near = near.filter(|near| !detected && near.share >= NEAR);
    let mut remarks = model.remarks();
    if model.lab().is_some() && !selection.body_was_looked_at() {
        remarks.push(
            "no change of the body could be judged: debonding, inclusions, anisotropy, Poisson's ratio, a base that gives".to_owned(),
        );
    }
    if let Some(chosen) = chosen {
        let held_out = |fitted: &Fitted| fitted.weighed_held_out(model);
        let rivals = rivals(selection, plain, chosen, model.base(), held_out);
        let earned = |p: &Physics| {
            without(selection, plain, chosen, |other| other != p) / least(model, &selection.base, *p)
        };
        let earned: Vec<f64> = named.iter().map(earned).collect();
        let evidence = Evidence {
            explained: before_noise.explained(&after_noise),
            gain: earned.iter().copied().fold(f64::INFINITY, f64::min),
            margin: rivals.iter().map(Rival::margin).fold(1.0, f64::min).max(0.0),
            left: after_noise.deviations(),
            effects: named.len(),
        };
        verdict.evidence = Some(evidence);
        mispredict.extend(rivals.iter().filter(|r| r.only_mispredicts(HARDLY_TOLD)).map(|r| r.reading));
        let sure = confidence(&evidence);
        let standing = Standing::of(shows, sure, &earned, &evidence);
        if standing == Standing::Chance {
            remarks.push(format!("{} might explain the little that is left", names(&named)));
            // What is chosen earned what was asked of it, and so comes nearer than whatever does not.
            verdict.confidence = LEAST_CONFIDENCE;
            detected = false;
        } else if standing == Standing::Doubted {
            verdict.unexplained = true;
            verdict.confidence = unlisted(&before_noise);
            let closest = rivals.first().filter(|_| evidence.margin < HARDLY_TOLD);
            let decides = closest.filter(|_| evidence.explained >= EXPLAINS).map(|rival| rival.reading);
            given_up = decides.filter(|&rival| selection.tried[rival].fitted.end == End::GivenUp);
            let but = match closest {
                _ if evidence.explained < EXPLAINS => {
                    format!("leaves {:.0} % of what is beyond noise", 100.0 * (1.0 - evidence.explained))
                }
                Some(rival) => format!("is hardly told from {}", names(&rival.blamed)),
                None if evidence.effects > 2 => format!("takes {} effects for it", evidence.effects),
                None => "explains hardly more than chance or elements can".to_owned(),
            };
            remarks.extend(doubts(selection, chosen, &named, &but));
        } else {
            let mut as_well: Vec<Physics> = Vec::new();
            let alike =
                |rival: &&Rival| rival.lacks < alike(rival.own) && !rival.only_mispredicts(HARDLY_TOLD);
            for rival in rivals.iter().filter(alike) {
                for &physics in rival.blamed.iter().filter(|p| !chosen.physics.contains(p)) {
                    if !as_well.contains(&physics) {
                        as_well.push(physics);
                    }
                }
            }
            if !as_well.is_empty() {
                remarks.push(format!("the recording cannot tell {} from {}", names(&named), names(&as_well)));
            }
            verdict.unexplained = named.iter().any(|p| !p.catalogued());
            if verdict.unexplained && as_well.is_empty() {
                remarks.push(format!("no entry of the catalogue explains as much as {}", names(&named)));
            }
            match verdict.unexplained {
                true => verdict.explained_by = named,
                false => verdict.physics = named,
            }
            verdict.confidence = sure;
            verdict.ambiguous_with = as_well.into_iter().filter(|p| p.catalogued()).collect();
        }
        if verdict.unexplained {
            remarks.extend(uneven::said(model, &chosen.fitted));
            let drags = chosen.physics.contains(&Physics::StickyRestraint);
            remarks.extend(drags.then(|| sticky::ADVICE.to_owned()));
        }
    } else if detected {
        verdict.unexplained = true;
        verdict.confidence = unlisted(unblamed);
    }
    remarks.extend(near.map(|near| near.said()));
    remarks.extend(reading.and_then(|reading| lag_in_step(reading, model.base())).map(in_step::said));
    if let Some(Evidence { left, .. }) = verdict.evidence.filter(|e| detected && e.left > PLAIN_SD) {
        remarks.push(format!(
            "{left:.0} standard deviations beyond noise are left: something lesser may act besides, or elements leave it"
        ));
    }
    if chosen.is_some_and(|c| c.fitted.end != End::AtRest) {
        remarks.push("the fit had not come to rest after its last step; its values may be off".to_owned());
    }
    let properties = if detected { properties(model, before) } else { Vec::new() };
    Judged { detected, p_value, verdict, properties, remarks, whole: None, given_up, mispredict, near }
}

/// Whether a reading may be named.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Standing {
    /// No mismatch shows without it, and it is doubtful itself, or something lesser may have left what it explains.
    Chance,
    /// There is a mismatch, but the reading is doubtful, or leaves too much of it.
    Doubted,
    /// It may.
    Named,
}

impl Standing {
    fn of(shows: bool, sure: f64, earned: &[f64], evidence: &Evidence) -> Self {
        if !shows && (sure < LEAST_CONFIDENCE || !beyond_chance(earned)) {
            Self::Chance
        } else if sure < LEAST_CONFIDENCE || evidence.explained < EXPLAINS && evidence.left > PLAIN_SD {
            Self::Doubted
        } else {
            Self::Named
        }
    }
}

/// Rivals that lack less than this share of what is explained make a reading doubtful.
const HARDLY_TOLD: f64 = 0.3;

/// No reading is surer beside which something else may act.
const NOT_ALONE: f64 = 0.85;

/// Names in a row.
fn names(physics: &[Physics]) -> String {
    physics.iter().map(|p| p.said()).collect::<Vec<_>>().join(" and ")
}

/// What follows for the missing thing from where the baseline misses.
fn properties(model: &Model<'_>, left: &Left) -> Vec<String> {
    let of = |which: &dyn Fn(&Mean) -> bool| left.mean_square(which);
    let mut said = Vec::new();
    let (force, _) = of(&|m| m.marker.is_none());
    let (markers, _) = of(&|m| m.marker.is_some());
    said.push(match (force > 2.0, markers > 1.2) {
        (true, false) => "it shows in the force and not in the markers".to_owned(),
        (false, true) => "it shows in the markers and not in the force".to_owned(),
        _ => "it shows in force and markers alike".to_owned(),
    });
    let phase = |phase: Phase| of(&|m| m.phase == phase).0 - 1.0;
    let (approach, hold, retreat) = (phase(Phase::Approach), phase(Phase::Hold), phase(Phase::Retreat));
    if approach > 3.0 * retreat || retreat > 3.0 * approach {
        said.push("it differs between approach and retreat: it has a memory, or lost motion".to_owned());
    }
    if hold > 3.0 * approach.max(retreat) {
        said.push("it shows most while the tip is held".to_owned());
    }
    let depth = |mean: &Mean| model.tracks[mean.poke].depth_m.iter().copied().fold(0.0, f64::max);
    let deepest = left.means.iter().map(depth).fold(0.0, f64::max);
    let (deep, shallow) =
        (of(&|m| depth(m) > 0.75 * deepest).0 - 1.0, of(&|m| depth(m) < 0.5 * deepest).0 - 1.0);
    if deep > 8.0 * shallow.max(0.0) && deep > 1.0 {
        said.push("it grows faster than the depth".to_owned());
    }
    said
}

/// A stiffening below which the law is worked out by way of large strain alone.
const LITTLE_STIFFENING: f64 = 1.0;

/// Confidence of a stiffening that takes the place of what could not be worked out.
const SHORT_OF_DEPTH: f64 = 0.7;

/// A modulus this many standard deviations outside the range that the operator expects is doubted.
const DOUBTED_SD: f64 = 3.0;

/// Coordinates of a ball's centre with their ranges (m); empty where there is no ball.
pub(super) fn ball_centre(model: &Model<'_>, fitted: &Fitted) -> Vec<(f64, [f64; 2])> {
    let ball = |knob: &Knob| matches!(knob, Knob::Bulk(BulkKnob::BallCentre(_)));
    let knobs = fitted.acting.knobs.iter().enumerate().filter(|(_, knob)| ball(knob));
    knobs.map(|(i, knob)| (fitted.at[model.base() + i], model.range(*knob).0)).collect()
}

/// Whether a value (m) lies at an end of its range.
fn at_an_end(value: f64, [low, high]: [f64; 2]) -> bool {
    const CLOSE_M: f64 = 1e-5;
    (value - low).min(high - value) < CLOSE_M
}

impl Judged {
    /// Whether nothing is named, though an entry of the catalogue might be to blame.
    pub(super) fn doubted(&self) -> bool {
        self.verdict.blamed().is_empty()
    }

    /// Those of the effects of the reading `whole` that are not blamed may act besides.
    pub(super) fn part_of(&mut self, selection: &Selection, whole: usize, base: usize) {
        let reading = &selection.tried[whole];
        let mut besides = blamed(reading, base);
        besides.retain(|p| !self.verdict.physics.contains(p));
        self.remarks.extend(lag_in_step(reading, base).map(in_step::said));
        if besides.is_empty() {
            return;
        }
        self.whole = Some(whole);
        self.verdict.confidence = self.verdict.confidence.min(NOT_ALONE);
        let said = format!("besides, {} may act: this recording does not settle that", names(&besides));
        self.remarks.push(said);
    }

    /// A force that is read too large or too small by a factor looks like another modulus, and like nothing else: where the
    /// modulus lies outside the range that the operator expects, that stays possible, whatever was found.
    pub(super) fn doubt_modulus(&mut self, modulus_pa: Estimate, [low, high]: [f64; 2]) {
        let Estimate { value, sd } = modulus_pa;
        let outside = (low - value).max(value - high);
        let blamed = self.verdict.blamed().iter().chain(&self.verdict.ambiguous_with);
        let named = blamed.copied().any(|p| p == Physics::ForceGain);
        if outside <= DOUBTED_SD * sd || named {
            return;
        }
        self.verdict.ambiguous_with.push(Physics::ForceGain);
        self.verdict.confidence = self.verdict.confidence.min(LEAST_CONFIDENCE);
        self.remarks.push(format!(
            "the modulus, {:.2} kPa, lies outside the range that the operator expects ({:.2} to {:.2} kPa): a force read too \
             large or too small by a factor would look the same",
            1e-3 * value, 1e-3 * low, 1e-3 * high
        ));
    }

    /// Stiffening with strain contains large strain alone, and, if there is little of it, takes its place where that could not
    /// be worked out as deep as the recording goes.
    pub(super) fn doubt_stiffening(&mut self, model: &Model<'_>, chosen: &Fitted) {
        let little = chosen.acting.knobs.iter().enumerate().any(|(i, knob)| {
            matches!(knob, Knob::Stiffening(_)) && chosen.at[model.base() + i] < LITTLE_STIFFENING
        });
        let blamed = little && self.verdict.blamed().contains(&Physics::StrainStiffening);
        if !blamed || model.shelf(true).is_none_or(Shelf::strains_in_full) {
            return;
        }
        let Verdict { ambiguous_with, confidence, .. } = &mut self.verdict;
        if !ambiguous_with.contains(&Physics::FiniteStrain) {
            ambiguous_with.push(Physics::FiniteStrain);
        }
        *confidence = confidence.min(SHORT_OF_DEPTH);
        self.remarks.push(
            "without stiffening the body is close to giving way under the deepest poke, and was worked out for lesser depths \
             only: stiffening stands for large strain of any kind"
                .to_owned(),
        );
    }

    /// A ball that would leave the body if it could stands in for something at its surface, such as restraint of another kind than was found.
    /// `centre` holds every coordinate with its range (m).
    pub(super) fn doubt_ball(&mut self, centre: &[(f64, [f64; 2])]) {
        let at_surface = centre.iter().any(|(value, range)| at_an_end(*value, *range));
        if !at_surface || !self.verdict.blamed().contains(&Physics::Inclusion) {
            return;
        }
        self.verdict.confidence = self.verdict.confidence.min(LEAST_CONFIDENCE);
        self.remarks.push(
            "the ball is centred on the surface of the phantom: restraint of another kind than was found there may look the same"
                .to_owned(),
        );
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::rivals::tests::{selection, with_a_lag_in_step};
    use super::*;

    /// These are blamed, so surely.
    pub(in super::super) fn judged(physics: &[Physics], confidence: f64) -> Judged {
        let verdict = Verdict {
            physics: physics.to_vec(),
            unexplained: false,
            explained_by: Vec::new(),
            confidence,
            ambiguous_with: Vec::new(),
            evidence: None,
        };
        Judged {
            detected: true,
            p_value: 0.0,
            verdict,
            properties: Vec::new(),
            remarks: Vec::new(),
            whole: None,
            given_up: None,
            mispredict: Vec::new(),
            near: None,
        }
    }

    /// A reading with a restraint that serves worse than the baseline's.
    #[test]
    fn what_leaves_more_than_the_baseline_explains_nothing() {
        let selection = selection();
        assert_eq!(explaining(&selection, 1000.0).map(|t| t.fitted.cost), Some(100.0));
        assert!(explaining(&selection, 90.0).is_none());
        assert!(explaining(&Selection { chosen: None, ..selection }, 1000.0).is_none());
    }

    /// What explains more was not believed; with the same effect and another it is no rival, and hardly more is none.
    #[test]
    fn what_explains_more_is_told() {
        let mut selection = selection();
        let more = |s: &Selection, chosen: usize| disbelieved(s, &s.tried[chosen]).map(|t| t.fitted.cost);
        assert_eq!(more(&selection, 2), Some(110.0));
        assert_eq!(more(&selection, 3), Some(100.0));
        assert_eq!(more(&selection, 1), None);
        let said = |chosen: usize| {
            doubts(&selection, &selection.tried[chosen], &[Physics::CameraLag], "leaves much")
        };
        assert_eq!((said(1).len(), said(2).len()), (1, 2));
        assert!(said(2)[0].contains("camera-lag comes closest"), "{:?}", said(2));
        assert!(said(2)[1].contains("drying") && said(2)[1].contains("would explain more"), "{:?}", said(2));
        selection.tried.retain(|t| t.physics.len() == 1);
        assert_eq!(more(&selection, 2), None);
    }

    /// The plainer of two effects that are doubted together, and what is said of the other.
    #[test]
    fn one_of_two_may_stand_alone() {
        let selection = selection();
        let whole = &selection.tried[0];
        assert_eq!((selection.part(whole, 1), selection.part(whole, 0)), (Some(1), None));
        let mut alone = judged(&[Physics::Drying], 0.97);
        assert!(!alone.doubted());
        alone.part_of(&selection, 0, 0);
        assert!(alone.remarks[0].contains("besides, camera-lag may act"), "{:?}", alone.remarks);
        assert!(alone.verdict.confidence <= NOT_ALONE);
        let fewer = Selection { chosen: Some(1), ..selection };
        assert_eq!(alone.why(&fewer, 0), alone.why(&fewer, 4));
        assert_ne!(alone.why(&fewer, 0), alone.why(&fewer, 3));
        // A lag that is not blamed is told, and settles nothing.
        let in_step = with_a_lag_in_step();
        let mut plain = Judged { whole: None, remarks: Vec::new(), ..alone.clone() };
        plain.verdict.confidence = 0.97;
        plain.part_of(&in_step, 0, 1);
        assert_eq!((plain.whole, plain.verdict.confidence, plain.remarks.len()), (None, 0.97, 1));
        assert!(plain.remarks[0].contains("late by 0.9 ms"), "{:?}", plain.remarks);
        alone.verdict.physics.clear();
        assert!(alone.doubted());
        alone.verdict.explained_by.push(Physics::UnevenScale);
        assert!(!alone.doubted());
    }

    /// What shows is never called chance because an explanation of it is doubtful, and a doubtful one is never named.
    #[test]
    fn a_mismatch_that_shows_is_not_nothing() {
        let clear = Evidence { explained: 1.0, gain: 10.0, margin: 1.0, left: 0.0, effects: 1 };
        let too_little = Evidence { explained: 0.7, left: 10.0, ..clear };
        let (plain, weak) = (&[5.0][..], &[1.2][..]);
        for (shows, sure, earned, evidence, expected) in [
            (true, 0.9, plain, clear, Standing::Named),
            (true, 0.9, weak, clear, Standing::Named),
            (true, 0.3, plain, clear, Standing::Doubted),
            (true, 0.9, plain, too_little, Standing::Doubted),
            (true, 0.9, plain, Evidence { left: 2.0, ..too_little }, Standing::Named),
            (false, 0.9, plain, clear, Standing::Named),
            (false, 0.9, weak, clear, Standing::Chance),
            (false, 0.3, plain, clear, Standing::Chance),
        ] {
            assert_eq!(Standing::of(shows, sure, earned, &evidence), expected, "{shows} {sure} {earned:?}");
        }
    }

    /// A ball centred within 10 µm of a side is doubted, one a millimetre inside is not; nor is anything where no ball is blamed.
    #[test]
    fn a_ball_on_the_surface_is_doubted() {
        let of = |physics: Physics, z: f64| {
            let mut judged = judged(&[Physics::Drying, physics], 0.96);
            judged.doubt_ball(&[(0.05, [0.0, 0.1]), (z, [0.0, 0.025])]);
            (judged.verdict.confidence, judged.remarks.len())
        };
        for z in [0.0, 5e-6, 0.025] {
            assert_eq!(of(Physics::Inclusion, z), (LEAST_CONFIDENCE, 1), "{z}");
        }
        assert_eq!((of(Physics::Inclusion, 1e-3), of(Physics::Inclusion, 0.024)), ((0.96, 0), (0.96, 0)));
        assert_eq!(of(Physics::SelfWeight, 0.0), (0.96, 0));
    }

    /// A camera's scale that earns 27 times what is asked acts, whether or not a gain beside it earns more than chance may.
    #[test]
    fn one_plain_effect_is_enough() {
        assert!(beyond_chance(&[27.0, 1.8]) && beyond_chance(&[1.8, 27.0]));
        assert!(!beyond_chance(&[1.8, 1.5]));
    }
}
