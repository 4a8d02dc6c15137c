//! The mesh that comes with a recording: tetrahedra that know nothing of the bench's boxes, sites or patches.
//!
//! A block of tetrahedra with a plane of nodes at the end of the glue, its other nodes moved at random within
//! their side. Surfaces: `fixed` (underside, glued), `search` (rest of the underside), `observed` (top).

use super::SimError;
use super::hex_mesh::Slab;
use super::seed::{Use, stream};
use crate::mesh::{Block, TetMesh, block, check};
use rand::RngExt;

/// Largest shift of a node along each axis, in cells.
const JITTER: f64 = 0.15;

/// Cuts `slab` into tetrahedra of about `cell_m`.
pub(super) fn fit_mesh(slab: &Slab, cell_m: f64, seed: u64) -> Result<TetMesh, SimError> {
    let mut rng = stream(seed, Use::FitMesh);
    let cells = slab.size_m.map(|l| (l / cell_m).round().max(2.0) as usize);
    let mut mesh = block(&Block { size_m: slab.size_m, cells })?;
    let uniform: [f64; 3] = std::array::from_fn(|a| slab.size_m[a] / cells[a] as f64);
    // The plane of nodes nearest to the end of the glue moves there; those before and after spread evenly.
    let (length, end) = (slab.size_m[0], slab.glue_end_m);
    let glued = (end / uniform[0]).round().clamp(1.0, cells[0] as f64 - 1.0);
    let free = cells[0] as f64 - glued;
    let two_parts = end > 0.0 && end < length;
    let at = |x: f64| {
        let plane = (x / uniform[0]).round();
        match plane {
            _ if !two_parts || plane == cells[0] as f64 => x,
            // Why: `end * glued / glued` is often not `end` in the last place, and that plane would then be no end of the glue.
            _ if plane == glued => end,
            _ if plane < glued => end * plane / glued,
            _ => end + (length - end) * (plane - glued) / free,
        }
    };
    let spacing_x = if two_parts { (end / glued).min((length - end) / free) } else { uniform[0] };
    let spacing = [spacing_x, uniform[1], uniform[2]];
    for node in &mut mesh.nodes {
        node.x = at(node.x);
        let on_side: [bool; 3] = std::array::from_fn(|a| node[a] == 0.0 || node[a] == slab.size_m[a]);
        let on_glue_end = node.z == 0.0 && node.x == end;
        for a in 0..3 {
            // The numbers are drawn for every node so that they do not depend on which nodes stay.
            let shift: f64 = rng.random_range(-JITTER..JITTER);
            if !(on_side[a] || a == 0 && on_glue_end) {
                node[a] += shift * spacing[a];
            }
        }
    }
    let underside = mesh.surfaces.remove("z-").unwrap_or_default();
    let top = mesh.surfaces.remove("z+").unwrap_or_default();
    let (fixed, search): (Vec<[u32; 3]>, Vec<[u32; 3]>) =
        underside.into_iter().partition(|&f| mesh.triangle(f).0.iter().all(|p| p.x <= end));
    mesh.surfaces.clear();
    for (name, surface) in [("fixed", fixed), ("search", search), ("observed", top)] {
        mesh.surfaces.insert(name.to_owned(), surface);
    }
    check(&mesh)?;
    Ok(mesh)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_stay_flat_and_the_glue_ends_on_edges() {
        // Ends of the glue that rounding treats differently.
        for end in (0..40).map(|i| 0.0613 - 2.3e-4 * f64::from(i)) {
            let slab = Slab { size_m: [0.153, 0.097, 0.0241], glue_end_m: end };
            let mesh = fit_mesh(&slab, 0.0065, 3).expect("a mesh");
            assert!((mesh.volume() / (0.153 * 0.097 * 0.0241) - 1.0).abs() < 1e-12);
            let area = |name| mesh.surface(name).iter().map(|&f| mesh.triangle(f).area()).sum::<f64>();
            assert!((area("fixed") / (end * 0.097) - 1.0).abs() < 1e-12, "glue to {end} m");
            assert!((area("search") / ((0.153 - end) * 0.097) - 1.0).abs() < 1e-12, "glue to {end} m");
            assert!((area("observed") / (0.153 * 0.097) - 1.0).abs() < 1e-12);
            assert_eq!(mesh.surfaces.len(), 3);
        }
    }

    #[test]
    fn nodes_are_off_the_grid() {
        let slab = Slab { size_m: [0.15, 0.1, 0.025], glue_end_m: 0.06 };
        let [a, b] = [1, 2].map(|seed| fit_mesh(&slab, 0.0065, seed).expect("a mesh"));
        let apart = a.nodes.iter().zip(&b.nodes).filter(|(p, q)| p != q).count();
        assert!(apart as f64 > 0.9 * a.nodes.len() as f64);
    }
}
