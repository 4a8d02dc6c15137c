//! The stiffness matrix of a clamped elastic block: what the tests and the benchmark of `sparse` solve.
//!
//! P1 tetrahedra, isotropic linear elasticity with E = 1 and ν = 0.45, the side z = 0 held; lengths in m.

use nalgebra::{Matrix3, SMatrix, Vector3};
use phantom_rig::mesh::{Block, TetMesh, block};
use phantom_rig::sparse::{Pattern, SymmetricMatrix};
use std::sync::Arc;

/// Poisson's ratio.
const POISSON: f64 = 0.45;

/// A stiffness matrix, and where its unknowns are.
pub(crate) struct ElasticBlock {
    /// The matrix of the free displacements.
    pub(crate) matrix: SymmetricMatrix,
    /// The node of each unknown (m).
    pub(crate) position: Vec<[f64; 3]>,
}

/// The stiffness of a block cut into `cells` boxes of six tetrahedra; inner nodes are moved by up to `jitter`
/// box edges, in a fixed pattern.
pub(crate) fn elastic_block(size_m: [f64; 3], cells: [usize; 3], jitter: f64) -> ElasticBlock {
    let mut mesh = block(&Block { size_m, cells }).expect("a proper block");
    let edge = Vector3::from_fn(|a, _| size_m[a] / cells[a] as f64);
    for (i, p) in mesh.nodes.iter_mut().enumerate() {
        if (0..3).all(|a| p[a] > 0.0 && p[a] < size_m[a]) {
            *p += Vector3::from_fn(|a, _| jitter * edge[a] * (((i * 3 + a) as f64) * 12.9898).sin());
        }
    }
    stiffness(&mesh)
}

/// The stiffness of `mesh` with all nodes at z = 0 held.
pub(crate) fn stiffness(mesh: &TetMesh) -> ElasticBlock {
    let mut first_unknown = vec![None; mesh.nodes.len()];
    let mut position = Vec::new();
    for (node, p) in mesh.nodes.iter().enumerate() {
        if p.z > 0.0 {
            first_unknown[node] = Some(position.len() as u32);
            position.extend([[p.x, p.y, p.z]; 3]);
        }
    }
    let free: Vec<Vec<u32>> = mesh
        .tets
        .iter()
        .map(|t| t.iter().filter_map(|&n| first_unknown[n as usize]).flat_map(|f| f..f + 3).collect())
        .collect();
    let pattern = Pattern::from_elements(position.len(), free.iter().map(Vec::as_slice));
    let mut matrix = SymmetricMatrix::zeros(Arc::new(pattern));
    for (tet, unknowns) in mesh.tets.iter().zip(&free) {
        let whole = element(&mesh.corners(*tet));
        let kept: Vec<usize> = (0..4)
            .filter(|&i| first_unknown[tet[i] as usize].is_some())
            .flat_map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
            .collect();
        let values: Vec<f64> =
            kept.iter().flat_map(|&i| kept.iter().map(move |&j| (i, j))).map(|ij| whole[ij]).collect();
        matrix.add_element(unknowns, &values);
    }
    ElasticBlock { matrix, position }
}

/// `∫ λ (∇·u)(∇·v) + 2µ ε(u):ε(v)` over one tetrahedron with constant gradients.
fn element(corners: &[Vector3<f64>; 4]) -> SMatrix<f64, 12, 12> {
    let lambda = POISSON / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON));
    let mu = 0.5 / (1.0 + POISSON);
    let edges =
        Matrix3::from_columns(&[corners[1] - corners[0], corners[2] - corners[0], corners[3] - corners[0]]);
    let volume = edges.determinant() / 6.0;
    let inverse = edges.try_inverse().expect("a tetrahedron with volume");
    let mut gradients = [Vector3::zeros(); 4];
    for i in 0..3 {
        gradients[i + 1] = inverse.row(i).transpose();
        gradients[0] -= gradients[i + 1];
    }
    SMatrix::from_fn(|row, column| {
        let (a, i, b, j) = (row / 3, row % 3, column / 3, column % 3);
        let (ga, gb) = (gradients[a], gradients[b]);
        let same = if i == j { ga.dot(&gb) } else { 0.0 };
        volume * (lambda * ga[i] * gb[j] + mu * (ga[j] * gb[i] + same))
    })
}
