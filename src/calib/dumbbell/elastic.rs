//! Engineering stress of a pull of a material that keeps its volume, at stretch λ; E its slope at λ = 1.
//!
//! | model | P(λ) | source |
//! | --- | --- | --- |
//! | linear | E (λ − 1) | Hooke |
//! | neo-Hookean | E/3 (λ − λ⁻²) | Treloar 1943 |
//! | Yeoh | E/3 (λ − λ⁻²) (1 + q (I₁ − 3)), I₁ = λ² + 2/λ | Yeoh 1993, two terms |
//! | Ogden | 2E/(3α) (λ^{α−1} − λ^{−α/2−1}) | Ogden 1972, one term |

use num_dual::{Dual64, DualNum};

/// A model. Its first parameter is E (Pa), the second q or α (1).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Elastic {
    /// Straight.
    Linear,
    /// One constant.
    NeoHookean,
    /// Stiffens or softens with the first invariant.
    Yeoh,
    /// A power of the stretch.
    Ogden,
}

impl Elastic {
    /// From few parameters to many.
    pub const ALL: [Self; 4] = [Self::NeoHookean, Self::Linear, Self::Yeoh, Self::Ogden];

    /// What people call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::NeoHookean => "neo-Hookean",
            Self::Yeoh => "Yeoh",
            Self::Ogden => "Ogden",
        }
    }

    /// Where a search for the second parameter starts; none where there is no second.
    pub(super) fn second(self) -> Option<f64> {
        match self {
            Self::Yeoh => Some(0.0),
            Self::Ogden => Some(2.0),
            _ => None,
        }
    }

    pub(super) fn stress(self, p: &[Dual64], stretch: Dual64) -> Dual64 {
        let neo = || p[0] / 3.0 * (stretch - stretch.powi(-2));
        match self {
            Self::Linear => p[0] * (stretch - 1.0),
            Self::NeoHookean => neo(),
            Self::Yeoh => neo() * (p[1] * (stretch.powi(2) + stretch.recip() * 2.0 - 3.0) + 1.0),
            Self::Ogden => {
                let log = stretch.ln();
                let power = |n: Dual64| (n * log).exp();
                p[0] * 2.0 / (p[1] * 3.0) * (power(p[1] - 1.0) - power(p[1] * -0.5 - 1.0))
            }
        }
    }

    /// Stress (Pa) at a stretch.
    pub fn at(self, parameters: &[f64], stretch: f64) -> f64 {
        let plain: Vec<Dual64> = parameters.iter().map(|p| Dual64::from(*p)).collect();
        self.stress(&plain, Dual64::from(stretch)).re
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The slope at λ = 1 is E, and the neo-Hookean secant at 10 % lies 8.8 % below it (1.1 − 1.1⁻² = 0.27355; /3/0.1 = 0.9118).
    #[test]
    fn slopes_at_rest() {
        for model in Elastic::ALL {
            let p = [1.0, 1.7];
            let slope = (model.at(&p, 1.0 + 1e-6) - model.at(&p, 1.0 - 1e-6)) / 2e-6;
            assert!((slope - 1.0).abs() < 1e-6, "{model:?} {slope}");
        }
        assert!((Elastic::NeoHookean.at(&[1.0], 1.1) / 0.1 - 0.9118).abs() < 1e-4);
    }
}
