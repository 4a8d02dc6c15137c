//! What is said.

use super::beyond::Beyond;
use super::confidence::{LEAST_CONFIDENCE, PLAIN_SD, confidence, nothing_left_out, unlisted};
use super::diagnosis::{Estimate, Evidence, Phase, Verdict};
use super::extra::Shelf;
use super::knob::Knob;
use super::left::{Left, Mean};
use super::model::Model;
use super::physics::Physics;
use super::refit::{End, Fitted};
use super::select::{Selection, Tried, least};
use super::uneven;

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
    /// Whether it is explained, but by what is no entry of the catalogue.
    pub in_no_catalogue: bool,
    /// Index of the reading with what may act besides what is blamed, and is doubted.
    pub whole: Option<usize>,
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
fn beyond_chance(earned: &[f64]) -> bool {
    earned.iter().any(|gain| *gain >= BEYOND_CHANCE)
}

/// The chosen reading, where it leaves less than the baseline: that may have another restraint, which serves it better than any effect does
/// with this one.
fn explaining(selection: &Selection, plain: f64) -> Option<&Tried> {
    selection.chosen.map(|i| &selection.tried[i]).filter(|chosen| chosen.fitted.cost < plain)
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
    let p_value = before_noise.p_value();
    let chosen = explaining(selection, plain);
    let shows = p_value < false_alarm / 2.0;
    let mut detected = chosen.is_some() || shows;
    let mut verdict = Verdict {
        physics: Vec::new(),
        unexplained: false,
        confidence: nothing_left_out(p_value),
        ambiguous_with: Vec::new(),
        evidence: None,
    };
    let mut remarks = model.remarks();
    if model.lab().is_some() && !selection.body_was_looked_at() {
        remarks.push(
            "no change of the body could be judged: debonding, inclusions, anisotropy, Poisson's ratio, a base that gives".to_owned(),
        );
    }
    let mut in_no_catalogue = false;
    if let Some(chosen) = chosen {
        let in_step_s = lag_in_step(chosen, model.base());
        let named = apart_from_lag(&chosen.physics, in_step_s);
        let others = rivals(selection, chosen, &named);
        let lacks = |other: &Tried| other.fitted.cost - chosen.fitted.cost;
        let margin = |other: &&Tried| lacks(other) / own_gain(selection, plain, chosen, other);
        let earned = |p: &Physics| {
            without(selection, plain, chosen, |other| other != p) / least(model, &selection.base, *p)
        };
        let earned: Vec<f64> = named.iter().map(earned).collect();
        let evidence = Evidence {
            explained: before_noise.explained(&after_noise),
            gain: earned.iter().copied().fold(f64::INFINITY, f64::min),
            margin: others.iter().map(margin).fold(1.0, f64::min).max(0.0),
            left: after_noise.deviations(),
            effects: named.len(),
        };
        verdict.evidence = Some(evidence);
        let sure = confidence(&evidence);
        let standing = Standing::of(shows, sure, &earned, &evidence);
        if named.is_empty() {
            verdict.confidence = nothing_left_out(1.0);
            detected = false;
        } else if standing == Standing::Chance {
            remarks.push(format!("{} might explain the little that is left", names(&chosen.physics)));
            // No surer than where nothing explains anything.
            verdict.confidence = (1.0 - sure).clamp(LEAST_CONFIDENCE, nothing_left_out(p_value));
            detected = false;
        } else if standing == Standing::Doubted {
            verdict.unexplained = true;
            verdict.confidence = unlisted(&before_noise);
            let closest = others.first().filter(|_| evidence.margin < HARDLY_TOLD);
            let but = match closest {
                _ if evidence.explained < EXPLAINS => {
                    format!("leaves {:.0} % of what is beyond noise", 100.0 * (1.0 - evidence.explained))
                }
                Some(rival) => format!("is hardly told from {}", names(&rival.physics)),
                None if evidence.effects > 2 => format!("takes {} effects for it", evidence.effects),
                None => "explains hardly more than chance or elements can".to_owned(),
            };
            remarks.push(format!("{} comes closest, but {but}", names(&chosen.physics)));
        } else {
            let mut as_well: Vec<Physics> = Vec::new();
            for other in others.iter().filter(|o| lacks(o) < alike(own_gain(selection, plain, chosen, o))) {
                for &physics in other.physics.iter().filter(|p| !chosen.physics.contains(p)) {
                    if !as_well.contains(&physics) {
                        as_well.push(physics);
                    }
                }
            }
            if !as_well.is_empty() {
                remarks.push(format!("the recording cannot tell {} from {}", names(&named), names(&as_well)));
            }
            in_no_catalogue = named.iter().any(|p| !p.catalogued());
            if in_no_catalogue && as_well.is_empty() {
                remarks.push(format!("no entry of the catalogue explains as much as {}", names(&named)));
            }
            if !in_no_catalogue {
                verdict.physics = named;
            }
            verdict.unexplained = in_no_catalogue;
            verdict.confidence = sure;
            verdict.ambiguous_with = as_well.into_iter().filter(|p| p.catalogued()).collect();
        }
        remarks.extend(in_step_s.map(|lag_s| {
            format!(
                "the camera's clock is off by {:.1} ms, which is fitted and not blamed: clocks are put together no better",
                1e3 * lag_s
            )
        }));
        remarks.extend(uneven::said(model, &chosen.fitted).filter(|_| verdict.unexplained));
    } else if detected {
        verdict.unexplained = true;
        verdict.confidence = unlisted(&before_noise);
    }
    if let Some(Evidence { left, .. }) = verdict.evidence.filter(|e| detected && e.left > PLAIN_SD) {
        remarks.push(format!(
            "{left:.0} standard deviations beyond noise are left: something lesser may act besides, or elements leave it"
        ));
    }
    if chosen.is_some_and(|c| c.fitted.end != End::AtRest) {
        remarks.push("the fit had not come to rest after its last step; its values may be off".to_owned());
    }
    let properties = if detected { properties(model, before) } else { Vec::new() };
    Judged { detected, p_value, verdict, properties, remarks, in_no_catalogue, whole: None }
}

