//! Everything that may act besides the baseline, as one set of values whose neutral member is the baseline.
//!
//! Signs and zeros are those of the physics catalogue.

use super::dual::{Dual, MOST, resized};
use super::extra::Large;
use super::sticky::Sticky;
use super::uneven;
use nalgebra::DVector;

/// One term of a Prony series: share of the instantaneous stiffness that relaxes, and its time constant (s).
#[derive(Debug, Clone, Copy)]
pub(super) struct Term<const N: usize = MOST> {
    pub relaxed_fraction: Dual<N>,
    pub time_constant_s: Dual<N>,
}

/// What a restraint does besides pulling in proportion.
#[derive(Debug, Clone)]
pub(super) struct Band<const N: usize = MOST> {
    /// Memory of the restraint: of what it is stretched by.
    pub memory: Vec<Term<N>>,
    /// Acts along a direction only, in tension, beyond a gap.
    pub slack: Option<Slack<N>>,
    /// What drags beside it; nothing does where it is slack.
    pub sticky: Option<Sticky<N>>,
}

/// `f = −max(0, k s) d` with `s = u·d − gap`, where a band remembers `−max(0, 𝓔[s]) d`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Slack<const N: usize = MOST> {
    pub gap_m: Dual<N>,
    /// Unit vector `d`.
    pub direction: [f64; 3],
}

impl<const N: usize> Slack<N> {
    /// Whether the mean of its discs, displaced by `u`, has it pull: it does with `stiffness` times the stretch, and `past`.
    pub(super) fn pulls(&self, u: &[Dual<N>], (stiffness, past): &(Dual<N>, DVector<Dual<N>>)) -> bool {
        let pull = |(u, past): (&[Dual<N>], &[Dual<N>])| self.stretch(u) * stiffness + self.along(past);
        u.chunks_exact(3).zip(past.as_slice().chunks_exact(3)).map(pull).sum::<Dual<N>>().re > 0.0
    }

    /// By how much each of its discs stretches it (m): beyond the gap, or, while it does not pull, to where it would pull with nothing.
    pub(super) fn stretched(
        &self,
        u: &[Dual<N>],
        (stiffness, past): &(Dual<N>, DVector<Dual<N>>),
        pulls: bool,
    ) -> DVector<Dual<N>> {
        let of = |(u, past): (&[Dual<N>], &[Dual<N>])| {
            let stretch = match pulls {
                true => self.stretch(u),
                false if stiffness.re > 0.0 => -self.along(past) / stiffness,
                false => Dual::from(0.0),
            };
            self.direction.map(|d| stretch * d)
        };
        DVector::from_iterator(u.len(), u.chunks_exact(3).zip(past.as_slice().chunks_exact(3)).flat_map(of))
    }

    fn stretch(&self, u: &[Dual<N>]) -> Dual<N> {
        self.along(u) - self.gap_m
    }

    fn along(&self, v: &[Dual<N>]) -> Dual<N> {
        v.iter().zip(self.direction).map(|(v, d)| *v * d).sum()
    }
}

/// All effects.
#[derive(Debug, Clone)]
pub(super) struct Effects<const N: usize = MOST> {
    /// Memory of the phantom.
    pub relaxation: Vec<Term<N>>,
    /// `E(t) = E (1 + rate t)` (1/s).
    pub drying_per_s: Dual<N>,
    /// One a restraint group.
    pub bands: Vec<Band<N>>,
    /// Coulomb coefficient at the tip; `None` sticks.
    pub friction: Option<Dual<N>>,
    /// Lost depth at contact (m).
    pub late_m: Dual<N>,
    /// Full width of the play (m).
    pub backlash_m: Dual<N>,
    /// Of frame and holder along the poke (m/N).
    pub stage_m_per_n: Dual<N>,
    /// Of the force's zero (N/s).
    pub drift_n_per_s: [Dual<N>; 3],
    /// Of each force axis.
    pub gain: [Dual<N>; 3],
    /// Rotation vector of the camera's displacements (rad).
    pub rotation_rad: [Dual<N>; 3],
    /// Of all displacements, and of z besides.
    pub scale: Dual<N>,
    pub depth_gain: Dual<N>,
    /// What the scale has besides at a place of the picture, by what it is in proportion to (see `uneven`).
    pub uneven: [Dual<N>; uneven::KINDS],
    /// Markers show the state this much earlier than their stamp (s).
    pub lag_s: Dual<N>,
    /// A law that is not linear in the displacement.
    pub large: Option<Large>,
}

