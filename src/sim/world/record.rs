//! A world turned into the recording that its session would leave.

use super::body::Body;
use super::camera::markers;
use super::effect::Effect;
use super::force_sensor::wrench;
use super::foreign::Foreign;
use super::history::Setup;
use super::hold_law::{Friction, HoldLaw};
use super::memory::{Memory, PronyTerm};
use super::past::Past;
use super::phantom::Phantom;
use super::plan::{Hold, World};
use super::rig::Rig;
use super::touch::Touch;
use crate::geometry::Vec3;
use crate::observation::{Contact, Phantom as Stated, Poke, Recording, Tip, TipShape};
use crate::sim::SimError;
use crate::sim::fit_mesh::fit_mesh;
use crate::sim::instruments::stage;
use crate::sim::record::{DENSITY_KG_M3, MAX_STANDOFF_M};

impl World {
    /// Runs the session on its phantom, which was prepared from the same plan.
    ///
    /// # Errors
    /// [`SimError`] as for [`World::happen`].
    pub fn record(&self, phantom: &Phantom) -> Result<Recording, SimError> {
        self.happen(phantom)?.record()
    }

    /// What goes through the session, from the effects.
    pub(super) fn setup(&self, step_s: f64) -> Setup {
        let mut setup = Setup {
            young_modulus_pa: self.young_modulus_pa,
            terms: Vec::new(),
            drift_per_s: 0.0,
            holds: Vec::new(),
            friction: None,
            stage_compliance: 0.0,
            weight: Vec3::zeros(),
        };
        let mut in_springs: Vec<PronyTerm> = Vec::new();
        let mut slack = vec![None; self.holds.len()];
        let mut sticky = None;
        for effect in &self.effects {
            match effect {
                Effect::Memory(Memory::Relaxation { terms }) => setup.terms.extend(terms),
                Effect::Memory(Memory::BandViscosity { terms }) => in_springs.extend(terms),
                Effect::Memory(Memory::Drying { modulus_rate_per_s }) => {
                    setup.drift_per_s += modulus_rate_per_s;
                }
                Effect::Touch(Touch::SlackBand { hold, direction, gap_m }) => {
                    for (h, slack) in slack.iter_mut().enumerate() {
                        if hold.is_none_or(|only| only == h) {
                            *slack = Some((Vec3::from(*direction), *gap_m));
                        }
                    }
                }
                Effect::Touch(Touch::TipSlip { friction_coefficient }) => {
                    setup.friction = Some(*friction_coefficient);
                }
                Effect::Rig(Rig::StageCompliance { compliance_m_per_n }) => {
                    setup.stage_compliance += compliance_m_per_n;
                }
                Effect::Body(Body::SelfWeight { gravity_m_s2 }) => {
                    setup.weight += Vec3::from(*gravity_m_s2) * DENSITY_KG_M3;
                }
                Effect::Foreign(Foreign::StickyHolds { stiffness_n_per_m, yield_n }) => {
                    let (stiffness, yield_n) = (*stiffness_n_per_m, *yield_n);
                    sticky = Some(Friction { stiffness, yield_n, slider: Vec3::zeros() });
                }
                Effect::Rig(_) | Effect::Body(_) | Effect::Large(_) | Effect::Foreign(_) => {}
            }
        }
        for (hold, slack) in self.holds.iter().zip(slack) {
            if let Hold::Springs { stiffness_n_per_m, .. } = *hold {
                setup.holds.push(HoldLaw::new(stiffness_n_per_m, &in_springs, step_s, slack, sticky.clone()));
            }
        }
        setup
    }
}

impl Past<'_> {
    /// What the instruments make of it.
    ///
    /// # Errors
    /// [`SimError::BadBlock`] where the recording's mesh cannot be cut.
    pub fn record(&self) -> Result<Recording, SimError> {
        let Self { world, timeline, happened, .. } = self;
        let pokes = (1..).zip(&timeline.pokes).map(|(number, scheduled)| Poke {
            number,
            site: Vec3::from(scheduled.plan.site_m),
            direction: Vec3::from(scheduled.plan.direction),
            radius_m: scheduled.plan.radius_m,
            start_s: scheduled.start_s,
            end_s: scheduled.end_s,
        });
        Ok(Recording {
            name: world.name.clone(),
            rest_until_s: timeline.rest_until_s,
            phantom: Stated {
                poisson_ratio: world.stated_poisson_ratio,
                density_kg_m3: DENSITY_KG_M3,
                modulus_range_pa: world.modulus_range_pa,
                gravity: None,
            },
            tip: Tip { contact: Contact::Bonded, shape: TipShape::Pad },
            noise: world.instruments.noise,
            max_standoff_m: MAX_STANDOFF_M,
            mesh: fit_mesh(&world.phantom.slab, world.fit_cell_m, world.phantom.seed)?,
            pokes: pokes.collect(),
            stage: Some(stage(world.seed, &world.instruments, timeline)),
            wrench: wrench(world, happened, timeline.end_s),
            markers: markers(world, self.phantom, timeline, happened),
        })
    }
}

#[cfg(test)]
pub(super) mod tests;
