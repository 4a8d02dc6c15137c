//! Energy, internal forces and tangent of the whole body at a displacement.
//!
//! Cells are computed in parallel and added up in the order of their numbers, batch by batch, so that the sums
//! do not depend on the number of threads.

use super::body::components;
use super::cell::{Cell, CellForce, SIDE};
use super::{FiniteError, HeldBody, Solid};
use crate::fem::material::{MaterialError, Parameter};
use crate::sparse::SymmetricMatrix;
use rayon::prelude::*;

/// Cells computed before they are added up: enough work for all threads, little enough memory (4 MB).
const BATCH: usize = 512;

/// Energy and forces of a body.
#[derive(Debug, Clone)]
pub(super) struct Internal {
    /// Stored energy (J).
    pub(super) energy: f64,
    /// f_int on every component (N).
    pub(super) force: Vec<f64>,
    /// Euclidean norm over the free components of Σ |cell force| (N), what cancels in equilibrium, and so the
    /// size that a residual is compared with. Rounding grows with the displacement gradient, not with the
    /// strain, so that a share of the forces of an unturned body is added; else a body that only turns, whose
    /// forces are nothing but rounding, would never be in equilibrium.
    pub(super) scale: f64,
}

/// That share: a body is as exact as its strains down to strains of a thousandth of its turn.
const TURNED: f64 = 1e-3;

/// A tangent and what held components add to it.
pub(super) struct Linear {
    /// K over the free components (N/m).
    pub(super) tangent: SymmetricMatrix,
    /// K_fh δu_h on every unknown (N).
    pub(super) coupling: Vec<f64>,
}

impl HeldBody {
    /// Energy and internal forces at the displacement `u` (m, every component).
    pub(super) fn internal(&self, solid: &Solid, u: &[f64]) -> Result<Internal, FiniteError> {
        let mut sum = Sum::new(self);
        let mut batch = vec![CellForce::ZERO; BATCH];
        self.each_batch(
            solid,
            &mut batch,
            |cell, nodes, out| {
                *out = cell.force(&gather(u, nodes))?;
                Ok(())
            },
            |nodes, out| sum.add(nodes, out),
        )?;
        Ok(sum.finish())
    }

    /// The tangent at `u`, and what moving the held components by `held_step` (m, order of `held()`) adds to
    /// the forces on the free ones.
    pub(super) fn linear(&self, solid: &Solid, u: &[f64], held_step: &[f64]) -> Result<Linear, FiniteError> {
        let mut tangent = self.zero_matrix();
        let mut coupling = vec![0.0; self.free().len()];
        let moves = held_step.iter().any(|&x| x != 0.0);
        let mut step = vec![0.0; if moves { u.len() } else { 0 }];
        if moves {
            for (&c, &x) in self.held().iter().zip(held_step) {
                step[c as usize] = x;
            }
        }
        let side = 3 * self.space().order().cell_nodes();
        let mut batch = vec![vec![0.0; side * side]; BATCH];
        let (mut unknowns, mut values) = (Vec::with_capacity(side), Vec::with_capacity(side * side));
        self.each_batch(
            solid,
            &mut batch,
            |cell, nodes, out| cell.tangent(&gather(u, nodes), out),
            |nodes, stiffness| {
                unknowns.clear();
                values.clear();
                let place: Vec<Option<u32>> = components(nodes).map(|c| self.unknown(c)).collect();
                for (row, unknown) in place.iter().enumerate() {
                    let Some(unknown) = unknown else { continue };
                    unknowns.push(*unknown);
                    for (column, other) in place.iter().enumerate() {
                        if other.is_some() {
                            values.push(stiffness[row * side + column]);
                        } else if moves {
                            let component = 3 * nodes[column / 3] as usize + column % 3;
                            coupling[*unknown as usize] += stiffness[row * side + column] * step[component];
                        }
                    }
                }
                tangent.add_element(&unknowns, &values);
            },
        )?;
        Ok(Linear { tangent, coupling })
    }

    /// ∂f_int/∂(parameter) at fixed displacement, on every component (N per unit of the parameter); cells for
    /// which `counts` says no are left out.
    pub(super) fn force_sensitivity(
        &self,
        solid: &Solid,
        u: &[f64],
        parameter: Parameter,
        counts: impl Fn(usize) -> bool + Sync,
    ) -> Result<Vec<f64>, FiniteError> {
        let mut sum = Sum::new(self);
        let mut batch = vec![CellForce::ZERO; BATCH];
        self.each_batch(
            solid,
            &mut batch,
            |cell, nodes, out| {
                *out = if counts(cell.index) {
                    cell.sensitivity(&gather(u, nodes), parameter)?
                } else {
                    CellForce::ZERO
                };
                Ok(())
            },
            |nodes, out| sum.add(nodes, out),
        )?;
        Ok(sum.finish().force)
    }

