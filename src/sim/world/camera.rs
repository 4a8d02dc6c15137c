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
use nalgebra::Rotation3;
use rand::RngExt;

/// Rows of the camera. Markers under a tip in contact are hidden; others are lost now and then.
pub(super) fn markers(world: &World, phantom: &Phantom, timeline: &Timeline, course: &Happened) -> Markers {
    let mut rng = stream(world.seed, Use::Camera);
    let (instruments, sites) = (&world.instruments, &phantom.markers);
    let mut wanderer = instruments
        .wander
        .map(|w| (w.marker_m, Wanderer::new(&w, 1.0 / instruments.frame_rate_hz, &mut rng)));
    let frame_time_s = row_times(instruments.frame_rate_hz, timeline.end_s);
    let mut rows = Vec::with_capacity(frame_time_s.len() * sites.len());
    let lag_s = lag(world);
    let view = View::of(world);
    for (frame, &t) in (0..).zip(&frame_time_s) {
        let moved = course.moved_at(t - lag_s);
        let tip = timeline.at(t).map(|(poke, _)| timeline.pokes[poke].plan);
        let offset = wanderer.as_mut().map_or([0.0; 3], |(sd, w)| w.step(&mut rng).map(|x| x * *sd));
        for (marker, site) in (0..).zip(sites) {
            let error: [f64; 3] =
                std::array::from_fn(|c| offset[c] + instruments.noise.marker_m[c] * normal(&mut rng));
            let lost = rng.random_bool(instruments.lost_share);
            let hidden = tip.is_some_and(|plan| {
                (Vec3::from(*site) - Vec3::from(plan.site_m)).norm() < SHADOW * plan.radius_m
            });
            if lost || hidden {
                continue;
            }
            let seen = view.position(
                Vec3::from(*site),
                Vec3::from_column_slice(&moved.as_slice()[3 * marker as usize..][..3]),
            );
            let position_m = std::array::from_fn(|c| rounded(seen[c] + error[c], LENGTH_DIGITS));
            rows.push(MarkerRow { frame, marker, position_m });
        }
    }
    Markers { numbers: (1..=sites.len() as u32).collect(), frame_time_s, rows }
}

/// How late the camera is (s).
fn lag(world: &World) -> f64 {
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
