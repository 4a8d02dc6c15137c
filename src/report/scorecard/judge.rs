//! One draw: what was concealed against what was said.

use super::aliases::declared;
use super::answer::Answer;
use super::errors::{ParameterError, modulus_error, parameter_errors, place_error_m};
use super::said::{Said, Verdict, Weighed};
use serde::Serialize;

/// What stands for an effect outside the catalogue, and for the verdict that nothing in it explains a recording.
const UNEXPLAINED: &str = "unexplained";

/// One concealed recording with its verdict.
#[derive(Debug, Clone, PartialEq)]
pub struct Draw {
    /// Name of the draw.
    pub name: String,
    /// What was concealed.
    pub answer: Answer,
    /// What was said.
    pub said: Said,
    /// Time of the diagnosis (s).
    pub seconds: f64,
}

/// What was concealed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Nothing.
    Nothing,
    /// One entry of the catalogue.
    One,
    /// Several entries.
    Several,
    /// Something that the catalogue does not list.
    OffCatalogue,
}

/// How the verdict stands to the answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    /// Exactly what was concealed, or a declared set that holds it.
    Right,
    /// Some of several effects, and nothing else.
    Partly,
    /// An effect was concealed, and nothing was called.
    Missed,
    /// An effect of the catalogue was concealed, and it was called unexplained.
    Abstained,
    /// Nothing was concealed, and a mismatch was called.
    FalseAlarm,
    /// Something was named that was not concealed.
    WrongName,
    /// The diagnosis ended with an error.
    Failed,
}

/// One draw, judged.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Judged {
    /// Name of the draw.
    pub name: String,
    /// What was concealed.
    pub kind: Kind,
    /// Its ids.
    pub concealed: Vec<String>,
    /// Ids that were named.
    pub named: Vec<String>,
    /// Ids that could not be told from them.
    pub ambiguous_with: Vec<String>,
    /// How the two compare.
    pub outcome: Outcome,
    /// Whether a mismatch was called.
    pub detected: bool,
    /// Probability of a misfit as large by chance.
    pub p_value: Option<f64>,
    /// Confidence of the verdict.
    pub confidence: Option<f64>,
    /// What spoke for the verdict.
    pub evidence: Option<Weighed>,
    /// Strength of the effects.
    pub strength: Option<f64>,
    /// Of each beside the others, in the order of their ids; empty where it is not known.
    pub own_strength: Vec<f64>,
    /// Strength over the norm of the readings.
    pub strength_share: Option<f64>,
    /// Distance between concealed and found place (m), where the right entry has one.
    pub place_error_m: Option<f64>,
    /// Errors of the parameters of entries that were named rightly.
    pub parameters: Vec<ParameterError>,
    /// Found over true modulus, less one, before and after.
    pub modulus_error: [Option<f64>; 2],
    /// Whether the 90 % interval of the modulus, after, holds the truth.
    pub modulus_covered: Option<bool>,
    /// Held-out misfit, before and after.
    pub held_out: [Option<f64>; 2],
    /// Time of the diagnosis (s).
    pub seconds: f64,
    /// Why it failed.
    pub error: Option<String>,
}

/// Compares a draw's verdict with its answer.
pub fn judge(draw: &Draw) -> Judged {
    let answer = &draw.answer;
    let mut judged = Judged {
        name: draw.name.clone(),
        kind: kind(answer),
        concealed: answer.physics.clone(),
        named: Vec::new(),
        ambiguous_with: Vec::new(),
        outcome: Outcome::Failed,
        detected: false,
        p_value: None,
        confidence: None,
        evidence: None,
        strength: answer.strength,
        own_strength: own_strength(answer).unwrap_or_default(),
        strength_share: answer.strength.zip(answer.signal).map(|(strength, signal)| strength / signal),
        place_error_m: None,
        parameters: Vec::new(),
        modulus_error: [None; 2],
        modulus_covered: None,
        held_out: [None; 2],
        seconds: draw.seconds,
        error: None,
    };
    let said = match &draw.said {
        Said::Verdict(said) => said,
        Said::Failed(why) => {
            judged.error = Some(why.clone());
            return judged;
        }
    };
    judged.named = said.physics().to_vec();
    judged.ambiguous_with = said.ambiguous_with().to_vec();
    judged.detected = said.detected();
    judged.p_value = said.p_value();
    judged.confidence = said.confidence();
    judged.evidence = said.evidence();
    judged.outcome = outcome(judged.kind, &answer.physics, said);
    let both: Vec<&String> = answer.physics.iter().filter(|id| said.physics().contains(id)).collect();
    judged.place_error_m = both.iter().find_map(|id| place_error_m(id, answer, said));
    judged.parameters = both.iter().flat_map(|id| parameter_errors(id, answer, said)).collect();
    let [before, after] = said.modulus().map(|found| modulus_error(answer, &found));
    judged.modulus_error = [before.relative, after.relative];
    judged.modulus_covered = after.covered;
    judged.held_out = said.held_out();
    judged
}