    /// The smallest volume ratio J at the corners of all cells, and the cell that has it.
    pub(super) fn least_volume_ratio(&self, solid: &Solid, u: &[f64]) -> Result<(usize, f64), FiniteError> {
        let mut least = (0, f64::INFINITY);
        let mut batch = vec![(0, f64::INFINITY); BATCH];
        self.each_batch(
            solid,
            &mut batch,
            |cell, nodes, out| {
                *out = (cell.index, cell.least_volume_ratio(&gather(u, nodes)));
                Ok(())
            },
            |_, &(cell, ratio)| {
                if ratio < least.1 {
                    least = (cell, ratio);
                }
            },
        )?;
        Ok(least)
    }

    /// Computes the cells of a batch in parallel, then hands them over in the order of their numbers. Of
    /// several cells that fail the first is reported.
    fn each_batch<T: Send>(
        &self,
        solid: &Solid,
        batch: &mut [T],
        compute: impl Fn(&Cell<'_>, &[u32], &mut T) -> Result<(), MaterialError> + Sync,
        mut add: impl FnMut(&[u32], &T),
    ) -> Result<(), FiniteError> {
        let space = self.space();
        let cells = space.cells().len();
        for first in (0..cells).step_by(batch.len()) {
            let used = &mut batch[..BATCH.min(cells - first)];
            let failures: Vec<Option<MaterialError>> = used
                .par_iter_mut()
                .enumerate()
                .with_min_len(16)
                .map(|(at, out)| {
                    let index = first + at;
                    let cell = Cell {
                        index,
                        order: space.order(),
                        corners: space.corners(index as u32),
                        material: solid.material(),
                        relative_modulus: solid.relative_modulus(index),
                    };
                    compute(&cell, space.cell(index as u32), out).err()
                })
                .collect();
            for (at, failure) in failures.into_iter().enumerate() {
                if let Some(source) = failure {
                    return Err(FiniteError::Cell { cell: first + at, source });
                }
            }
            for (at, out) in used.iter().enumerate() {
                add(space.cell((first + at) as u32), out);
            }
        }
        Ok(())
    }
}

/// Displacements of a cell's nodes.
fn gather(u: &[f64], nodes: &[u32]) -> [f64; SIDE] {
    let mut local = [0.0; SIDE];
    for (local, component) in local.iter_mut().zip(components(nodes)) {
        *local = u[component as usize];
    }
    local
}

/// Cell forces, added up.
struct Sum<'a> {
    body: &'a HeldBody,
    energy: f64,
    force: Vec<f64>,
    magnitude: Vec<f64>,
}

impl<'a> Sum<'a> {
    fn new(body: &'a HeldBody) -> Self {
        let components = body.space().components();
        Self { body, energy: 0.0, force: vec![0.0; components], magnitude: vec![0.0; components] }
    }

    fn add(&mut self, nodes: &[u32], cell: &CellForce) {
        self.energy += cell.energy;
        for (component, f) in components(nodes).zip(cell.force) {
            self.force[component as usize] += f;
            self.magnitude[component as usize] += f.abs() + TURNED * cell.unturned;
        }
    }

