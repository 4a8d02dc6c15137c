//! A body on elements, and where dead loads take its markers.

use super::super::error::InverseError;
use super::super::lift::entered;
use super::case::{CaseMarker, DeadLoad};
use crate::fem::finite::{Controls, Equilibrium, FiniteError, HeldBody, Loads, Rider, Sensitivity, Solid};
use crate::fem::material::{Law, Material, Moduli, Parameter};
use crate::fem::{FemError, Order, Space, Spot, wrench_loads};
use crate::geometry::Vec3;
use crate::mesh::{SurfaceIndex, TetMesh};
use std::sync::Arc;

/// Names of the surfaces, as the bundle format has them.
pub(super) const FIXED: &str = "fixed";
const OBSERVED: &str = "observed";

/// A body that is held and can be loaded.
pub(super) struct Body {
    held: HeldBody,
    index: SurfaceIndex,
    poisson_ratio: f64,
}

/// A body under a load, and how that changes with the modulus.
pub(super) struct State {
    /// The equilibrium, to begin the next one from.
    pub(super) at: Equilibrium,
    /// Derivative of the displacement by the logarithm of the modulus (m).
    by_log_modulus: Vec<f64>,
}

/// Where a load takes a marker.
pub(super) struct Carried {
    /// Displacement (m).
    pub(super) moved: Vec3,
    /// Its derivative by the logarithm of the modulus (m).
    pub(super) by_log_modulus: Vec3,
    /// Whether the marker stands on the disc that is loaded: there the displacement depends on how the load is spread.
    pub(super) on_load: bool,
}

/// What it means for a load that the search for its equilibrium ended so.
fn not_carried(error: FiniteError, load: &DeadLoad) -> InverseError {
    match error {
        FiniteError::OutOfIterations { .. }
        | FiniteError::LoadStepTooSmall { .. }
        | FiniteError::TangentNotPositiveDefinite { .. }
        | FiniteError::LineSearch { .. }
        | FiniteError::Cell { .. } => {
            InverseError::NoEquilibrium { force_n: load.force_n.into(), source: error }
        }
        other => other.into(),
    }
}

impl Body {
    /// Quadratic elements on `mesh`; loads on discs are spread exactly on any mesh.
    pub(super) fn new(mesh: &TetMesh, poisson_ratio: f64) -> Result<Self, InverseError> {
        let space = Arc::new(Space::new(mesh, Order::P2).map_err(FemError::from)?);
        let held = HeldBody::clamped(space, FIXED)?;
        let index = SurfaceIndex::new(mesh, mesh.surface(OBSERVED));
        Ok(Self { held, index, poisson_ratio })
    }

    /// Unknowns solved for.
    pub(super) fn unknowns(&self) -> usize {
        self.held.free().len()
    }

    /// The neo-Hookean body of this modulus (Pa) under `load`, sought from `start`.
    pub(super) fn under(
        &self,
        load: &DeadLoad,
        modulus: f64,
        start: Option<&Equilibrium>,
    ) -> Result<State, InverseError> {
        let space = self.held.space();
        let material = Material::new(Moduli::new(modulus, self.poisson_ratio)?, Law::NeoHookean)?;
        let solid = Solid::homogeneous(material);
        let spot = Spot::disc(space, &entered(space, &load.direction), &load.site, load.radius_m)?;
        let mut loads = Loads { body_force: load.weight_n_m3, ..Loads::default() };
        let sizes = load.force_n.iter().chain(load.torque_nm.iter());
        for (mode, &size) in wrench_loads(space, &spot, &load.site)?.iter().zip(sizes) {
            loads.forces.extend(mode.iter().filter(|_| size != 0.0).map(|&(c, w)| (c, w * size)));
        }
        let refused = |error: FiniteError| not_carried(error, load);
        let at = self.held.equilibrium(&solid, &loads, start, &Controls::default()).map_err(refused)?;
        let change = self
            .held
            .linearise(&solid, &at)
            .map_err(refused)?
            .change(&Sensitivity::Material(Parameter::YoungModulus))?
            .displacement;
        Ok(State { at, by_log_modulus: change.iter().map(|c| c * modulus).collect() })
    }

    /// Where a state under `load` takes `markers`.
    pub(super) fn carried(
        &self,
        state: &State,
        load: &DeadLoad,
        markers: &[CaseMarker],
    ) -> Result<Vec<Carried>, InverseError> {
        let u = state.at.displacement();
        let of = |marker: &CaseMarker| {
            let rider = Rider::new(self.held.space(), &self.index, OBSERVED, &marker.rest)?;
            let to_site = (rider.foot() - load.site).norm();
            Ok(Carried {
                moved: rider.displacement(u),
                by_log_modulus: rider.change(u, &state.by_log_modulus),
                on_load: load.force_n.norm() > 0.0 && to_site < load.radius_m,
            })
        };
        markers.iter().map(of).collect()
    }
}
