//! A world turned into the recording that its session would leave.

use super::body::{Body, change};
use super::camera::markers;
use super::condensed::SessionBody;
use super::effect::{Effect, check};
use super::force_sensor::wrench;
use super::foreign::Foreign;
use super::happened::Happened;
use super::history::{Setup, carry};
use super::hold_law::{Friction, HoldLaw};
use super::large::LargeCourse;
use super::memory::{Memory, PronyTerm};
use super::motion::contacts;
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

/// Steps of time in one period of the force sensor.
///
/// Why: rows of the sensor are instants of the grid; markers are seen between them, where a kink (a band that tightens,
/// play that is used up) is off by an eighth of a step's motion at most: 2.5 µm at 4 mm/s.
const STEPS_A_ROW: f64 = 4.0;

impl World {
    /// Runs the session on its phantom, which was prepared from the same plan.
    ///
    /// # Errors
    /// [`SimError`]: another phantom, a place that does not exist, an effect whose figures mean nothing, equations
    /// without a solution.
    pub fn record(&self, phantom: &Phantom) -> Result<Recording, SimError> {
        if phantom.plan != self.phantom {
            return Err(SimError::OtherPhantom { session: self.name.clone() });
        }
        check(self)?;
        let timeline = self.timeline()?;
        let change = change(self)?;
        let body = SessionBody::new(self, phantom, change.as_ref())?;
        let step_s = 1.0 / (STEPS_A_ROW * self.instruments.sensor_rate_hz);
        let (contacts, setup) = (contacts(self, &timeline, step_s), self.setup(step_s));
        let give = setup.stage_compliance;
        let course = match LargeCourse::of(self, &body, &contacts, step_s, give, &phantom.markers)? {
            Some(large) => Happened::Large(large),
            None => {
                let course = carry(&body, setup, &contacts, step_s)?;
                Happened::Small { body, course }
            }
        };
        let pokes = (1..).zip(&timeline.pokes).map(|(number, scheduled)| Poke {
            number,
            site: Vec3::from(scheduled.plan.site_m),
            direction: Vec3::from(scheduled.plan.direction),
            radius_m: scheduled.plan.radius_m,
            start_s: scheduled.start_s,
            end_s: scheduled.end_s,
        });
        Ok(Recording {
            name: self.name.clone(),
            rest_until_s: timeline.rest_until_s,
            phantom: Stated {
                poisson_ratio: self.stated_poisson_ratio,
                density_kg_m3: DENSITY_KG_M3,
                modulus_range_pa: self.modulus_range_pa,
                gravity: None,
            },
            tip: Tip { contact: Contact::Bonded, shape: TipShape::Pad },
            noise: self.instruments.noise,
            max_standoff_m: MAX_STANDOFF_M,
            mesh: fit_mesh(&self.phantom.slab, self.fit_cell_m, self.phantom.seed)?,
            pokes: pokes.collect(),
            stage: Some(stage(self.seed, &self.instruments, &timeline)),
            wrench: wrench(self, &course, timeline.end_s),
            markers: markers(self, phantom, &timeline, &course),
        })
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

#[cfg(test)]
pub(super) mod tests;
