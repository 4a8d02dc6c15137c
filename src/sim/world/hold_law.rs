//! The force of one spring patch on the phantom: linear, slack, with memory, with dry friction, or all of it.

use super::memory::{Past, PronyTerm, relaxed};
use crate::geometry::{Mat3, Vec3};

/// One spring patch with its state.
///
/// λ = −k₀ (x(w) − Σ hⱼ pⱼ) − t: x(w) = w, or d max(0, w·d − gap) for a slack band; pⱼ what the springs remember of x; t
/// the force of a friction element that follows w with stiffness k_f as far as |t| ≤ yield lets it.
#[derive(Debug, Clone)]
pub(super) struct HoldLaw {
    /// k₀ (N/m).
    stiffness: f64,
    slack: Option<(Vec3, f64)>,
    past: Past,
    friction: Option<Friction>,
}

/// A spring in series with a slider.
#[derive(Debug, Clone)]
pub(super) struct Friction {
    /// k_f (N/m).
    pub(super) stiffness: f64,
    /// Largest force (N).
    pub(super) yield_n: f64,
    /// Where the slider is (m).
    pub(super) slider: Vec3,
}

impl HoldLaw {
    /// `stiffness` is that at equilibrium (N/m); `slack` holds direction and gap (m).
    pub(super) fn new(
        stiffness: f64,
        terms: &[PronyTerm],
        step_s: f64,
        slack: Option<(Vec3, f64)>,
        friction: Option<Friction>,
    ) -> Self {
        let past = Past::new(terms, step_s, 3);
        Self { stiffness: stiffness / (1.0 - relaxed(terms)), slack, past, friction }
    }

    /// x(w) and ∂x/∂w.
    fn stretch(&self, w: Vec3) -> (Vec3, Mat3) {
        match self.slack {
            None => (w, Mat3::identity()),
            Some((d, gap)) if w.dot(&d) > gap => (d * (w.dot(&d) - gap), d * d.transpose()),
            Some(_) => (Vec3::zeros(), Mat3::zeros()),
        }
    }

    /// λ and ∂λ/∂w at the end of the step ahead.
    pub(super) fn pull(&self, w: Vec3) -> (Vec3, Mat3) {
        let (x, slope) = self.stretch(w);
        let share = self.past.share();
        let before = Vec3::from_column_slice(&self.past.held_back());
        let mut force = -self.stiffness * (share * x - before);
        let mut tangent = -self.stiffness * share * slope;
        if let Some(friction) = &self.friction {
            let (drag, drag_slope) = friction.drag(w);
            force -= drag;
            tangent -= drag_slope;
        }
        (force, tangent)
    }

    /// Ends the step at w.
    pub(super) fn advance(&mut self, w: Vec3) {
        let (x, _) = self.stretch(w);
        self.past.advance(x.as_slice());
        if let Some(friction) = &mut self.friction {
            friction.slider = w - friction.drag(w).0 / friction.stiffness;
        }
    }
}

impl Friction {
    /// t and ∂t/∂w: k_f (w − slider), brought back to the yield force along itself.
    fn drag(&self, w: Vec3) -> (Vec3, Mat3) {
        let trial = self.stiffness * (w - self.slider);
        let size = trial.norm();
        if size <= self.yield_n {
            return (trial, self.stiffness * Mat3::identity());
        }
        let along = trial / size;
        let turn = Mat3::identity() - along * along.transpose();
        (self.yield_n * along, self.stiffness * self.yield_n / size * turn)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A slack band is a straight line in three pieces: nothing up to the gap, nothing the other way, k beyond.
    #[test]
    fn a_slack_band_pulls_beyond_its_gap_only() {
        let down = -Vec3::z();
        let band = HoldLaw::new(60.0, &[], 0.01, Some((down, 8e-4)), None);
        for (z, expected) in [(1e-3, 0.0), (-7e-4, 0.0), (-1e-3, 60.0 * 2e-4), (-3e-3, 60.0 * 2.2e-3)] {
            let (force, _) = band.pull(Vec3::new(5e-4, 0.0, z));
            assert!((force - Vec3::z() * expected).norm() < 1e-12, "{z}: {force}");
        }
    }

    /// Stretched and let go by turns: the loop of a spring beside a spring with a slider (Jenkins element), by hand: with
    /// k = 50, k_f = 100, yield 0.05 N it slides from 0.5 mm on; back from 2 mm it slides again 1 mm later.
    #[test]
    fn friction_leaves_a_loop() {
        let friction = Friction { stiffness: 100.0, yield_n: 0.05, slider: Vec3::zeros() };
        let mut hold = HoldLaw::new(50.0, &[], 0.01, None, Some(friction));
        let mut at = |x: f64| {
            let w = Vec3::x() * x;
            let force = hold.pull(w).0.x;
            hold.advance(w);
            -force
        };
        let steps = [
            (4e-4, 150.0 * 4e-4),
            (1e-3, 0.05 + 0.05),
            (2e-3, 0.1 + 0.05),
            (1.5e-3, 0.075 + 0.0),
            (1e-3, 0.05 - 0.05),
            (0.0, -0.05),
        ];
        for (x, expected) in steps {
            let force = at(x);
            assert!((force - expected).abs() < 1e-12, "{x}: {force} N, {expected} N");
        }
    }

    /// Springs that relax: the stated stiffness is what is left.
    #[test]
    fn relaxed_springs_have_their_stated_stiffness() {
        let terms = [PronyTerm { relaxed_fraction: 0.4, time_constant_s: 0.5 }];
        let mut hold = HoldLaw::new(90.0, &terms, 0.05, None, None);
        let w = Vec3::new(1e-3, 0.0, -2e-3);
        for _ in 0..400 {
            hold.advance(w);
        }
        assert!((hold.pull(w).0 + 90.0 * w).norm() < 1e-9);
    }
}
