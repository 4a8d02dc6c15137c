//! The phantom under small loads: isotropic linear elasticity, condensed to what touches and what is watched.
//!
//! For a homogeneous block the stiffness is E K₁. One factorisation of K₁ gives the compliance between all
//! supports and from them to all watched points; what then varies (modulus, spring stiffness, which tip is in
//! contact) is dense algebra on a few dozen numbers, and exact, because tips and patches pull with a fixed
//! distribution of traction.

use super::SimError;
use super::quadratic::{NODES, gauss_points};
use super::supports::Support;
use super::unknowns::{Row, Unknowns};
use crate::sparse::{Analysis, Ordering, Pattern, SymmetricMatrix};
use nalgebra::{DMatrix, Matrix3};
use std::collections::HashMap;
use std::sync::Arc;

/// Compliance of the block at E = 1 Pa; block (i, j) of three rows and columns holds the displacement along
/// each axis at i from unit forces along each axis at j.
#[derive(Debug, Clone)]
pub(super) struct Compliance {
    /// Among the supports (m/N · Pa), 3 supports × 3 supports.
    pub(super) supports: DMatrix<f64>,
    /// From the supports to the watched points, 3 points × 3 supports.
    pub(super) watched: DMatrix<f64>,
}

/// How one tip acts while it is in contact, all restraints in place.
#[derive(Debug, Clone)]
pub(super) struct TipResponse {
    /// Force of the tip on the phantom for a displacement of the tip (N/m).
    pub(super) stiffness: Matrix3<f64>,
    /// Displacement of the watched points for a displacement of the tip, 3 points × 3.
    pub(super) watched: DMatrix<f64>,
}

/// Stiffness of one box at E = 1 Pa: 60 × 60, row by row.
///
/// K[a i, b j] = ∫ λ ∂ᵢNₐ ∂ⱼN_b + μ ∂ⱼNₐ ∂ᵢN_b + μ δᵢⱼ ∇Nₐ·∇N_b, the weak form of λ tr ε 1 + 2 μ ε.
pub(super) fn element_stiffness(size: [f64; 3], poisson_ratio: f64) -> Vec<f64> {
    let lambda = poisson_ratio / ((1.0 + poisson_ratio) * (1.0 - 2.0 * poisson_ratio));
    let mu = 0.5 / (1.0 + poisson_ratio);
    let n = 3 * NODES;
    let mut stiffness = vec![0.0; n * n];
    for point in gauss_points(size) {
        for (a, ga) in point.gradient.iter().enumerate() {
            for (b, gb) in point.gradient.iter().enumerate() {
                let dot = ga[0] * gb[0] + ga[1] * gb[1] + ga[2] * gb[2];
                for i in 0..3 {
                    let row = &mut stiffness[(3 * a + i) * n + 3 * b..][..3];
                    for (j, entry) in row.iter_mut().enumerate() {
                        let shear = if i == j { dot } else { 0.0 };
                        *entry += point.weight * (lambda * ga[i] * gb[j] + mu * (ga[j] * gb[i] + shear));
                    }
                }
            }
        }
    }
    stiffness
}

/// The stiffness of the block at E = 1 Pa, held by its glue.
pub(super) fn assemble(unknowns: &Unknowns, poisson_ratio: f64) -> Result<SymmetricMatrix, SimError> {
    if !(poisson_ratio > -1.0 && poisson_ratio < 0.5) {
        return Err(SimError::PoissonRatio { value: poisson_ratio });
    }
    let mut stiffness = SymmetricMatrix::zeros(pattern(unknowns));
    // Boxes of one shape share their stiffness; equal sizes differ by rounding, so they are compared in nm.
    let mut shapes: HashMap<[i64; 3], Vec<f64>> = HashMap::new();
    for element in &unknowns.elements {
        let size = unknowns.mesh.size(element.cell);
        let full = shapes
            .entry(size.map(|l| (l * 1e9).round() as i64))
            .or_insert_with(|| element_stiffness(size, poisson_ratio));
        stiffness.add_element(&element.unknowns, &element.reduce(full));
    }
    Ok(stiffness)
}

