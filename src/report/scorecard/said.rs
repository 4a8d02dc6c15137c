//! What a diagnosis said, as its `diagnosis.json` has it, or that it ended without one.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// One draw's verdict as it was put on disk.
#[derive(Debug, Clone, PartialEq)]
pub enum Said {
    /// A diagnosis.
    Verdict(Box<Verdict>),
    /// It ended with an error.
    Failed(String),
}

/// The part of `diagnosis.json` that is judged.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Verdict {
    mismatch: MismatchKeys,
    verdict: VerdictKeys,
    #[serde(default)]
    parameters: BTreeMap<String, BTreeMap<String, Parameter>>,
    baseline: ReadingKeys,
    extended: ReadingKeys,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
struct MismatchKeys {
    detected: bool,
    #[serde(default)]
    p_value: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
struct VerdictKeys {
    physics: Vec<String>,
    confidence: Option<f64>,
    #[serde(default)]
    ambiguous_with: Vec<String>,
    #[serde(default)]
    evidence: Option<Weighed>,
}

/// What spoke for what is named; numbers without bound are absent.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Weighed {
    /// Share of what is beyond noise that it explains.
    pub explained_share: Option<f64>,
    /// What the least of its effects gains, over what is asked of that.
    pub gain_over_least: Option<f64>,
    /// Share of that by which the closest other reading lacks it.
    pub margin_share: Option<f64>,
    /// What it leaves beyond noise, in standard deviations.
    pub left_deviations: Option<f64>,
    /// Number of effects.
    pub effects: usize,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
struct ReadingKeys {
    young_modulus_pa: Number,
    held_out_chi2_per_dof: Option<f64>,
}

/// A number with its standard deviation; what could not be determined is absent.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Number {
    /// Value (SI).
    pub value: Option<f64>,
    /// Standard deviation (SI).
    pub sd: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged)]
enum Parameter {
    One(Number),
    Many(Vec<Number>),
    /// A name, of a law for instance.
    Name(String),
}

impl Verdict {
    /// Whether a mismatch was called.
    pub fn detected(&self) -> bool {
        self.mismatch.detected
    }

    /// Probability of a misfit of the baseline as large by chance.
    pub fn p_value(&self) -> Option<f64> {
        self.mismatch.p_value
    }

    /// Ids that it names; `unexplained` among them when nothing explains the recording.
    pub fn physics(&self) -> &[String] {
        &self.verdict.physics
    }

    /// Ids that it cannot tell from those.
    pub fn ambiguous_with(&self) -> &[String] {
        &self.verdict.ambiguous_with
    }

    /// Probability that it gives itself of being right.
    pub fn confidence(&self) -> Option<f64> {
        self.verdict.confidence
    }

    /// What spoke for what is named, or comes closest.
    pub fn evidence(&self) -> Option<Weighed> {
        self.verdict.evidence
    }

    /// Numbers of a parameter; empty when it has none of that id.
    pub fn numbers(&self, physics: &str, id: &str) -> &[Number] {
        match self.parameters.get(physics).and_then(|p| p.get(id)) {
            Some(Parameter::One(number)) => std::slice::from_ref(number),
            Some(Parameter::Many(numbers)) => numbers,
            Some(Parameter::Name(_)) | None => &[],
        }
    }

    /// The name that a parameter is; none of a number.
    pub fn name(&self, physics: &str, id: &str) -> Option<&str> {
        match self.parameters.get(physics)?.get(id)? {
            Parameter::Name(name) => Some(name),
            Parameter::One(_) | Parameter::Many(_) => None,
        }
    }

    /// Modulus before and after (Pa).
    pub fn modulus(&self) -> [Number; 2] {
        [self.baseline.young_modulus_pa, self.extended.young_modulus_pa]
    }

    /// Held-out misfit before and after.
    pub fn held_out(&self) -> [Option<f64>; 2] {
        [self.baseline.held_out_chi2_per_dof, self.extended.held_out_chi2_per_dof]
    }
}
