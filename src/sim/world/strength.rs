//! How much the effects of a world change its recording, over the noise.

use super::phantom::Phantom;
use super::plan::World;
use crate::geometry::Vec3;
use crate::observation::{MarkerRow, Noise, Recording};
use crate::sim::SimError;
use std::collections::HashMap;

impl World {
    /// Root of the sum of squares of what the effects change in forces and markers, each over its standard deviation;
    /// `None` where nothing acts, or only a wrong statement of Poisson's ratio, which changes no reading.
    ///
    /// The noise is the same with and without effects and falls out. So does the best common factor of the forces, which
    /// is a mere change of the modulus; what restraint and modulus take up beyond it is not taken out.
    ///
    /// # Errors
    /// [`SimError`] as for [`World::record`].
    pub fn strength(&self, phantom: &Phantom, recording: &Recording) -> Result<Option<f64>, SimError> {
        if self.effects.is_empty() {
            return Ok(None);
        }
        let plain = World { effects: Vec::new(), ..self.clone() };
        let mut quiet = plain.clone();
        quiet.instruments.noise =
            Noise { force_n: [0.0; 3], torque_nm: [0.0; 3], marker_m: [0.0; 3], stage_m: [0.0; 3] };
        quiet.instruments.wander = None;
        let (plain, quiet) = (plain.record(phantom)?, quiet.record(phantom)?);
        let force_sd = Vec3::from(recording.noise.force_n);
        let forces = |r: &Recording| -> Vec<Vec3> {
            r.wrench.force_n.iter().map(|f| Vec3::from(*f).component_div(&force_sd)).collect()
        };
        let change: Vec<Vec3> = forces(recording).iter().zip(&forces(&plain)).map(|(a, b)| a - b).collect();
        let shape = forces(&quiet);
        let dot = |a: &[Vec3], b: &[Vec3]| a.iter().zip(b).map(|(a, b)| a.dot(b)).sum::<f64>();
        let factor = dot(&change, &shape) / dot(&shape, &shape).max(f64::MIN_POSITIVE);
        let mut sum: f64 = change.iter().zip(&shape).map(|(a, b)| (a - b * factor).norm_squared()).sum();
        // Displacements from the rest positions, as a shift of the camera's frame shows in nothing else. Rows that only one
        // of the two has seen do not count.
        let marker_sd = Vec3::from(recording.noise.marker_m);
        let rest = [recording.rest_positions(), plain.rest_positions()];
        let moved = |row: &MarkerRow, rest: &[(Vec3, usize)]| {
            Vec3::from(row.position_m) - rest[row.marker as usize].0
        };
        let without: HashMap<(u32, u32), Vec3> =
            plain.markers.rows.iter().map(|r| ((r.frame, r.marker), moved(r, &rest[1]))).collect();
        for row in &recording.markers.rows {
            if let Some(other) = without.get(&(row.frame, row.marker)) {
                sum += (moved(row, &rest[0]) - other).component_div(&marker_sd).norm_squared();
            }
        }
        Ok(Some(sum.sqrt()))
    }
}
