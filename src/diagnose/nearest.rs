//! Where nothing is called: the effect that, refitted by itself, comes nearest to what is asked of it, and what is said of it.

use super::in_step::blamed;
use super::physics::Physics;
use super::select::{Selection, Tried};

/// An effect that, refitted by itself, explains some of what is asked of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Nearest {
    /// The reading's index among all that were tried.
    pub reading: usize,
    /// The effect.
    pub physics: Physics,
    /// What it explains of the baseline, over what is asked.
    pub share: f64,
}

/// The effect that, refitted by itself, comes nearest to what is `asked` of it, of a baseline with the sum of squares `plain`. None where none
/// promised enough to be refitted, or none may be blamed; `base` of a reading's values come before its knobs'.
pub(super) fn nearest(
    selection: &Selection,
    plain: f64,
    base: usize,
    asked: impl Fn(Physics) -> f64,
) -> Option<Nearest> {
    let plain = plain.min(selection.base.cost);
    let alone = |(_, t): &(usize, &Tried)| t.physics.len() == 1 && !blamed(t, base).is_empty();
    let measured = |(reading, t): (usize, &Tried)| {
        let physics = t.physics[0];
        Nearest { reading, physics, share: (plain - t.fitted.cost) / asked(physics) }
    };
    let all = selection.tried.iter().enumerate().filter(alone).map(measured);
    all.max_by(|a, b| a.share.total_cmp(&b.share))
}

impl Nearest {
    /// Among the remarks.
    pub(super) fn said(&self) -> String {
        format!("{} comes nearest to what would be named, {}", self.physics.said(), self.why())
    }

    /// Why it is not the verdict.
    pub(super) fn why(&self) -> String {
        let but = match self.share < 1.0 {
            true => "it may act weakly",
            false => "other entries, or pokes that its fit has not seen, speak against it, but it may act",
        };
        format!("with {:.0} % of what is asked of it: {but}", 100.0 * self.share)
    }
}

/// What the next poke is to tell from its rivals: what comes so `near` that it may act though nothing is called, what is chosen, or else what
/// comes closest. None where nothing was refitted.
pub(super) fn asked_about(selection: &Selection, near: Option<Nearest>) -> Option<&Tried> {
    let told = near.map(|near| near.reading).or(selection.chosen).map(|i| &selection.tried[i]);
    told.or_else(|| selection.tried.iter().min_by(|a, b| a.fitted.cost.total_cmp(&b.fitted.cost)))
}

#[cfg(test)]
mod tests {
    use super::super::knob::Knob;
    use super::super::rivals::tests::selection;
    use super::*;
    use nalgebra::DVector;

    /// Of what was refitted by itself; what asks for more comes less near, and a lag that is not blamed is none.
    #[test]
    fn the_nearest_effect_is_measured_by_what_is_asked_of_it() {
        let mut selection = selection();
        let asked = |physics| if physics == Physics::Drying { 1000.0 } else { 100.0 };
        let found = |reading, physics, share| Some(Nearest { reading, physics, share });
        assert_eq!(nearest(&selection, 1000.0, 0, asked), found(3, Physics::SlackBand, 6.9));
        assert_eq!(nearest(&selection, 1000.0, 0, |_| 1000.0), found(1, Physics::Drying, 0.7));
        // Of the better baseline, with whichever restraint.
        assert_eq!(nearest(&selection, 1500.0, 0, |_| 1000.0), found(1, Physics::Drying, 0.7));
        assert_eq!(nearest(&selection, 900.0, 0, |_| 1000.0), found(1, Physics::Drying, 0.6));
        selection.tried.retain(|t| t.physics != [Physics::SlackBand] && t.physics != [Physics::Drying]);
        assert_eq!(nearest(&selection, 1000.0, 0, asked), found(1, Physics::CameraLag, 1.0));
        for lag in selection.tried.iter_mut().filter(|t| t.physics == [Physics::CameraLag]) {
            lag.fitted.acting.knobs = vec![Knob::Lag];
            lag.fitted.at = DVector::from_vec(vec![9.0, 9e-4]);
        }
        assert_eq!(nearest(&selection, 1000.0, 1, asked), None);
    }

    #[test]
    fn what_earns_its_name_and_is_not_named_is_not_called_weak() {
        let of = |share| Nearest { reading: 1, physics: Physics::Drying, share }.said();
        assert!(of(0.7).contains("with 70 % of what is asked of it: it may act weakly"), "{}", of(0.7));
        assert!(of(2.18).contains("218 %") && of(2.18).contains("speak against it"), "{}", of(2.18));
    }

    /// What is told to come near is asked about, though a reading was chosen that explains nothing, and others cost less.
    #[test]
    fn the_next_poke_asks_about_what_was_told() {
        let mut selection = selection();
        let cost = |s: &Selection, near| asked_about(s, near).map(|t| t.fitted.cost);
        let near = Nearest { reading: 3, physics: Physics::SlackBand, share: 0.7 };
        assert_eq!((cost(&selection, Some(near)), cost(&selection, None)), (Some(310.0), Some(100.0)));
        selection.chosen = Some(1);
        assert_eq!((cost(&selection, Some(near)), cost(&selection, None)), (Some(310.0), Some(300.0)));
        selection.chosen = None;
        assert_eq!((cost(&selection, Some(near)), cost(&selection, None)), (Some(310.0), Some(100.0)));
        selection.tried.clear();
        assert_eq!(cost(&selection, None), None);
    }
}