fn own_strength(answer: &Answer) -> Option<Vec<f64>> {
    let own = answer.own_strength.as_ref()?;
    answer.physics.iter().map(|id| own.get(id).copied()).collect()
}

fn kind(answer: &Answer) -> Kind {
    match answer.physics.as_slice() {
        [] => Kind::Nothing,
        ids if ids.iter().any(|id| id == UNEXPLAINED) => Kind::OffCatalogue,
        [_] => Kind::One,
        _ => Kind::Several,
    }
}

fn outcome(kind: Kind, truth: &[String], said: &Verdict) -> Outcome {
    let named = said.physics();
    let unexplained = named.iter().any(|id| id == UNEXPLAINED);
    match kind {
        Kind::Nothing if named.is_empty() && !said.detected() => Outcome::Right,
        Kind::Nothing => Outcome::FalseAlarm,
        Kind::OffCatalogue if unexplained => Outcome::Right,
        _ if unexplained => Outcome::Abstained,
        _ if named.is_empty() => Outcome::Missed,
        Kind::OffCatalogue => Outcome::WrongName,
        Kind::One | Kind::Several if matches(truth, named, said.ambiguous_with()) => Outcome::Right,
        Kind::One | Kind::Several if named.iter().all(|id| truth.contains(id)) => Outcome::Partly,
        Kind::One | Kind::Several => Outcome::WrongName,
    }
}