/// A camera that is late by less than this (s) is not blamed: the offset of its clock is found from the same markers (by a session's export,
/// within half a millisecond on simulated benches), and what is left of it is no physics that was left out.
const IN_STEP_S: f64 = 2e-3;

/// The camera's lag (s) in a reading, if it is no more than that; `base` of its values come before its knobs'.
fn lag_in_step(reading: &Tried, base: usize) -> Option<f64> {
    let Fitted { acting, at, .. } = &reading.fitted;
    let lag = acting.knobs.iter().position(|knob| matches!(knob, Knob::Lag))?;
    Some(at[base + lag]).filter(|lag_s| lag_s.abs() < IN_STEP_S)
}

/// The effects of a reading that may be blamed.
fn apart_from_lag(physics: &[Physics], in_step_s: Option<f64>) -> Vec<Physics> {
    physics.iter().copied().filter(|p| in_step_s.is_none() || *p != Physics::CameraLag).collect()
}

/// Readings that do without some of what the chosen one would blame.
fn rivals<'a>(selection: &'a Selection, chosen: &Tried, named: &[Physics]) -> Vec<&'a Tried> {
    let mut rivals = others(selection, chosen);
    rivals.retain(|other| !named.iter().all(|p| other.physics.contains(p)));
    rivals
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

/// Readings of as many effects as the chosen one that are neither part of it nor contain it, the closest first. Stiffening
/// contains large strain.
pub(super) fn others<'a>(selection: &'a Selection, chosen: &Tried) -> Vec<&'a Tried> {
    let within = |p: &Physics, a: &[Physics]| {
        a.contains(p) || *p == Physics::FiniteStrain && a.contains(&Physics::StrainStiffening)
    };
    let contains = |a: &[Physics], b: &[Physics]| b.iter().all(|p| within(p, a));
    let mut others: Vec<&Tried> = selection
        .tried
        .iter()
        .filter(|t| t.physics.len() == chosen.physics.len())
        .filter(|t| !contains(&t.physics, &chosen.physics))
        .collect();
    others.sort_by(|a, b| a.fitted.cost.total_cmp(&b.fitted.cost));
    others
}

