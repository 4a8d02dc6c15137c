//! How a mesh is made finer where it must be: mesh and wanted edge length (m) → a conforming finer mesh.
//!
//! Rounds of longest-edge bisection on the skeleton (Plaza & Carey 2000). In a round
//! 1. every edge longer than wanted is marked;
//! 2. every triangle and tetrahedron with a marked edge gets its longest edge marked, until nothing changes:
//!    so angles stay bounded away from zero however often a place is refined;
//! 3. every tetrahedron is halved at its longest marked edge, and its halves likewise. A face is cut in the
//!    order of its own marked edges, whichever of its two tetrahedra asks, so the pieces fit.

use super::TetMesh;
use crate::geometry::Vec3;
use std::collections::HashMap;

/// Cuts edges until every edge is at most as long as `size_m` says at its midpoint, and the mesh conforms. Named
/// surfaces are cut along. New nodes lie at midpoints of edges and follow those of `mesh`, which stay as they
/// are. Returns the input when nothing needs cutting.
///
/// `size_m` is asked at midpoints only: it must not fall faster than about half the distance, or a long edge
/// may pass over a small place that wants short ones.
///
/// # Panics
/// When `size_m` is not positive somewhere: no mesh could follow it.
pub fn refine(mesh: &TetMesh, size_m: impl Fn(&Vec3) -> f64) -> TetMesh {
    let mut fine = mesh.clone();
    let mut skeleton = Skeleton::default();
    let mut edges: Vec<[u32; 6]> = fine.tets.iter().map(|&t| skeleton.edges_of(t, &fine.nodes)).collect();
    let mut marked_until = 0;
    loop {
        let new = marked_until..skeleton.edges.len();
        marked_until = new.end;
        if !skeleton.mark_longer(new, &fine.nodes, &size_m) {
            return fine;
        }
        skeleton.close(&edges);
        skeleton.place_midpoints(&mut fine.nodes);
        for surface in fine.surfaces.values_mut() {
            let mut pieces = Vec::with_capacity(surface.len());
            surface.iter().for_each(|&triangle| skeleton.cut(triangle, &mut pieces));
            *surface = pieces;
        }
        let (mut tets, mut tet_edges) =
            (Vec::with_capacity(fine.tets.len()), Vec::with_capacity(edges.len()));
        let mut pieces = Vec::new();
        for (&tet, &around) in fine.tets.iter().zip(&edges) {
            if around.iter().any(|&e| skeleton.edges[e as usize].marked) {
                skeleton.cut(tet, &mut pieces);
                tet_edges.extend(pieces.iter().map(|&piece| skeleton.edges_of(piece, &fine.nodes)));
                tets.append(&mut pieces);
            } else {
                tets.push(tet);
                tet_edges.push(around);
            }
        }
        fine.tets = tets;
        edges = tet_edges;
    }
}

/// Edges of a tetrahedron as pairs of its corners; the first three are those of the face 0 1 2.
const TET_EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [1, 2], [0, 3], [1, 3], [2, 3]];
/// Faces of a tetrahedron as triples of [`TET_EDGES`].
const TET_FACES: [[usize; 3]; 4] = [[0, 1, 2], [0, 3, 4], [1, 3, 5], [2, 4, 5]];

#[derive(Debug, Clone, Copy)]
struct Edge {
    /// Its ends, the smaller index first.
    ends: [u32; 2],
    length_squared: f64,
    /// To be cut in this round, or cut before (no tetrahedron has it any more then).
    marked: bool,
    /// The node in its middle, once it is cut.
    midpoint: Option<u32>,
}

impl Edge {
    /// Whether it is cut before `other` when both are marked. Edges of equal length take turns by their ends,
    /// so that all who ask get the same answer.
    fn goes_before(&self, other: &Self) -> bool {
        self.length_squared.total_cmp(&other.length_squared).then_with(|| self.ends.cmp(&other.ends)).is_gt()
    }
}

/// All edges that ever were in the mesh.
#[derive(Debug, Default)]
struct Skeleton {
    edges: Vec<Edge>,
    index: HashMap<[u32; 2], u32>,
}

impl Skeleton {
    /// The edges of a tetrahedron, new ones added, in the order of [`TET_EDGES`].
    fn edges_of(&mut self, tet: [u32; 4], nodes: &[Vec3]) -> [u32; 6] {
        TET_EDGES.map(|[i, j]| {
            let ends = [tet[i].min(tet[j]), tet[i].max(tet[j])];
            *self.index.entry(ends).or_insert_with(|| {
                let length_squared = (nodes[ends[1] as usize] - nodes[ends[0] as usize]).norm_squared();
                self.edges.push(Edge { ends, length_squared, marked: false, midpoint: None });
                self.edges.len() as u32 - 1
            })
        })
    }