/// Whether all that was concealed is named and nothing else, declared aliases standing for each other where the set was
/// reported.
fn matches(truth: &[String], named: &[String], beside: &[String]) -> bool {
    let aliased = |one: &String, others: &[String]| others.iter().any(|other| declared(one, other));
    let found = |t: &String| named.contains(t) || (beside.contains(t) && aliased(t, named));
    let meant = |n: &String| truth.contains(n) || truth.iter().any(|t| beside.contains(t) && declared(n, t));
    named.len() == truth.len() && truth.iter().all(found) && named.iter().all(meant)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn said(physics: &[&str], beside: &[&str], detected: bool) -> Verdict {
        serde_json::from_value(json!({
            "mismatch": {"detected": detected},
            "verdict": {"physics": physics, "confidence": 0.8, "ambiguous_with": beside},
            "parameters": {"inclusion": {
                "centre_x_m": {"value": 0.053, "sd": 0.001},
                "centre_y_m": {"value": 0.044, "sd": 0.001},
                "centre_z_m": {"value": 0.01, "sd": 0.001},
                "radius_m": {"value": 0.0066, "sd": 0.0005},
                "modulus_ratio": {"value": 3.3, "sd": 0.1},
            }},
            "baseline": {"young_modulus_pa": {"value": 11e3, "sd": 100.0}, "held_out_chi2_per_dof": 5.0},
            "extended": {"young_modulus_pa": {"value": 10.1e3, "sd": 100.0}, "held_out_chi2_per_dof": 1.0},
        }))
        .expect("a verdict")
    }

    fn judged(physics: &[&str], said: Said) -> Judged {
        let answer = serde_json::from_value(json!({
            "physics": physics,
            "young_modulus_pa": 10e3,
            "strength": 12.0,
            "parameters": {"inclusion": {
                "centre_x_m": 0.05, "centre_y_m": 0.04, "centre_z_m": 0.01, "radius_m": 0.006, "modulus_ratio": 3.0,
            }},
        }))
        .expect("an answer");
        judge(&Draw { name: "draw-0001".to_owned(), answer, said, seconds: 3.0 })
    }

    fn outcome_of(truth: &[&str], named: &[&str], beside: &[&str]) -> Outcome {
        let detected = !named.is_empty();
        judged(truth, Said::Verdict(Box::new(said(named, beside, detected)))).outcome
    }

    #[test]
    fn each_verdict_has_its_outcome() {
        use Outcome::{Abstained, FalseAlarm, Missed, Partly, Right, WrongName};
        for (truth, named, beside, expected) in [
            (&[][..], &[][..], &[][..], Right),
            (&[], &["drying"], &[], FalseAlarm),
            (&[], &["unexplained"], &[], FalseAlarm),
            (&["inclusion"], &["inclusion"], &[], Right),
            (&["inclusion"], &[], &[], Missed),
            (&["inclusion"], &["unexplained"], &[], Abstained),
            (&["inclusion"], &["drying"], &[], WrongName),
            (&["inclusion"], &["inclusion", "drying"], &[], WrongName),
            (&["inclusion", "drying"], &["drying", "inclusion"], &[], Right),
            (&["inclusion", "drying"], &["drying"], &[], Partly),
            (&["inclusion", "drying"], &["drying", "tip-slip"], &[], WrongName),
            (&["unexplained"], &["unexplained"], &[], Right),
            (&["unexplained"], &["inclusion"], &[], WrongName),
            (&["unexplained"], &[], &[], Missed),
        ] {
            assert_eq!(outcome_of(truth, named, beside), expected, "{truth:?} {named:?}");
        }
    }

    /// A declared set counts when it is reported as a set, not when only its wrong member is named; nor does a set that
    /// the catalogue does not declare.
    #[test]
    fn declared_sets_count_when_reported() {
        use Outcome::{Right, WrongName};
        let debonded = ["base-debonding"];
        assert_eq!(outcome_of(&debonded, &["inclusion"], &["base-debonding"]), Right);
        assert_eq!(outcome_of(&debonded, &["base-debonding"], &["inclusion"]), Right);
        assert_eq!(outcome_of(&debonded, &["inclusion"], &[]), WrongName);
        assert_eq!(outcome_of(&debonded, &["drying"], &["base-debonding"]), WrongName);
        assert_eq!(
            outcome_of(&["base-debonding", "camera-lag"], &["inclusion", "camera-lag"], &["base-debonding"]),
            Right
        );
    }

    #[test]
    fn a_mismatch_without_a_name_is_a_false_alarm() {
        let judged = judged(&[], Said::Verdict(Box::new(said(&[], &[], true))));
        assert_eq!(judged.outcome, Outcome::FalseAlarm);
    }

    /// 3-4-0 mm off: 5 mm. Modulus 10 % before, 1 % after, within 1.645 × 100 Pa. The ratio is 10 % and three deviations
    /// off, the radius 10 % and 1.2 deviations.
    #[test]
    fn errors_are_those_of_the_figures() {
        let judged = judged(&["inclusion"], Said::Verdict(Box::new(said(&["inclusion"], &[], true))));
        assert!((judged.place_error_m.expect("a place") - 0.005).abs() < 1e-12);
        let [before, after] = judged.modulus_error.map(|e| e.expect("an error"));
        assert!((before - 0.1).abs() < 1e-12 && (after - 0.01).abs() < 1e-12);
        assert_eq!(judged.modulus_covered, Some(true));
        let errors: Vec<(&str, f64, Option<bool>)> =
            judged.parameters.iter().map(|p| (p.id.as_str(), p.relative, p.covered)).collect();
        assert_eq!(errors.len(), 2, "{errors:?}");
        assert!(errors.iter().all(|e| (e.1 - 0.1).abs() < 1e-9), "{errors:?}");
        assert_eq!(errors.iter().map(|e| e.2).collect::<Vec<_>>(), [Some(false), Some(true)].to_vec());
    }

    #[test]
    fn own_strengths_stand_in_the_order_of_the_ids() {
        let of = |own: serde_json::Value| {
            let answer =
                json!({"physics": ["inclusion", "drying"], "young_modulus_pa": 1e4, "own_strength": own});
            let answer = serde_json::from_value(answer).expect("an answer");
            judge(&Draw { name: String::new(), answer, said: Said::Failed(String::new()), seconds: 0.0 })
                .own_strength
        };
        assert_eq!(of(json!({"drying": 4.0, "inclusion": 9.0})), [9.0, 4.0]);
        assert_eq!(of(json!({"drying": 4.0})), [0.0; 0]);
        assert_eq!(of(json!(null)), [0.0; 0]);
    }

    #[test]
    fn a_diagnosis_that_failed_is_no_verdict() {
        let judged = judged(&["inclusion"], Said::Failed("no".to_owned()));
        assert_eq!((judged.outcome, judged.error.as_deref()), (Outcome::Failed, Some("no")));
    }
}
