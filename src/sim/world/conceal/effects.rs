//! What may be concealed, and how strong it is: an entry of the catalogue → an effect on a phantom that is poked so.

use crate::geometry::Vec3;
use crate::sim::world::body::Body;
use crate::sim::world::effect::Effect;
use crate::sim::world::foreign::Foreign;
use crate::sim::world::large::{Large, StiffeningLaw};
use crate::sim::world::memory::{Memory, PronyTerm};
use crate::sim::world::phantom::PhantomPlan;
use crate::sim::world::plan::Press;
use crate::sim::world::rig::Rig;
use crate::sim::world::touch::Touch;
use rand::{Rng, RngExt};

/// Entries of the catalogue that a world may conceal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Entry {
    FiniteStrain,
    StrainStiffening,
    Relaxation,
    StressSoftening,
    Drying,
    Inclusion,
    Anisotropy,
    PoissonRatio,
    BaseDebonding,
    CompliantBase,
    SlackBand,
    BandViscosity,
    TipSlip,
    LateContact,
    Backlash,
    StageCompliance,
    ForceDrift,
    ForceGain,
    CameraMisalignment,
    CameraScale,
    CameraLag,
    SelfWeight,
}

pub(super) const ENTRIES: [Entry; 22] = [
    Entry::FiniteStrain,
    Entry::StrainStiffening,
    Entry::Relaxation,
    Entry::StressSoftening,
    Entry::Drying,
    Entry::Inclusion,
    Entry::Anisotropy,
    Entry::PoissonRatio,
    Entry::BaseDebonding,
    Entry::CompliantBase,
    Entry::SlackBand,
    Entry::BandViscosity,
    Entry::TipSlip,
    Entry::LateContact,
    Entry::Backlash,
    Entry::StageCompliance,
    Entry::ForceDrift,
    Entry::ForceGain,
    Entry::CameraMisalignment,
    Entry::CameraScale,
    Entry::CameraLag,
    Entry::SelfWeight,
];

/// A log-uniform number.
pub(super) fn log_uniform(rng: &mut impl Rng, low: f64, high: f64) -> f64 {
    low * (high / low).powf(rng.random())
}

/// A number of this size or its opposite.
pub(super) fn either_sign(rng: &mut impl Rng, size: f64) -> f64 {
    if rng.random_bool(0.5) { size } else { -size }
}

/// A direction, all alike.
pub(super) fn direction(rng: &mut impl Rng) -> Vec3 {
    let z: f64 = rng.random_range(-1.0..1.0);
    let angle = rng.random_range(0.0..std::f64::consts::TAU);
    let r = (1.0 - z * z).sqrt();
    Vec3::new(r * angle.cos(), r * angle.sin(), z)
}

/// One or two terms of a Prony series.
fn terms(rng: &mut impl Rng, low: f64, high: f64) -> Vec<PronyTerm> {
    let relaxed_fraction = log_uniform(rng, low, high);
    let time_constant_s = log_uniform(rng, 0.5, 12.0);
    let mut terms = vec![PronyTerm { relaxed_fraction, time_constant_s }];
    if rng.random_bool(0.25) {
        terms[0].relaxed_fraction *= 0.6;
        terms.push(PronyTerm {
            relaxed_fraction: 0.4 * relaxed_fraction,
            time_constant_s: 6.0 * time_constant_s,
        });
    }
    terms
}

/// The effect of an entry; none for Poisson's ratio, which is a statement and not an effect.
pub(super) fn effect(
    rng: &mut impl Rng,
    entry: Entry,
    phantom: &PhantomPlan,
    pokes: &[Press],
) -> Option<Effect> {
    Some(match entry {
        Entry::PoissonRatio => return None,
        Entry::FiniteStrain => Effect::Large(Large::FiniteStrain),
        Entry::StrainStiffening => {
            let stiffening = log_uniform(rng, 0.5, 3.0);
            Effect::Large(if rng.random_bool(0.5) {
                Large::StrainStiffening { law: StiffeningLaw::Fung, stiffening }
            } else {
                Large::StrainStiffening { law: StiffeningLaw::Yeoh, stiffening: 0.5 * stiffening }
            })
        }
        Entry::StressSoftening => Effect::Large(Large::StressSoftening {
            softening: log_uniform(rng, 0.08, 0.4),
            scale_j_m3: log_uniform(rng, 10.0, 80.0),
        }),
        Entry::Relaxation => Effect::Memory(Memory::Relaxation { terms: terms(rng, 0.04, 0.35) }),
        Entry::BandViscosity => Effect::Memory(Memory::BandViscosity { terms: terms(rng, 0.15, 0.6) }),
        Entry::Drying => {
            let rate = log_uniform(rng, 2e-4, 3e-3);
            Effect::Memory(Memory::Drying { modulus_rate_per_s: either_sign(rng, rate) })
        }
        Entry::Inclusion
        | Entry::Anisotropy
        | Entry::BaseDebonding
        | Entry::CompliantBase
        | Entry::SelfWeight => Effect::Body(body(rng, entry, phantom, pokes)),
        Entry::SlackBand => Effect::Touch(Touch::SlackBand {
            hold: None,
            direction: [0.0, 0.0, -1.0],
            gap_m: log_uniform(rng, 1e-4, 1e-3),
        }),
        Entry::TipSlip => Effect::Touch(Touch::TipSlip { friction_coefficient: log_uniform(rng, 0.1, 0.5) }),
        Entry::LateContact
        | Entry::Backlash
        | Entry::StageCompliance
        | Entry::ForceDrift
        | Entry::ForceGain
        | Entry::CameraMisalignment
        | Entry::CameraScale
        | Entry::CameraLag => Effect::Rig(rig(rng, entry)),
    })
}

