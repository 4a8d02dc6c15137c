//! What a body with nodal restraints needs of the elements: the dense compliance between the search nodes,
//! the observed points and the load, for a unit Young's modulus, with the known supports holding.
//!
//! With `u = (E K₁ + Σⱼ kⱼ Mⱼ)⁻¹ f`, everything that the inverse methods here do happens in the blocks of
//! `K₁⁻¹`: `C_SS` (3 Nₛ × 3 Nₛ, 1/m), `C_OS` (3 Nₒ × 3 Nₛ), and in the displacement of the free body under the
//! load, `c_S`, `c_O` (N/m, to be divided by E). Component `3 j + i` is component `i` of the j-th point. The
//! price is one sparse solve per search component and one for the load.

use super::SolveError;
use crate::fem::{FemError, Functional, Model, Spot, SpotKind};
use crate::geometry::Vec3;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// The condensed body under one load.
#[derive(Debug, Clone)]
pub struct Condensed {
    /// Compliance of the search nodes (3 Nₛ × 3 Nₛ, 1/m).
    pub search_search: DMatrix<f64>,
    /// Displacement of the observed points under forces at the search nodes (3 Nₒ × 3 Nₛ, 1/m).
    pub observed_search: DMatrix<f64>,
    /// E times the displacement of the search nodes under the load, restraints absent (3 Nₛ, N/m).
    pub search_load: DVector<f64>,
    /// E times the displacement of the observed points under the load, restraints absent (3 Nₒ, N/m).
    pub observed_load: DVector<f64>,
    /// E times the work of the load on its own displacement, restraints absent (N²/m).
    pub load_load: f64,
}

/// The body condensed under several loads, of which any combination may act.
#[derive(Debug, Clone)]
pub struct Loaded {
    /// Compliance of the search nodes (3 Nₛ × 3 Nₛ, 1/m).
    pub search_search: DMatrix<f64>,
    /// Displacement of the observed points under forces at the search nodes (3 Nₒ × 3 Nₛ, 1/m).
    pub observed_search: DMatrix<f64>,
    /// E times the displacement of the search nodes under each load (3 Nₛ × loads).
    pub search_loads: DMatrix<f64>,
    /// E times the displacement of the observed points under each load (3 Nₒ × loads).
    pub observed_loads: DMatrix<f64>,
    /// E times the work of each load on the displacement of each (loads × loads).
    pub load_loads: DMatrix<f64>,
}

impl Loaded {
    /// Condenses `model` onto the places `search` and the points `observed`, under `loads`: nodal forces
    /// (`[3 n + i]`, N) each.
    ///
    /// # Errors
    /// What the sparse solves report.
    pub fn new(
        model: &Model,
        search: &[Spot],
        observed: &[Spot],
        loads: &[Vec<f64>],
    ) -> Result<Self, FemError> {
        let components = model.space().components();
        let mut forces: Vec<Vec<f64>> = Vec::with_capacity(3 * search.len() + loads.len());
        for functional in search.iter().flat_map(|s| &s.weights) {
            let mut unit = vec![0.0; components];
            functional.iter().for_each(|&(c, w)| unit[c as usize] += w);
            forces.push(unit);
        }
        forces.extend_from_slice(loads);
        let mut unit_fields = model.displace(forces)?;
        let load_fields = unit_fields.split_off(3 * search.len());
        let at = |places: &[Spot], fields: &[Vec<f64>]| {
            let values = fields.iter().flat_map(|f| places.iter().flat_map(|s| <[f64; 3]>::from(s.of(f))));
            DMatrix::from_iterator(3 * places.len(), fields.len(), values)
        };
        let raw = at(search, &unit_fields);
        let work = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(f, u)| f * u).sum();
        Ok(Self {
            search_search: 0.5 * (&raw + raw.transpose()),
            observed_search: at(observed, &unit_fields),
            search_loads: at(search, &load_fields),
            observed_loads: at(observed, &load_fields),
            load_loads: DMatrix::from_fn(loads.len(), loads.len(), |i, j| work(&loads[i], &load_fields[j])),
        })
    }

    /// The body under `share` (one entry a load) of its loads, seen at the observed points `seen` alone.
    pub fn under(&self, share: &DVector<f64>, seen: &[usize]) -> Condensed {
        let rows: Vec<usize> = seen.iter().flat_map(|&p| 3 * p..3 * p + 3).collect();
        Condensed {
            search_search: self.search_search.clone(),
            observed_search: self.observed_search.select_rows(&rows),
            search_load: &self.search_loads * share,
            observed_load: (&self.observed_loads * share).select_rows(&rows),
            load_load: share.dot(&(&self.load_loads * share)),
        }
    }
}

impl Condensed {
    /// Condenses `model` onto the places `search`, where springs may act, and the points `observed`, under
    /// forces (N) at the places `load`. A node is a place whose weights are 1.
    ///
    /// # Errors
    /// What the sparse solves report.
    pub fn new(
        model: &Model,
        search: &[Spot],
        observed: &[Spot],
        load: &[(Spot, Vec3)],
    ) -> Result<Self, FemError> {
        let mut applied = vec![0.0; model.space().components()];
        for (spot, force) in load {
            for (functional, f) in spot.weights.iter().zip(force) {
                functional.iter().for_each(|&(c, w)| applied[c as usize] += w * f);
            }
        }
        let loaded = Loaded::new(model, search, observed, &[applied])?;
        Ok(Self {
            search_load: loaded.search_loads.column(0).into_owned(),
            observed_load: loaded.observed_loads.column(0).into_owned(),
            load_load: loaded.load_loads[(0, 0)],
            search_search: loaded.search_search,
            observed_search: loaded.observed_search,
        })
    }

    /// Number of search nodes.
    pub fn search_nodes(&self) -> usize {
        self.search_load.len() / 3
    }

    /// Number of observed points.
    pub fn observed_points(&self) -> usize {
        self.observed_load.len() / 3
    }

    /// The Cholesky factor of the search nodes' compliance.
    ///
    /// # Errors
    /// [`SolveError::NotPositiveDefinite`] when a search node is held or named twice.
    pub(super) fn search_factor(&self) -> Result<Cholesky<f64, Dyn>, SolveError> {
        self.search_search.clone().cholesky().ok_or(SolveError::NotPositiveDefinite {
            what: "the compliance of the search nodes",
            size: self.search_load.len(),
        })
    }
}

/// Node `node` at `position` (m) as a place.
pub(super) fn node_spot(node: u32, position: Vec3) -> Spot {
    let weights = [0, 1, 2].map(|i| -> Functional { vec![(3 * node + i, 1.0)] });
    Spot { weights, kind: SpotKind::Marker { foot: position, offset: Vec3::zeros() } }
}
