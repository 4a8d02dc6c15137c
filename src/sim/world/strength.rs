//! How much the effects of a world change its recording, over the noise, and how much of that no other modulus and no
//! other springs would.

use super::answer::{Answer, POISSON_RATIO};
use super::phantom::Phantom;
use super::plan::{Hold, World};
use crate::geometry::Vec3;
use crate::observation::{MarkerRow, Noise, Recording};
use crate::sim::SimError;
use nalgebra::{DMatrix, DVector};
use std::collections::{BTreeMap, HashMap};

/// What effects change in the readings.
#[derive(Debug, Clone, PartialEq)]
pub struct Strength {
    /// Root of the sum of squares of what they change in forces and markers, each over its standard deviation, less what
    /// another modulus and other stiffnesses of the springs would change alike (at first order).
    pub net: f64,
    /// The same of each entry of the catalogue by itself (`unexplained` for what it does not list), less also what more or
    /// less of the others would change alike.
    pub own: BTreeMap<&'static str, f64>,
    /// Root of the sum of squares of the readings themselves, without effects and noise.
    pub signal: f64,
}

/// By this share the springs' stiffness is raised to see what that changes.
const STIFFER: f64 = 0.02;

impl World {
    /// How strongly the effects act; `None` where there are none.
    ///
    /// The noise is the same with and without effects and falls out. Of a wrong statement of Poisson's ratio it is what
    /// a phantom as stated, which has to be prepared, would have shown instead.
    ///
    /// # Errors
    /// [`SimError`] as for [`World::record`] and [`Phantom::prepare`].
    pub fn strength(&self, phantom: &Phantom, recording: &Recording) -> Result<Option<Strength>, SimError> {
        let stated = self.stated_poisson_ratio;
        let misstated = stated != self.phantom.poisson_ratio;
        if self.effects.is_empty() && !misstated {
            return Ok(None);
        }
        let mut plain = World { effects: Vec::new(), ..self.clone() };
        plain.phantom.poisson_ratio = stated;
        let other = match misstated {
            true => Some(Phantom::prepare(&plain.phantom)?),
            false => None,
        };
        let as_stated = other.as_ref().unwrap_or(phantom);
        let mut quiet = plain.clone();
        quiet.instruments.noise =
            Noise { force_n: [0.0; 3], torque_nm: [0.0; 3], marker_m: [0.0; 3], stage_m: [0.0; 3] };
        quiet.instruments.wander = None;
        let quietly = Readings::of(&quiet.record(as_stated)?, &recording.noise);
        let mut others = Vec::new();
        for hold in 0..quiet.holds.len() {
            let mut stiffer = quiet.clone();
            if let Hold::Springs { stiffness_n_per_m, .. } = &mut stiffer.holds[hold] {
                *stiffness_n_per_m *= 1.0 + STIFFER;
                others.push(Readings::of(&stiffer.record(as_stated)?, &recording.noise));
            }
        }
        let with = Readings::of(recording, &recording.noise);
        let without = Readings::of(&plain.record(as_stated)?, &recording.noise);
        let ids = Answer::of(self).physics;
        let lacks = |id: &&'static str| {
            let lacking = self.without(id);
            let on = if lacking.phantom == self.phantom { phantom } else { as_stated };
            Ok(Readings::of(&lacking.record(on)?, &recording.noise))
        };
        // Without the only one there is none, which is known already.
        let several = if ids.len() > 1 { &ids[..] } else { &[] };
        let lacking: Vec<Readings> = several.iter().map(lacks).collect::<Result<_, SimError>>()?;
        // Rows that only some of them have seen do not count.
        let seen = with.seen_also_by([&without, &quietly].into_iter().chain(&others).chain(&lacking));
        let [with, without, quietly] = [with, without, quietly].map(|readings| readings.of_seen(&seen));
        // The stage drives: another modulus, of phantom and springs, is a common factor of the forces.
        let mut forces = quietly.clone();
        forces.rows_range_mut(3 * recording.wrench.force_n.len()..).fill(0.0);
        let others = others.iter().map(|other| other.of_seen(&seen) - &quietly);
        let columns: Vec<DVector<f64>> = std::iter::once(forces).chain(others).collect();
        let changes: Vec<DVector<f64>> = lacking.iter().map(|lacks| &with - lacks.of_seen(&seen)).collect();
        let net = beyond(with - without, &columns);
        let own = |(i, id)| (id, if changes.is_empty() { net } else { beside(i, &changes, &columns) });
        let own = ids.into_iter().enumerate().map(own).collect();
        Ok(Some(Strength { net, own, signal: quietly.norm() }))
    }

    /// The same world without one entry of its answer.
    fn without(&self, id: &str) -> Self {
        let mut other = self.clone();
        other.effects.retain(|effect| effect.entry() != id);
        if id == POISSON_RATIO {
            other.phantom.poisson_ratio = self.stated_poisson_ratio;
        }
        other
    }
}

