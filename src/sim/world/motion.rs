//! What the stage reports, and where the tip really goes.

use super::effect::Effect;
use super::foreign::Foreign;
use super::plan::{Press, World};
use super::rig::Rig;
use crate::geometry::Vec3;
use crate::sim::timeline::Timeline;

/// The tip in contact at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Contact {
    /// Index among the sites that are poked.
    pub(super) tip: usize,
    /// Where the stage holds the tip, from the site (m).
    pub(super) target: Vec3,
    /// Unit vector along which the stage moves.
    pub(super) direction: Vec3,
    /// Unit vector into the phantom.
    pub(super) inward: Vec3,
}

/// The tip at each instant of a grid of `step_s`; none while nothing touches the phantom.
pub(super) fn contacts(world: &World, timeline: &Timeline, step_s: f64) -> Vec<Option<Contact>> {
    let count = (timeline.end_s / step_s).round() as usize + 1;
    let mut carriage = Carriage::new(world);
    (0..count)
        .map(|n| {
            let t = n as f64 * step_s;
            let (poke, reported) = timeline.at(t)?;
            carriage.contact(world, poke, &world.pokes[poke], reported, t)
        })
        .collect()
}

/// What lies between the stage's report and the tip.
pub(super) struct Carriage {
    /// Sites that are poked, ascending.
    sites: Vec<usize>,
    play: Play,
}

impl Carriage {
    pub(super) fn new(world: &World) -> Self {
        Self { sites: world.touched(), play: Play { poke: usize::MAX, at: 0.0 } }
    }

    /// The tip while the stage reports so much depth (m) in a poke; none while nothing touches the phantom. `number` tells pokes apart.
    pub(super) fn contact(
        &mut self,
        world: &World,
        number: usize,
        press: &Press,
        reported_m: f64,
        time_s: f64,
    ) -> Option<Contact> {
        let mut depth = reported_m;
        let mut direction = Vec3::from(press.direction);
        let mut touching = true;
        for effect in &world.effects {
            match *effect {
                Effect::Foreign(Foreign::StageExpansion { rate_m_per_s }) => depth += rate_m_per_s * time_s,
                Effect::Foreign(Foreign::StageMisalignment { rotation_rad }) => {
                    direction = nalgebra::Rotation3::new(Vec3::from(rotation_rad)) * direction;
                }
                Effect::Rig(Rig::Backlash { backlash_m }) => {
                    depth = self.play.follow(number, depth, backlash_m);
                }
                Effect::Rig(Rig::LateContact { gap_m }) => {
                    depth -= gap_m;
                    touching &= depth > 0.0;
                }
                _ => {}
            }
        }
        touching.then(|| Contact {
            tip: self.sites.partition_point(|&s| s < press.site),
            target: depth * direction,
            direction,
            inward: Vec3::from(world.phantom.sites[press.site].inward),
        })
    }
}

/// The play operator: what is pushed follows only when the play is used up. At the start of a poke it lies at the near
/// end, so that the first motion is lost.
struct Play {
    poke: usize,
    at: f64,
}

impl Play {
    fn follow(&mut self, poke: usize, reported: f64, width: f64) -> f64 {
        if self.poke != poke {
            *self = Self { poke, at: reported };
        }
        self.at = self.at.clamp(reported - width, reported);
        self.at
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: nothing for the first 0.2 of the way in, 0.2 behind until the turn, still for 0.2, then together.
    #[test]
    fn play_is_lost_on_the_way_in_and_at_the_turn() {
        let mut play = Play { poke: usize::MAX, at: 0.0 };
        let reported = [0.0, 0.1, 0.2, 0.5, 1.0, 1.0, 0.9, 0.8, 0.7, 0.0];
        let actual = [0.0, 0.0, 0.0, 0.3, 0.8, 0.8, 0.8, 0.8, 0.7, 0.0];
        for (r, a) in reported.into_iter().zip(actual) {
            assert!((play.follow(3, r, 0.2) - a).abs() < 1e-15, "{r}");
        }
        assert_eq!(play.follow(4, 0.1, 0.2), 0.1);
    }
}