    /// Marks those of the edges `which` that are longer than wanted; whether there are any.
    fn mark_longer(
        &mut self,
        which: std::ops::Range<usize>,
        nodes: &[Vec3],
        size_m: impl Fn(&Vec3) -> f64,
    ) -> bool {
        let mut any = false;
        for edge in &mut self.edges[which] {
            let middle = middle(edge.ends, nodes);
            let size = size_m(&middle);
            assert!(size > 0.0, "the wanted edge length at {middle:?} is {size} m; expected more than 0");
            edge.marked = edge.length_squared > size * size;
            any |= edge.marked;
        }
        any
    }

    /// Marks the longest edge of every triangle and tetrahedron that has a marked one, until all have.
    fn close(&mut self, tets: &[[u32; 6]]) {
        let mut changed = true;
        while changed {
            changed = false;
            for tet in tets {
                if tet.iter().any(|&e| self.edges[e as usize].marked) {
                    for face in TET_FACES {
                        changed |= self.mark_longest(&face.map(|i| tet[i]));
                    }
                    changed |= self.mark_longest(tet);
                }
            }
        }
    }

    /// Marks the longest of `around` if any of them is marked; whether that was new.
    fn mark_longest(&mut self, around: &[u32]) -> bool {
        let mut longest = around[0];
        let mut any = false;
        for &edge in around {
            any |= self.edges[edge as usize].marked;
            if self.edges[edge as usize].goes_before(&self.edges[longest as usize]) {
                longest = edge;
            }
        }
        let target = &mut self.edges[longest as usize].marked;
        any && !std::mem::replace(target, *target || any)
    }

    fn place_midpoints(&mut self, nodes: &mut Vec<Vec3>) {
        for edge in &mut self.edges {
            if edge.marked && edge.midpoint.is_none() {
                edge.midpoint = Some(u32::try_from(nodes.len()).expect("fewer than 2³² nodes"));
                nodes.push(middle(edge.ends, nodes));
            }
        }
    }

    /// Appends the pieces of a triangle or tetrahedron, which keep its orientation.
    fn cut<const N: usize>(&self, simplex: [u32; N], pieces: &mut Vec<[u32; N]>) {
        let mut first: Option<(&Edge, u32, [usize; 2])> = None;
        for i in 0..N {
            for j in i + 1..N {
                let ends = [simplex[i].min(simplex[j]), simplex[i].max(simplex[j])];
                // Edges that this round creates are not known yet, and not cut before the next one.
                let Some(&edge) = self.index.get(&ends) else { continue };
                let edge = &self.edges[edge as usize];
                let Some(midpoint) = edge.midpoint else { continue };
                if first.is_none_or(|(before, ..)| edge.goes_before(before)) {
                    first = Some((edge, midpoint, [i, j]));
                }
            }
        }
        let Some((_, midpoint, ends)) = first else {
            pieces.push(simplex);
            return;
        };
        for end in ends {
            let mut half = simplex;
            half[end] = midpoint;
            self.cut(half, pieces);
        }
    }
}

