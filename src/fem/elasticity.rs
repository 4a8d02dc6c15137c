//! The stiffness of an isotropic, linear elastic body for a unit Young's modulus.
//!
//! `a(u, v) = ∫ λ div u div v + 2 μ ε(u) : ε(v)` with `λ = ν / ((1 + ν)(1 − 2ν))` and `μ = 1 / (2(1 + ν))`,
//! so that the stiffness of a body with modulus `E` is `E` times what is assembled here. Straight-edged
//! elements are integrated exactly.

use super::element::{barycentric_gradients, tet_quadrature};
use super::space::Space;
use crate::geometry::{Mat3, Vec3};

/// Lamé's constants `(λ, μ)` for a unit Young's modulus. Valid for `−1 < ν < 0.5`.
pub fn lame(poisson_ratio: f64) -> (f64, f64) {
    let nu = poisson_ratio;
    (nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), 0.5 / (1.0 + nu))
}

/// Stress of a displacement gradient `∇u` (`[i, j] = ∂uᵢ/∂xⱼ`) for a unit Young's modulus.
pub fn stress(gradient: &Mat3, poisson_ratio: f64) -> Mat3 {
    let (lambda, mu) = lame(poisson_ratio);
    Mat3::identity() * (lambda * gradient.trace()) + (gradient + gradient.transpose()) * mu
}

/// Stiffness of one cell, row-major, side three times the number of its nodes, unknown `3 a + i` for component
/// `i` at local node `a`.
pub fn cell_stiffness(space: &Space, cell: u32, poisson_ratio: f64) -> Vec<f64> {
    let order = space.order();
    let n = order.cell_nodes();
    let (lambda, mu) = lame(poisson_ratio);
    let (gradient, volume) = barycentric_gradients(&space.corners(cell));
    let points: Vec<([Vec3; 10], f64)> = tet_quadrature(order.stiffness_degree())
        .into_iter()
        .map(|(l, w)| (order.cell_gradient(l, &gradient), w * volume))
        .collect();
    let mut k = vec![0.0; 9 * n * n];
    for a in 0..n {
        for b in 0..=a {
            // G = ∫ ∇Nₐ ⊗ ∇N_b; then K_ab = λ G + μ Gᵀ + μ tr(G) I.
            let mut g = Mat3::zeros();
            for (at, weight) in &points {
                g += at[a] * at[b].transpose() * *weight;
            }
            let block = g * lambda + g.transpose() * mu + Mat3::identity() * (mu * g.trace());
            for i in 0..3 {
                for j in 0..3 {
                    k[(3 * a + i) * 3 * n + 3 * b + j] = block[(i, j)];
                    k[(3 * b + j) * 3 * n + 3 * a + i] = block[(i, j)];
                }
            }
        }
    }
    k
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::element::Order;
    use crate::mesh::TetMesh;

    fn one_cell(order: Order) -> Space {
        let mesh = TetMesh {
            nodes: vec![
                Vec3::new(0.1, 0.0, 0.0),
                Vec3::new(1.2, 0.1, -0.1),
                Vec3::new(0.2, 0.9, 0.1),
                Vec3::new(0.0, 0.3, 1.1),
            ],
            tets: vec![[0, 1, 2, 3]],
            ..TetMesh::default()
        };
        Space::new(&mesh, order).expect("one cell")
    }

    /// Six rigid motions store no energy; a uniform strain stores `½ σ : ε` times the volume.
    #[test]
    fn energy_of_rigid_motion_and_of_uniform_strain() {
        let nu = 0.47;
        for order in [Order::P1, Order::P2] {
            let space = one_cell(order);
            let k = cell_stiffness(&space, 0, nu);
            let n = 3 * order.cell_nodes();
            let energy = |gradient: Mat3, shift: Vec3| {
                let u: Vec<f64> = space
                    .cell(0)
                    .iter()
                    .flat_map(|&a| {
                        let u = gradient * space.nodes()[a as usize] + shift;
                        [u.x, u.y, u.z]
                    })
                    .collect();
                let mut sum = 0.0;
                for i in 0..n {
                    for j in 0..n {
                        sum += 0.5 * u[i] * k[i * n + j] * u[j];
                    }
                }
                sum
            };
            let spin = Mat3::new(0.0, -0.3, 0.2, 0.3, 0.0, -0.7, -0.2, 0.7, 0.0);
            assert!(energy(spin, Vec3::new(1.0, -2.0, 0.5)).abs() < 1e-12);
            let strain = Mat3::new(0.02, 0.01, 0.0, 0.03, -0.01, 0.005, 0.0, 0.02, 0.015);
            let symmetric = (strain + strain.transpose()) * 0.5;
            let (_, volume) = barycentric_gradients(&space.corners(0));
            let expected = 0.5 * stress(&strain, nu).dot(&symmetric) * volume;
            assert!((energy(strain, Vec3::zeros()) / expected - 1.0).abs() < 1e-12);
        }
    }
}
