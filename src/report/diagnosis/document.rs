//! What other programs read of a diagnosis: the keys of `diagnosis.json`.
//!
//! Units are in the keys (SI). The keys of the recording bundle's specification are a contract: `format`, `recording`,
//! `mismatch.{detected, p_value, channels, pokes, phases, region}`, `verdict.{physics, confidence, ambiguous_with}`,
//! `parameters`, `candidates[].{physics, held_out_chi2_per_dof, selected}`, `baseline`, `extended` and
//! `next_poke.{why, separates}`; the others may grow. A number that could not be determined (not finite) is `null`.

use super::names::{channel_name, coarse_channel, phase_name};
use crate::diagnose::{
    Candidate, Diagnosis, Estimate, Found, NextPoke, Parameter, Physics, Reading, Restrained,
};
use crate::geometry::Vec3;
use crate::report::ReportError;
use serde::Serialize;
use serde_json::{Map, Value, json};

/// What stands for "no entry of the catalogue explains it".
pub(super) const UNEXPLAINED: &str = "unexplained";

/// `diagnosis.json` as a value. `settings` are those that made the diagnosis, by name with unit.
///
/// # Errors
/// [`ReportError::Json`].
pub fn diagnosis_json(diagnosis: &Diagnosis, settings: &Map<String, Value>) -> Result<Value, ReportError> {
    Ok(serde_json::to_value(DiagnosisDocument::new(diagnosis, settings))?)
}

/// The document, in the order in which it is written.
#[derive(Serialize)]
pub(super) struct DiagnosisDocument<'a> {
    format: &'static str,
    recording: &'a str,
    mismatch: MismatchEntry<'a>,
    verdict: VerdictEntry,
    parameters: Map<String, Value>,
    candidates: Vec<CandidateEntry<'a>>,
    baseline: ReadingEntry,
    extended: ReadingEntry,
    next_poke: Option<NextPokeEntry<'a>>,
    remarks: &'a [String],
    program: Value,
    settings: &'a Map<String, Value>,
}

#[derive(Serialize)]
struct MismatchEntry<'a> {
    detected: bool,
    p_value: Option<f64>,
    /// `force`, `markers`: kinds of reading.
    channels: Vec<&'static str>,
    /// The same with direction.
    channels_in_detail: Vec<&'static str>,
    pokes: &'a [u32],
    phases: Vec<&'static str>,
    region: Option<RegionEntry>,
    properties: &'a [String],
}

#[derive(Serialize)]
struct RegionEntry {
    centroid_m: [f64; 3],
    radius_m: f64,
}

#[derive(Serialize)]
struct VerdictEntry {
    physics: Vec<&'static str>,
    /// What explains it though not all of it are entries.
    explained_by: Vec<&'static str>,
    confidence: Option<f64>,
    ambiguous_with: Vec<&'static str>,
    /// What the confidence was made of.
    evidence: Option<EvidenceEntry>,
}

#[derive(Serialize)]
struct EvidenceEntry {
    explained_share: Option<f64>,
    gain_over_least: Option<f64>,
    margin_share: Option<f64>,
    left_deviations: Option<f64>,
    effects: usize,
}

#[derive(Serialize)]
struct CandidateEntry<'a> {
    /// One id, or several joined by `+`.
    physics: String,
    /// The same ids one by one.
    together: Vec<&'static str>,
    score: Option<f64>,
    held_out_chi2_per_dof: Option<f64>,
    selected: bool,
    why: &'a str,
}

#[derive(Serialize)]
struct ReadingEntry {
    young_modulus_pa: EstimateEntry,
    restraint_total_n_per_m: Option<f64>,
    restraint_total_sd_n_per_m: Option<f64>,
    restraint_patches: Vec<PatchEntry>,
    chi2_per_dof: Option<f64>,
    held_out_chi2_per_dof: Option<f64>,
}

/// A patch, by those keys of `fit.json` that a diagnosis knows: no bound of what glue holds.
#[derive(Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
enum PatchEntry {
    Springs {
        #[serde(flatten)]
        place: PlaceEntry,
        stiffness_n_per_m: Option<f64>,
        sd: Option<f64>,
    },
    Glued {
        #[serde(flatten)]
        place: PlaceEntry,
    },
}