impl Effects {
    /// With derivatives by the first `N` parameters, and without a law that is not linear, which no march follows.
    pub(super) fn resized<const N: usize>(&self) -> Effects<N> {
        let term = |term: &Term| Term {
            relaxed_fraction: resized(&term.relaxed_fraction),
            time_constant_s: resized(&term.time_constant_s),
        };
        let slack = |slack: Slack| Slack { gap_m: resized(&slack.gap_m), direction: slack.direction };
        let band = |band: &Band| Band {
            memory: band.memory.iter().map(term).collect(),
            slack: band.slack.map(slack),
            sticky: band.sticky.map(|sticky| sticky.resized()),
        };
        let axes = |of: &[Dual; 3]| [0, 1, 2].map(|i| resized(&of[i]));
        Effects {
            relaxation: self.relaxation.iter().map(term).collect(),
            drying_per_s: resized(&self.drying_per_s),
            bands: self.bands.iter().map(band).collect(),
            friction: self.friction.as_ref().map(resized),
            late_m: resized(&self.late_m),
            backlash_m: resized(&self.backlash_m),
            stage_m_per_n: resized(&self.stage_m_per_n),
            drift_n_per_s: axes(&self.drift_n_per_s),
            gain: axes(&self.gain),
            rotation_rad: axes(&self.rotation_rad),
            scale: resized(&self.scale),
            depth_gain: resized(&self.depth_gain),
            uneven: std::array::from_fn(|i| resized(&self.uneven[i])),
            lag_s: resized(&self.lag_s),
            large: None,
        }
    }

    /// The baseline, with so many restraint groups.
    pub(super) fn neutral(groups: usize) -> Self {
        let (zero, one) = (Dual::from(0.0), Dual::from(1.0));
        Self {
            relaxation: Vec::new(),
            drying_per_s: zero,
            bands: vec![Band { memory: Vec::new(), slack: None, sticky: None }; groups],
            friction: None,
            late_m: zero,
            backlash_m: zero,
            stage_m_per_n: zero,
            drift_n_per_s: [zero; 3],
            gain: [one; 3],
            rotation_rad: [zero; 3],
            scale: one,
            depth_gain: one,
            uneven: [zero; uneven::KINDS],
            lag_s: zero,
            large: None,
        }
    }

    /// Whether the camera's scale differs over the picture, or may.
    pub(super) fn scale_uneven(&self) -> bool {
        self.uneven.iter().any(|x| differs(x, 0.0))
    }

    /// Whether the camera turns or scales all displacements alike, or may.
    pub(super) fn camera_acts(&self) -> bool {
        self.rotation_rad.iter().any(|x| differs(x, 0.0))
            || differs(&self.scale, 1.0)
            || differs(&self.depth_gain, 1.0)
    }
}

/// Whether a value is another than `from`, or may become one.
fn differs(x: &Dual, from: f64) -> bool {
    x.re != from || x.eps.0.is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A band of 5 N/m whose past takes 2 mN off, with a gap of 0.1 mm: it pulls where its disc is beyond 0.5 mm, and while it does not, it is stretched
    /// by the 0.4 mm at which it pulls with nothing.
    #[test]
    fn a_band_that_has_relaxed_goes_slack_where_it_pulls_with_nothing() {
        let slack: Slack = Slack { gap_m: Dual::from(1e-4), direction: [0.6, 0.0, 0.8] };
        let along = |size: f64| slack.direction.map(|d| Dual::from(size * d));
        let own = (Dual::from(5.0), DVector::from_column_slice(&along(-2e-3)));
        assert!(slack.pulls(&along(0.501e-3), &own) && !slack.pulls(&along(0.499e-3), &own));
        for (pulls, size) in [(true, 0.2e-3), (false, 0.4e-3)] {
            let stretched = slack.stretched(&along(0.3e-3), &own, pulls);
            let off = stretched.iter().zip(along(size)).map(|(s, expected)| (s.re - expected.re).abs());
            assert!(off.fold(0.0, f64::max) < 1e-15, "{pulls}: {stretched}");
        }
    }
}
