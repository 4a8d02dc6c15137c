//! What there is to see of phantom and tip at one instant, exactly as it is: no noise, no camera.

use super::effect::Effect;
use super::plan::{Press, World};
use super::rig::Rig;
use crate::geometry::Vec3;
use nalgebra::{DMatrix, DVector};

/// The phantom's skin and the tip at one instant. Phantom frame throughout.
#[derive(Debug, Clone, PartialEq)]
pub struct Glimpse {
    /// When that was, on the world's own clock (s).
    pub time_s: f64,
    /// Displacement of each vertex of the skin (m).
    pub moved_m: Vec<Vec3>,
    /// Its velocity (m/s), if that was asked for.
    pub speed_m_s: Option<Vec<Vec3>>,
    /// The tip, if it is anywhere near.
    pub tip: Option<SeenTip>,
}

/// The tip as one sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeenTip {
    /// True centre of its face (m): what play, a give of the stage and the like leave of what the stage reports.
    pub face_m: Vec3,
    /// Unit vector from the face to what holds it.
    pub outward: Vec3,
    /// Its velocity (m/s).
    pub velocity_m_s: Vec3,
    /// Its radius (m).
    pub radius_m: f64,
}

/// Displacements of watched points from `first` on under loads y: W y, without the columns of what does not act.
pub(super) fn displaced(watched: &DMatrix<f64>, loads: &DVector<f64>, first: usize) -> Vec<Vec3> {
    let mut moved = vec![Vec3::zeros(); watched.nrows() / 3 - first];
    for (column, &load) in watched.column_iter().zip(loads).filter(|(_, load)| **load != 0.0) {
        let rows = column.rows_range(3 * first..);
        for (moved, unit) in moved.iter_mut().zip(rows.as_slice().chunks_exact(3)) {
            *moved += Vec3::new(unit[0], unit[1], unit[2]) * load;
        }
    }
    moved
}

/// Between two displacements of points, and how fast they go from one to the other in `step_s` if that is asked for.
pub(super) fn blended(
    [before, after]: [Vec<Vec3>; 2],
    share: f64,
    step_s: f64,
    moving: bool,
) -> (Vec<Vec3>, Option<Vec<Vec3>>) {
    let pairs = || before.iter().zip(&after);
    let speed = moving.then(|| pairs().map(|(a, b)| (b - a) / step_s).collect());
    (pairs().map(|(a, b)| a + (b - a) * share).collect(), speed)
}

/// How much later than reported the tip is where it should be, along its line (m): see [`Rig::LateContact`].
pub(super) fn gap(world: &World) -> f64 {
    let gaps = world.effects.iter().map(|effect| match *effect {
        Effect::Rig(Rig::LateContact { gap_m }) => gap_m,
        _ => 0.0,
    });
    gaps.sum()
}

impl World {
    /// The tip of a poke with its face at a place (m), and its velocity (m/s).
    pub(super) fn tip_of(&self, press: &Press, face_m: Vec3, velocity_m_s: Vec3) -> Option<SeenTip> {
        let site = self.phantom.sites.get(press.site)?;
        Some(SeenTip { face_m, outward: -Vec3::from(site.inward), velocity_m_s, radius_m: site.radius_m })
    }
}
