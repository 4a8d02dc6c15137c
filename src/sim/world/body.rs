//! Linear bodies other than the baseline's, and the weight.

use super::altered::{Alteration, difference};
use super::answer::Figure;
use super::effect::Effect;
use super::foreign::Foreign;
use super::plan::World;
use crate::geometry::Vec3;
use crate::sim::SimError;
use crate::sim::linear::Compliance;

/// Another linear body (spec/physics-catalogue; parameters as defined there). Poisson's ratio is a world's own field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Body {
    /// `anisotropy`: stress = isotropic + c E (a·ε·a) a⊗a, c = `modulus_ratio` − 1.
    Anisotropy {
        /// a, unit vector.
        axis: [f64; 3],
        /// 1 + c.
        modulus_ratio: f64,
    },
    /// `inclusion`: a bonded ball of another modulus.
    Inclusion {
        /// Centre (m).
        centre_m: [f64; 3],
        /// Radius (m).
        radius_m: f64,
        /// Modulus over that of the phantom.
        modulus_ratio: f64,
    },
    /// `base-debonding`: a disc of the known glue carries no traction.
    BaseDebonding {
        /// Centre (x, y) on the underside (m).
        centre_m: [f64; 2],
        /// Radius (m).
        radius_m: f64,
    },
    /// `compliant-base`: the glue gives.
    CompliantBase {
        /// Traction per displacement (Pa/m).
        foundation_pa_per_m: f64,
    },
    /// `self-weight`: the phantom lies on a tray at rest, which is taken away while a tip touches it.
    SelfWeight {
        /// Acceleration of gravity in the phantom frame (m/s²).
        gravity_m_s2: [f64; 3],
    },
}

impl Body {
    /// Id in the physics catalogue.
    pub fn physics(&self) -> &'static str {
        match self {
            Self::Anisotropy { .. } => "anisotropy",
            Self::Inclusion { .. } => "inclusion",
            Self::BaseDebonding { .. } => "base-debonding",
            Self::CompliantBase { .. } => "compliant-base",
            Self::SelfWeight { .. } => "self-weight",
        }
    }

    /// Parameters by their ids in the catalogue.
    pub(super) fn parameters(&self) -> Vec<(&'static str, Figure)> {
        let number = Figure::Number;
        match *self {
            Self::Anisotropy { axis, modulus_ratio } => {
                vec![("axis", Figure::List(axis.to_vec())), ("modulus_ratio", number(modulus_ratio))]
            }
            Self::Inclusion { centre_m, radius_m, modulus_ratio } => vec![
                ("centre_x_m", number(centre_m[0])),
                ("centre_y_m", number(centre_m[1])),
                ("centre_z_m", number(centre_m[2])),
                ("radius_m", number(radius_m)),
                ("modulus_ratio", number(modulus_ratio)),
            ],
            Self::BaseDebonding { centre_m, radius_m } => vec![
                ("centre_x_m", number(centre_m[0])),
                ("centre_y_m", number(centre_m[1])),
                ("radius_m", number(radius_m)),
            ],
            Self::CompliantBase { foundation_pa_per_m } => {
                vec![("foundation_pa_per_m", number(foundation_pa_per_m))]
            }
            Self::SelfWeight { gravity_m_s2 } => {
                let g = Vec3::from(gravity_m_s2);
                let direction = g / g.norm();
                vec![
                    ("gravity_direction", Figure::List(direction.as_slice().to_vec())),
                    ("g", number(g.norm())),
                ]
            }
        }
    }
}

/// What the effects on the body change in the compliance of a session's tips, springs and spots, in the order of
/// `condensed`, and of the points that are watched (m); none when they change nothing.
pub(super) fn change(world: &World, watched: &[[f64; 3]]) -> Result<Option<Compliance>, SimError> {
    let mut alteration = Alteration::default();
    for effect in &world.effects {
        match *effect {
            Effect::Body(Body::Anisotropy { axis, modulus_ratio }) => {
                alteration.axes.push((Vec3::from(axis), modulus_ratio - 1.0));
            }
            Effect::Body(Body::Inclusion { centre_m, radius_m, modulus_ratio }) => {
                alteration.balls.push((Vec3::from(centre_m), radius_m, modulus_ratio));
            }
            Effect::Body(Body::BaseDebonding { centre_m, radius_m }) => {
                alteration.loose.push((centre_m, radius_m));
            }
            Effect::Body(Body::CompliantBase { foundation_pa_per_m }) => {
                alteration.foundation = Some(foundation_pa_per_m / world.young_modulus_pa);
            }
            Effect::Foreign(Foreign::DepthGradient { per_m }) => alteration.gradient_per_m += per_m,
            _ => {}
        }
    }
    if alteration == Alteration::default() {
        Ok(None)
    } else {
        difference(world, &alteration, watched).map(Some)
    }
}