#[derive(Serialize)]
struct PlaceEntry {
    centroid_m: [f64; 3],
    /// `null` where it stays where a fit has found it.
    centroid_sd_m: Option<[f64; 3]>,
    radius_m: f64,
    radius_estimated: bool,
}

#[derive(Serialize)]
struct EstimateEntry {
    value: Option<f64>,
    sd: Option<f64>,
}

#[derive(Serialize)]
struct NextPokeEntry<'a> {
    why: &'a str,
    separates: Vec<&'static str>,
    site_m: [f64; 3],
    direction: [f64; 3],
    depth_m: f64,
    rate_m_s: f64,
    hold_s: f64,
}

impl<'a> DiagnosisDocument<'a> {
    pub(super) fn new(diagnosis: &'a Diagnosis, settings: &'a Map<String, Value>) -> Self {
        let mismatch = &diagnosis.mismatch;
        let mut channels = Vec::new();
        for channel in &mismatch.channels {
            let name = coarse_channel(*channel);
            if !channels.contains(&name) {
                channels.push(name);
            }
        }
        Self {
            format: "phantom-diagnosis/1",
            recording: &diagnosis.recording,
            mismatch: MismatchEntry {
                detected: mismatch.detected,
                p_value: known(mismatch.p_value),
                channels,
                channels_in_detail: mismatch.channels.iter().map(|c| channel_name(*c)).collect(),
                pokes: &mismatch.pokes,
                phases: mismatch.phases.iter().map(|p| phase_name(*p)).collect(),
                region: mismatch
                    .region
                    .map(|r| RegionEntry { centroid_m: r.centroid_m.into(), radius_m: r.radius_m }),
                properties: &mismatch.properties,
            },
            verdict: VerdictEntry {
                physics: if diagnosis.verdict.unexplained {
                    vec![UNEXPLAINED]
                } else {
                    ids(&diagnosis.verdict.physics)
                },
                explained_by: ids(&diagnosis.verdict.explained_by),
                confidence: known(diagnosis.verdict.confidence),
                ambiguous_with: ids(&diagnosis.verdict.ambiguous_with),
                evidence: diagnosis.verdict.evidence.map(|e| EvidenceEntry {
                    explained_share: known(e.explained),
                    gain_over_least: known(e.gain),
                    margin_share: known(e.margin),
                    left_deviations: known(e.left),
                    effects: e.effects,
                }),
            },
            parameters: diagnosis.parameters.iter().map(parameters).collect(),
            candidates: diagnosis.candidates.iter().map(CandidateEntry::new).collect(),
            baseline: ReadingEntry::new(&diagnosis.baseline),
            extended: ReadingEntry::new(&diagnosis.extended),
            next_poke: diagnosis.next_poke.as_ref().map(NextPokeEntry::new),
            remarks: &diagnosis.remarks,
            program: json!({ "name": env!("CARGO_PKG_NAME"), "version": env!("CARGO_PKG_VERSION") }),
            settings,
        }
    }
}

impl<'a> CandidateEntry<'a> {
    fn new(candidate: &'a Candidate) -> Self {
        let together = ids(&candidate.physics);
        Self {
            physics: if together.is_empty() { "baseline".to_owned() } else { together.join("+") },
            together,
            score: known(candidate.score),
            held_out_chi2_per_dof: candidate.held_out_chi2_per_dof.and_then(known),
            selected: candidate.selected,
            why: &candidate.why,
        }
    }
}

impl ReadingEntry {
    fn new(reading: &Reading) -> Self {
        Self {
            young_modulus_pa: estimate(&reading.young_modulus_pa),
            restraint_total_n_per_m: known(reading.restraint_total_n_per_m.value),
            restraint_total_sd_n_per_m: known(reading.restraint_total_n_per_m.sd),
            restraint_patches: reading.restraint.iter().map(PatchEntry::new).collect(),
            chi2_per_dof: known(reading.chi2_per_dof),
            held_out_chi2_per_dof: known(reading.held_out_chi2_per_dof),
        }
    }
}

