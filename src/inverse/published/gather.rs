//! Nodal stiffnesses gathered into patches, so that they can be compared with what is known of a restraint.
//!
//! The paper gives one stiffness a node and compares sums. Here a node carries when its stiffness is at least 1 %
//! of the greatest in size; carrying nodes of one sign that share an edge of the search surface are one patch. Its
//! stiffness is the sum, its centre the mean weighted by stiffness, and its radius that of the disc with the same
//! second moment, though no less than that of the area that belongs to its nodes.

use crate::geometry::Vec3;
use crate::inverse::{Estimate, Patch, PatchKind};
use crate::mesh::TetMesh;
use std::collections::HashMap;

/// A node carries when its stiffness is at least this share of the greatest.
const CARRIES: f64 = 0.01;

/// Patches of `stiffness` (N/m, one each of `nodes`), stiffest first. No deviation is stated.
pub(super) fn gather(mesh: &TetMesh, surface: &str, nodes: &[u32], stiffness: &[f64]) -> Vec<Patch> {
    let greatest = stiffness.iter().fold(0.0_f64, |a, k| a.max(k.abs()));
    let carried: HashMap<u32, f64> = nodes
        .iter()
        .zip(stiffness)
        .filter(|(_, k)| k.abs() > 0.0 && k.abs() >= CARRIES * greatest)
        .map(|(&n, &k)| (n, k))
        .collect();
    let mut area: HashMap<u32, f64> = HashMap::new();
    let mut group: HashMap<u32, u32> = carried.keys().map(|&n| (n, n)).collect();
    for &corners in mesh.surface(surface) {
        let third = mesh.triangle(corners).area() / 3.0;
        for (i, &a) in corners.iter().enumerate() {
            *area.entry(a).or_default() += third;
            let b = corners[(i + 1) % 3];
            let (Some(ka), Some(kb)) = (carried.get(&a), carried.get(&b)) else { continue };
            if ka * kb > 0.0 {
                let (from, to) = (root(&group, a), root(&group, b));
                group.insert(from.max(to), from.min(to));
            }
        }
    }
    let mut members: HashMap<u32, Vec<u32>> = HashMap::new();
    for &n in nodes.iter().filter(|n| carried.contains_key(n)) {
        members.entry(root(&group, n)).or_default().push(n);
    }
    let mut patches: Vec<Patch> = members.into_values().map(|m| patch(mesh, &m, &carried, &area)).collect();
    patches.sort_by(|a, b| key(b).partial_cmp(&key(a)).unwrap_or(std::cmp::Ordering::Equal));
    patches
}

fn root(group: &HashMap<u32, u32>, mut node: u32) -> u32 {
    while group[&node] != node {
        node = group[&node];
    }
    node
}

fn patch(mesh: &TetMesh, members: &[u32], carried: &HashMap<u32, f64>, area: &HashMap<u32, f64>) -> Patch {
    let at = |n: u32| mesh.nodes[n as usize];
    let total: f64 = members.iter().map(|n| carried[n]).sum();
    let centroid_m: Vec3 = members.iter().map(|&n| at(n) * (carried[&n] / total)).sum();
    // A uniform disc of radius r has the second moment r² / 2.
    let second: f64 =
        members.iter().map(|&n| (at(n) - centroid_m).norm_squared() * carried[&n] / total).sum();
    let own: f64 = members.iter().map(|n| area.get(n).copied().unwrap_or(0.0)).sum();
    let unknown = Vec3::repeat(f64::NAN);
    Patch {
        kind: PatchKind::Springs { stiffness_n_per_m: Estimate { value: total, sd: f64::NAN } },
        centroid_m,
        centroid_sd_m: unknown,
        radius_m: (2.0 * second).max(own / std::f64::consts::PI).sqrt(),
        radius_estimated: true,
        stiffness_bound_n_per_m: None,
    }
}

/// Stiffness, then place, so that the order is always the same.
fn key(patch: &Patch) -> (f64, f64, f64) {
    let stiffness = match patch.kind {
        PatchKind::Springs { stiffness_n_per_m } => stiffness_n_per_m.value,
        PatchKind::Glued { stiffness_lower_bound_n_per_m } => stiffness_lower_bound_n_per_m,
    };
    (stiffness, patch.centroid_m.x, patch.centroid_m.y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Block, block};

    /// Two nodes side by side, one alone, one negative beside it, one of no weight.
    #[test]
    fn neighbours_of_one_sign_are_one_patch() {
        let mesh = block(&Block { size_m: [0.08, 0.04, 0.02], cells: [8, 4, 2] }).expect("a block");
        let at = |x: f64, y: f64| {
            let p = Vec3::new(x, y, 0.0);
            mesh.nodes.iter().position(|q| (q - p).norm() < 1e-9).expect("a node") as u32
        };
        let nodes = [at(0.01, 0.02), at(0.02, 0.02), at(0.06, 0.02), at(0.07, 0.02), at(0.04, 0.01)];
        let patches = gather(&mesh, "z-", &nodes, &[30.0, 10.0, 20.0, -5.0, 0.2]);
        let stiffness: Vec<f64> = patches.iter().map(|p| key(p).0).collect();
        assert_eq!(stiffness, [40.0, 20.0, -5.0]);
        assert!((patches[0].centroid_m - Vec3::new(0.0125, 0.02, 0.0)).norm() < 1e-12);
        // One inner node of a grid of 10 mm: 1 cm² belongs to it.
        assert!((patches[1].radius_m - (1e-4 / std::f64::consts::PI).sqrt()).abs() < 1e-9);
        assert!(gather(&mesh, "z-", &nodes, &[0.0; 5]).is_empty());
    }
}
