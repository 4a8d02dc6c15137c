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

use super::changes::{BodyChange, Changed};
use super::exact::{shared_moments, whole_moments};
use super::knob::BulkKnob;
use super::lab::Lab;
use super::laws::screened;
use super::loose::Loosened;
use crate::diagnose::DiagnoseError;
use crate::fem::NodalForces;
use nalgebra::DMatrix;
use std::f64::consts::PI;

impl Lab<'_> {
    /// As [`Lab::changed`], to first order in each change alone, without derivatives.
    ///
    /// # Errors
    /// As [`Lab::changed`].
    pub fn first_order(&self, knobs: &[(BulkKnob, f64)]) -> Result<BodyChange, DiagnoseError> {
        let changed = Changed::of(knobs, self.model.poisson_ratio())?;
        let (space, nu) = (self.model.space(), self.model.poisson_ratio());
        let mut value = DMatrix::zeros(self.seen.len(), self.loads);
        if let Some(inclusion) = changed.inclusion {
            let constants = screened(inclusion.ratio, nu);
            let mut forces = NodalForces::of(&self.loaded);
            for (cell, moments) in shared_moments(space, &inclusion.ball, true) {
                forces.add(&moments.part(space, cell, &constants));
            }
            value -= forces.work(&self.fields);
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
            let own = forces.work(&self.fields) * -size;
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
