//! Which law the phantom follows when strains are not small.

use super::super::answer::Figure;
use super::super::effect::Effect;
use super::super::plan::World;
use super::material::{Isochoric, Material, Softening};

/// A material that is not linear (spec/physics-catalogue; parameters as defined there).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Large {
    /// `finite-strain`: W = μ/2 (Ī₁ − 3) + κ/2 (J − 1)².
    FiniteStrain,
    /// `strain-stiffening`.
    StrainStiffening {
        /// Which energy.
        law: StiffeningLaw,
        /// b or c₂.
        stiffening: f64,
    },
    /// `stress-softening`: stress times 1 − r (1 − exp(−(w_max − w)/m)). By itself strains are small ones; beside
    /// one of the other laws the stress is that law's.
    StressSoftening {
        /// r.
        softening: f64,
        /// m (J/m³).
        scale_j_m3: f64,
    },
}

/// How the modulus rises with strain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StiffeningLaw {
    /// W = μ/(2b) (exp(b (Ī₁ − 3)) − 1) + κ/2 (J − 1)².
    Fung,
    /// W = μ/2 ((Ī₁ − 3) + c₂ (Ī₁ − 3)²) + κ/2 (J − 1)².
    Yeoh,
}

impl Large {
    /// Id in the physics catalogue.
    pub fn physics(&self) -> &'static str {
        match self {
            Self::FiniteStrain => "finite-strain",
            Self::StrainStiffening { .. } => "strain-stiffening",
            Self::StressSoftening { .. } => "stress-softening",
        }
    }

    /// Parameters by their ids in the catalogue.
    pub(in super::super) fn parameters(&self) -> Vec<(&'static str, Figure)> {
        match *self {
            Self::FiniteStrain => Vec::new(),
            Self::StrainStiffening { law, stiffening } => {
                let name = match law {
                    StiffeningLaw::Fung => "fung",
                    StiffeningLaw::Yeoh => "yeoh",
                };
                vec![("stiffening", Figure::Number(stiffening)), ("law", Figure::Name(name))]
            }
            Self::StressSoftening { softening, scale_j_m3 } => {
                vec![("softening", Figure::Number(softening)), ("scale_j_m3", Figure::Number(scale_j_m3))]
            }
        }
    }
}

/// The material of a world; none when it is linear elastic. The last law of each kind counts.
pub(super) fn material(world: &World) -> Option<Material> {
    let mut isochoric = Isochoric::SmallStrain;
    let mut softening = None;
    for effect in &world.effects {
        match *effect {
            Effect::Large(Large::FiniteStrain) => isochoric = Isochoric::NeoHookean,
            Effect::Large(Large::StrainStiffening { law, stiffening }) => {
                isochoric = match law {
                    StiffeningLaw::Fung => Isochoric::Fung(stiffening),
                    StiffeningLaw::Yeoh => Isochoric::Yeoh(stiffening),
                };
            }
            Effect::Large(Large::StressSoftening { softening: share, scale_j_m3 }) => {
                softening = Some(Softening { share, scale: scale_j_m3 });
            }
            _ => {}
        }
    }
    let linear = isochoric == Isochoric::SmallStrain && softening.is_none();
    (!linear)
        .then(|| Material::new(world.young_modulus_pa, world.phantom.poisson_ratio, isochoric, softening))
}
