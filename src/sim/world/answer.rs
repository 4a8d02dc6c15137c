//! What a world conceals, to be written beside its recording.

use super::effect::Effect;
use super::memory::{Memory, relaxed};
use super::plan::{Hold, World};
use crate::sim::truth::TrueRestraint;
use serde::Serialize;
use std::collections::BTreeMap;

/// The entry of the one effect that is not in the world but in what the operator states of it.
pub(super) const POISSON_RATIO: &str = "poisson-ratio";

/// The answer to a recording, in the terms of `diagnosis.json` and the physics catalogue.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Answer {
    /// Name of the recording.
    pub recording: String,
    /// Seed of the noise.
    pub seed: u64,
    /// Entries of the physics catalogue; `unexplained` for what it does not list; empty for the baseline.
    pub physics: Vec<&'static str>,
    /// Equilibrium modulus at small strain (Pa).
    pub young_modulus_pa: f64,
    /// Modulus before anything relaxes (Pa).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub instantaneous_modulus_pa: Option<f64>,
    /// Poisson's ratio.
    pub poisson_ratio: f64,
    /// Effects outside the catalogue, in words.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
    /// Parameters by physics id and parameter id.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub parameters: BTreeMap<&'static str, BTreeMap<&'static str, Figure>>,
    /// What holds the search surface.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub restraint: Vec<TrueRestraint>,
}

/// One parameter.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Figure {
    /// A number (SI).
    Number(f64),
    /// Terms of a series or components (SI).
    List(Vec<f64>),
    /// A name, of a law for instance.
    Name(&'static str),
}

impl Answer {
    /// What `world` conceals.
    pub fn of(world: &World) -> Self {
        let mut physics = Vec::new();
        let mut parameters: BTreeMap<_, BTreeMap<_, _>> = BTreeMap::new();
        if world.stated_poisson_ratio != world.phantom.poisson_ratio {
            physics.push(POISSON_RATIO);
            let figure = Figure::Number(world.phantom.poisson_ratio);
            parameters.insert(POISSON_RATIO, BTreeMap::from([("poisson_ratio", figure)]));
        }
        let mut notes = Vec::new();
        for effect in &world.effects {
            let id = effect.entry();
            if !physics.contains(&id) {
                physics.push(id);
            }
            if let Effect::Foreign(foreign) = effect {
                notes.push(format!("not in the catalogue: {}", foreign.note()));
            }
            let own = effect.parameters();
            if !own.is_empty() {
                parameters.entry(id).or_default().extend(own);
            }
        }
        let instantaneous = world.effects.iter().find_map(|effect| match effect {
            Effect::Memory(Memory::Relaxation { terms }) => {
                Some(world.young_modulus_pa / (1.0 - relaxed(terms)))
            }
            _ => None,
        });
        Self {
            recording: world.name.clone(),
            seed: world.seed,
            physics,
            young_modulus_pa: world.young_modulus_pa,
            instantaneous_modulus_pa: instantaneous,
            poisson_ratio: world.phantom.poisson_ratio,
            note: (!notes.is_empty()).then(|| notes.join("; ")),
            parameters,
            restraint: world.holds.iter().filter_map(|hold| restraint(world, hold)).collect(),
        }
    }
}

/// A hold in the terms of the answer; none when the phantom has no such place.
fn restraint(world: &World, hold: &Hold) -> Option<TrueRestraint> {
    Some(match *hold {
        Hold::Springs { patch, stiffness_n_per_m } => {
            let disc = world.phantom.patches.get(patch)?;
            TrueRestraint {
                kind: "springs",
                centroid_m: disc.centre_m,
                radius_m: disc.radius_m,
                stiffness_n_per_m: Some(stiffness_n_per_m),
            }
        }
        Hold::Glued { spot } => {
            let disc = world.phantom.spots.get(spot)?;
            TrueRestraint {
                kind: "glued",
                centroid_m: disc.centre_m,
                radius_m: disc.radius_m,
                stiffness_n_per_m: None,
            }
        }
    })
}
