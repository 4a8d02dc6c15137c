//! The points of integration of the body: displacement gradients there, and the forces of stresses given there.

use crate::fem::{Space, barycentric_gradients, tet_quadrature};
use crate::geometry::{Mat3, Vec3};
use rayon::prelude::*;

/// Volume (m³) and displacement gradient of every point, cell by cell.
pub(super) fn gradients(space: &Space, u: &[f64]) -> Vec<(f64, Mat3)> {
    let cells: Vec<Vec<(f64, Mat3)>> = (0..space.cells().len() as u32)
        .into_par_iter()
        .map(|cell| {
            let nodes = space.cell(cell);
            let mut points = Vec::new();
            each(space, cell, |shape, volume| points.push((volume, gradient(u, nodes, shape))));
            points
        })
        .collect();
    cells.concat()
}

/// Forces (N) on all components by the first Piola–Kirchhoff stress (Pa) that `stress` answers for the number of a point,
/// in the order of [`gradients`], and the gradient of `u` there: ∫ P ∇N dV.
pub(super) fn forces(space: &Space, u: &[f64], stress: impl Fn(usize, &Mat3) -> Mat3 + Sync) -> Vec<f64> {
    let rule = tet_quadrature(space.order().stiffness_degree()).len();
    let cells: Vec<[Vec3; 10]> = (0..space.cells().len())
        .into_par_iter()
        .map(|cell| {
            let nodes = space.cell(cell as u32);
            let (mut out, mut point) = ([Vec3::zeros(); 10], rule * cell);
            each(space, cell as u32, |shape, volume| {
                let p = stress(point, &gradient(u, nodes, shape)) * volume;
                out.iter_mut().zip(shape).for_each(|(f, g)| *f += p * g);
                point += 1;
            });
            out
        })
        .collect();
    let mut all = vec![0.0; space.components()];
    for (nodes, out) in space.cells().zip(&cells) {
        for (&node, f) in nodes.iter().zip(out) {
            (0..3).for_each(|i| all[3 * node as usize + i] += f[i]);
        }
    }
    all
}

/// Visits the points of a cell: gradients of its shape functions (1/m), volume (m³).
fn each(space: &Space, cell: u32, mut visit: impl FnMut(&[Vec3], f64)) {
    let (corner, volume) = barycentric_gradients(&space.corners(cell));
    let order = space.order();
    for (l, weight) in tet_quadrature(order.stiffness_degree()) {
        visit(&order.cell_gradient(l, &corner)[..order.cell_nodes()], weight * volume);
    }
}

fn gradient(u: &[f64], nodes: &[u32], shape: &[Vec3]) -> Mat3 {
    let part = |(&n, g): (&u32, &Vec3)| {
        let n = 3 * n as usize;
        Vec3::new(u[n], u[n + 1], u[n + 2]) * g.transpose()
    };
    nodes.iter().zip(shape).map(part).sum()
}
