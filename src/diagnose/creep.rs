//! How the markers move between pokes where a reading has a memory, so that creep is not taken for an error of the camera.

use super::effects::Effects;
use super::model::Model;
use super::refit::Fitted;
use super::rest::correlation;
use crate::geometry::Vec3;
use nalgebra::DVector;

/// Motion between pokes by a reading.
pub(super) enum Creep {
    /// Nothing moves there.
    None,
    /// Displacement of every marker (m, `3 m + i`) at every frame; none in pokes, and after the last one.
    At(Vec<Option<DVector<f64>>>),
}

impl Creep {
    /// Displacement (m) of a marker at a frame between pokes; none where the reading does not say.
    pub(super) fn of(&self, frame: usize, marker: usize) -> Option<Vec3> {
        match self {
            Self::None => Some(Vec3::zeros()),
            Self::At(frames) => {
                let all = frames.get(frame)?.as_ref()?;
                Some(all.fixed_rows::<3>(3 * marker).into_owned())
            }
        }
    }
}

impl<const N: usize> Effects<N> {
    /// Whether something moves on, or stays displaced, while nothing touches the phantom.
    pub(super) fn remember(&self) -> bool {
        !self.relaxation.is_empty()
            || self.bands.iter().any(|band| !band.memory.is_empty() || band.sticky.is_some())
    }
}

impl Model<'_> {
    /// Measures the errors of the instruments at rest once more, less what a reading says to move there. Whether they differ from
    /// those measured before.
    pub(super) fn measure_rest(&mut self, fitted: &Fitted) -> bool {
        let measured = correlation(
            self.settled.recording,
            self.settled.evidence,
            &self.creep(fitted).unwrap_or(Creep::None),
        );
        let differs = measured != self.correlation;
        self.correlation = measured;
        differs
    }

    fn creep(&self, fitted: &Fitted) -> Option<Creep> {
        let marched = self.march(&fitted.acting, &fitted.at)?;
        if !marched.effects.remember() {
            return Some(Creep::None);
        }
        let (rows, loads) = (&self.timeline.rows, &marched.rows.loads);
        let free = |row: usize| rows.get(row).is_some_and(|row| row.contact.is_none());
        let at = |time_s: f64| {
            let right = rows.partition_point(|row| row.time_s < time_s);
            let left = right.checked_sub(1)?;
            let share = match (free(left), free(right)) {
                (true, true) => (time_s - rows[left].time_s) / (rows[right].time_s - rows[left].time_s),
                (true, false) if right < rows.len() => 0.0,
                (false, true) => 1.0,
                _ => return None,
            };
            let load = |row: usize| loads[row].column(0);
            Some(&marched.body.markers.value * (load(left) * (1.0 - share) + load(right) * share))
        };
        Some(Creep::At(self.settled.recording.markers.frame_time_s.iter().map(|t| at(*t)).collect()))
    }
}