fn middle(ends: [u32; 2], nodes: &[Vec3]) -> Vec3 {
    (nodes[ends[0] as usize] + nodes[ends[1] as usize]) / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Block, block, boundary_triangles, check, quality};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// A slab with inner nodes moved by up to a fifth of the cells.
    fn jittered(size_m: [f64; 3], cells: [usize; 3]) -> TetMesh {
        let mut mesh = block(&Block { size_m, cells }).expect("block");
        let mut random = ChaCha8Rng::seed_from_u64(7);
        for p in &mut mesh.nodes {
            for a in 0..3 {
                let shift = random.random_range(-0.2..0.2) * size_m[a] / cells[a] as f64;
                if p[a] > 0.0 && p[a] < size_m[a] {
                    p[a] += shift;
                }
            }
        }
        mesh
    }

    /// 0.6 mm at the rim of a disc of 4 mm radius on top, growing by a third of the distance to 5 mm.
    fn around_a_rim(p: &Vec3) -> f64 {
        let from_axis = ((p.x - 0.02).powi(2) + (p.y - 0.02).powi(2)).sqrt();
        let distance = ((from_axis - 0.004).powi(2) + (p.z - 0.02).powi(2)).sqrt();
        (0.0006 + distance / 3.0).min(0.005)
    }

    fn longest_over_size(mesh: &TetMesh, size_m: impl Fn(&Vec3) -> f64) -> f64 {
        mesh.tets
            .iter()
            .flat_map(|t| TET_EDGES.map(|[i, j]| [t[i], t[j]]))
            .map(|[a, b]| {
                let (a, b) = (mesh.nodes[a as usize], mesh.nodes[b as usize]);
                (a - b).norm() / size_m(&((a + b) / 2.0))
            })
            .fold(0.0, f64::max)
    }

    fn area(mesh: &TetMesh, triangles: &[[u32; 3]]) -> f64 {
        triangles.iter().map(|&t| mesh.triangle(t).area()).sum()
    }

    #[test]
    fn grading_to_a_rim_keeps_body_surfaces_and_shape() {
        let coarse = jittered([0.04, 0.04, 0.02], [8, 8, 4]);
        let fine = refine(&coarse, around_a_rim);
        assert!(fine.tets.len() > 20 * coarse.tets.len(), "{} tetrahedra", fine.tets.len());
        check(&fine).expect("conforming: no branching faces, surfaces on the boundary, one piece");
        assert!((fine.volume() / coarse.volume() - 1.0).abs() < 1e-12);
        let outside = |mesh: &TetMesh| area(mesh, &boundary_triangles(mesh).expect("conforming"));
        // A hanging node would leave faces inside the body without a partner.
        assert!((outside(&fine) / outside(&coarse) - 1.0).abs() < 1e-12);
        for name in coarse.surfaces.keys() {
            let (before, after) = (area(&coarse, coarse.surface(name)), area(&fine, fine.surface(name)));
            assert!((after / before - 1.0).abs() < 1e-12, "{name}: {before} → {after}");
        }
        assert!(longest_over_size(&fine, around_a_rim) <= 1.0);
        let (before, after) = (quality(&coarse).expect("tets"), quality(&fine).expect("tets"));
        assert!(after.worst_radius_ratio >= 0.3 * before.worst_radius_ratio, "{before:?} → {after:?}");
    }

    #[test]
    fn refining_again_changes_nothing() {
        let fine = refine(&jittered([0.04, 0.04, 0.02], [4, 4, 2]), |_| 0.004);
        assert_eq!(refine(&fine, |_| 0.004), fine);
        let coarse = jittered([0.04, 0.04, 0.02], [4, 4, 2]);
        assert_eq!(refine(&coarse, |_| f64::INFINITY), coarse);
    }

    #[test]
    fn nodes_of_the_coarse_mesh_stay_and_new_ones_halve_edges() {
        let coarse = block(&Block { size_m: [1.0; 3], cells: [1, 1, 1] }).expect("block");
        let fine = refine(&coarse, |p| if p.norm() < 0.6 { 0.3 } else { 2.0 });
        assert_eq!(fine.nodes[..8], coarse.nodes[..]);
        // Edges of a unit cube are halved, so coordinates are whole multiples of a power of two.
        assert!(fine.nodes.iter().flat_map(|p| p.iter()).all(|x| (x * 64.0).fract() == 0.0));
        assert!(fine.nodes.len() > 8);
        let mut seen: Vec<_> = fine.nodes.iter().map(|p| [p.x, p.y, p.z].map(f64::to_bits)).collect();
        seen.sort_unstable();
        seen.dedup();
        assert_eq!(seen.len(), fine.nodes.len(), "no node twice");
    }

    #[test]
    fn repeated_refinement_of_one_place_does_not_flatten_tetrahedra() {
        let mut mesh = jittered([0.04, 0.04, 0.02], [4, 4, 2]);
        let start = quality(&mesh).expect("tets").worst_radius_ratio;
        for round in 0..12 {
            let size = 0.01 * 0.6_f64.powi(round);
            mesh = refine(&mesh, |p| size + 0.5 * (p - Vec3::new(0.013, 0.017, 0.02)).norm());
        }
        let worst = quality(&mesh).expect("tets").worst_radius_ratio;
        assert!(worst >= 0.3 * start, "{start} → {worst}");
    }

    /// Where the wanted length jumps, a coarse tetrahedron is cut again and again from one side: only the
    /// closure keeps it from becoming a sliver (without it the worst ratio falls 160-fold here).
    #[test]
    fn a_jump_of_the_size_does_not_flatten_tetrahedra() {
        let coarse = jittered([0.04, 0.04, 0.02], [4, 4, 2]);
        let fine = refine(&coarse, |p| if (p.x - p.y).abs() < 0.005 { 0.001 } else { 1.0 });
        check(&fine).expect("conforming");
        let [before, after] = [&coarse, &fine].map(|m| quality(m).expect("tets").worst_radius_ratio);
        assert!(after >= 0.1 * before, "{before} → {after}");
    }

    #[test]
    #[should_panic(expected = "expected more than 0")]
    fn a_size_of_zero_is_refused() {
        refine(&jittered([1.0; 3], [1, 1, 1]), |_| 0.0);
    }
}
