//! Internal forces and stiffness of the whole block for one law, with what each point has been through.

use super::material::Material;
use crate::geometry::Mat3;
use crate::sim::SimError;
use crate::sim::legendre::gauss_legendre;
use crate::sim::linear::{analyse, pattern};
use crate::sim::quadratic::{NODES, gradient};
use crate::sim::unknowns::Unknowns;
use crate::sparse::{Analysis, Pattern, SymmetricMatrix};
use std::collections::HashMap;
use std::sync::Arc;

/// Weight (m³) and gradients of the shape functions (1/m) at one point.
type Point = (f64, [[f64; 3]; NODES]);

/// The block on one mesh.
pub(super) struct Solid<'a> {
    pub(super) unknowns: &'a Unknowns,
    material: Material,
    rules: Vec<Vec<Point>>,
    rule_of: Vec<usize>,
    pattern: Arc<Pattern>,
    pub(super) analysis: Analysis,
    /// Points in a box.
    points: usize,
    /// Largest energy density so far at each point, box by box (J/m³).
    reached: Vec<f64>,
    /// Factor on it: a point that is as far as it ever was goes on (below 1) or back (above 1).
    pub(super) side: f64,
}

impl<'a> Solid<'a> {
    /// With `along` points of integration along each edge of a box.
    ///
    /// Why two may be better than three: the 20-node box with eight points is as accurate and less stiff where the material
    /// hardly changes its volume (reduced integration: Zienkiewicz, Taylor & Too 1971), and takes a third of the time; its
    /// modes without energy do not fit together in neighbouring boxes.
    pub(super) fn new(unknowns: &'a Unknowns, material: Material, along: usize) -> Result<Self, SimError> {
        let gauss = gauss_legendre(along);
        let rule = |size: [f64; 3]| -> Vec<Point> {
            let mut points = Vec::with_capacity(along.pow(3));
            for &(x, wx) in &gauss {
                for &(y, wy) in &gauss {
                    for &(z, wz) in &gauss {
                        let weight = wx * wy * wz * size[0] * size[1] * size[2];
                        points.push((weight, gradient([x, y, z].map(|s| 2.0 * s - 1.0), size)));
                    }
                }
            }
            points
        };
        let mut rules = Vec::new();
        // Equal sizes differ by rounding, so shapes are compared in nm.
        let mut shapes: HashMap<[i64; 3], usize> = HashMap::new();
        let rule_of = unknowns
            .elements
            .iter()
            .map(|element| {
                let size = unknowns.mesh.size(element.cell);
                *shapes.entry(size.map(|l| (l * 1e9).round() as i64)).or_insert_with(|| {
                    rules.push(rule(size));
                    rules.len() - 1
                })
            })
            .collect();
        let pattern = pattern(unknowns);
        let analysis = analyse(unknowns, &pattern)?;
        let points = along.pow(3);
        let reached = vec![0.0; points * unknowns.elements.len()];
        Ok(Self { unknowns, material, rules, rule_of, pattern, analysis, points, reached, side: 1.0 })
    }

    /// Internal forces (N) and stiffness (N/m) at `u`; `None` where the block is turned inside out.
    pub(super) fn respond(&self, u: &[f64]) -> Option<(Vec<f64>, SymmetricMatrix)> {
        let mut force = vec![0.0; u.len()];
        let mut stiffness = SymmetricMatrix::zeros(self.pattern.clone());
        let mut full = vec![0.0; 9 * NODES * NODES];
        for (e, element) in self.unknowns.elements.iter().enumerate() {
            let nodal = element.nodal(u);
            let mut local = [[0.0; 3]; NODES];
            full.fill(0.0);
            for (p, (weight, slopes)) in self.rules[self.rule_of[e]].iter().enumerate() {
                let reached = self.side * self.reached[self.points * e + p];
                let response = self.material.respond(&displacement_gradient(slopes, &nodal), reached)?;
                let stress = response.stress * *weight;
                for (f, g) in local.iter_mut().zip(slopes) {
                    for (i, f) in f.iter_mut().enumerate() {
                        *f += stress[(i, 0)] * g[0] + stress[(i, 1)] * g[1] + stress[(i, 2)] * g[2];
                    }
                }
                add_tangent(*weight, slopes, &response.tangent, &mut full);
            }
            for &(n, slot, share) in &element.follow {
                for c in 0..3 {
                    force[element.unknowns[3 * slot as usize + c] as usize] += share * local[n as usize][c];
                }
            }
            stiffness.add_element(&element.unknowns, &element.reduce(&full));
        }
        Some((force, stiffness))
    }

    /// Notes how far each point has been strained at `u`, where softening asks for it.
    pub(super) fn remember(&mut self, u: &[f64]) -> Option<()> {
        if self.material.softening.is_none() {
            return Some(());
        }
        for (e, element) in self.unknowns.elements.iter().enumerate() {
            let nodal = element.nodal(u);
            for (p, (_, slopes)) in self.rules[self.rule_of[e]].iter().enumerate() {
                let h = displacement_gradient(slopes, &nodal);
                let reached = &mut self.reached[self.points * e + p];
                *reached = reached.max(self.material.respond(&h, 0.0)?.energy);
            }
        }
        Some(())
    }
}

/// ∂u/∂X.
fn displacement_gradient(slopes: &[[f64; 3]; NODES], nodal: &[[f64; 3]; NODES]) -> Mat3 {
    let mut h = Mat3::zeros();
    for (u, g) in nodal.iter().zip(slopes) {
        for i in 0..3 {
            for a in 0..3 {
                h[(i, a)] += u[i] * g[a];
            }
        }
    }
    h
}

/// K[a i, b j] += w ∂_A Nₐ A_{iAjB} ∂_B N_b, 60 × 60 row by row.
fn add_tangent(weight: f64, slopes: &[[f64; 3]; NODES], tangent: &[[f64; 9]; 9], full: &mut [f64]) {
    for (b, gb) in slopes.iter().enumerate() {
        // A_{iAjB} ∂_B N_b for all i, A and j.
        let half: [[f64; 3]; 9] = std::array::from_fn(|row| {
            std::array::from_fn(|j| {
                let part = &tangent[row][3 * j..3 * j + 3];
                weight * (part[0] * gb[0] + part[1] * gb[1] + part[2] * gb[2])
            })
        });
        for (a, ga) in slopes.iter().enumerate() {
            for i in 0..3 {
                let entries = &mut full[(3 * a + i) * 3 * NODES + 3 * b..][..3];
                let [x, y, z] = [half[3 * i], half[3 * i + 1], half[3 * i + 2]];
                for (j, entry) in entries.iter_mut().enumerate() {
                    *entry += ga[0] * x[j] + ga[1] * y[j] + ga[2] * z[j];
                }
            }
        }
    }
}
