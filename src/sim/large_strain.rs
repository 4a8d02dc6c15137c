//! Energy, internal forces and stiffness of the whole block under large strain (total Lagrangian).
//!
//! Π = Σ w W(F), f = ∂Π/∂u, K = ∂f/∂u, with F = 1 + Σ uₐ ⊗ ∇Nₐ at the Gauss points of the undeformed boxes.

use super::SimError;
use super::linear::{analyse, pattern};
use super::neo_hookean::NeoHookean;
use super::quadratic::{GaussPoint, NODES, gauss_points};
use super::unknowns::{Element, Unknowns};
use crate::geometry::Mat3;
use crate::sparse::{Analysis, Pattern, SymmetricMatrix};
use std::collections::HashMap;
use std::sync::Arc;

/// The block, ready to be deformed.
pub(super) struct LargeStrain<'a> {
    pub(super) unknowns: &'a Unknowns,
    material: NeoHookean,
    /// Gauss points of each shape of box, and the shape of each element.
    rules: Vec<Vec<GaussPoint>>,
    rule_of: Vec<usize>,
    pattern: Arc<Pattern>,
    pub(super) analysis: Analysis,
}

/// Deformation gradient at a Gauss point.
fn deformation(point: &GaussPoint, nodal: &[[f64; 3]; NODES]) -> Mat3 {
    let mut f = Mat3::identity();
    for (u, gradient) in nodal.iter().zip(&point.gradient) {
        for i in 0..3 {
            for a in 0..3 {
                f[(i, a)] += u[i] * gradient[a];
            }
        }
    }
    f
}

impl<'a> LargeStrain<'a> {
    /// Prepares `unknowns` with one material everywhere.
    pub(super) fn new(unknowns: &'a Unknowns, material: NeoHookean) -> Result<Self, SimError> {
        let mut rules = Vec::new();
        // Equal sizes differ by rounding, so shapes are compared in nm.
        let mut shapes: HashMap<[i64; 3], usize> = HashMap::new();
        let rule_of = unknowns
            .elements
            .iter()
            .map(|element| {
                let size = unknowns.mesh.size(element.cell);
                *shapes.entry(size.map(|l| (l * 1e9).round() as i64)).or_insert_with(|| {
                    rules.push(gauss_points(size));
                    rules.len() - 1
                })
            })
            .collect();
        let pattern = pattern(unknowns);
        let analysis = analyse(unknowns, &pattern)?;
        Ok(Self { unknowns, material, rules, rule_of, pattern, analysis })
    }

    /// Elements with their Gauss points.
    fn elements(&self) -> impl Iterator<Item = (&Element, &[GaussPoint])> {
        let rules = self.rule_of.iter().map(|&r| self.rules[r].as_slice());
        self.unknowns.elements.iter().zip(rules)
    }

    /// Strain energy (J); `None` when the block is turned inside out somewhere.
    pub(super) fn energy(&self, u: &[f64]) -> Option<f64> {
        let mut energy = 0.0;
        for (element, points) in self.elements() {
            let nodal = element.nodal(u);
            for point in points {
                energy += point.weight * self.material.energy(&deformation(point, &nodal))?;
            }
        }
        Some(energy)
    }

    /// Internal forces on the unknowns (N).
    pub(super) fn force(&self, u: &[f64]) -> Option<Vec<f64>> {
        let mut force = vec![0.0; u.len()];
        for (element, points) in self.elements() {
            let nodal = element.nodal(u);
            let mut local = [[0.0; 3]; NODES];
            for point in points {
                let stress = point.weight * self.material.stress(&deformation(point, &nodal))?;
                for (f, g) in local.iter_mut().zip(&point.gradient) {
                    for (i, f) in f.iter_mut().enumerate() {
                        *f += (0..3).map(|a| stress[(i, a)] * g[a]).sum::<f64>();
                    }
                }
            }
            for &(n, slot, weight) in &element.follow {
                for c in 0..3 {
                    force[element.unknowns[3 * slot as usize + c] as usize] += weight * local[n as usize][c];
                }
            }
        }
        Some(force)
    }

    /// Consistent tangent stiffness (N/m).
    pub(super) fn stiffness(&self, u: &[f64]) -> Option<SymmetricMatrix> {
        let mut stiffness = SymmetricMatrix::zeros(self.pattern.clone());
        for (element, points) in self.elements() {
            let nodal = element.nodal(u);
            let mut full = vec![0.0; 9 * NODES * NODES];
            for point in points {
                self.add_tangent(point, &deformation(point, &nodal), &mut full)?;
            }
            stiffness.add_element(&element.unknowns, &element.reduce(&full));
        }
        Some(stiffness)
    }

    /// K[a i, b j] += w ∂_A Nₐ A_{iAjB} ∂_B N_b, 60 × 60 row by row.
    fn add_tangent(&self, point: &GaussPoint, f: &Mat3, full: &mut [f64]) -> Option<()> {
        let tangent = self.material.tangent(f)?;
        for (b, gb) in point.gradient.iter().enumerate() {
            // A_{iAjB} ∂_B N_b for all i, A and j.
            let half: [[f64; 3]; 9] = std::array::from_fn(|row| {
                std::array::from_fn(|j| {
                    let part = &tangent[row][3 * j..3 * j + 3];
                    point.weight * (part[0] * gb[0] + part[1] * gb[1] + part[2] * gb[2])
                })
            });
            for (a, ga) in point.gradient.iter().enumerate() {
                for i in 0..3 {
                    let entries = &mut full[(3 * a + i) * 3 * NODES + 3 * b..][..3];
                    let [x, y, z] = [half[3 * i], half[3 * i + 1], half[3 * i + 2]];
                    for (j, entry) in entries.iter_mut().enumerate() {
                        *entry += ga[0] * x[j] + ga[1] * y[j] + ga[2] * z[j];
                    }
                }
            }
        }
        Some(())
    }
}
