//! How finely a given mesh must be cut: the mesh is a geometry, not yet a discretisation.
//!
//! Three places need small elements. Where known glue ends the stress is singular, like the square root of the
//! distance where the surface goes on flat, and more mildly where the body ends there too. Where a tip's disc
//! comes close to another side of the body, the half-space's near field leaves a sharp load on that side. And
//! where a disc does not lie on a flat part of the surface, the elements carry its load by themselves.
//!
//! At the end of flat glue the error of any compliance falls in proportion to the element size there
//! (the energy of a square-root singularity inside one element), so that two discretisations whose
//! sizes differ by a factor of two leave, by Richardson's extrapolation (1911), only what does not follow that
//! law; [`Discretisation::fine`] and [`Discretisation::coarse`] are such a pair.

use super::size_field::{Need, SizeField};
use super::spot::Spot;
use crate::geometry::{Disc, Vec3, basis_from_axis};
use crate::mesh::{MeshError, TetMesh, boundary_triangles, refine};
use std::collections::HashMap;

/// What a discretisation is to resolve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resolution {
    /// Edge length (m) at the end of flat glue; twice this where body and glue end together.
    pub glue_m: f64,
    /// Longest edge anywhere (m).
    pub longest_m: f64,
}

impl Resolution {
    /// The mesh as it was given, cut only where discs need it.
    pub const AS_GIVEN: Self = Self { glue_m: f64::INFINITY, longest_m: f64::INFINITY };

    /// The resolution of level `level` for a body: each level halves the size at the end of the glue. Sizes are
    /// set by the body's thickness (twice its volume over its surface), not by the mesh it came with.
    pub fn of(mesh: &TetMesh, level: u32) -> Result<Self, MeshError> {
        let area: f64 = boundary_triangles(mesh)?.iter().map(|&f| mesh.triangle(f).area()).sum();
        let thickness = 2.0 * mesh.volume() / area;
        Ok(Self {
            glue_m: thickness * GLUE_SHARE / f64::from(1 << level),
            longest_m: thickness * LONGEST_SHARE,
        })
    }
}

/// Edge length at the end of the glue on level 0, and longest edge anywhere, over the body's thickness.
const GLUE_SHARE: f64 = 0.45;
const LONGEST_SHARE: f64 = 0.8;

/// Edges grow by this share of the distance from what they resolve.
const GROWTH: f64 = 1.0;

/// A disc that hangs over an edge or lies on a curved surface is resolved by edges of this share of its radius.
const RIM_SHARE: f64 = 0.25;

/// Cuts `mesh` where `fixed` ends and where `discs` (on this mesh) need it, to `resolution`.
pub fn discretise(
    mesh: &TetMesh,
    fixed: &str,
    discs: &[&Spot],
    resolution: &Resolution,
) -> Result<TetMesh, MeshError> {
    let boundary = boundary_triangles(mesh)?;
    let glue = glue_ends(mesh, fixed, &boundary).into_iter();
    let mut needs: Vec<Need> = glue.map(|(a, b, size)| Need::along(a, b, size * resolution.glue_m)).collect();
    for spot in discs {
        needs.extend(needs_of(mesh, &boundary, spot));
    }
    let sizes = SizeField::new(needs, resolution.longest_m, GROWTH);
    Ok(refine(mesh, |p| sizes.at(p)))
}

/// Whether a disc (on this mesh) needs smaller edges than a body without it.
pub fn needs_small_edges(mesh: &TetMesh, spot: &Spot) -> Result<bool, MeshError> {
    Ok(!needs_of(mesh, &boundary_triangles(mesh)?, spot).is_empty())
}

/// What a disc needs.
fn needs_of(mesh: &TetMesh, boundary: &[[u32; 3]], spot: &Spot) -> Vec<Need> {
    let Some((disc, flat)) = spot.as_disc() else { return Vec::new() };
    if flat {
        return close_sides(mesh, boundary, &disc);
    }
    rim(&disc, 24).map(|at| Need::at(at, disc.radius * RIM_SHARE)).collect()
}

/// So many points around a disc's rim.
fn rim(disc: &Disc, points: u32) -> impl Iterator<Item = Vec3> {
    let (centre, basis) = (disc.centre, basis_from_axis(&disc.normal) * disc.radius);
    (0..points).map(move |i| {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(i) / f64::from(points)).sin_cos();
        centre + basis * Vec3::new(cos, sin, 0.0)
    })
}

/// Edges where the named surface ends: both ends, and the size wanted there relative to the end of flat glue.
fn glue_ends(mesh: &TetMesh, fixed: &str, boundary: &[[u32; 3]]) -> Vec<(Vec3, Vec3, f64)> {
    let mut held: HashMap<(u32, u32), (u32, Vec3)> = HashMap::new();
    for &face in mesh.surface(fixed) {
        let normal = mesh.triangle(face).normal();
        for edge in edges(face) {
            held.entry(edge).or_insert((0, normal)).0 += 1;
        }
    }
    held.retain(|_, (count, _)| *count == 1);
    let mut beside: HashMap<(u32, u32), Vec<Vec3>> = HashMap::new();
    for &face in boundary {
        for edge in edges(face) {
            if held.contains_key(&edge) {
                beside.entry(edge).or_default().push(mesh.triangle(face).normal());
            }
        }
    }
    let mut ends: Vec<((u32, u32), f64)> = held
        .into_iter()
        .map(|(edge, (_, normal))| {
            let flat = beside[&edge].iter().all(|n| n.dot(&normal) > 0.9);
            (edge, if flat { 1.0 } else { 2.0 })
        })
        .collect();
    ends.sort_by_key(|(edge, _)| *edge);
    ends.into_iter().map(|((a, b), size)| (mesh.nodes[a as usize], mesh.nodes[b as usize], size)).collect()
}

