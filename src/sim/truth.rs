//! What was concealed in a draw, to be written beside its recording.

use super::draw::{Draw, Kinematics};
use super::supports::Restraint;
use serde::Serialize;

/// The answer to a recording, in the terms of `fit.json` and the physics catalogue.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Truth {
    /// Name of the recording.
    pub recording: String,
    /// Seed of the draw.
    pub seed: u64,
    /// Entries of the physics catalogue that the recording holds.
    pub physics: Vec<&'static str>,
    /// Equilibrium modulus at small strain (Pa).
    pub young_modulus_pa: f64,
    /// Poisson's ratio.
    pub poisson_ratio: f64,
    /// What holds the search surface.
    pub restraint: Vec<TrueRestraint>,
}

/// One concealed restraint.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrueRestraint {
    /// `springs` or `glued`.
    pub kind: &'static str,
    /// Centre (m).
    pub centroid_m: [f64; 3],
    /// Radius (m).
    pub radius_m: f64,
    /// Total stiffness (N/m); none for glue.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stiffness_n_per_m: Option<f64>,
}

impl Truth {
    /// What `draw` conceals.
    pub fn of(draw: &Draw) -> Self {
        Self {
            recording: draw.name.clone(),
            seed: draw.seed,
            physics: match draw.kinematics {
                Kinematics::SmallStrain => Vec::new(),
                Kinematics::FiniteStrain => vec!["finite-strain"],
            },
            young_modulus_pa: draw.young_modulus_pa,
            poisson_ratio: draw.poisson_ratio,
            restraint: draw.restraints.iter().map(TrueRestraint::of).collect(),
        }
    }
}

impl TrueRestraint {
    fn of(restraint: &Restraint) -> Self {
        match *restraint {
            Restraint::Springs { centre_m, radius_m, stiffness_n_per_m } => Self {
                kind: "springs",
                centroid_m: centre_m,
                radius_m,
                stiffness_n_per_m: Some(stiffness_n_per_m),
            },
            Restraint::Glued { centre_m, radius_m } => {
                Self { kind: "glued", centroid_m: centre_m, radius_m, stiffness_n_per_m: None }
            }
        }
    }
}
