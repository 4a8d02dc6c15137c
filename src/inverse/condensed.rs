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
        let components = model.space().components();
        let mut forces: Vec<Vec<f64>> = Vec::with_capacity(3 * search.len() + 1);
        for functional in search.iter().flat_map(|s| &s.weights) {
            let mut unit = vec![0.0; components];
            functional.iter().for_each(|&(c, w)| unit[c as usize] += w);
            forces.push(unit);
        }
        let mut applied = vec![0.0; components];
        for (spot, force) in load {
            for (functional, f) in spot.weights.iter().zip(force) {
                functional.iter().for_each(|&(c, w)| applied[c as usize] += w * f);
            }
        }
        forces.push(applied.clone());
        let mut unit_fields = model.displace(forces)?;
        let load_field = &unit_fields.pop().unwrap_or_default();
        let at = |places: &[Spot], field: &Vec<f64>| {
            let values = places.iter().flat_map(|s| <[f64; 3]>::from(s.of(field)));
            DVector::from_iterator(3 * places.len(), values)
        };
        let at_search = |field: &Vec<f64>| at(search, field);
        let at_observed = |field: &Vec<f64>| at(observed, field);
        let column = |f: &dyn Fn(&Vec<f64>) -> DVector<f64>, rows: usize| {
            let columns: Vec<DVector<f64>> = unit_fields.iter().map(f).collect();
            if columns.is_empty() { DMatrix::zeros(rows, 0) } else { DMatrix::from_columns(&columns) }
        };
        let raw = column(&at_search, 3 * search.len());
        Ok(Self {
            search_search: 0.5 * (&raw + raw.transpose()),
            observed_search: column(&at_observed, 3 * observed.len()),
            search_load: at_search(load_field),
            observed_load: at_observed(load_field),
            load_load: applied.iter().zip(load_field).map(|(f, u)| f * u).sum(),
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
