//! A world that goes on as it is told where the stage is: the reduced model behind the simulated devices.
//!
//! Where [`World::record`] knows when each poke happens, here the stage comes when it comes. The body is condensed to the world's
//! sites, and the world's pokes say along which lines it will be pressed; a tip that enters the phantom is taken to be on the nearest
//! of these lines, so that a place that no poke names answers as its neighbour does.

use super::body::change;
use super::camera::{Camera, lag};
use super::condensed::SessionBody;
use super::effect::check;
use super::force_sensor::ForceSensor;
use super::glimpse::{Glimpse, SeenTip, blended, displaced, gap};
use super::history::Carrier;
use super::large::LargeBody;
use super::motion::{Carriage, Contact, contacts};
use super::phantom::Phantom;
use super::plan::World;
use crate::geometry::Vec3;
use crate::sim::SimError;
use crate::sim::skin::Skin;
use nalgebra::{DMatrix, DVector};
use std::collections::VecDeque;
use std::sync::Arc;

/// Step of time (s). A motion of 8 mm/s goes 8 µm in it.
const STEP_S: f64 = 1e-3;
/// A tip beside its line by more than this is still on the phantom, but nobody asked for what the model says there (m).
const BESIDE_M: f64 = 0.02;
/// At one place several lines may begin: one that leads elsewhere than the tip goes counts as so much farther off (m, for a unit
/// vector's distance of 1).
const ASTRAY_M: f64 = 0.01;
/// Where the tip goes shows in a way of this length (m).
const HEADING_M: f64 = 5e-5;
/// A tip that is farther in than this without having touched came from elsewhere (m): 8 mm/s go so far in a quarter of a second.
const FIRST_TOUCH_M: f64 = 0.002;

/// Further back than the camera is late, so many steps are remembered: whoever looks may come so much too late.
const REMEMBERED: usize = 50;

/// A bench that goes on in time.
pub struct Live {
    world: World,
    body: SessionBody,
    way: Way,
    carriage: Carriage,
    sensor: ForceSensor,
    camera: Camera,
    markers: Vec<[f64; 3]>,
    skin: Option<Arc<Skin>>,
    instants: u64,
    /// Where the tip was lately, and where it goes (unit vector).
    came_from: Option<Vec3>,
    heading: Vec3,
    /// Pokes so far, and the one in progress as an index into those of the world.
    touches: usize,
    touched: Option<usize>,
    /// Force of the tip on the phantom at the last two instants (N).
    force: [Vec3; 2],
    /// The poke along whose line the tip went last.
    line: usize,
    /// How the stage gives (m/N).
    stage_compliance: f64,
    /// What moved the markers lately and where the tip was (m), the newest last.
    recent: VecDeque<(Loaded, Vec3)>,
}

/// How the phantom gives way.
enum Way {
    Small(Box<Carrier>),
    Large(LargeBody),
}

/// What moves the markers.
enum Loaded {
    /// y of the condensed phantom.
    Small(DVector<f64>),
    /// The way of a tip at large strain, and how far along it is (m).
    Large(Option<(usize, f64)>),
}

impl Live {
    /// A bench on a phantom that was prepared from the world's plan, after `at_rest_s` seconds in which nothing happened to it. Force and
    /// camera are read at the world's rates.
    ///
    /// # Errors
    /// [`SimError`] as for [`World::record`].
    pub fn new(world: World, phantom: &Phantom, at_rest_s: f64) -> Result<Self, SimError> {
        if phantom.plan != world.phantom {
            return Err(SimError::OtherPhantom { session: world.name.clone() });
        }
        check(&world)?;
        let body = SessionBody::new(&world, phantom, change(&world, &phantom.watched)?.as_ref())?;
        let setup = world.setup(STEP_S);
        let instants = (at_rest_s / STEP_S).round() as u64;
        let planned = contacts(&world, &world.timeline()?, STEP_S);
        let stage_compliance = setup.stage_compliance;
        let large = LargeBody::of(&world, &body, &planned, stage_compliance, &phantom.watched)?;
        let way = match large {
            Some(large) => Way::Large(large),
            None => Way::Small(Box::new(Carrier::new(&body, setup, STEP_S).after(instants))),
        };
        let instruments = &world.instruments;
        Ok(Self {
            carriage: Carriage::new(&world),
            sensor: ForceSensor::new(&world, instruments.sensor_rate_hz),
            camera: Camera::new(&world, instruments.frame_rate_hz),
            markers: phantom.markers.clone(),
            skin: phantom.skin.clone(),
            instants,
            came_from: None,
            heading: Vec3::zeros(),
            touches: 0,
            touched: None,
            force: [Vec3::zeros(); 2],
            line: 0,
            stage_compliance,
            recent: VecDeque::new(),
            world,
            body,
            way,
        })
    }

