//! A session that has happened, to be looked at at any time before any instrument has.

use super::body::change;
use super::camera::lag;
use super::condensed::SessionBody;
use super::effect::check;
use super::glimpse::{Glimpse, SeenTip, displaced};
use super::happened::Happened;
use super::history::carry;
use super::large::LargeCourse;
use super::motion::{Contact, contacts};
use super::phantom::Phantom;
use super::plan::World;
use crate::geometry::Vec3;
use crate::sim::SimError;
use crate::sim::timeline::Timeline;

/// Steps of time in one period of the force sensor.
///
/// Why: rows of the sensor are instants of the grid; markers are seen between them, where a kink (a band that tightens,
/// play that is used up) is off by an eighth of a step's motion at most: 2.5 µm at 4 mm/s.
const STEPS_A_ROW: f64 = 4.0;
/// Between pokes the tip draws back at this speed (m/s) as far as this (m), and is then out of sight.
const DRAWN_BACK_M_S: f64 = 0.04;
const OUT_OF_SIGHT_M: f64 = 0.02;

/// A session on its phantom, gone through from beginning to end.
pub struct Past<'a> {
    pub(super) world: &'a World,
    pub(super) phantom: &'a Phantom,
    pub(super) timeline: Timeline,
    pub(super) happened: Happened,
    contacts: Vec<Option<Contact>>,
    step_s: f64,
    stage_compliance: f64,
}

impl World {
    /// Goes through the session on its phantom, which was prepared from the same plan.
    ///
    /// # Errors
    /// [`SimError`]: another phantom, a place that does not exist, an effect whose figures mean nothing, equations
    /// without a solution.
    pub fn happen<'a>(&'a self, phantom: &'a Phantom) -> Result<Past<'a>, SimError> {
        if phantom.plan != self.phantom {
            return Err(SimError::OtherPhantom { session: self.name.clone() });
        }
        check(self)?;
        let timeline = self.timeline()?;
        let change = change(self, &phantom.watched)?;
        let body = SessionBody::new(self, phantom, change.as_ref())?;
        let step_s = 1.0 / (STEPS_A_ROW * self.instruments.sensor_rate_hz);
        let (contacts, setup) = (contacts(self, &timeline, step_s), self.setup(step_s));
        let stage_compliance = setup.stage_compliance;
        let large = LargeCourse::of(self, &body, &contacts, step_s, stage_compliance, &phantom.watched)?;
        let happened = match large {
            Some(large) => Happened::Large(large),
            None => {
                let course = carry(&body, setup, &contacts, step_s)?;
                Happened::Small { body, course }
            }
        };
        Ok(Past { world: self, phantom, timeline, happened, contacts, step_s, stage_compliance })
    }
}

impl Past<'_> {
    /// When it ends (s); it began at 0.
    pub fn end_s(&self) -> f64 {
        self.timeline.end_s
    }

    /// What was to happen.
    pub fn world(&self) -> &World {
        self.world
    }

    /// The phantom on which it happened.
    pub fn phantom(&self) -> &Phantom {
        self.phantom
    }

    /// What a camera that stamps its picture with `stamped_s` (s) has in front of it: that of the same time, or of an earlier one if the
    /// camera lags. With velocities if `moving`. None on a phantom without a skin.
    pub fn glimpse(&self, stamped_s: f64, moving: bool) -> Option<Glimpse> {
        self.phantom.skin.as_ref()?;
        let time_s = (stamped_s - lag(self.world)).max(0.0);
        let moved_m = self.skin_at(time_s);
        let speed_m_s = moving.then(|| {
            let [before, after] = [time_s - self.step_s, time_s + self.step_s].map(|t| self.skin_at(t));
            before.iter().zip(after).map(|(a, b)| (b - a) / (2.0 * self.step_s)).collect()
        });
        Some(Glimpse { time_s, moved_m, speed_m_s, tip: self.tip_at(time_s) })
    }

    /// Displacements of the skin at a time (m).
    fn skin_at(&self, time_s: f64) -> Vec<Vec3> {
        let first = self.phantom.markers.len();
        match &self.happened {
            Happened::Small { body, course } => displaced(&body.watched, &course.loads_at(time_s), first),
            Happened::Large(course) => {
                let moved = course.moved_at(time_s);
                moved.as_slice()[3 * first..].chunks_exact(3).map(Vec3::from_column_slice).collect()
            }
        }
    }

    fn tip_at(&self, time_s: f64) -> Option<SeenTip> {
        let places = [time_s - self.step_s, time_s, time_s + self.step_s].map(|t| self.face_at(t));
        let (poke, face) = places[1]?;
        let velocity = match (places[0], places[2]) {
            (Some((a, before)), Some((b, after))) if (a, b) == (poke, poke) => {
                (after - before) / (2.0 * self.step_s)
            }
            _ => Vec3::zeros(),
        };
        self.world.tip_of(&self.world.pokes[poke], face, velocity)
    }

    /// The poke to which the tip belongs, and where its face is (m).
    fn face_at(&self, time_s: f64) -> Option<(usize, Vec3)> {
        let pokes = &self.timeline.pokes;
        let away = |poke: usize| (pokes[poke].start_s - time_s).max(time_s - pokes[poke].end_s).max(0.0);
        let poke = (0..pokes.len()).min_by(|&a, &b| away(a).total_cmp(&away(b)))?;
        let plan = &pokes[poke].plan;
        let (site, direction) = (Vec3::from(plan.site_m), Vec3::from(plan.direction));
        let instant = (time_s / self.step_s).clamp(0.0, (self.contacts.len() - 1) as f64);
        let (before, share) = (instant as usize, instant.fract());
        let held = [before, (before + 1).min(self.contacts.len() - 1)].map(|n| self.contacts[n]);
        if let [Some(a), Some(b)] = held {
            let give =
                a.direction * (self.stage_compliance * a.direction.dot(&self.happened.force_at(time_s)));
            return Some((poke, site + a.target + (b.target - a.target) * share - give));
        }
        let depth = self.timeline.at(time_s).map_or(0.0, |(_, depth)| depth);
        let back = DRAWN_BACK_M_S * away(poke);
        let short = super::glimpse::gap(self.world).max(0.0) + back - depth;
        (back < OUT_OF_SIGHT_M).then(|| (poke, site - direction * short))
    }
}

#[cfg(test)]
mod tests;
