//! Where the tip is: what the stage reports, play and lost contact taken off.

use super::dual::Dual;
use super::effects::Effects;
use super::track::Touch;

/// The tip behind its stage. Play acts along the poke: the tip follows the report on approach only after its full width,
/// and again at reversal; a late contact takes its gap off the depth.
#[derive(Debug, Clone, Copy)]
pub(super) struct Play<const N: usize> {
    follows: Dual<N>,
}

impl<const N: usize> Default for Play<N> {
    fn default() -> Self {
        Self { follows: Dual::from(0.0) }
    }
}

impl<const N: usize> Play<N> {
    /// Displacement of the tip at the next row (m).
    pub(super) fn follow(&mut self, touch: &Touch, effects: &Effects<N>) -> [Dual<N>; 3] {
        let along = touch.direction;
        let reported = touch.reported_m.dot(&along);
        let depth = Dual::from(reported);
        let behind = depth - effects.backlash_m;
        if behind.re > self.follows.re {
            self.follows = behind;
        } else if depth.re < self.follows.re {
            self.follows = depth;
        }
        let mut actual = self.follows - effects.late_m;
        if effects.late_m.re > 0.0 && actual.re < 0.0 {
            actual = Dual::from(0.0);
        }
        let aside = touch.reported_m - along * reported;
        std::array::from_fn(|i| actual * along[i] + aside[i])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;

    /// Down to 5, up to 3, down to 4: followed by hand with a play of 1 and a gap of 0.5.
    #[test]
    fn play_and_gap_by_hand() {
        let depths = [0.5, 1.0, 3.0, 5.0, 4.5, 4.0, 3.0, 3.5, 4.0, 4.5];
        let followed = |backlash: f64, late: f64| -> Vec<f64> {
            let mut effects = Effects::neutral(0);
            effects.backlash_m = Dual::from(backlash);
            effects.late_m = Dual::from(late);
            let mut play = Play::default();
            let row = |d: &f64| {
                let touch = Touch {
                    site: 0,
                    direction: -Vec3::z(),
                    inward: -Vec3::z(),
                    reported_m: Vec3::new(0.1, 0.0, -d),
                };
                -play.follow(&touch, &effects)[2].re
            };
            depths.iter().map(row).collect()
        };
        assert_eq!(followed(0.0, 0.0), depths);
        assert_eq!(followed(1.0, 0.0), [0.0, 0.0, 2.0, 4.0, 4.0, 4.0, 3.0, 3.0, 3.0, 3.5]);
        assert_eq!(followed(0.0, 1.5), [0.0, 0.0, 1.5, 3.5, 3.0, 2.5, 1.5, 2.0, 2.5, 3.0]);
    }
}
