//! A linear elastic body with any component prescribed and any load, put together from the cells' stiffness:
//! what the tests need and the program does not.

use crate::linear_fields::Field;
use phantom_rig::fem::{Space, barycentric_gradients, cell_stiffness, tet_quadrature, triangle_quadrature};
use phantom_rig::geometry::Vec3;
use phantom_rig::mesh::TetMesh;
use phantom_rig::sparse::{Analysis, Ordering, Pattern, SymmetricMatrix};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::sync::Arc;

/// Moves the nodes of a block from the origin to `size` by `step`, each side's nodes within their side.
pub(crate) fn moved(mesh: &mut TetMesh, size: [f64; 3], mut step: impl FnMut(&Vec3) -> Vec3) {
    for p in &mut mesh.nodes {
        let by = step(p);
        for axis in 0..3 {
            if p[axis] > 1e-9 * size[axis] && p[axis] < (1.0 - 1e-9) * size[axis] {
                p[axis] += by[axis];
            }
        }
    }
}

/// Moves every node by up to `share` of the cell's edge, as [`moved`] does.
pub(crate) fn jittered(mesh: &mut TetMesh, size: [f64; 3], cells: [usize; 3], share: f64, seed: u64) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    moved(mesh, size, |_| {
        Vec3::from_fn(|i, _| random.random_range(-share..share) * size[i] / cells[i] as f64)
    });
}

/// Prescribes the field on the whole boundary.
pub(crate) fn on_boundary(space: &Space, field: &impl Field) -> Vec<Option<f64>> {
    let mut prescribed = vec![None; space.components()];
    for face in 0..space.faces().len() {
        for &n in space.face_nodes(face) {
            let u = field.value(&space.nodes()[n as usize]);
            for i in 0..3 {
                prescribed[3 * n as usize + i] = Some(u[i]);
            }
        }
    }
    prescribed
}

/// Nodal forces of the body force that keeps a field in equilibrium.
pub(crate) fn body_force(space: &Space, field: &impl Field, nu: f64) -> Vec<f64> {
    let rule = tet_quadrature(6);
    let mut force = vec![0.0; space.components()];
    for (cell, nodes) in space.cells().enumerate() {
        let corners = space.corners(cell as u32);
        let (_, volume) = barycentric_gradients(&corners);
        for (l, w) in &rule {
            let p: Vec3 = corners.iter().zip(l).map(|(c, l)| c * *l).sum();
            let b = field.body_force(&p, nu) * (w * volume);
            for (&node, n) in nodes.iter().zip(space.order().cell_shape(*l)) {
                for i in 0..3 {
                    force[3 * node as usize + i] += n * b[i];
                }
            }
        }
    }
    force
}

/// Nodal forces of a uniform traction on a named surface.
pub(crate) fn traction(space: &Space, surface: &str, traction: Vec3) -> Vec<f64> {
    let mut force = vec![0.0; space.components()];
    for &face in space.surface(surface) {
        let area = space.face_triangle(face).area();
        for (l, w) in triangle_quadrature(2) {
            for (&node, n) in space.face_nodes(face).iter().zip(space.order().face_shape(l)) {
                for i in 0..3 {
                    force[3 * node as usize + i] += n * w * area * traction[i];
                }
            }
        }
    }
    force
}

/// Nodal displacement for a unit modulus.
pub(crate) fn solve(space: &Space, nu: f64, prescribed: &[Option<f64>], force: &[f64]) -> Vec<f64> {
    let mut unknown = vec![None; space.components()];
    let mut position = Vec::new();
    let mut rhs = Vec::new();
    for c in 0..space.components() {
        if prescribed[c].is_none() {
            unknown[c] = Some(position.len() as u32);
            let p = space.nodes()[c / 3];
            position.push([p.x, p.y, p.z]);
            rhs.push(force[c]);
        }
    }
    let cells: Vec<Vec<usize>> = space
        .cells()
        .map(|cell| cell.iter().flat_map(|&n| (0..3).map(move |i| 3 * n as usize + i)).collect())
        .collect();
    let lists: Vec<Vec<u32>> =
        cells.iter().map(|cell| cell.iter().filter_map(|&c| unknown[c]).collect()).collect();
    let pattern = Arc::new(Pattern::from_elements(rhs.len(), lists.iter().map(Vec::as_slice)));
    let mut matrix = SymmetricMatrix::zeros(Arc::clone(&pattern));
    for (index, (cell, list)) in cells.iter().zip(&lists).enumerate() {
        let k = cell_stiffness(space, index as u32, nu);
        let side = cell.len();
        let mut free = Vec::with_capacity(list.len() * list.len());
        for (a, &to) in cell.iter().enumerate() {
            let Some(row) = unknown[to] else { continue };
            for (b, &from) in cell.iter().enumerate() {
                match prescribed[from] {
                    None => free.push(k[a * side + b]),
                    Some(value) => rhs[row as usize] -= k[a * side + b] * value,
                }
            }
        }
        matrix.add_element(list, &free);
    }
    let analysis =
        Analysis::new(&pattern, Ordering::NestedDissection { position: &position }).expect("an order");
    let factor = analysis.factor(&matrix).expect("held against rigid motion");
    factor.solve_in_place(&mut rhs, 1).expect("the right length");
    unknown
        .iter()
        .zip(prescribed)
        .map(|(u, value)| u.map_or_else(|| value.unwrap_or_default(), |u| rhs[u as usize]))
        .collect()
}