fn edges(face: [u32; 3]) -> [(u32, u32); 3] {
    [(0, 1), (1, 2), (2, 0)].map(|(i, j): (usize, usize)| (face[i].min(face[j]), face[i].max(face[j])))
}

/// Points of other sides of the body close to a flat disc, with the size that the near field needs there.
fn close_sides(mesh: &TetMesh, boundary: &[[u32; 3]], disc: &Disc) -> Vec<Need> {
    let rim: Vec<Vec3> = rim(disc, 48).collect();
    let mut needs = Vec::new();
    for &face in boundary {
        let triangle = mesh.triangle(face);
        if triangle.0.iter().all(|p| (p - disc.centre).dot(&disc.normal).abs() < 1e-4 * disc.radius) {
            continue;
        }
        for p in &rim {
            let near = triangle.nearest(p).position;
            let distance = (near - p).norm();
            if distance < 0.5 * disc.radius {
                needs.push(Need::at(near, (0.6 * distance).max(0.05 * disc.radius)));
            }
        }
    }
    needs
}

/// Two discretisations of one body whose sizes at the end of the glue differ by a factor of two.
#[derive(Debug, Clone)]
pub struct Discretisation {
    /// The coarser one.
    pub coarse: TetMesh,
    /// The finer one.
    pub fine: TetMesh,
}

/// Edges turn out at this share of the size that was asked for, in the mean: bisection halves what is too long.
const AS_CUT: f64 = 0.7;

impl Discretisation {
    /// A pair on `level` and `level + 1`, or, where the given mesh is finer than that, on its own size and half of it.
    pub fn pair(mesh: &TetMesh, fixed: &str, discs: &[&Spot], level: u32) -> Result<Self, MeshError> {
        let mut resolution = Resolution::of(mesh, level)?;
        if let Some(given) = glue_edge_m(mesh, fixed)? {
            resolution.glue_m = resolution.glue_m.min(given / AS_CUT);
        }
        let half = Resolution { glue_m: 0.5 * resolution.glue_m, ..resolution };
        Ok(Self {
            coarse: discretise(mesh, fixed, discs, &resolution)?,
            fine: discretise(mesh, fixed, discs, &half)?,
        })
    }

    /// Richardson's extrapolation of a compliance from the pair: its error at the end of flat glue halves from
    /// coarse to fine.
    pub fn extrapolate(coarse: f64, fine: f64) -> f64 {
        2.0 * fine - coarse
    }
}

/// How much longer the given mesh's edges are where flat glue ends than those of level 0; 1 where no glue ends.
pub fn coarseness(mesh: &TetMesh, fixed: &str) -> Result<f64, MeshError> {
    let level = Resolution::of(mesh, 0)?;
    Ok(glue_edge_m(mesh, fixed)?.map_or(1.0, |given| given / (AS_CUT * level.glue_m)))
}

/// Mean length (m) of the edges at which flat glue ends, or, where none does, of those at which glue and body end
/// together.
fn glue_edge_m(mesh: &TetMesh, fixed: &str) -> Result<Option<f64>, MeshError> {
    let ends = glue_ends(mesh, fixed, &boundary_triangles(mesh)?);
    let mean = |flat: bool| {
        let lengths: Vec<f64> =
            ends.iter().filter(|(.., size)| (*size == 1.0) == flat).map(|(a, b, _)| (b - a).norm()).collect();
        (!lengths.is_empty()).then(|| lengths.iter().sum::<f64>() / lengths.len() as f64)
    };
    Ok(mean(true).or_else(|| mean(false)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::{Order, Space};
    use crate::mesh::{Block, block};

    /// A slab of 120 × 60 × 20 mm in so many cells, glued on the left half of its base.
    fn slab(cells: [usize; 3]) -> TetMesh {
        let mut mesh = block(&Block { size_m: [0.12, 0.06, 0.02], cells }).expect("a block");
        let base = mesh.surface("z-").iter().copied();
        let glued = base.filter(|t| t.iter().all(|&n| mesh.nodes[n as usize].x < 0.0601)).collect();
        mesh.surfaces.insert("fixed".to_owned(), glued);
        mesh
    }

    /// Twice as fine where the glue ends is half as coarse; a body without glue is not judged.
    #[test]
    fn coarseness_goes_with_the_edges_where_glue_ends() {
        let of = |cells| coarseness(&slab(cells), "fixed").expect("sound");
        let (coarse, fine) = (of([8, 4, 2]), of([16, 8, 4]));
        assert!((coarse / fine - 2.0).abs() < 1e-9, "{coarse} {fine}");
        assert_eq!(coarseness(&slab([8, 4, 2]), "nowhere").expect("sound"), 1.0);
    }

    /// A disc in the middle of the top needs nothing; one whose rim comes close to a side does.
    #[test]
    fn discs_close_to_a_side_need_small_edges() {
        let mesh = slab([8, 4, 2]);
        let space = Space::new(&mesh, Order::P1).expect("a space");
        let top = space.surface("z+").to_vec();
        for (y, needs) in [(0.03, false), (0.008, false), (0.007, true)] {
            let spot = Spot::disc(&space, &top, &Vec3::new(0.06, y, 0.02), 0.005).expect("on the top");
            assert_eq!(needs_small_edges(&mesh, &spot).expect("sound"), needs, "{y}");
        }
    }
}
