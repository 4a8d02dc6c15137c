//! Effects that the physics catalogue does not list: the right answer to them is `unexplained`.

/// An effect outside the catalogue.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Foreign {
    /// The modulus varies linearly through the depth: 1 + slope (z − half the height).
    DepthGradient {
        /// Slope (1/m).
        per_m: f64,
    },
    /// The force sensor reads no component beyond a limit.
    ForceSaturation {
        /// Limit (N).
        limit_n: f64,
    },
    /// The force sensor's sensitivity falls with the load: reading = F (1 − F² / scale²) in each component.
    ForceCurvature {
        /// Scale (N).
        scale_n: f64,
    },
    /// A sine on every force channel.
    ForceHum {
        /// Amplitude (N).
        amplitude_n: f64,
        /// Frequency (Hz).
        frequency_hz: f64,
    },
    /// The camera's scale varies across the picture: displacements along x and y times 1 + slope (x − centre) along x,
    /// likewise along y, as with distortion quadratic in the position.
    LensDistortion {
        /// Slope (1/m).
        per_m: f64,
    },
    /// The stage's column grows: the tip is farther along the poke than reported, by rate × t from the start of the
    /// recording.
    StageExpansion {
        /// Rate (m/s).
        rate_m_per_s: f64,
    },
    /// The stage's axes are turned against the phantom's: the tip moves askew.
    StageMisalignment {
        /// Rotation vector (rad).
        rotation_rad: [f64; 3],
    },
    /// All springs carry besides a spring in series with dry friction: a loop that does not depend on the rate.
    StickyHolds {
        /// Stiffness before it slides (N/m).
        stiffness_n_per_m: f64,
        /// Force at which it slides (N).
        yield_n: f64,
    },
}

impl Foreign {
    /// What it is, in words.
    pub fn note(&self) -> String {
        match *self {
            Self::DepthGradient { per_m } => {
                format!("modulus times 1 + {per_m}/m x (z - half the height)")
            }
            Self::ForceSaturation { limit_n } => format!("force sensor clips at {limit_n} N"),
            Self::ForceCurvature { scale_n } => format!("force reading = F (1 - F^2/({scale_n} N)^2)"),
            Self::ForceHum { amplitude_n, frequency_hz } => {
                format!("hum of {amplitude_n} N at {frequency_hz} Hz in all forces")
            }
            Self::LensDistortion { per_m } => {
                format!("lateral displacements times 1 + {per_m}/m x distance from the centre")
            }
            Self::StageExpansion { rate_m_per_s } => {
                format!("tip creeps along the poke by {rate_m_per_s} m/s")
            }
            Self::StageMisalignment { rotation_rad } => format!("stage turned by {rotation_rad:?} rad"),
            Self::StickyHolds { stiffness_n_per_m, yield_n } => {
                format!("springs with dry friction: {stiffness_n_per_m} N/m up to {yield_n} N")
            }
        }
    }
}
