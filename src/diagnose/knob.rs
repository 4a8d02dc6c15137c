//! The parameters that a reading of a recording adds to the baseline's: ids and bounds of the catalogue, and where each
//! acts.

use super::bulk::BulkKnob;
use super::dual::Dual;
use super::effects::{Band, Effects, Slack, Term};
use super::extra::Large;
use super::large::StiffeningLaw;
use super::physics::Physics;
use super::sticky::{SMALLEST_SLIP_M, Sticky};
use super::uneven::Unevenness;
use num_dual::DualNum;

/// One parameter of an effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Knob {
    /// Share of the phantom's instantaneous modulus that the n-th term relaxes.
    Relaxed(usize),
    /// Its time constant, by the logarithm.
    Time(usize),
    Drying,
    /// As for the phantom, of all restraint alike.
    BandRelaxed(usize),
    BandTime(usize),
    /// Of all restraint alike, which then acts along a direction; also of what the baseline took for glue, for it may be bands that are slack.
    Gap([f64; 3]),
    /// What drags beside all restraint alike, by the logarithm: stiffness over the springs', and slip (m).
    StickyRatio,
    StickySlip,
    Friction,
    Late,
    Backlash,
    StageGive,
    Drift(usize),
    /// Of one axis of the force sensor, by the logarithm.
    Gain(usize),
    Rotation(usize),
    /// Where the camera takes all markers to be, less where they are, along an axis (m).
    Translation(usize),
    Scale,
    DepthGain,
    /// Of the scale over the picture.
    Uneven(Unevenness),
    Lag,
    /// A linear change of the body.
    Bulk(BulkKnob),
    /// Strain that is not small: on.
    FiniteStrain,
    /// Parameter of the law.
    Stiffening(StiffeningLaw),
    /// Share, and the logarithm of the scale (J/m³).
    Softening,
    SofteningScale,
    /// Acceleration along an axis (m/s²) of a body that always carries its weight.
    Gravity(usize),
    /// The same of one that carries it only while the tip touches: something else holds it at rest.
    GravityUnderTip(usize),
}

impl Knob {
    /// The entry of the catalogue that it belongs to.
    pub(super) fn physics(self) -> Physics {
        match self {
            Self::Relaxed(_) | Self::Time(_) => Physics::ViscoelasticRelaxation,
            Self::Drying => Physics::Drying,
            Self::BandRelaxed(_) | Self::BandTime(_) => Physics::BandViscosity,
            Self::Gap(_) => Physics::SlackBand,
            Self::StickyRatio | Self::StickySlip => Physics::StickyRestraint,
            Self::Friction => Physics::TipSlip,
            Self::Late => Physics::LateContact,
            Self::Backlash => Physics::StageBacklash,
            Self::StageGive => Physics::StageCompliance,
            Self::Drift(_) => Physics::ForceDrift,
            Self::Gain(_) => Physics::ForceGain,
            Self::Rotation(_) | Self::Translation(_) => Physics::CameraMisalignment,
            Self::Scale | Self::DepthGain => Physics::CameraScale,
            Self::Uneven(_) => Physics::UnevenScale,
            Self::Lag => Physics::CameraLag,
            Self::Bulk(bulk) => bulk.physics(),
            Self::FiniteStrain => Physics::FiniteStrain,
            Self::Stiffening(_) => Physics::StrainStiffening,
            Self::Softening | Self::SofteningScale => Physics::StressSoftening,
            Self::Gravity(_) | Self::GravityUnderTip(_) => Physics::SelfWeight,
        }
    }