    fn finish(self) -> Internal {
        let squares: f64 = self.body.free().iter().map(|&c| self.magnitude[c as usize].powi(2)).sum();
        Internal { energy: self.energy, force: self.force, scale: squares.sqrt() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::material::{Law, Material, Moduli};
    use crate::fem::{Order, Space};
    use crate::mesh::{Block, block};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use std::sync::Arc;

    /// Small, clamped at the base, with a modulus that differs from cell to cell.
    fn body(order: Order, law: Law) -> (HeldBody, Solid) {
        let mesh = block(&Block { size_m: [0.03, 0.02, 0.02], cells: [3, 2, 2] }).expect("block");
        let cells = mesh.tets.len();
        let space = Arc::new(Space::new(&mesh, order).expect("space"));
        let moduli = Moduli::new(1e4, 0.47).expect("a proper solid");
        let material = Material::new(moduli, law).expect("a proper law");
        let relative = (0..cells).map(|c| 1.0 + 0.3 * (c % 5) as f64).collect();
        let solid = Solid::graded(material, relative).expect("positive");
        (HeldBody::clamped(space, "z-").expect("held"), solid)
    }

    fn field(rng: &mut ChaCha8Rng, components: usize, size: f64) -> Vec<f64> {
        (0..components).map(|_| size * rng.random_range(-1.0..1.0)).collect()
    }

    const LAWS: [Law; 4] =
        [Law::Linear, Law::NeoHookean, Law::Yeoh { stiffening: 0.9 }, Law::Fung { stiffening: 0.7 }];

    /// At an arbitrary state: Π(u + t d) = Π + t f·d + ½ t² d·K d + O(t³), f(u + t d) = f + t K d + O(t²). Halving
    /// t must divide the remainders by 8 and by 4. `K d` also covers steps of held components.
    #[test]
    fn forces_are_the_slope_of_the_energy_and_the_tangent_that_of_the_forces() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        for order in [Order::P1, Order::P2] {
            for law in LAWS {
                let (body, solid) = body(order, law);
                let n = body.space().components();
                let (u, d) = (field(&mut rng, n, 4e-4), field(&mut rng, n, 1.0));
                let at = body.internal(&solid, &u).expect("not inverted");
                let held_step: Vec<f64> = body.held().iter().map(|&c| d[c as usize]).collect();
                let linear = body.linear(&solid, &u, &held_step).expect("not inverted");
                let free: Vec<f64> = body.free().iter().map(|&c| d[c as usize]).collect();
                let mut product = vec![0.0; free.len()];
                linear.tangent.multiply(&free, &mut product);
                let remainders = |t: f64| {
                    let moved: Vec<f64> = u.iter().zip(&d).map(|(u, d)| u + t * d).collect();
                    let moved = body.internal(&solid, &moved).expect("not inverted");
                    let slope: f64 = at.force.iter().zip(&d).map(|(f, d)| f * d).sum();
                    let energy = (moved.energy - at.energy - t * slope).abs();
                    let force = body.free().iter().zip(product.iter().zip(&linear.coupling)).map(
                        |(&c, (k, coupling))| {
                            let c = c as usize;
                            (moved.force[c] - at.force[c] - t * (k + coupling)).powi(2)
                        },
                    );
                    (energy, force.sum::<f64>().sqrt())
                };
                let (coarse, fine) = (remainders(1e-6), remainders(0.5e-6));
                let energy_order = (coarse.0 / fine.0).log2();
                assert!((energy_order - 2.0).abs() < 0.05, "{order:?} {law:?}: energy {energy_order}");
                let force_order = (coarse.1 / fine.1).log2();
                let rounding = fine.1 < 1e-13 * at.scale;
                assert!(
                    rounding || (force_order - 2.0).abs() < 0.05,
                    "{order:?} {law:?}: force {force_order}"
                );
            }
        }
    }

    /// Without strain the tangent of every law is the linear stiffness of `fem::elasticity`.
    #[test]
    fn the_tangent_at_rest_is_the_linear_stiffness() {
        for order in [Order::P1, Order::P2] {
            for law in LAWS {
                let (body, solid) = body(order, law);
                let rest = vec![0.0; body.space().components()];
                let tangent = body.linear(&solid, &rest, &[]).expect("at rest").tangent;
                let mut linear = body.zero_matrix();
                let side = 3 * order.cell_nodes();
                for (cell, nodes) in body.space().cells().enumerate() {
                    let unit = crate::fem::cell_stiffness(body.space(), cell as u32, 0.47);
                    let young = 1e4 * solid.relative_modulus(cell);
                    let kept: Vec<(usize, u32)> = components(nodes)
                        .enumerate()
                        .filter_map(|(at, c)| body.unknown(c).map(|x| (at, x)))
                        .collect();
                    let unknowns: Vec<u32> = kept.iter().map(|k| k.1).collect();
                    let values: Vec<f64> = kept
                        .iter()
                        .flat_map(|row| kept.iter().map(|column| young * unit[row.0 * side + column.0]))
                        .collect();
                    linear.add_element(&unknowns, &values);
                }
                let largest = linear.values().iter().fold(0.0_f64, |m, v| v.abs().max(m));
                for (a, b) in tangent.values().iter().zip(linear.values()) {
                    assert!((a - b).abs() < 1e-13 * largest, "{order:?} {law:?}: {a} {b}");
                }
            }
        }
    }

    #[test]
    fn the_first_inverted_cell_is_named_with_its_volume_ratio() {
        let (body, solid) = body(Order::P1, Law::NeoHookean);
        let turned: Vec<f64> = body
            .space()
            .nodes()
            .iter()
            .flat_map(|p| [0.0, 0.0, if p.z > 0.015 { -1.5 * p.z } else { 0.0 }])
            .collect();
        let error = body.internal(&solid, &turned).expect_err("inverted");
        let FiniteError::Cell { cell, source: MaterialError::Inverted { jacobian } } = error else {
            panic!("{error}")
        };
        // The upper layer of cells is pulled from z = 0.02 to −0.01: J = (−0.01 − 0.01) / 0.01.
        assert!(body.space().corners(cell as u32).iter().any(|p| p.z > 0.015));
        assert!((jacobian + 2.0).abs() < 1e-12, "{jacobian}");
    }
}
