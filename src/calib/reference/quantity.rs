//! Which quantities a reference value may be of, and how surely one is known.

use crate::calib::coverage::Z95;
use serde::{Deserialize, Serialize};

/// A quantity that a reference value gives. Its key in a file names the unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum ReferenceQuantity {
    /// Young's modulus at small strain, long time (Pa).
    YoungModulus,
    /// Stiffness of a band, or of all bands together (N/m).
    Stiffness,
    /// Share of the force that relaxes between two times after a step, the validity's: 1 − G(t₂)/G(t₁); without times all that relaxes (1).
    RelaxedFraction,
    /// Time constant of such a share (s).
    TimeConstant,
    /// Length by which a band is slack (m).
    Slack,
}

impl ReferenceQuantity {
    /// All of them.
    pub const ALL: [Self; 5] =
        [Self::YoungModulus, Self::Stiffness, Self::RelaxedFraction, Self::TimeConstant, Self::Slack];

    /// Its key in a file.
    pub fn key(self) -> &'static str {
        match self {
            Self::YoungModulus => "young_modulus_pa",
            Self::Stiffness => "stiffness_n_per_m",
            Self::RelaxedFraction => "relaxed_fraction",
            Self::TimeConstant => "time_constant_s",
            Self::Slack => "slack_m",
        }
    }

    /// What people call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::YoungModulus => "Young’s modulus",
            Self::Stiffness => "stiffness",
            Self::RelaxedFraction => "relaxed fraction",
            Self::TimeConstant => "time constant",
            Self::Slack => "slack",
        }
    }

    /// SI times the first is in the unit of the second, for people.
    pub fn shown(self) -> (f64, &'static str) {
        match self {
            Self::YoungModulus => (1e-3, "kPa"),
            Self::Stiffness => (1.0, "N/m"),
            Self::RelaxedFraction => (1.0, ""),
            Self::TimeConstant => (1.0, "s"),
            Self::Slack => (1e3, "mm"),
        }
    }

    /// Whether it may be zero or less.
    pub(super) fn must_be_positive(self) -> bool {
        self != Self::Slack
    }
}

/// A value in SI, with what is known of its error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Figure {
    /// The value.
    pub value: f64,
    /// Its standard uncertainty: one standard deviation of everything that is not known of it.
    pub sd: f64,
    /// An interval that holds the true value with a probability of 90 %, where it is not value ± 1.645 sd.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interval_90: Option<[f64; 2]>,
}

impl Figure {
    /// The 90 % interval: as given, or of a normal distribution.
    pub fn interval(&self) -> [f64; 2] {
        let half = Z95 * self.sd;
        self.interval_90.unwrap_or([self.value - half, self.value + half])
    }
}
