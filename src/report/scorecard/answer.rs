//! What was concealed, as the sealed file of a draw has it.

use serde::Deserialize;
use std::collections::BTreeMap;

/// The answer to one draw.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Answer {
    /// Entries of the physics catalogue; `unexplained` for what it does not list; empty for the baseline.
    pub physics: Vec<String>,
    /// Equilibrium modulus at small strain (Pa).
    pub young_modulus_pa: f64,
    /// Parameters by physics id and parameter id.
    #[serde(default)]
    pub parameters: BTreeMap<String, BTreeMap<String, Figure>>,
    /// What the effects change in the readings, over their noise; none where nothing is concealed.
    #[serde(default)]
    pub strength: Option<f64>,
    /// The same of each entry beside the others, by physics id.
    #[serde(default)]
    pub own_strength: Option<BTreeMap<String, f64>>,
    /// Norm of the readings, over their noise, where something is concealed.
    #[serde(default)]
    pub signal: Option<f64>,
}

/// One parameter.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum Figure {
    /// A number (SI).
    Number(f64),
    /// Terms of a series or components (SI).
    List(Vec<f64>),
    /// A name, of a law for instance.
    Name(String),
}

impl Figure {
    /// Its numbers; none for a name.
    pub(super) fn numbers(&self) -> &[f64] {
        match self {
            Self::Number(value) => std::slice::from_ref(value),
            Self::List(values) => values,
            Self::Name(_) => &[],
        }
    }

    /// The name that it is; none of a number.
    pub(super) fn name(&self) -> Option<&str> {
        match self {
            Self::Name(name) => Some(name),
            Self::Number(_) | Self::List(_) => None,
        }
    }
}
