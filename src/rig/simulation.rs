//! What a rig file says of a simulated bench → the world behind the simulated devices.
//!
//! Fits and reports never see this part: it is left out of what a session keeps of the rig file.

use super::RigError;
use super::camera::CameraKeys;
use crate::observation::{Noise, PlannedPoke};
use crate::sim::{
    Body, Disc, Effect, Hold, Instruments, Large, Memory, PhantomPlan, PronyTerm, Rig, Slab, StiffeningLaw,
    Touch, World,
};
use serde::Deserialize;

/// `[simulation]`: a phantom on a bench that only exists here.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SimulationKeys {
    /// Seed of all noise, of the marker sites and of the mesh.
    seed: u64,
    /// Block, from the phantom frame's origin.
    size_mm: [f64; 3],
    /// Its underside is glued from x = 0 to here.
    glue_end_mm: f64,
    young_modulus_kpa: f64,
    poisson_ratio: f64,
    /// Mean distance between the dots on its top.
    marker_spacing_mm: f64,
    /// Edge of the boxes from which the mesh that a session comes with is cut.
    mesh_cell_mm: f64,
    frame_rate_hz: f64,
    force_noise_n: [f64; 3],
    torque_noise_nm: [f64; 3],
    marker_noise_mm: [f64; 3],
    #[serde(default)]
    lost_marker_share: f64,
    #[serde(default, rename = "band")]
    bands: Vec<BandKeys>,
    #[serde(default, rename = "effect")]
    effects: Vec<EffectKeys>,
    camera: Option<CameraKeys>,
}

/// `[[simulation.band]]`: springs that pull on a disc of the underside.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct BandKeys {
    centre_mm: [f64; 2],
    radius_mm: f64,
    stiffness_n_per_m: f64,
}

/// `[[simulation.effect]]`: an entry of the physics catalogue, with its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(tag = "physics", rename_all = "kebab-case", deny_unknown_fields)]
enum EffectKeys {
    FiniteStrain {},
    StrainStiffening { law: LawWord, stiffening: f64 },
    StressSoftening { softening: f64, scale_j_m3: f64 },
    ViscoelasticRelaxation { relaxed_fraction: Vec<f64>, time_constant_s: Vec<f64> },
    BandViscosity { relaxed_fraction: Vec<f64>, time_constant_s: Vec<f64> },
    Drying { modulus_rate_per_s: f64 },
    Inclusion { centre_mm: [f64; 3], radius_mm: f64, modulus_ratio: f64 },
    Anisotropy { axis: [f64; 3], modulus_ratio: f64 },
    BaseDebonding { centre_mm: [f64; 2], radius_mm: f64 },
    CompliantBase { foundation_pa_per_m: f64 },
    SelfWeight { gravity_m_s2: [f64; 3] },
    SlackBand { direction: [f64; 3], gap_mm: f64 },
    TipSlip { friction_coefficient: f64 },
    LateContact { gap_mm: f64 },
    StageBacklash { backlash_mm: f64 },
    StageCompliance { compliance_mm_per_n: f64 },
    ForceDrift { rate_n_per_s: [f64; 3] },
    ForceGain { gain: [f64; 3] },
    CameraMisalignment { rotation_rad: [f64; 3], translation_mm: [f64; 3] },
    CameraScale { scale: f64, depth_gain: f64 },
    CameraLag { lag_s: f64 },
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum LawWord {
    Fung,
    Yeoh,
}

const MM: f64 = 1e-3;

impl SimulationKeys {
    /// The camera above the phantom, if there is one.
    pub(super) fn camera(&self) -> Option<&CameraKeys> {
        self.camera.as_ref()
    }

