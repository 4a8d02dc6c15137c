//! The models: an elastic force that remembers.
//!
//! F(t) = zero + a∞ φ∞(d) + Σ a_i ∫ exp(−(t − s)/τ_i) dφ(d(s)), φ(d) = (exp(B d/D) − 1)/(exp(B) − 1), D the greatest deformation: 1 there, a straight
//! line for B = 0 (Fung 1993, Biomechanics, 7.6: quasi-linear viscoelasticity). φ∞ is φ, or has a B of its own.
//! With a step at once to D the force behind it is G(t) = a∞ + Σ a_i exp(−t/τ_i). Terms are free, or stand at half decades with a_i ∝ τ_i^{−m}, which is a power law in time.

use super::convolution::branch;
use super::recording::Recording;
use crate::calib::regression::{Termination, derivatives};
use nalgebra::DMatrix;
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

    /// Parameters: a∞ and amplitudes, logarithms of time constants, B, B∞; forces and times over those of [`Scale`].
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

/// What deformations, forces and times are counted in, so that no unit has a say in a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scale {
    /// Greatest deformation D of what is fitted (m or 1).
    pub(super) deformation: f64,
    /// Greatest force, less the zero (N or Pa).
    pub(super) force: f64,
    /// Longest recording (s).
    pub(super) time_s: f64,
    /// Shortest and longest time constants of a power law, over that time.
    pub(super) span: [f64; 2],
}

/// A model with its parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Law {
    /// Which.
    pub kind: Kind,
    /// See [`Kind::parameters`].
    pub(super) parameters: Vec<f64>,
    /// Covariance of the parameters, from the scatter of what the fit leaves.
    pub(super) covariance: DMatrix<f64>,
    pub(super) scale: Scale,
    /// How its search ended. Without a minimum the parameters are not told apart, though the forces may be well predicted.
    pub termination: Termination,
}

impl Law {
    /// Force that never relaxes, at the greatest deformation (N or Pa).
    pub fn lasting(&self) -> f64 {
        self.scale.force * self.parameters[0]
    }

    /// The terms, shortest first.
    pub fn terms(&self) -> Vec<Term> {
        let mut terms: Vec<Term> = spectrum(self.kind, &plain(&self.parameters), self.scale.span)
            .iter()
            .map(|(a, t)| Term { amplitude: self.scale.force * a.re, time_s: self.scale.time_s * t.re })
            .collect();
        terms.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        terms
    }

    /// G(t) = a∞ + Σ a_i exp(−t/τ_i): force at a time (s) after a step to the greatest deformation (N or Pa).
    pub fn after_step(&self, time_s: f64) -> f64 {
        self.scale.force * self.relaxation(&plain(&self.parameters), time_s).re
    }

    fn relaxation(&self, p: &[Dual64], time_s: f64) -> Dual64 {
        let left = |t: Dual64| (-(t.recip() * (time_s / self.scale.time_s))).exp();
        spectrum(self.kind, p, self.scale.span).into_iter().fold(p[0], |sum, (a, t)| sum + a * left(t))
    }

    /// 1 − G(t₂)/G(t₁), the share of the force that relaxes between two times after a step (s), and its standard deviation g C gᵀ, g its
    /// derivatives by the parameters, C their covariance.
    pub fn relaxed(&self, between_s: [f64; 2]) -> (f64, f64) {
        let share = |p: &[Dual64]| {
            let [early, late] = between_s.map(|t| self.relaxation(p, t));
            vec![-late / early + 1.0]
        };
        let by = derivatives(&self.parameters, share);
        // What has no say may be open.
        let counts: Vec<usize> = (0..by.ncols()).filter(|j| by[(0, *j)] != 0.0).collect();
        let pairs = counts.iter().flat_map(|i| counts.iter().map(move |j| (*i, *j)));
        let variance: f64 = pairs.map(|(i, j)| by[(0, i)] * self.covariance[(i, j)] * by[(0, j)]).sum();
        (share(&plain(&self.parameters))[0].re, variance.max(0.0).sqrt())
    }

    /// What it says for the rows of a recording; its zero is the recording's.
    pub fn force(&self, recording: &Recording) -> Vec<f64> {
        let times: Vec<f64> = recording.time_s.iter().map(|t| t / self.scale.time_s).collect();
        let deformation: Vec<f64> =
            recording.deformation.iter().map(|d| d / self.scale.deformation).collect();
        let found = forces(self.kind, &plain(&self.parameters), self.scale.span, &times, &deformation);
        found.iter().map(|f| recording.zero() + self.scale.force * f.re).collect()
    }
}

fn plain(parameters: &[f64]) -> Vec<Dual64> {
    parameters.iter().map(|p| Dual64::from(*p)).collect()
}

/// Amplitudes and time constants, over the scale.
fn spectrum(kind: Kind, p: &[Dual64], span: [f64; 2]) -> Vec<(Dual64, Dual64)> {
    if kind.terms > 0 {
        return (0..kind.terms).map(|i| (p[1 + i], p[1 + kind.terms + i].exp())).collect();
    }
    let decades = (span[1] / span[0]).log10();
    let count = (A_DECADE * decades).ceil().max(1.0) as usize;
    let shares: Vec<(Dual64, f64)> = (0..=count)
        .map(|i| span[0] * 10_f64.powf(decades * i as f64 / count as f64))
        .map(|time| ((-p[2] * (time / span[0]).ln()).exp(), time))
        .collect();
    let whole: Dual64 = shares.iter().map(|(share, _)| *share).sum();
    shares.into_iter().map(|(share, time)| (p[1] * share / whole, Dual64::from(time))).collect()
}

/// Forces without the zero, over the scale, as times and deformations are.
pub(super) fn forces(
    kind: Kind,
    p: &[Dual64],
    span: [f64; 2],
    times: &[f64],
    deformation: &[f64],
) -> Vec<Dual64> {
    let shapes = kind.parameters() - usize::from(kind.stiffens) - usize::from(kind.apart);
    let steep = if kind.stiffens { p[shapes] } else { Dual64::from(0.0) };
    let elastic: Vec<Dual64> = deformation.iter().map(|d| shape(steep, *d)).collect();
    let lasting = if kind.apart { Some(p[shapes + 1]) } else { None };
    let mut sum: Vec<Dual64> =
        deformation.iter().zip(&elastic).map(|(d, e)| p[0] * lasting.map_or(*e, |b| shape(b, *d))).collect();
    for (amplitude, time) in spectrum(kind, p, span) {
        // None of it: nothing to be followed. Its derivative is asked for nevertheless.
        if amplitude.re == 0.0 && amplitude.eps == 0.0 {
            continue;
        }
        for (total, h) in sum.iter_mut().zip(branch(times, &elastic, time)) {
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
