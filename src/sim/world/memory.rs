//! What the phantom and its springs remember: Prony series in the condensed space, and a modulus that drifts.
//!
//! Stress σ(t) = ∫ E(t − s) dε(s) with E(t) = E₀ (1 − Σ gᵢ (1 − e^(−t/τᵢ))) and a constant Poisson's ratio is, for every
//! quantity y that is linear in the displacements, E₀ (y − Σ gᵢ qᵢ) with qᵢ′ = (y − qᵢ)/τᵢ. Where y is linear in a step
//! the update of qᵢ is exact (Simo & Hughes 1998, section 10.3).

use super::answer::Figure;

/// One term of a Prony series.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PronyTerm {
    /// gᵢ, share of the instantaneous stiffness that relaxes.
    pub relaxed_fraction: f64,
    /// τᵢ (s).
    pub time_constant_s: f64,
}

/// Memory and ageing (spec/physics-catalogue; parameters as defined there).
#[derive(Debug, Clone, PartialEq)]
pub enum Memory {
    /// `viscoelastic-relaxation` of the phantom.
    Relaxation {
        /// The series.
        terms: Vec<PronyTerm>,
    },
    /// `band-viscosity`: all springs relax likewise. Their stated stiffness is that at equilibrium.
    BandViscosity {
        /// The series.
        terms: Vec<PronyTerm>,
    },
    /// `drying`: E(t) = E (1 + rate · t), t from the start of the recording.
    Drying {
        /// Rate (1/s).
        modulus_rate_per_s: f64,
    },
}

impl Memory {
    /// Id in the physics catalogue.
    pub fn physics(&self) -> &'static str {
        match self {
            Self::Relaxation { .. } => "viscoelastic-relaxation",
            Self::BandViscosity { .. } => "band-viscosity",
            Self::Drying { .. } => "drying",
        }
    }

    /// Parameters by their ids in the catalogue.
    pub(super) fn parameters(&self) -> Vec<(&'static str, Figure)> {
        match self {
            Self::Relaxation { terms } | Self::BandViscosity { terms } => {
                let list = |f: fn(&PronyTerm) -> f64| Figure::List(terms.iter().map(f).collect());
                vec![
                    ("relaxed_fraction", list(|t| t.relaxed_fraction)),
                    ("time_constant_s", list(|t| t.time_constant_s)),
                ]
            }
            Self::Drying { modulus_rate_per_s } => {
                vec![("modulus_rate_per_s", Figure::Number(*modulus_rate_per_s))]
            }
        }
    }
}

/// Σ gᵢ.
pub(super) fn relaxed(terms: &[PronyTerm]) -> f64 {
    terms.iter().map(|t| t.relaxed_fraction).sum()
}

/// What one quantity of `n` numbers remembers.
#[derive(Debug, Clone)]
pub(super) struct Past {
    terms: Vec<Term>,
    /// The quantity at the end of the last step.
    last: Vec<f64>,
}

#[derive(Debug, Clone)]
struct Term {
    fraction: f64,
    /// q ← keep q + before y + now y⁺.
    keep: f64,
    before: f64,
    now: f64,
    q: Vec<f64>,
}

impl Past {
    /// At rest for ever, to be carried on in steps of `step_s`.
    pub(super) fn new(terms: &[PronyTerm], step_s: f64, n: usize) -> Self {
        let term = |t: &PronyTerm| {
            let x = step_s / t.time_constant_s;
            let keep = (-x).exp();
            // (1 − e^(−x))/x: the mean of e^(−s) over the step.
            let mean = -(-x).exp_m1() / x;
            Term { fraction: t.relaxed_fraction, keep, before: mean - keep, now: 1.0 - mean, q: vec![0.0; n] }
        };
        Self { terms: terms.iter().map(term).collect(), last: vec![0.0; n] }
    }

    /// s of the step ahead: y⁺ − Σ gᵢ qᵢ⁺ = s y⁺ − h.
    pub(super) fn share(&self) -> f64 {
        1.0 - self.terms.iter().map(|t| t.fraction * t.now).sum::<f64>()
    }

    /// h of the step ahead.
    pub(super) fn held_back(&self) -> Vec<f64> {
        let mut sum = vec![0.0; self.last.len()];
        for t in &self.terms {
            for ((s, q), y) in sum.iter_mut().zip(&t.q).zip(&self.last) {
                *s += t.fraction * (t.keep * q + t.before * y);
            }
        }
        sum
    }

    /// Takes the step to `now`.
    pub(super) fn advance(&mut self, now: &[f64]) {
        for t in &mut self.terms {
            for ((q, y), next) in t.q.iter_mut().zip(&self.last).zip(now) {
                *q = t.keep * *q + t.before * y + t.now * next;
            }
        }
        self.last.copy_from_slice(now);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A standard linear solid, ramp for T then hold: σ/E₀ε̇ = t − g (t − τ (1 − e^(−t/τ))) while it moves and
    /// T (1 − g) + g τ (e^(−(t−T)/τ) − e^(−t/τ)) afterwards. The update is exact, whatever the step.
    #[test]
    fn a_ramp_and_hold_of_a_standard_linear_solid() {
        let (g, tau, ramp_s) = (0.3, 1.7, 2.0);
        let terms = [PronyTerm { relaxed_fraction: g, time_constant_s: tau }];
        for step_s in [0.5, 0.05] {
            let mut past = Past::new(&terms, step_s, 1);
            for n in 1..(8.0 / step_s) as usize {
                let t = n as f64 * step_s;
                let y = t.min(ramp_s);
                let stress = past.share() * y - past.held_back()[0];
                past.advance(&[y]);
                let exact = if t <= ramp_s {
                    t - g * (t + tau * (-t / tau).exp_m1())
                } else {
                    ramp_s * (1.0 - g) + g * tau * ((-(t - ramp_s) / tau).exp() - (-t / tau).exp())
                };
                assert!((stress - exact).abs() < 1e-13, "t = {t}: {stress}, {exact}");
            }
        }
    }
}