impl PatchEntry {
    fn new(patch: &Restrained) -> Self {
        let place = PlaceEntry {
            centroid_m: patch.centroid_m.into(),
            centroid_sd_m: patch.centroid_sd_m.map(Into::into),
            radius_m: patch.radius_m,
            radius_estimated: patch.stiffness_n_per_m.is_none(),
        };
        match patch.stiffness_n_per_m {
            Some(own) => Self::Springs { place, stiffness_n_per_m: known(own.value), sd: known(own.sd) },
            None => Self::Glued { place },
        }
    }
}

impl<'a> NextPokeEntry<'a> {
    fn new(poke: &'a NextPoke) -> Self {
        let components = |v: &Vec3| <[f64; 3]>::from(*v);
        Self {
            why: &poke.why,
            separates: ids(&poke.separates),
            site_m: components(&poke.poke.site),
            direction: components(&poke.poke.direction),
            depth_m: poke.poke.depth_m,
            rate_m_s: poke.poke.rate_m_s,
            hold_s: poke.poke.hold_s,
        }
    }
}

/// The parameters of an entry by their ids; lists where the catalogue has lists.
fn parameters(found: &Found) -> (String, Value) {
    let value = |p: &Parameter| {
        let values: Vec<EstimateEntry> = p.values.iter().map(estimate).collect();
        match values.as_slice() {
            [only] if !p.list => json!(only),
            _ => json!(values),
        }
    };
    let law = found.law.map(|law| ("law".to_owned(), json!(law.id())));
    let by_id: Map<String, Value> =
        found.parameters.iter().map(|p| (p.id.to_owned(), value(p))).chain(law).collect();
    (found.physics.id().to_owned(), Value::Object(by_id))
}

fn estimate(estimate: &Estimate) -> EstimateEntry {
    EstimateEntry { value: known(estimate.value), sd: known(estimate.sd) }
}

fn ids(physics: &[Physics]) -> Vec<&'static str> {
    physics.iter().map(|p| p.id()).collect()
}

fn known(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::StiffeningLaw;

    /// Springs have a stiffness, `null` where it is not known; glue has none.
    #[test]
    fn patches_are_written_by_their_kind() {
        let springs = Restrained {
            centroid_m: Vec3::new(0.12, 0.05, 0.0),
            centroid_sd_m: Some(Vec3::new(1e-4, 2e-4, 0.0)),
            radius_m: 0.005,
            stiffness_n_per_m: Some(Estimate { value: 62.5, sd: f64::NAN }),
        };
        let written = |patch| json!(PatchEntry::new(&patch));
        let expected = json!({
            "kind": "springs", "centroid_m": [0.12, 0.05, 0.0], "centroid_sd_m": [1e-4, 2e-4, 0.0],
            "radius_m": 0.005, "radius_estimated": false, "stiffness_n_per_m": 62.5, "sd": null,
        });
        assert_eq!(written(springs), expected);
        let expected = json!({
            "kind": "glued", "centroid_m": [0.12, 0.05, 0.0], "centroid_sd_m": null,
            "radius_m": 0.005, "radius_estimated": true,
        });
        assert_eq!(written(Restrained { stiffness_n_per_m: None, centroid_sd_m: None, ..springs }), expected);
    }

    /// The catalogue gives the law beside the parameter, as a word.
    #[test]
    fn the_law_of_stiffening_is_written_beside_its_parameter() {
        let values = vec![Estimate { value: 1.5, sd: 0.1 }];
        let parameters = vec![Parameter { id: "stiffening", values, list: false }];
        let found = |law| Found { physics: Physics::StrainStiffening, parameters: parameters.clone(), law };
        let written = super::parameters(&found(Some(StiffeningLaw::Yeoh))).1;
        assert_eq!(written, json!({ "law": "yeoh", "stiffening": { "value": 1.5, "sd": 0.1 } }));
        assert_eq!(super::parameters(&found(None)).1.as_object().map(Map::len), Some(1));
    }
}
