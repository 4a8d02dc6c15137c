//! What was noticed while an export was read: notes, and units that their numbers contradict.

use super::error::Place;
use std::fmt;

/// How much a finding weighs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Weight {
    /// Good to know.
    Note,
    /// Labels that contradict the numbers or one another. A column whose unit may be wrong gives no SI values until it is said.
    Contradiction,
}

/// Something noticed.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// How much it weighs.
    pub weight: Weight,
    /// Where.
    pub place: Place,
    /// What, with the numbers that show it.
    pub text: String,
}

impl Finding {
    pub(super) fn contradiction(place: Place, text: String) -> Self {
        Self { weight: Weight::Contradiction, place, text }
    }

    pub(super) fn note(place: Place, text: String) -> Self {
        Self { weight: Weight::Note, place, text }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let weight = if self.weight == Weight::Note { "note" } else { "CONTRADICTION" };
        write!(f, "{weight}: {}: {}", self.place, self.text)
    }
}