fn body(rng: &mut impl Rng, entry: Entry, phantom: &PhantomPlan, pokes: &[Press]) -> Body {
    let size = phantom.slab.size_m;
    let within =
        |x: f64, low: f64, high: f64| if low < high { x.clamp(low, high) } else { 0.5 * (low + high) };
    match entry {
        Entry::Inclusion => {
            // Under one of the sites on top that are poked.
            let near = phantom.sites[pokes[2 * rng.random_range(0..2)].site].centre_m;
            let radius_m = rng.random_range(0.005..0.009);
            let inset = radius_m + 0.0015;
            let mut centre_m: [f64; 3] = std::array::from_fn(|a| {
                within(near[a] + rng.random_range(-0.012..0.012), inset, size[a] - inset)
            });
            centre_m[2] = within(rng.random_range(0.0..size[2]), inset, size[2] - inset);
            let ratio = log_uniform(rng, 1.5, 6.0);
            Body::Inclusion {
                centre_m,
                radius_m,
                modulus_ratio: if rng.random_bool(0.7) { ratio } else { 1.0 / ratio },
            }
        }
        Entry::Anisotropy => {
            let c = log_uniform(rng, 0.05, 0.8);
            Body::Anisotropy { axis: direction(rng).into(), modulus_ratio: 1.0 + c }
        }
        Entry::BaseDebonding => {
            let over_glue = pokes.iter().map(|p| phantom.sites[p.site].centre_m);
            let near = over_glue.min_by(|a, b| a[0].total_cmp(&b[0])).unwrap_or([0.0; 3]);
            let most = 0.5 * phantom.slab.glue_end_m.min(size[1]) - 0.003;
            let radius_m = rng.random_range(0.006..0.014_f64).min(most);
            let inset = radius_m + 0.002;
            let mut place =
                |a: usize, end: f64| within(near[a] + rng.random_range(-0.008..0.008), inset, end - inset);
            Body::BaseDebonding { centre_m: [place(0, phantom.slab.glue_end_m), place(1, size[1])], radius_m }
        }
        Entry::CompliantBase => Body::CompliantBase { foundation_pa_per_m: log_uniform(rng, 7e5, 8e6) },
        // A bath carries most of the weight: a slab of 10 kPa would hang down by its own length.
        _ => Body::SelfWeight { gravity_m_s2: [0.0, 0.0, -log_uniform(rng, 0.02, 0.4)] },
    }
}

fn rig(rng: &mut impl Rng, entry: Entry) -> Rig {
    match entry {
        Entry::LateContact => Rig::LateContact { gap_m: log_uniform(rng, 3e-5, 4e-4) },
        Entry::Backlash => Rig::Backlash { backlash_m: log_uniform(rng, 3e-5, 3e-4) },
        Entry::StageCompliance => Rig::StageCompliance { compliance_m_per_n: log_uniform(rng, 4e-5, 6e-4) },
        Entry::ForceDrift => {
            let rate = log_uniform(rng, 1e-4, 3e-3);
            Rig::ForceDrift { rate_n_per_s: (direction(rng) * rate).into() }
        }
        Entry::ForceGain => {
            let mut gain = [1.0; 3];
            let off = log_uniform(rng, 0.02, 0.2);
            gain[rng.random_range(0..3)] += either_sign(rng, off);
            Rig::ForceGain { gain }
        }
        Entry::CameraMisalignment => {
            let angle = log_uniform(rng, 0.008, 0.08);
            Rig::CameraMisalignment {
                rotation_rad: (direction(rng) * angle).into(),
                translation_m: (direction(rng) * 5e-4).into(),
            }
        }
        Entry::CameraScale => {
            let off = log_uniform(rng, 0.015, 0.12);
            let value = 1.0 + either_sign(rng, off);
            if rng.random_bool(0.5) {
                Rig::CameraScale { scale: value, depth_gain: 1.0 }
            } else {
                Rig::CameraScale { scale: 1.0, depth_gain: value }
            }
        }
        _ => Rig::CameraLag { lag_s: log_uniform(rng, 0.02, 0.3) },
    }
}

pub(super) fn foreign(rng: &mut impl Rng) -> Foreign {
    match rng.random_range(0..8) {
        0 => {
            let slope = log_uniform(rng, 12.0, 50.0);
            Foreign::DepthGradient { per_m: either_sign(rng, slope) }
        }
        1 => Foreign::ForceSaturation { limit_n: rng.random_range(0.2..0.5) },
        2 => Foreign::ForceCurvature { scale_n: log_uniform(rng, 1.2, 4.0) },
        3 => Foreign::ForceHum {
            amplitude_n: log_uniform(rng, 0.004, 0.04),
            frequency_hz: rng.random_range(0.3..12.0),
        },
        4 => {
            let slope = log_uniform(rng, 0.5, 5.0);
            Foreign::LensDistortion { per_m: either_sign(rng, slope) }
        }
        5 => {
            let rate = log_uniform(rng, 5e-7, 8e-6);
            Foreign::StageExpansion { rate_m_per_s: either_sign(rng, rate) }
        }
        6 => {
            let angle = log_uniform(rng, 0.02, 0.15);
            Foreign::StageMisalignment { rotation_rad: (direction(rng) * angle).into() }
        }
        _ => Foreign::StickyHolds {
            stiffness_n_per_m: log_uniform(rng, 60.0, 300.0),
            yield_n: log_uniform(rng, 0.01, 0.08),
        },
    }
}