    /// Id of the parameter; knobs that share it are its components.
    pub(super) fn id(self) -> &'static str {
        match self {
            Self::Relaxed(_) | Self::BandRelaxed(_) => "relaxed_fraction",
            Self::Time(_) | Self::BandTime(_) => "time_constant_s",
            Self::Drying => "modulus_rate_per_s",
            Self::Gap(_) | Self::Late => "gap_m",
            Self::StickyRatio => "stiffness_ratio",
            Self::StickySlip => "slip_m",
            Self::Friction => "friction_coefficient",
            Self::Backlash => "backlash_m",
            Self::StageGive => "compliance_m_per_n",
            Self::Drift(_) => "rate_n_per_s",
            Self::Gain(_) => "gain",
            Self::Rotation(_) => "rotation_rad",
            Self::Translation(_) => "translation_m",
            Self::Scale => "scale",
            Self::DepthGain => "depth_gain",
            Self::Uneven(_) => "uneven_scale",
            Self::Lag => "lag_s",
            Self::Bulk(bulk) => bulk.id().0,
            Self::FiniteStrain => "share",
            Self::Stiffening(_) => "stiffening",
            Self::Softening => "softening",
            Self::SofteningScale => "scale_j_m3",
            Self::Gravity(_) | Self::GravityUnderTip(_) => "g",
        }
    }

    /// Whether the catalogue gives it as a list: terms of a series, components of a vector.
    pub(super) fn list(self) -> bool {
        matches!(
            self,
            Self::Relaxed(_)
                | Self::Time(_)
                | Self::BandRelaxed(_)
                | Self::BandTime(_)
                | Self::Drift(_)
                | Self::Gain(_)
                | Self::Rotation(_)
                | Self::Translation(_)
                | Self::Gravity(_)
                | Self::GravityUnderTip(_)
        )
    }

    /// Whether the parameter is fitted by its logarithm.
    pub(super) fn by_logarithm(self) -> bool {
        matches!(
            self,
            Self::Time(_)
                | Self::BandTime(_)
                | Self::StickyRatio
                | Self::StickySlip
                | Self::Friction
                | Self::Gain(_)
                | Self::SofteningScale
        )
    }

    /// Smallest and largest value, and the longest step of a fit, in the units of the value (or of its logarithm); those of
    /// a change of the body are the laboratory's.
    pub(super) fn range(self) -> ([f64; 2], f64) {
        match self {
            Self::Relaxed(_) | Self::BandRelaxed(_) => ([0.0, 0.9], 0.15),
            Self::Time(_) | Self::BandTime(_) => ([0.02_f64.ln(), 500.0_f64.ln()], 0.8),
            Self::Drying => ([-0.01, 0.01], 1e-3),
            Self::Gap(_) => ([0.0, 4e-3], 3e-4),
            Self::StickyRatio => ([0.02_f64.ln(), 20.0_f64.ln()], 0.5),
            Self::StickySlip => ([SMALLEST_SLIP_M.ln(), 5e-3_f64.ln()], 0.4),
            Self::Friction => ([0.01_f64.ln(), 3.0_f64.ln()], 0.4),
            Self::Late => ([0.0, 2e-3], 1e-4),
            Self::Backlash => ([0.0, 1.5e-3], 1e-4),
            Self::StageGive => ([0.0, 2e-3], 1e-4),
            Self::Drift(_) => ([-0.05, 0.05], 5e-3),
            Self::Gain(_) => ([-0.7, 0.7], 0.1),
            Self::Rotation(_) => ([-0.5, 0.5], 0.1),
            Self::Translation(_) => ([-2e-3, 2e-3], 5e-4),
            Self::Scale | Self::DepthGain => ([0.5, 2.0], 0.1),
            Self::Uneven(_) => ([-0.5, 0.5], 0.05),
            Self::Lag => ([-0.5, 0.5], 0.05),
            Self::Bulk(_) => ([f64::NEG_INFINITY, f64::INFINITY], f64::INFINITY),
            Self::FiniteStrain => ([1.0, 1.0], 1.0),
            Self::Stiffening(_) => ([0.0, 20.0], 2.0),
            Self::Softening => ([0.0, 0.9], 0.15),
            Self::SofteningScale => ([1e-2_f64.ln(), 1e5_f64.ln()], 1.0),
            Self::Gravity(_) | Self::GravityUnderTip(_) => ([-20.0, 20.0], 5.0),
        }
    }

    /// Standard deviation that it is known with beforehand about a neutral 0, where a recording may leave it open: the gain
    /// of an axis along which nothing ever pulled, weight along one that does nothing, a small ball that may as well be rigid, the direction of
    /// an axis that is hardly stiffer, a shift that a recording of few markers near the tip does not show.
    pub(super) fn prior_sd(self) -> f64 {
        match self {
            Self::Gain(_) => 0.3,
            Self::Bulk(BulkKnob::BallRatio | BulkKnob::Turn(_)) => 1.0,
            Self::Gravity(_) | Self::GravityUnderTip(_) => 10.0,
            Self::Translation(_) => 1e-3,
            _ => f64::INFINITY,
        }
    }

    /// Turns it to `value` (or to the exponential of it); what changes the body or where it is seen acts there.
    pub(super) fn set(self, effects: &mut Effects, value: Dual) {
        let raw = value;
        let value = if self.by_logarithm() { value.exp() } else { value };
        match self {
            Self::Relaxed(n) => term(&mut effects.relaxation, n).relaxed_fraction = value,
            Self::Time(n) => term(&mut effects.relaxation, n).time_constant_s = value,
            Self::Drying => effects.drying_per_s = value,
            Self::BandRelaxed(n) => {
                effects.bands.iter_mut().for_each(|b| term(&mut b.memory, n).relaxed_fraction = value);
            }
            Self::BandTime(n) => {
                effects.bands.iter_mut().for_each(|b| term(&mut b.memory, n).time_constant_s = value);
            }
            Self::Gap(direction) => {
                let slack = Slack { gap_m: value, direction };
                effects.bands.iter_mut().for_each(|b| b.slack = Some(slack));
            }
            Self::StickyRatio => effects.bands.iter_mut().for_each(|b| sticky(b).ratio = value),
            Self::StickySlip => effects.bands.iter_mut().for_each(|b| sticky(b).slip_m = value),
            Self::Friction => effects.friction = Some(value),
            Self::Late => effects.late_m = value,
            Self::Backlash => effects.backlash_m = value,
            Self::StageGive => effects.stage_m_per_n = value,
            Self::Drift(axis) => effects.drift_n_per_s[axis] = value,
            Self::Gain(axis) => effects.gain[axis] = value,
            Self::Rotation(axis) => effects.rotation_rad[axis] = value,
            Self::Scale => effects.scale = value,
            Self::DepthGain => effects.depth_gain = value,
            Self::Lag => effects.lag_s = value,
            Self::Uneven(of) => effects.uneven[of as usize] = value,
            Self::Bulk(_) | Self::Translation(_) => {}
            Self::FiniteStrain => effects.large = Some(Large::FiniteStrain),
            Self::Stiffening(law) => effects.large = Some(Large::Stiffening(law, value)),
            Self::Softening => effects.large = Some(Large::Softening(value, Dual::from(0.0))),
            Self::SofteningScale => {
                if let Some(Large::Softening(_, log_scale)) = &mut effects.large {
                    *log_scale = raw;
                }
            }
            Self::Gravity(axis) | Self::GravityUnderTip(axis) => {
                let comes_and_goes = matches!(self, Self::GravityUnderTip(_));
                let none = Large::Weight { comes_and_goes, gravity: [Dual::from(0.0); 3] };
                if let Large::Weight { gravity, .. } = effects.large.get_or_insert(none) {
                    gravity[axis] = value;
                }
            }
        }
    }
}

/// A term that does nothing.
fn rest() -> Term {
    Term { relaxed_fraction: Dual::from(0.0), time_constant_s: Dual::from(1.0) }
}

/// What drags beside a band, at first with nothing.
fn sticky(band: &mut Band) -> &mut Sticky {
    band.sticky.get_or_insert(Sticky { ratio: Dual::from(0.0), slip_m: Dual::from(1.0) })
}

fn term(terms: &mut Vec<Term>, n: usize) -> &mut Term {
    while terms.len() <= n {
        terms.push(rest());
    }
    &mut terms[n]
}
