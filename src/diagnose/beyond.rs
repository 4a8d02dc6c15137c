//! How plainly a reading leaves more than noise, in the force and in the markers.

use super::left::Left;
use statrs::distribution::{ContinuousCDF, Normal};

/// How much wider than white noise the sum of squares of means scatters, because what elements leave is common to neighbours and to the
/// pieces of a poke.
const WIDER: f64 = 1.6;

/// And that of the force where its zero wanders: the eight pieces of a poke then err alike.
const WIDER_WANDERING: f64 = 2.9;

/// What the squares of means have beyond their expectation.
///
/// Why by channel: a hundred markers have fifty times as many means as the force. Summed up with them, what is plain in the force would
/// drown in their scatter, and wherever their errors are taken for larger than they are nothing would be left at all.
pub(super) struct Beyond {
    /// Of the force and of the markers: the sum, and its standard deviation for noise alone.
    channels: [(f64, f64); 2],
}

impl Beyond {
    /// Of what a reading leaves.
    pub(super) fn noise(left: &Left) -> Self {
        let of = |marker: bool| {
            let means = || left.means.iter().filter(|m| m.marker.is_some() == marker);
            let sum: f64 = means().map(|m| m.square - 1.0).sum();
            let wider = if left.wanders && !marker { WIDER_WANDERING } else { WIDER };
            (sum, wider * (2.0 * means().count().max(1) as f64).sqrt())
        };
        Self { channels: [of(false), of(true)] }
    }

    /// The plainest channel's, in standard deviations.
    pub(super) fn deviations(&self) -> f64 {
        self.channels.iter().map(|(sum, sd)| sum / sd).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Probability that noise alone makes one of the channels as plain.
    pub(super) fn p_value(&self) -> f64 {
        (self.channels.len() as f64 * Normal::standard().sf(self.deviations())).clamp(f64::MIN_POSITIVE, 1.0)
    }

    /// All that is beyond one standard deviation.
    pub(super) fn all(&self) -> f64 {
        self.channels.iter().map(|(sum, sd)| (sum - sd).max(0.0)).sum()
    }

    /// The share of all that is beyond noise which a reading explains, the rest being `after`.
    pub(super) fn explained(&self, after: &Self) -> f64 {
        let least = self.channels.iter().map(|(_, sd)| *sd).fold(0.0, f64::max);
        1.0 - after.all() / self.all().max(least)
    }
}

#[cfg(test)]
mod tests {
    use super::super::diagnosis::{Channel, Phase};
    use super::super::left::Mean;
    use super::*;

    /// Means of the force and of the markers, all with these squares.
    fn left(force: f64, markers: f64) -> Left {
        let mean = |channel, marker, square| Mean { poke: 0, phase: Phase::Hold, channel, marker, square };
        let of_force = (0..150).map(|_| mean(Channel::ForceAlong, None, force));
        let of_markers = (0..20_000).map(|m| mean(Channel::Markers(0), Some(m), markers));
        Left { means: of_force.chain(of_markers).collect(), wanders: false }
    }

    /// Markers whose errors are taken for larger than they are do not hide what the force shows, and it is not explained before it is
    /// gone.
    #[test]
    fn what_the_force_shows_does_not_drown_in_the_markers() {
        let before = Beyond::noise(&left(200.0, 0.7));
        assert!(before.deviations() > 100.0 && before.p_value() < 1e-12);
        let half = Beyond::noise(&left(100.0, 0.7));
        assert!((before.explained(&half) - 0.5).abs() < 0.01);
        let all = Beyond::noise(&left(1.0, 0.7));
        assert!(all.deviations() <= 0.0 && before.explained(&all) == 1.0);
        assert!(Beyond::noise(&left(1.0, 1.0)).p_value() == 1.0);
        let some = Beyond::noise(&left(1.8, 1.0)).p_value();
        let wanders = Beyond::noise(&Left { wanders: true, ..left(1.8, 1.0) }).p_value();
        assert!(some < 1e-4 && wanders > 5e-3, "{some} {wanders}");
    }
}
