//! The models: an elastic force that remembers.
//!
//! F(t) = zero + a∞ φ∞(d) + Σ a_i ∫ exp(−(t − s)/τ_i) dφ(d(s)), φ(d) = (exp(B d/D) − 1)/(exp(B) − 1), D the greatest deformation: 1 there, a straight
//! line for B = 0 (Fung 1993, Biomechanics, 7.6: quasi-linear viscoelasticity). φ∞ is φ, or has a B of its own. Slack d₀ is taken off d first.
//! Terms are free, or stand at half decades with a_i ∝ τ_i^{−m}, which is a power law in time.

use super::convolution::branch;
use super::recording::Recording;
use crate::calib::regression::Termination;
use num_dual::{Dual64, DualNum};

/// Terms of a power law a decade.
const A_DECADE: f64 = 2.0;

/// Which model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Kind {
    /// Number of free terms; 0: a power law.
    pub terms: usize,
    /// The force stiffens with the deformation.
    pub stiffens: bool,
    /// The part that stays stiffens by another measure than the part that relaxes.
    pub apart: bool,
}

impl Kind {
    /// In words.
    pub fn words(&self) -> String {
        let terms = match self.terms {
            0 => "a power law".to_owned(),
            1 => "one term".to_owned(),
            n => format!("{n} terms"),
        };
        let shape = match (self.stiffens, self.apart) {
            (false, _) => "linear in the deformation",
            (true, false) => "stiffening",
            (true, true) => "stiffening, what relaxes apart from what stays",
        };
        format!("{terms}, {shape}")
    }

    /// Parameters: logarithms of a∞ and amplitudes, of time constants, B, B∞.
    pub(super) fn parameters(&self) -> usize {
        let terms = if self.terms == 0 { 3 } else { 1 + 2 * self.terms };
        terms + usize::from(self.stiffens) + usize::from(self.apart)
    }
}

/// One relaxing term.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Term {
    /// Force that it carries at the greatest deformation when nothing has relaxed (N or Pa).
    pub amplitude: f64,
    /// Its time constant (s).
    pub time_s: f64,
}

/// A model with its parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Law {
    /// Which.
    pub kind: Kind,
    /// See [`Kind::parameters`].
    pub(super) parameters: Vec<f64>,
    /// Greatest deformation D of what it was fitted to.
    pub(super) greatest: f64,
    /// Shortest and longest time constants of a power law (s).
    pub(super) span_s: [f64; 2],
    /// How its search ended. Without a minimum the parameters are not told apart, though the forces may be well predicted.
    pub termination: Termination,
}

impl Law {
    /// Force that never relaxes, at the greatest deformation (N or Pa).
    pub fn lasting(&self) -> f64 {
        self.parameters[0].exp()
    }

    /// The terms, shortest first.
    pub fn terms(&self) -> Vec<Term> {
        let plain: Vec<Dual64> = self.parameters.iter().map(|p| Dual64::from(*p)).collect();
        let mut terms: Vec<Term> = spectrum(self.kind, &plain, self.span_s)
            .iter()
            .map(|(a, t)| Term { amplitude: a.re, time_s: t.re })
            .collect();
        terms.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        terms
    }

    /// What it says for the rows of a recording; its zero is the recording's.
    pub fn force(&self, recording: &Recording) -> Vec<f64> {
        let plain: Vec<Dual64> = self.parameters.iter().map(|p| Dual64::from(*p)).collect();
        let zero = recording.zero();
        let (t, d) = (&recording.time_s, &recording.deformation);
        forces(self.kind, &plain, self.greatest, self.span_s, t, d).iter().map(|f| zero + f.re).collect()
    }
}

fn spectrum(kind: Kind, p: &[Dual64], span_s: [f64; 2]) -> Vec<(Dual64, Dual64)> {
    if kind.terms > 0 {
        return (0..kind.terms).map(|i| (p[1 + i].exp(), p[1 + kind.terms + i].exp())).collect();
    }
    let decades = (span_s[1] / span_s[0]).log10();
    let count = (A_DECADE * decades).ceil().max(1.0) as usize;
    let shares: Vec<(Dual64, f64)> = (0..=count)
        .map(|i| span_s[0] * 10_f64.powf(decades * i as f64 / count as f64))
        .map(|time| ((-p[2] * (time / span_s[0]).ln()).exp(), time))
        .collect();
    let whole: Dual64 = shares.iter().map(|(share, _)| *share).sum();
    shares.into_iter().map(|(share, time)| (p[1].exp() * share / whole, Dual64::from(time))).collect()
}

/// Forces without the zero.
pub(super) fn forces(
    kind: Kind,
    p: &[Dual64],
    greatest: f64,
    span_s: [f64; 2],
    time_s: &[f64],
    deformation: &[f64],
) -> Vec<Dual64> {
    let shapes = kind.parameters() - usize::from(kind.stiffens) - usize::from(kind.apart);
    let steep = if kind.stiffens { p[shapes] } else { Dual64::from(0.0) };
    let elastic: Vec<Dual64> = deformation.iter().map(|d| shape(steep, d / greatest)).collect();
    let lasting = if kind.apart { Some(p[shapes + 1]) } else { None };
    let mut sum: Vec<Dual64> = deformation
        .iter()
        .zip(&elastic)
        .map(|(d, e)| p[0].exp() * lasting.map_or(*e, |b| shape(b, d / greatest)))
        .collect();
    for (amplitude, time) in spectrum(kind, p, span_s) {
        for (total, h) in sum.iter_mut().zip(branch(time_s, &elastic, time)) {
            *total += amplitude * h;
        }
    }
    sum
}

/// φ: 0 at 0, 1 at 1.
fn shape(steep: Dual64, at: f64) -> Dual64 {
    if steep.re.abs() < 1e-4 {
        return steep * (0.5 * at * (at - 1.0)) + at;
    }
    ((steep * at).exp() - 1.0) / (steep.exp() - 1.0)
}
