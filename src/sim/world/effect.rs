//! One effect, of any family.

use super::answer::Figure;
use super::body::Body;
use super::foreign::Foreign;
use super::large::Large;
use super::memory::{Memory, relaxed};
use super::plan::World;
use super::rig::Rig;
use super::touch::Touch;
use crate::geometry::Vec3;
use crate::sim::SimError;

/// What acts in a world besides the baseline (linear, homogeneous, without memory, instruments exact up to noise).
#[derive(Debug, Clone, PartialEq)]
pub enum Effect {
    /// Stage, force sensor or camera.
    Rig(Rig),
    /// Another linear body.
    Body(Body),
    /// Memory and ageing.
    Memory(Memory),
    /// Holds and contact that are not linear.
    Touch(Touch),
    /// Large strain and softening.
    Large(Large),
    /// What the physics catalogue does not list.
    Foreign(Foreign),
}

impl Effect {
    /// As an answer names it: its id in the physics catalogue, or `unexplained` for what that does not list.
    pub fn entry(&self) -> &'static str {
        self.physics().unwrap_or("unexplained")
    }

    /// Id in the physics catalogue; none for what it does not list.
    pub fn physics(&self) -> Option<&'static str> {
        match self {
            Self::Rig(e) => Some(e.physics()),
            Self::Body(e) => Some(e.physics()),
            Self::Memory(e) => Some(e.physics()),
            Self::Touch(e) => Some(e.physics()),
            Self::Large(e) => Some(e.physics()),
            Self::Foreign(_) => None,
        }
    }

    /// Parameters by their ids in the catalogue.
    pub fn parameters(&self) -> Vec<(&'static str, Figure)> {
        match self {
            Self::Rig(e) => e.parameters(),
            Self::Body(e) => e.parameters(),
            Self::Memory(e) => e.parameters(),
            Self::Touch(e) => e.parameters(),
            Self::Large(e) => e.parameters(),
            Self::Foreign(_) => Vec::new(),
        }
    }
}

/// Refuses effects whose figures mean nothing.
pub(super) fn check(world: &World) -> Result<(), SimError> {
    let mut refused = None;
    let mut need =
        |good: bool, effect: &'static str, what: &'static str, value: f64, expected: &'static str| {
            if !good && refused.is_none() {
                refused = Some(SimError::BadEffect { effect, what, value, expected });
            }
        };
    for effect in &world.effects {
        let id = effect.physics().unwrap_or("effect outside the catalogue");
        let unit = |v: [f64; 3]| Vec3::from(v).norm();
        let mut positive =
            |what, value: f64| need(value > 0.0 && value.is_finite(), id, what, value, "more than 0");
        match effect {
            Effect::Body(Body::Inclusion { radius_m, modulus_ratio, .. }) => {
                positive("radius_m", *radius_m);
                positive("modulus_ratio", *modulus_ratio);
            }
            Effect::Body(Body::BaseDebonding { radius_m, .. }) => positive("radius_m", *radius_m),
            Effect::Body(Body::CompliantBase { foundation_pa_per_m }) => {
                positive("foundation_pa_per_m", *foundation_pa_per_m);
            }
            Effect::Body(Body::Anisotropy { axis, modulus_ratio }) => {
                positive("modulus_ratio", *modulus_ratio);
                need((unit(*axis) - 1.0).abs() < 1e-9, id, "length of axis", unit(*axis), "1");
            }
            Effect::Touch(Touch::SlackBand { direction, .. }) => {
                need((unit(*direction) - 1.0).abs() < 1e-9, id, "length of direction", unit(*direction), "1");
            }
            Effect::Touch(Touch::TipSlip { friction_coefficient }) => {
                positive("friction_coefficient", *friction_coefficient);
            }
            Effect::Memory(Memory::Relaxation { terms } | Memory::BandViscosity { terms }) => {
                for term in terms {
                    positive("time_constant_s", term.time_constant_s);
                }
                let sum = relaxed(terms);
                need(
                    (0.0..1.0).contains(&sum),
                    id,
                    "sum of relaxed_fraction",
                    sum,
                    "at least 0, less than 1",
                );
            }
            Effect::Foreign(Foreign::StickyHolds { stiffness_n_per_m, yield_n }) => {
                positive("stiffness", *stiffness_n_per_m);
                positive("yield force", *yield_n);
            }
            Effect::Foreign(Foreign::DepthGradient { per_m }) => {
                let swing = (0.5 * per_m * world.phantom.slab.size_m[2]).abs();
                need(swing < 1.0, id, "change of the modulus from the middle", swing, "less than 1");
            }
            Effect::Large(Large::StrainStiffening { stiffening, .. }) => positive("stiffening", *stiffening),
            Effect::Large(Large::StressSoftening { softening, scale_j_m3 }) => {
                positive("scale_j_m3", *scale_j_m3);
                need((0.0..1.0).contains(softening), id, "softening", *softening, "at least 0, less than 1");
            }
            Effect::Rig(_) | Effect::Body(_) | Effect::Memory(_) | Effect::Large(_) | Effect::Foreign(_) => {}
        }
    }
    refused.map_or_else(|| together(&world.effects), Err)
}

/// Refuses what cannot act beside a material that is not linear: everything that changes the body or what holds it, and,
/// beside softening, a stage that gives, which would have to be known to say where the tip turns back.
fn together(effects: &[Effect]) -> Result<(), SimError> {
    let Some(large) = effects.iter().find(|e| matches!(e, Effect::Large(_))) else { return Ok(()) };
    let softens = effects.iter().any(|e| matches!(e, Effect::Large(Large::StressSoftening { .. })));
    let clash = effects.iter().find(|e| match e {
        Effect::Body(_) | Effect::Memory(_) | Effect::Touch(_) => true,
        Effect::Foreign(Foreign::DepthGradient { .. } | Foreign::StickyHolds { .. }) => true,
        Effect::Rig(Rig::StageCompliance { .. }) => softens,
        Effect::Rig(_) | Effect::Large(_) | Effect::Foreign(_) => false,
    });
    let name = |e: &Effect| e.physics().unwrap_or("an effect outside the catalogue");
    clash.map_or(Ok(()), |clash| Err(SimError::NotTogether { one: name(large), other: name(clash) }))
}
