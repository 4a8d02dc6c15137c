//! What the camera reports of the markers.

use super::effect::Effect;
use super::foreign::Foreign;
use super::happened::Happened;
use super::phantom::Phantom;
use super::plan::World;
use super::rig::Rig;
use crate::geometry::Vec3;
use crate::observation::{MarkerRow, Markers};
use crate::sim::instruments::{LENGTH_DIGITS, SHADOW, Wanderer, normal, rounded, row_times};
use crate::sim::seed::{Use, stream};
use crate::sim::timeline::Timeline;
use nalgebra::{DVector, Rotation3};
use rand::RngExt;
use rand_chacha::ChaCha12Rng;

/// Rows of the camera.
pub(super) fn markers(world: &World, phantom: &Phantom, timeline: &Timeline, course: &Happened) -> Markers {
    let (rate_hz, sites) = (world.instruments.frame_rate_hz, &phantom.markers);
    let mut camera = Camera::new(world, rate_hz);
    let frame_time_s = row_times(rate_hz, timeline.end_s);
    let mut rows = Vec::with_capacity(frame_time_s.len() * sites.len());
    let lag_s = lag(world);
    for (frame, &t) in (0..).zip(&frame_time_s) {
        let tip = timeline.at(t).map(|(poke, _)| timeline.pokes[poke].plan);
        let tip = tip.map(|plan| (Vec3::from(plan.site_m), plan.radius_m));
        for (marker, position) in camera.frame(world, sites, &course.moved_at(t - lag_s), tip) {
            rows.push(MarkerRow { frame, marker, position_m: position.map(|x| rounded(x, LENGTH_DIGITS)) });
        }
    }
    Markers { numbers: (1..=sites.len() as u32).collect(), frame_time_s, rows }
}

/// The camera with its noise. Markers under a tip in contact are hidden; others are lost now and then.
pub(super) struct Camera {
    rng: ChaCha12Rng,
    wanderer: Option<(f64, Wanderer)>,
}

impl Camera {
    /// It takes `rate_hz` frames a second.
    pub(super) fn new(world: &World, rate_hz: f64) -> Self {
        let mut rng = stream(world.seed, Use::Camera);
        let wander = world.instruments.wander;
        let wanderer = wander.map(|w| (w.marker_m, Wanderer::new(&w, 1.0 / rate_hz, &mut rng)));
        Self { rng, wanderer }
    }

    /// Index and position (m) of each marker that is seen. `moved`: displacements, three a marker (m); `tip`: site and radius of the tip
    /// that touches the phantom (m).
    pub(super) fn frame(
        &mut self,
        world: &World,
        sites: &[[f64; 3]],
        moved: &DVector<f64>,
        tip: Option<(Vec3, f64)>,
    ) -> Vec<(u32, [f64; 3])> {
        let (instruments, rng) = (&world.instruments, &mut self.rng);
        let view = View::of(world);
        let offset = self.wanderer.as_mut().map_or([0.0; 3], |(sd, w)| w.step(rng).map(|x| x * *sd));
        let mut seen = Vec::with_capacity(sites.len());
        for (marker, (&site, moved)) in (0..).zip(sites.iter().zip(moved.as_slice().chunks_exact(3))) {
            let site = Vec3::from(site);
            let error: [f64; 3] =
                std::array::from_fn(|c| offset[c] + instruments.noise.marker_m[c] * normal(rng));
            let lost = rng.random_bool(instruments.lost_share);
            let hidden = tip.is_some_and(|(centre, radius)| (site - centre).norm() < SHADOW * radius);
            if !lost && !hidden {
                let position = view.position(site, Vec3::from_column_slice(moved)) + Vec3::from(error);
                seen.push((marker, position.into()));
            }
        }
        seen
    }
}

impl World {
    /// How late the camera is (s).
    pub(in crate::sim) fn camera_lag_s(&self) -> f64 {
        lag(self)
    }
}

/// How late the camera is (s).
pub(super) fn lag(world: &World) -> f64 {
    let lags = world.effects.iter().map(|effect| match *effect {
        Effect::Rig(Rig::CameraLag { lag_s }) => lag_s,
        _ => 0.0,
    });
    lags.sum()
}

/// How the camera maps what it sees.
struct View<'a> {
    effects: &'a [Effect],
    /// Middle of the picture (m).
    middle: Vec3,
}

impl<'a> View<'a> {
    fn of(world: &'a World) -> Self {
        Self { effects: &world.effects, middle: Vec3::from(world.phantom.slab.size_m) * 0.5 }
    }

    /// Where a marker (m) that was displaced (m) is seen.
    ///
    /// Why displacements: the camera was registered to the phantom by its rest positions, so that a wrong scale or
    /// direction is left in what moves only.
    fn position(&self, site: Vec3, mut moved: Vec3) -> Vec3 {
        let mut shift = Vec3::zeros();
        for effect in self.effects {
            match *effect {
                Effect::Rig(Rig::CameraScale { scale, depth_gain }) => {
                    moved.component_mul_assign(&Vec3::new(scale, scale, scale * depth_gain));
                }
                Effect::Rig(Rig::CameraMisalignment { rotation_rad, translation_m }) => {
                    moved = Rotation3::new(Vec3::from(rotation_rad)) * moved;
                    shift += Vec3::from(translation_m);
                }
                Effect::Foreign(Foreign::LensDistortion { per_m }) => {
                    let gain = (site - self.middle) * per_m;
                    moved.component_mul_assign(&Vec3::new(1.0 + gain.x, 1.0 + gain.y, 1.0));
                }
                _ => {}
            }
        }
        site + moved + shift
    }
}
