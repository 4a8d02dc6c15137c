//! What is not linear where the phantom is touched: bands that hang slack, tips that slide.

use super::answer::Figure;

/// Holds and contact that are not linear (spec/physics-catalogue; parameters as defined there).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Touch {
    /// `slack-band`: springs pull with −k max(0, u·d − gap) d only; with gap 0, in tension only.
    SlackBand {
        /// Index of the hold, or all springs.
        hold: Option<usize>,
        /// d, unit vector: the motion that tightens the band.
        direction: [f64; 3],
        /// Gap (m).
        gap_m: f64,
    },
    /// `tip-slip`: Coulomb friction at the tip's disc, which may lift off, too.
    TipSlip {
        /// Friction coefficient.
        friction_coefficient: f64,
    },
}

impl Touch {
    /// Id in the physics catalogue.
    pub fn physics(&self) -> &'static str {
        match self {
            Self::SlackBand { .. } => "slack-band",
            Self::TipSlip { .. } => "tip-slip",
        }
    }

    /// Parameters by their ids in the catalogue.
    pub(super) fn parameters(&self) -> Vec<(&'static str, Figure)> {
        match *self {
            Self::SlackBand { direction, gap_m, .. } => {
                vec![("gap_m", Figure::Number(gap_m)), ("direction", Figure::List(direction.to_vec()))]
            }
            Self::TipSlip { friction_coefficient } => {
                vec![("friction_coefficient", Figure::Number(friction_coefficient))]
            }
        }
    }
}
