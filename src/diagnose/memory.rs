//! A stiffness that relaxes: displacement in time → force in time, exactly for a displacement linear between rows.
//!
//! For a Prony series `𝓔[u]ₙ = eₙ uₙ + hₙ`, `h` known from the past (Taylor, Pister and Goudreau 1970).

use super::dual::Dual;
use super::effects::Term;
use nalgebra::DVector;
use num_dual::DualNum;

/// The past of one hereditary operator: one state for each term and component.
pub(super) struct Memory<const N: usize> {
    /// Long-time stiffness.
    lasting: Dual<N>,
    /// Stiffness and time constant (s) of every term.
    terms: Vec<(Dual<N>, Dual<N>)>,
    state: Vec<DVector<Dual<N>>>,
    last: DVector<Dual<N>>,
    /// The last step (s), and by how much every term decays over it and on average within it.
    step: Option<(f64, Vec<(Dual<N>, Dual<N>)>)>,
}

impl<const N: usize> Memory<N> {
    /// `lasting` stays; every term relaxes a share of the instantaneous stiffness.
    pub(super) fn new(lasting: Dual<N>, terms: &[Term<N>], components: usize) -> Self {
        let relaxed: Dual<N> = terms.iter().map(|t| t.relaxed_fraction).sum();
        let instantaneous = lasting / (Dual::from(1.0) - relaxed);
        let terms: Vec<(Dual<N>, Dual<N>)> =
            terms.iter().map(|t| (instantaneous * t.relaxed_fraction, t.time_constant_s)).collect();
        let still = || DVector::from_element(components, Dual::from(0.0));
        Self { lasting, state: terms.iter().map(|_| still()).collect(), terms, last: still(), step: None }
    }

    /// Decay over a step, and the mean of the decay within it.
    fn decay(time_constant_s: Dual<N>, dt: f64) -> (Dual<N>, Dual<N>) {
        let over = Dual::from(dt) / time_constant_s;
        let decay = (-over).exp();
        (decay, (Dual::from(1.0) - decay) / over)
    }

    /// `e` and `h` of the step (s) that is to come, scaled by `age`.
    pub(super) fn step(&mut self, dt: f64, age: Dual<N>) -> (Dual<N>, DVector<Dual<N>>) {
        if self.step.as_ref().is_none_or(|(known, _)| *known != dt) {
            let decays = self.terms.iter().map(|(_, time_constant)| Self::decay(*time_constant, dt));
            self.step = Some((dt, decays.collect()));
        }
        let mut e = self.lasting;
        let mut h = DVector::from_element(self.last.len(), Dual::from(0.0));
        for ((stiffness, decay, mean), state) in self.decaying().zip(&self.state) {
            let stiffness = stiffness * mean;
            e += stiffness;
            for i in 0..h.len() {
                h[i] += decay * state[i] - stiffness * self.last[i];
            }
        }
        (e * age, h.map(|x| x * age))
    }

    /// Goes on by that step, to a displacement.
    pub(super) fn advance(&mut self, to: DVector<Dual<N>>) {
        let decaying: Vec<(Dual<N>, Dual<N>, Dual<N>)> = self.decaying().collect();
        for ((stiffness, decay, mean), state) in decaying.into_iter().zip(&mut self.state) {
            let stiffness = stiffness * mean;
            for i in 0..to.len() {
                state[i] = decay * state[i] + stiffness * (to[i] - self.last[i]);
            }
        }
        self.last = to;
    }

    /// Stiffness of every term, and its decay over the step and on average within it.
    fn decaying(&self) -> impl Iterator<Item = (Dual<N>, Dual<N>, Dual<N>)> + '_ {
        let decays = self.step.iter().flat_map(|(_, decays)| decays);
        self.terms.iter().zip(decays).map(|((stiffness, _), (decay, mean))| (*stiffness, *decay, *mean))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A standard linear solid, ramped to 1 in `T` and held, against the convolution's closed form
    /// (Tschoegl 1989, chapter 2): `E∞ + E₁ τ/T (e^{T/τ} − 1) e^{−t/τ}`; and its inverse gives the ramp back.
    #[test]
    fn a_ramp_and_hold_relaxes_by_the_closed_form() {
        let term: Term = Term { relaxed_fraction: Dual::from(0.3), time_constant_s: Dual::from(2.0) };
        let (lasting, ramp) = (0.7, 0.5);
        let mut memory = Memory::new(Dual::from(lasting), &[term], 1);
        let mut inverse = Memory::new(Dual::from(lasting), &[term], 1);
        for row in 1..=200 {
            let t = 0.05 * f64::from(row);
            let u = (t / ramp).min(1.0);
            let (e, h) = memory.step(0.05, Dual::from(1.0));
            let force = (e * u + h[0]).re;
            memory.advance(DVector::from_element(1, Dual::from(u)));
            let expected = if t <= ramp {
                lasting * t / ramp + 0.3 * 2.0 / ramp * (1.0 - (-t / 2.0).exp())
            } else {
                lasting + 0.3 * 2.0 / ramp * ((ramp / 2.0).exp() - 1.0) * (-t / 2.0).exp()
            };
            assert!((force - expected).abs() < 1e-12, "{t}: {force} {expected}");
            let (e, h) = inverse.step(0.05, Dual::from(1.0));
            let back = (Dual::from(force) - h[0]) / e;
            assert!((back.re - u).abs() < 1e-12);
            inverse.advance(DVector::from_element(1, back));
        }
    }
}