    /// The world in which `pokes` will be made; the force sensor delivers `rate_hz` records a second.
    pub(super) fn world(
        &self,
        name: &str,
        stated_poisson_ratio: f64,
        modulus_range_pa: [f64; 2],
        rate_hz: f64,
        pokes: &[PlannedPoke],
    ) -> Result<World, RigError> {
        let metres = |mm: &[f64; 3]| mm.map(|x| x * MM);
        let size_m = metres(&self.size_mm);
        let patch = |band: &BandKeys| Disc {
            centre_m: [band.centre_mm[0] * MM, band.centre_mm[1] * MM, 0.0],
            radius_m: band.radius_mm * MM,
        };
        let mut world = World {
            name: name.to_owned(),
            seed: self.seed,
            phantom: PhantomPlan {
                seed: self.seed,
                slab: Slab { size_m, glue_end_m: self.glue_end_mm * MM },
                poisson_ratio: self.poisson_ratio,
                sites: Vec::new(),
                patches: self.bands.iter().map(patch).collect(),
                spots: Vec::new(),
                marker_spacing_m: self.marker_spacing_mm * MM,
            },
            young_modulus_pa: self.young_modulus_kpa * 1e3,
            modulus_range_pa,
            stated_poisson_ratio,
            holds: (0..)
                .zip(&self.bands)
                .map(|(patch, b)| Hold::Springs { patch, stiffness_n_per_m: b.stiffness_n_per_m })
                .collect(),
            pokes: Vec::new(),
            instruments: Instruments {
                sensor_rate_hz: rate_hz,
                frame_rate_hz: self.frame_rate_hz,
                noise: Noise {
                    force_n: self.force_noise_n,
                    torque_nm: self.torque_noise_nm,
                    marker_m: metres(&self.marker_noise_mm),
                    stage_m: [0.0; 3],
                },
                wander: None,
                lost_share: self.lost_marker_share,
                marker_spacing_m: self.marker_spacing_mm * MM,
                pause_s: 1.0,
            },
            fit_cell_m: self.mesh_cell_mm * MM,
            effects: self.effects.iter().map(EffectKeys::effect).collect::<Result<_, _>>()?,
        };
        for poke in pokes {
            world.press(poke)?;
        }
        Ok(world)
    }
}

impl EffectKeys {
    fn effect(&self) -> Result<Effect, RigError> {
        let metres = |mm: [f64; 3]| mm.map(|x| x * MM);
        Ok(match self.clone() {
            Self::FiniteStrain {} => Effect::Large(Large::FiniteStrain),
            Self::StrainStiffening { law, stiffening } => {
                let law = match law {
                    LawWord::Fung => StiffeningLaw::Fung,
                    LawWord::Yeoh => StiffeningLaw::Yeoh,
                };
                Effect::Large(Large::StrainStiffening { law, stiffening })
            }
            Self::StressSoftening { softening, scale_j_m3 } => {
                Effect::Large(Large::StressSoftening { softening, scale_j_m3 })
            }
            Self::ViscoelasticRelaxation { relaxed_fraction, time_constant_s } => {
                let terms = series("viscoelastic-relaxation", &relaxed_fraction, &time_constant_s)?;
                Effect::Memory(Memory::Relaxation { terms })
            }
            Self::BandViscosity { relaxed_fraction, time_constant_s } => {
                let terms = series("band-viscosity", &relaxed_fraction, &time_constant_s)?;
                Effect::Memory(Memory::BandViscosity { terms })
            }
            Self::Drying { modulus_rate_per_s } => Effect::Memory(Memory::Drying { modulus_rate_per_s }),
            Self::Inclusion { centre_mm, radius_mm, modulus_ratio } => Effect::Body(Body::Inclusion {
                centre_m: metres(centre_mm),
                radius_m: radius_mm * MM,
                modulus_ratio,
            }),
            Self::Anisotropy { axis, modulus_ratio } => {
                Effect::Body(Body::Anisotropy { axis, modulus_ratio })
            }
            Self::BaseDebonding { centre_mm, radius_mm } => Effect::Body(Body::BaseDebonding {
                centre_m: centre_mm.map(|x| x * MM),
                radius_m: radius_mm * MM,
            }),
            Self::CompliantBase { foundation_pa_per_m } => {
                Effect::Body(Body::CompliantBase { foundation_pa_per_m })
            }
            Self::SelfWeight { gravity_m_s2 } => Effect::Body(Body::SelfWeight { gravity_m_s2 }),
            Self::SlackBand { direction, gap_mm } => {
                Effect::Touch(Touch::SlackBand { hold: None, direction, gap_m: gap_mm * MM })
            }
            Self::TipSlip { friction_coefficient } => Effect::Touch(Touch::TipSlip { friction_coefficient }),
            Self::LateContact { gap_mm } => Effect::Rig(Rig::LateContact { gap_m: gap_mm * MM }),
            Self::StageBacklash { backlash_mm } => {
                Effect::Rig(Rig::Backlash { backlash_m: backlash_mm * MM })
            }
            Self::StageCompliance { compliance_mm_per_n } => {
                Effect::Rig(Rig::StageCompliance { compliance_m_per_n: compliance_mm_per_n * MM })
            }
            Self::ForceDrift { rate_n_per_s } => Effect::Rig(Rig::ForceDrift { rate_n_per_s }),
            Self::ForceGain { gain } => Effect::Rig(Rig::ForceGain { gain }),
            Self::CameraMisalignment { rotation_rad, translation_mm } => {
                Effect::Rig(Rig::CameraMisalignment { rotation_rad, translation_m: metres(translation_mm) })
            }
            Self::CameraScale { scale, depth_gain } => Effect::Rig(Rig::CameraScale { scale, depth_gain }),
            Self::CameraLag { lag_s } => Effect::Rig(Rig::CameraLag { lag_s }),
        })
    }
}

fn series(effect: &'static str, fractions: &[f64], times_s: &[f64]) -> Result<Vec<PronyTerm>, RigError> {
    if fractions.len() != times_s.len() || fractions.is_empty() {
        return Err(RigError::UnequalSeries { effect, fractions: fractions.len(), times: times_s.len() });
    }
    let terms = fractions.iter().zip(times_s);
    Ok(terms
        .map(|(&relaxed_fraction, &time_constant_s)| PronyTerm { relaxed_fraction, time_constant_s })
        .collect())
}