/// What the chosen reading explains beyond what it has in common with another.
///
/// Why: beside an effect that explains nearly everything, all that may come with it lack little of the whole.
fn own_gain(selection: &Selection, plain: f64, chosen: &Tried, other: &Tried) -> f64 {
    without(selection, plain, chosen, |p| other.physics.contains(p))
}

/// By how much the sum of squares rises where only some effects of the chosen reading act.
fn without(selection: &Selection, plain: f64, chosen: &Tried, stays: impl Fn(&Physics) -> bool) -> f64 {
    let kept: Vec<&Physics> = chosen.physics.iter().filter(|p| stays(p)).collect();
    let same = |t: &&Tried| t.physics.len() == kept.len() && kept.iter().all(|p| t.physics.contains(p));
    let costs = selection.tried.iter().filter(same).map(|t| t.fitted.cost);
    costs.fold(plain.min(selection.base.cost), f64::min) - chosen.fitted.cost
}

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

impl Judged {
    /// Whether nothing is named, though an entry of the catalogue might be to blame.
    pub(super) fn doubted(&self) -> bool {
        self.verdict.physics.is_empty() && !self.in_no_catalogue
    }

    /// Those of the effects of the reading `whole` that are not blamed may act besides.
    pub(super) fn part_of(&mut self, selection: &Selection, whole: usize) {
        let effects = selection.tried[whole].physics.iter().copied();
        let besides: Vec<Physics> = effects.filter(|p| !self.verdict.physics.contains(p)).collect();
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
        let Verdict { physics, ambiguous_with, .. } = &self.verdict;
        let named = physics.iter().chain(ambiguous_with).any(|p| *p == Physics::ForceGain);
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
        let Verdict { physics, ambiguous_with, confidence, .. } = &mut self.verdict;
        let little = chosen.acting.knobs.iter().enumerate().any(|(i, knob)| {
            matches!(knob, Knob::Stiffening(_)) && chosen.at[model.base() + i] < LITTLE_STIFFENING
        });
        let blamed = little && physics.contains(&Physics::StrainStiffening);
        if !blamed || model.shelf(true).is_none_or(Shelf::strains_in_full) {
            return;
        }
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

    /// Why one of the readings tried is, or is not, the verdict.
    pub(super) fn why(&self, selection: &Selection, tried: usize) -> String {
        let chosen = selection.chosen.map(|i| &selection.tried[i]);
        let own = &selection.tried[tried];
        let gain = selection.base.cost - own.fitted.cost;
        match chosen {
            Some(_) if selection.chosen == Some(tried) && self.in_no_catalogue => {
                "nothing explains as much with as little, but it is in no catalogue".to_owned()
            }
            Some(_) if selection.chosen == Some(tried) && self.verdict.unexplained => {
                "it comes closest, but leaves too much or is hardly told from others".to_owned()
            }
            Some(_) if selection.chosen == Some(tried) => {
                "nothing explains as much with as little".to_owned()
            }
            Some(_) if own.fitted.end == End::GivenUp => {
                "given up: it could not have come close to what explains more".to_owned()
            }
            Some(chosen)
                if self.whole.is_some() && chosen.physics.iter().all(|p| own.physics.contains(p)) =>
            {
                "whether something acts besides is not settled".to_owned()
            }
            Some(chosen) if own.fitted.cost < chosen.fitted.cost => {
                "what it adds is no more than chance or elements can".to_owned()
            }
            Some(chosen) => {
                let best = selection.base.cost - chosen.fitted.cost;
                format!("it removes {:.0} % of what the verdict removes", 100.0 * gain / best)
            }
            None => "what it adds is no more than chance or elements can".to_owned(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two effects, a rival of one of them, and what each costs alone; the first in the list is chosen.
    fn selection() -> Selection {
        use Physics::{CameraLag, Drying, SlackBand};
        let tried =
            |physics: &[Physics], cost| Tried { physics: physics.to_vec(), fitted: Fitted::that_costs(cost) };
        let tried = vec![
            tried(&[Drying, CameraLag], 100.0),
            tried(&[Drying], 300.0),
            tried(&[CameraLag], 900.0),
            tried(&[SlackBand], 800.0),
            tried(&[Drying, SlackBand], 110.0),
        ];
        let base = Fitted::that_costs(1000.0);
        Selection { base, screened: Vec::new(), tried, chosen: Some(0), complete: true }
    }

    /// A rival has as many effects; of the two chosen it lacks one, and only what that one explains is between them.
    #[test]
    fn a_rival_is_measured_by_what_it_lacks() {
        let selection = selection();
        let chosen = &selection.tried[0];
        let rivals = others(&selection, chosen);
        assert_eq!(rivals.len(), 1);
        assert_eq!(rivals[0].physics, [Physics::Drying, Physics::SlackBand]);
        assert_eq!(own_gain(&selection, 1000.0, chosen, rivals[0]), 200.0);
        // Nothing in common with it: all that both explain, of the better baseline.
        let stranger = &selection.tried[3];
        assert_eq!(own_gain(&selection, 950.0, chosen, stranger), 850.0);
    }

    /// What stands in for a lag that is not blamed is no rival of what is; of a lag that is blamed it is one.
    #[test]
    fn a_clock_in_step_is_not_blamed() {
        let mut selection = selection();
        for (lag_s, named, rivals_left) in [
            (9e-4, &[Physics::Drying][..], 0),
            (-9e-4, &[Physics::Drying][..], 0),
            (3e-3, &[Physics::Drying, Physics::CameraLag][..], 1),
        ] {
            let fitted = &mut selection.tried[0].fitted;
            fitted.acting.knobs = vec![Knob::Drying, Knob::Lag];
            fitted.at = nalgebra::DVector::from_vec(vec![9.0, 1e-4, lag_s]);
            let chosen = &selection.tried[0];
            let in_step_s = lag_in_step(chosen, 1);
            assert_eq!(in_step_s, (named.len() == 1).then_some(lag_s));
            let found = apart_from_lag(&chosen.physics, in_step_s);
            assert_eq!(found, named);
            assert_eq!(rivals(&selection, chosen, &found).len(), rivals_left);
        }
        assert_eq!(lag_in_step(&selection.tried[1], 0), None);
    }

    /// A reading with a restraint that serves worse than the baseline's.
    #[test]
    fn what_leaves_more_than_the_baseline_explains_nothing() {
        let selection = selection();
        assert_eq!(explaining(&selection, 1000.0).map(|t| t.fitted.cost), Some(100.0));
        assert!(explaining(&selection, 90.0).is_none());
        assert!(explaining(&Selection { chosen: None, ..selection }, 1000.0).is_none());
    }

    /// The plainer of two effects that are doubted together, and what is said of the other.
    #[test]
    fn one_of_two_may_stand_alone() {
        let selection = selection();
        let whole = &selection.tried[0];
        assert_eq!((selection.part(whole, 1), selection.part(whole, 0)), (Some(1), None));
        let verdict = Verdict {
            physics: vec![Physics::Drying],
            unexplained: false,
            confidence: 0.97,
            ambiguous_with: Vec::new(),
            evidence: None,
        };
        let (properties, remarks) = (Vec::new(), Vec::new());
        let mut alone = Judged {
            detected: true,
            p_value: 0.0,
            verdict,
            properties,
            remarks,
            in_no_catalogue: false,
            whole: None,
        };
        assert!(!alone.doubted());
        alone.part_of(&selection, 0);
        assert!(alone.remarks[0].contains("besides, camera-lag may act"), "{:?}", alone.remarks);
        assert!(alone.verdict.confidence <= NOT_ALONE);
        let fewer = Selection { chosen: Some(1), ..selection };
        assert_eq!(alone.why(&fewer, 0), alone.why(&fewer, 4));
        assert_ne!(alone.why(&fewer, 0), alone.why(&fewer, 3));
        alone.verdict.physics.clear();
        assert!(alone.doubted());
        assert!(!Judged { in_no_catalogue: true, ..alone }.doubted());
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

    /// A camera's scale that earns 27 times what is asked acts, whether or not a gain beside it earns more than chance may.
    #[test]
    fn one_plain_effect_is_enough() {
        assert!(beyond_chance(&[27.0, 1.8]) && beyond_chance(&[1.8, 27.0]));
        assert!(!beyond_chance(&[1.8, 1.5]));
    }
}
