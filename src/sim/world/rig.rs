//! What stage, force sensor and camera do wrong. The phantom knows nothing of it but for where the tip goes.

use super::answer::Figure;

/// A fault of an instrument or of the stage (spec/physics-catalogue; parameters as defined there).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rig {
    /// `late-contact`: actual depth = max(0, reported − gap).
    LateContact {
        /// Gap (m).
        gap_m: f64,
    },
    /// `stage-backlash`: play operator of this full width along the poke.
    Backlash {
        /// Lost motion (m).
        backlash_m: f64,
    },
    /// `stage-compliance`: actual = reported − compliance × force along the poke.
    StageCompliance {
        /// Compliance (m/N).
        compliance_m_per_n: f64,
    },
    /// `force-drift`: reading = force + rate × t.
    ForceDrift {
        /// Rate along each axis (N/s).
        rate_n_per_s: [f64; 3],
    },
    /// `force-gain`: reading = gain × force, by axis.
    ForceGain {
        /// Gain along each axis.
        gain: [f64; 3],
    },
    /// `camera-misalignment`: displacements turned, positions shifted.
    CameraMisalignment {
        /// Rotation vector in the phantom frame (rad).
        rotation_rad: [f64; 3],
        /// Shift of all positions (m).
        translation_m: [f64; 3],
    },
    /// `camera-scale`: displacements times `scale`, along z besides times `depth_gain`.
    CameraScale {
        /// Along all axes.
        scale: f64,
        /// Along the camera's line of sight, −z of the phantom.
        depth_gain: f64,
    },
    /// `camera-lag`: a row stamped t shows the state at t − lag.
    CameraLag {
        /// Lag (s).
        lag_s: f64,
    },
}

impl Rig {
    /// Id in the physics catalogue.
    pub fn physics(&self) -> &'static str {
        match self {
            Self::LateContact { .. } => "late-contact",
            Self::Backlash { .. } => "stage-backlash",
            Self::StageCompliance { .. } => "stage-compliance",
            Self::ForceDrift { .. } => "force-drift",
            Self::ForceGain { .. } => "force-gain",
            Self::CameraMisalignment { .. } => "camera-misalignment",
            Self::CameraScale { .. } => "camera-scale",
            Self::CameraLag { .. } => "camera-lag",
        }
    }

    /// Parameters by their ids in the catalogue.
    pub(super) fn parameters(&self) -> Vec<(&'static str, Figure)> {
        let list = |values: [f64; 3]| Figure::List(values.to_vec());
        match *self {
            Self::LateContact { gap_m } => vec![("gap_m", Figure::Number(gap_m))],
            Self::Backlash { backlash_m } => vec![("backlash_m", Figure::Number(backlash_m))],
            Self::StageCompliance { compliance_m_per_n } => {
                vec![("compliance_m_per_n", Figure::Number(compliance_m_per_n))]
            }
            Self::ForceDrift { rate_n_per_s } => vec![("rate_n_per_s", list(rate_n_per_s))],
            Self::ForceGain { gain } => vec![("gain", list(gain))],
            Self::CameraMisalignment { rotation_rad, translation_m } => {
                vec![("rotation_rad", list(rotation_rad)), ("translation_m", list(translation_m))]
            }
            Self::CameraScale { scale, depth_gain } => {
                vec![("scale", Figure::Number(scale)), ("depth_gain", Figure::Number(depth_gain))]
            }
            Self::CameraLag { lag_s } => vec![("lag_s", Figure::Number(lag_s))],
        }
    }
}
