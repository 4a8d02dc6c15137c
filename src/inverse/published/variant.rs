//! The published method and what the paper compares it with.

use super::Regularisation;

/// Which form of the two-step method.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Variant {
    /// As published: energy regularisation, then l1.
    Published,
    /// The unit matrix in step one, as printed; then l1.
    Unit,
    /// The unit matrix on unknowns relative to the start; then l1.
    UnitScaled,
    /// No regularisation in step one; then l1.
    Unregularised,
    /// Energy regularisation, then the direct method.
    Direct,
}

impl Variant {
    /// Its name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Published => "published",
            Self::Unit => "published-unit",
            Self::UnitScaled => "published-unit-scaled",
            Self::Unregularised => "published-unregularised",
            Self::Direct => "published-direct",
        }
    }

    /// What α multiplies in step one.
    pub fn regularisation(self) -> Regularisation {
        match self {
            Self::Published | Self::Direct => Regularisation::Energy,
            Self::Unit => Regularisation::Unit,
            Self::UnitScaled => Regularisation::UnitScaled,
            Self::Unregularised => Regularisation::None,
        }
    }
}