/// Norm of what of one of the changes neither the others nor the columns make alike.
fn beside(one: usize, changes: &[DVector<f64>], columns: &[DVector<f64>]) -> f64 {
    let others = changes.iter().enumerate().filter(|(i, _)| *i != one).map(|(_, change)| change.clone());
    beyond(changes[one].clone(), &columns.iter().cloned().chain(others).collect::<Vec<_>>())
}

/// Norm of what of `change` the columns leave (least squares).
fn beyond(change: DVector<f64>, columns: &[DVector<f64>]) -> f64 {
    let absorbed = DMatrix::from_columns(columns).qr().q();
    (&change - &absorbed * absorbed.tr_mul(&change)).norm()
}

/// Readings, each over its standard deviation.
struct Readings {
    force: Vec<Vec3>,
    /// Displacements from the rest positions, as a shift of the camera's frame shows in nothing else; by frame and marker.
    moved: HashMap<(u32, u32), Vec3>,
}

impl Readings {
    fn of(recording: &Recording, noise: &Noise) -> Self {
        let [force_sd, marker_sd] = [noise.force_n, noise.marker_m].map(Vec3::from);
        let rest = recording.rest_positions();
        let moved = |row: &MarkerRow| {
            (Vec3::from(row.position_m) - rest[row.marker as usize].0).component_div(&marker_sd)
        };
        Self {
            force: recording.wrench.force_n.iter().map(|f| Vec3::from(*f).component_div(&force_sd)).collect(),
            moved: recording.markers.rows.iter().map(|r| ((r.frame, r.marker), moved(r))).collect(),
        }
    }

    /// Frames and markers that others have seen as well.
    fn seen_also_by<'a>(&self, others: impl Iterator<Item = &'a Self>) -> Vec<(u32, u32)> {
        let mut seen: Vec<(u32, u32)> = self.moved.keys().copied().collect();
        others.for_each(|other| seen.retain(|key| other.moved.contains_key(key)));
        seen.sort_unstable();
        seen
    }

    /// Forces, then these of the markers.
    fn of_seen(&self, seen: &[(u32, u32)]) -> DVector<f64> {
        let values = self.force.iter().chain(seen.iter().map(|key| &self.moved[key]));
        DVector::from_vec(values.flat_map(|v| v.iter().copied()).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of (1, 1, 0), less the first axis, (0, 3, 1) leaves 1/√10.
    #[test]
    fn what_others_make_alike_is_not_an_effects_own() {
        let vector = |v: [f64; 3]| DVector::from_column_slice(&v);
        let changes = [vector([1.0, 1.0, 0.0]), vector([0.0, 3.0, 1.0])];
        let columns = [vector([2.0, 0.0, 0.0])];
        assert!((beside(0, &changes, &columns) - 0.1_f64.sqrt()).abs() < 1e-12);
        assert!((beside(1, &changes, &columns) - 1.0).abs() < 1e-12);
        assert!(beside(0, &[vector([1.0, 1.0, 0.0]), vector([5.0, 2.0, 0.0])], &columns) < 1e-12);
    }
}