/// Which unknowns meet in an element.
pub(super) fn pattern(unknowns: &Unknowns) -> Arc<Pattern> {
    let elements = unknowns.elements.iter().map(|e| e.unknowns.as_slice());
    Arc::new(Pattern::from_elements(unknowns.dimension(), elements))
}

/// A good order of elimination.
pub(super) fn analyse(unknowns: &Unknowns, pattern: &Arc<Pattern>) -> Result<Analysis, SimError> {
    let position: Vec<[f64; 3]> = unknowns.position.iter().flat_map(|&p| [p; 3]).collect();
    Ok(Analysis::new(pattern, Ordering::NestedDissection { position: &position })?)
}

/// Unit forces on every row along every axis, one column each: column 3 r + c.
pub(super) fn unit_loads(rows: &[&Row], dimension: usize) -> Vec<f64> {
    let mut loads = vec![0.0; 3 * rows.len() * dimension];
    for (column, values) in loads.chunks_exact_mut(dimension).enumerate() {
        for &(node, weight) in rows[column / 3] {
            values[3 * node as usize + column % 3] = weight;
        }
    }
    loads
}

/// What rows see of displacement fields given one a column: 3 rows × columns.
pub(super) fn seen(rows: &[&Row], fields: &[f64], dimension: usize) -> DMatrix<f64> {
    let columns = fields.len() / dimension;
    DMatrix::from_fn(3 * rows.len(), columns, |i, j| {
        let field = &fields[j * dimension..][..dimension];
        rows[i / 3].iter().map(|&(node, weight)| weight * field[3 * node as usize + i % 3]).sum()
    })
}

/// Condenses the block to its supports and watched points.
pub(super) fn condense(
    unknowns: &Unknowns,
    poisson_ratio: f64,
    supports: &[&Row],
    watched: &[&Row],
) -> Result<Compliance, SimError> {
    let stiffness = assemble(unknowns, poisson_ratio)?;
    let factor = analyse(unknowns, stiffness.pattern())?.factor(&stiffness)?;
    let dimension = unknowns.dimension();
    let mut fields = unit_loads(supports, dimension);
    factor.solve_in_place(&mut fields, 3 * supports.len())?;
    let within = seen(supports, &fields, dimension);
    Ok(Compliance {
        supports: 0.5 * (&within + within.transpose()),
        watched: seen(watched, &fields, dimension),
    })
}

impl Compliance {
    /// The response to support `tip` being moved, with every support of `held` (indices into the condensed
    /// ones) in place: (C / E + D) f = g, f the force of the supports on the phantom.
    pub(super) fn respond(
        &self,
        young_modulus_pa: f64,
        tip: usize,
        held: &[(usize, &Support)],
    ) -> Result<TipResponse, SimError> {
        let active: Vec<usize> = std::iter::once(tip).chain(held.iter().map(|h| h.0)).collect();
        let column = |i: usize| 3 * active[i / 3] + i % 3;
        let n = 3 * active.len();
        let mut system =
            DMatrix::from_fn(n, n, |i, j| self.supports[(column(i), column(j))] / young_modulus_pa);
        for (h, (_, support)) in held.iter().enumerate() {
            for c in 3 * (h + 1)..3 * (h + 2) {
                system[(c, c)] += support.compliance;
            }
        }
        let mut force = DMatrix::zeros(n, 3);
        force.fill_diagonal(1.0);
        let factor = system.cholesky().ok_or(SimError::SingularSupports { supports: active.len() })?;
        factor.solve_mut(&mut force);
        let watched = DMatrix::from_fn(self.watched.nrows(), n, |i, j| self.watched[(i, column(j))]);
        Ok(TipResponse {
            stiffness: force.fixed_view::<3, 3>(0, 0).into_owned(),
            watched: watched * &force / young_modulus_pa,
        })
    }
}
