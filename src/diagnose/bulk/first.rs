//! Changes to first order, for scans: the work of a change of stiffness on fields that do not know of it.
//!
//! `ΔC = −Uᵀ δK U`. A strong change screens itself; what is known of that in closed form is taken in, so that the pattern
//! is that of a strong change and its size about right:
//! - a ball by Eshelby's factors ([`screened`]);
//! - a stiffer axis by `c → 1 − 1/(1 + c)`, exact for a plain stretch along it;
//! - loose glue, under tractions `t` of the unchanged body, by the opening of a penny-shaped crack between two halves,
//!   `u = 4 (1 − ν²) / (π E) √(a² − ρ²) t` (Sneddon 1946 for tension; shear differs by `2/(2 − ν)`): here one half is rigid.
//!   Where the disc reaches over the end of the glue that is too little, as the rest of the hold takes over there;
//! - a give of the hold by the tractions that it meets, without redistribution.

use super::ball::Ball;
use super::changes::{BodyChange, Changed};
use super::exact::{shared_moments, whole_moments};
use super::knob::BulkKnob;
use super::lab::Lab;
use super::laws::screened;
use super::loose::Loosened;
use crate::diagnose::{DiagnoseError, Physics};
use crate::fem::{Constants, NodalForces};
use nalgebra::DMatrix;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Knobs, and what they change.
pub(super) type Look = (Vec<(BulkKnob, f64)>, BodyChange);

/// Entries that change the body.
const ENTRIES: [Physics; 5] = [
    Physics::Inclusion,
    Physics::Anisotropy,
    Physics::PoissonRatio,
    Physics::BaseDebonding,
    Physics::CompliantBase,
];

impl Lab<'_> {
    /// What each entry that changes the body does at all its [`Lab::places`], to first order; places without an answer are left out.
    /// Every reading that is scanned asks for the same: worked out when first needed, and kept.
    ///
    /// Memory: a matrix of everything seen under everything loaded for each place, two where a place has an opposite.
    pub fn looks(&self) -> &[(Physics, Vec<Look>)] {
        if let Some(looks) = self.looks.get() {
            return looks;
        }
        let all = |physics: Physics| -> Vec<Look> {
            let at = |knobs: &Vec<(BulkKnob, f64)>| self.first_order_both(knobs).unwrap_or_default();
            self.places(physics).par_iter().flat_map_iter(at).collect()
        };
        let made = ENTRIES.map(|physics| (physics, all(physics))).to_vec();
        self.looks.get_or_init(|| made)
    }

    /// As [`Lab::first_order`], and for what may be more or less, also the opposite: a ball as much softer as this one is
    /// stiffer, for a change of the whole body that of the other sign.
    ///
    /// # Errors
    /// As [`Lab::changed`].
    fn first_order_both(&self, knobs: &[(BulkKnob, f64)]) -> Result<Vec<Look>, DiagnoseError> {
        let nu = self.model.poisson_ratio();
        let opposite = || -> Vec<(BulkKnob, f64)> {
            let turned = |knob: BulkKnob| knob == BulkKnob::BallRatio || knob.of_the_whole();
            knobs.iter().map(|&(knob, value)| (knob, if turned(knob) { -value } else { value })).collect()
        };
        if let Some(inclusion) = Changed::of(knobs, nu)?.inclusion {
            let ratios = [inclusion.ratio, 1.0 / inclusion.ratio];
            let works = self.work_of_ball(&inclusion.ball, &ratios.map(|ratio| screened(ratio, nu)))?;
            let both = [knobs.to_vec(), opposite()].into_iter().zip(works);
            return Ok(both.map(|(knobs, work)| (knobs, BodyChange::of(&-work, &[], self.sites))).collect());
        }
        let change = self.first_order(knobs)?;
        let mut both = Vec::new();
        if knobs.iter().all(|(knob, _)| knob.of_the_whole()) {
            both.push((opposite(), change.opposite()));
        }
        both.push((knobs.to_vec(), change));
        Ok(both)
    }

    /// Work of these changes of constants inside a ball on the unchanged fields, of everything seen and everything loaded.
    fn work_of_ball(&self, ball: &Ball, constants: &[Constants]) -> Result<Vec<DMatrix<f64>>, DiagnoseError> {
        let space = self.model.space();
        let mut forces = vec![NodalForces::of(&self.loaded); constants.len()];
        for (cell, moments) in shared_moments(space, ball, true) {
            for (forces, constants) in forces.iter_mut().zip(constants) {
                forces.add(&moments.part(space, cell, constants));
            }
        }
        Ok(NodalForces::work_of(&forces, self.fields()?))
    }

    /// As [`Lab::changed`], to first order in each change alone, without derivatives.
    ///
    /// # Errors
    /// As [`Lab::changed`].
    pub fn first_order(&self, knobs: &[(BulkKnob, f64)]) -> Result<BodyChange, DiagnoseError> {
        let changed = Changed::of(knobs, self.model.poisson_ratio())?;
        let (space, nu) = (self.model.space(), self.model.poisson_ratio());
        let mut value = DMatrix::zeros(self.seen.len(), self.loads);
        if let Some(inclusion) = changed.inclusion {
            for work in self.work_of_ball(&inclusion.ball, &[screened(inclusion.ratio, nu)])? {
                value -= work;
            }
        }
        for (knob, amount) in knobs.iter().filter(|(knob, _)| knob.of_the_whole()) {
            let (constants, size) = match knob {
                BulkKnob::Along(_) => {
                    // The slope at the ratio itself, brought back to that at 1, times 1 − 1/ratio.
                    (changed.law.by_log_ratio(), (1.0 - (-amount).exp()) * (-amount).exp())
                }
                BulkKnob::Poisson => {
                    let mut before = changed.law;
                    before.poisson_ratio = nu;
                    (before.by_poisson_ratio(), *amount)
                }
                _ => continue,
            };
            let mut forces = NodalForces::of(&self.loaded);
            for cell in 0..space.cells().len() as u32 {
                forces.add(&whole_moments(space, cell).part(space, cell, &constants));
            }
            let own = forces.work(self.fields()?) * -size;
            value += self.own.missed(&own);
            value += own;
        }
        if let Some(disc) = &changed.loose {
            let (radius, opens) = (disc.radius_m, 4.0 * (1.0 - nu * nu) / PI);
            let opening = move |rho: f64| opens * (radius * radius - rho * rho).max(0.0).sqrt();
            value += self.given(Some((disc, &opening)))?;
        }
        if changed.give_m > 0.0 {
            value += self.given(None)? * changed.give_m;
        }
        let mut change = BodyChange::of(&value, &[], self.sites);
        if changed.finer != 0.0
            && let Some(finer) = self.finer()?
        {
            change.add(finer, changed.finer);
        }
        Ok(change)
    }

    /// `∫ m t·t` over the glue, of everything seen and everything loaded.
    fn given(&self, loose: Option<(&Loosened, &dyn Fn(f64) -> f64)>) -> Result<DMatrix<f64>, DiagnoseError> {
        let tractions = self.tractions()?;
        let loaded = tractions.rows(0, self.loads).into_owned();
        let mut forces = NodalForces::of(&loaded);
        for part in self.glue.weighed(self.model.space(), loose) {
            forces.add(&part);
        }
        Ok(forces.work(tractions))
    }
}