    /// Time that has been gone through (s).
    pub fn time_s(&self) -> f64 {
        self.instants as f64 * STEP_S
    }

    /// Goes on until `time_s`. `tip_m` says where the tip's centre is at a time (s, on from [`Live::time_s`]), as the stage reports it
    /// (m, phantom frame); the last that it is asked for may be a step after `time_s`.
    ///
    /// # Errors
    /// [`SimError`]: equations without a solution.
    pub fn advance(&mut self, time_s: f64, tip_m: impl Fn(f64) -> [f64; 3]) -> Result<(), SimError> {
        while self.time_s() < time_s {
            self.instants += 1;
            let reported = Vec3::from(tip_m(self.time_s()));
            let contact = self.contact(reported);
            let (force, loaded) = match &mut self.way {
                Way::Small(carrier) => {
                    let (force, loads) = carrier.step(&self.body, contact.as_ref())?;
                    (force, Loaded::Small(loads))
                }
                Way::Large(body) => {
                    let along = contact.as_ref().map(|c| body.step(c));
                    (along.map_or(Vec3::zeros(), |a| body.force(a)), Loaded::Large(along))
                }
            };
            self.force = [self.force[1], force];
            let tip = self.true_tip(reported, contact.as_ref());
            self.recent.push_back((loaded, tip));
            while self.recent.len() > 2 + REMEMBERED + self.steps_late() {
                self.recent.pop_front();
            }
        }
        Ok(())
    }

    /// What the force sensor reads at a time within the last step: force (N) and moment about the tip's centre (N·m), of the tip on the
    /// phantom, in the phantom frame. Each call is one reading, with noise of its own.
    pub fn wrench(&mut self, time_s: f64) -> [f64; 6] {
        let share = (1.0 - (self.time_s() - time_s) / STEP_S).clamp(0.0, 1.0);
        let force = self.force[0] * (1.0 - share) + self.force[1] * share;
        let (force, torque) = self.sensor.read(&self.world, force, time_s);
        [force.x, force.y, force.z, torque.x, torque.y, torque.z]
    }

    /// What the camera sees now: number and position (m) of each marker. Each call is one frame, with noise of its own.
    pub fn markers(&mut self) -> Vec<(u32, [f64; 3])> {
        let n = 3 * self.markers.len();
        let rows = |w: &DMatrix<f64>, loads: &DVector<f64>| w.rows(0, n) * loads;
        let moved = match (self.seen(0).map(|seen| &seen.0), &self.way) {
            (Some(Loaded::Small(loads)), _) => rows(&self.body.watched, loads),
            (Some(Loaded::Large(Some(along))), Way::Large(body)) => body.moved(*along),
            _ => DVector::zeros(n),
        };
        let site = self.touched.and_then(|p| self.world.phantom.sites.get(self.world.pokes[p].site));
        let tip = site.map(|s| (Vec3::from(s.centre_m), s.radius_m));
        let seen = self.camera.frame(&self.world, &self.markers, &moved, tip);
        seen.into_iter().map(|(index, position)| (index + 1, position)).collect()
    }

    /// What a camera has in front of it at a time within the last 50 ms (s), or before that if it lags; at the earliest of them where the
    /// time is earlier, and at the latest where it is later. With velocities if `moving`. None on a phantom without a skin.
    pub fn glimpse(&self, time_s: f64, moving: bool) -> Option<Glimpse> {
        self.skin.as_ref()?;
        let ago = ((self.time_s() - time_s) / STEP_S).clamp(0.0, REMEMBERED as f64);
        let (back, share) = (ago.floor() as usize, 1.0 - ago.fract());
        let skin = |back| self.skin_at(self.seen(back).map(|seen| &seen.0));
        // A picture of things that stand still at an instant of the grid needs no other.
        let (moved_m, speed_m_s) = match share == 1.0 && !moving {
            true => (skin(back), None),
            false => blended([skin(back + 1), skin(back)], share, STEP_S, moving),
        };
        let time_s = self.time_s() - (ago + self.steps_late() as f64) * STEP_S;
        Some(Glimpse { time_s, moved_m, speed_m_s, tip: self.tip(back, share) })
    }

    /// What the camera can look at; none on a phantom without.
    pub fn skin(&self) -> Option<&Arc<Skin>> {
        self.skin.as_ref()
    }

    /// The tip in what the camera sees, at a share of the step that ended `back` steps ago.
    fn tip(&self, back: usize, share: f64) -> Option<SeenTip> {
        let [before, after] = [self.seen(back + 1)?.1, self.seen(back)?.1];
        let face = before + (after - before) * share;
        self.world.tip_of(self.world.pokes.get(self.line)?, face, (after - before) / STEP_S)
    }

    /// Displacements of the skin (m).
    fn skin_at(&self, loaded: Option<&Loaded>) -> Vec<Vec3> {
        let first = self.markers.len();
        match (loaded, &self.way) {
            (Some(Loaded::Small(loads)), _) => displaced(&self.body.watched, loads, first),
            (Some(Loaded::Large(Some(along))), Way::Large(body)) => {
                let moved = body.moved(*along);
                moved.as_slice()[3 * first..].chunks_exact(3).map(Vec3::from_column_slice).collect()
            }
            _ => vec![Vec3::zeros(); self.body.watched.nrows() / 3 - first],
        }
    }

    /// By how many steps the camera is late.
    fn steps_late(&self) -> usize {
        (lag(&self.world) / STEP_S).round() as usize
    }

    /// What the camera sees of the latest instant but `back`, or of the first that is known.
    fn seen(&self, back: usize) -> Option<&(Loaded, Vec3)> {
        self.recent.get(self.recent.len().checked_sub(1)?.saturating_sub(self.steps_late() + back))
    }

    /// Where the tip is while the stage reports it at `reported` (m).
    fn true_tip(&self, reported: Vec3, contact: Option<&Contact>) -> Vec3 {
        let Some(press) = self.world.pokes.get(self.line) else { return reported };
        match (contact, self.world.phantom.sites.get(press.site)) {
            (Some(contact), Some(site)) => {
                let give = self.stage_compliance * contact.direction.dot(&self.force[1]);
                Vec3::from(site.centre_m) + contact.target - contact.direction * give
            }
            _ => reported - Vec3::from(press.direction) * gap(&self.world),
        }
    }

    /// Whether the tip is in the phantom, and on which line.
    fn contact(&mut self, tip: Vec3) -> Option<Contact> {
        self.head_for(tip);
        // How far along its line a tip is that has gone so far below the surface, and how far it is beside it there.
        let depth_on = |poke: usize| {
            let press = &self.world.pokes[poke];
            let site = &self.world.phantom.sites[press.site];
            let (direction, inward) = (Vec3::from(press.direction), Vec3::from(site.inward));
            let off = tip - Vec3::from(site.centre_m);
            let depth = off.dot(&inward) / direction.dot(&inward);
            (depth, (off - direction * depth).norm())
        };
        let nearest = self.touched.or_else(|| {
            let lines = (0..self.world.pokes.len()).map(|poke| (poke, depth_on(poke)));
            let astray = |poke: usize| (self.heading - Vec3::from(self.world.pokes[poke].direction)).norm();
            lines
                .filter(|(_, (depth, beside))| (0.0..FIRST_TOUCH_M).contains(depth) && *beside < BESIDE_M)
                .map(|(poke, (_, beside))| (poke, beside + ASTRAY_M * astray(poke)))
                .min_by(|a, b| a.1.total_cmp(&b.1))
                .map(|(poke, _)| poke)
        });
        let inside = |&poke: &usize| {
            let (depth, beside) = depth_on(poke);
            depth >= 0.0 && beside < BESIDE_M
        };
        let poke = nearest.filter(inside);
        if poke.is_some() && self.touched.is_none() {
            self.touches += 1;
        }
        self.touched = poke;
        let (poke, time_s) = (poke?, self.time_s());
        self.line = poke;
        let depth = depth_on(poke).0;
        self.carriage.contact(&self.world, self.touches, &self.world.pokes[poke], depth, time_s)
    }

    /// Notes where the tip is going.
    fn head_for(&mut self, tip: Vec3) {
        let Some(from) = self.came_from else {
            self.came_from = Some(tip);
            return;
        };
        if (tip - from).norm() > HEADING_M {
            self.heading = (tip - from).normalize();
            self.came_from = Some(tip);
        }
    }
}

#[cfg(test)]
mod tests;
