//! The phantom's surface as the pages draw it, and discs that lie on it. Lengths leave here in millimetres,
//! displacements in micrometres, as plain columns.

use crate::geometry::{Mat3, Vec3, basis_from_axis};
use crate::mesh::{MeshError, TetMesh, boundary_triangles};
use serde::Serialize;
use std::collections::{BTreeMap, HashMap};

/// Columns of x, y and z.
#[derive(Serialize)]
pub(in crate::report) struct Columns {
    x: Vec<f64>,
    y: Vec<f64>,
    z: Vec<f64>,
}

/// Corners of triangles in columns, by the group of surface: `fixed`, `search` or `free`.
pub(in crate::report) type Triangles = BTreeMap<&'static str, [Vec<u32>; 3]>;

/// A disc that moves with the surface node under its centre.
#[derive(Serialize)]
pub(in crate::report) struct DiscScene {
    centre_mm: [f64; 3],
    radius_mm: f64,
    /// Two unit vectors that span it.
    span: [[f64; 3]; 2],
    /// Outward unit normal.
    normal: [f64; 3],
    /// Index of the surface node under its centre.
    node: usize,
}

/// The boundary of the mesh with its own numbering of nodes.
pub(in crate::report) struct Skin {
    /// Node of the mesh for each node of the skin.
    pub(in crate::report) origin: Vec<usize>,
    pub(in crate::report) nodes: Vec<Vec3>,
    pub(in crate::report) triangles: Triangles,
    /// Outward normal at each node (area-weighted, not normalised).
    normals: Vec<Vec3>,
}

impl Skin {
    pub(in crate::report) fn new(mesh: &TetMesh) -> Result<Self, MeshError> {
        let mut group = HashMap::new();
        for name in ["search", "fixed"] {
            group.extend(mesh.surface(name).iter().map(|&t| (sorted(t), name)));
        }
        let mut number: HashMap<u32, u32> = HashMap::new();
        let mut skin = Self {
            origin: Vec::new(),
            nodes: Vec::new(),
            triangles: ["fixed", "search", "free"].map(|name| (name, [const { Vec::new() }; 3])).into(),
            normals: Vec::new(),
        };
        for triangle in boundary_triangles(mesh)? {
            let name = group.get(&sorted(triangle)).copied().unwrap_or("free");
            let normal = mesh.triangle(triangle).normal() * mesh.triangle(triangle).area();
            for (corner, node) in triangle.into_iter().enumerate() {
                let local = *number.entry(node).or_insert_with(|| {
                    skin.origin.push(node as usize);
                    skin.nodes.push(mesh.nodes[node as usize]);
                    skin.normals.push(Vec3::zeros());
                    skin.nodes.len() as u32 - 1
                });
                skin.normals[local as usize] += normal;
                if let Some(columns) = skin.triangles.get_mut(name) {
                    columns[corner].push(local);
                }
            }
        }
        Ok(skin)
    }

    /// Length of the diagonal of the box around the phantom (m).
    pub(in crate::report) fn diagonal(&self) -> f64 {
        let Some(first) = self.nodes.first() else { return 0.0 };
        let (low, high) = self.nodes.iter().fold((*first, *first), |(l, h), p| (l.inf(p), h.sup(p)));
        (high - low).norm()
    }

    /// The node nearest to a point.
    fn nearest(&self, point: &Vec3) -> usize {
        let distance = |i: &usize| (self.nodes[*i] - point).norm_squared();
        (0..self.nodes.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
    }

    /// A disc on the surface; `normal` is taken from the surface when `None`.
    pub(in crate::report) fn disc(&self, centre: &Vec3, radius_m: f64, normal: Option<Vec3>) -> DiscScene {
        let node = self.nearest(centre);
        let normal = normal.unwrap_or_else(|| self.normal_at(node));
        let basis: Mat3 = basis_from_axis(&normal);
        let column = |i: usize| [basis[(0, i)], basis[(1, i)], basis[(2, i)]];
        let centre_mm = [centre.x, centre.y, centre.z].map(|v| rounded(v * 1e3, 1e3));
        DiscScene {
            centre_mm,
            radius_mm: rounded(radius_m * 1e3, 1e3),
            span: [column(0), column(1)],
            normal: column(2),
            node,
        }
    }

    /// The surface's normal at a node, or upwards where it has none.
    fn normal_at(&self, node: usize) -> Vec3 {
        self.normals.get(node).and_then(|n| n.try_normalize(1e-300)).unwrap_or_else(Vec3::z)
    }
}

pub(in crate::report) fn millimetres<'a>(points: impl Iterator<Item = &'a Vec3>) -> Columns {
    columns(points, 1e3, 1e3)
}

pub(in crate::report) fn micrometres<'a>(points: impl Iterator<Item = &'a Vec3>) -> Columns {
    columns(points, 1e6, 10.0)
}

fn columns<'a>(points: impl Iterator<Item = &'a Vec3>, scale: f64, per_unit: f64) -> Columns {
    let mut columns = Columns { x: Vec::new(), y: Vec::new(), z: Vec::new() };
    for p in points {
        columns.x.push(rounded(p.x * scale, per_unit));
        columns.y.push(rounded(p.y * scale, per_unit));
        columns.z.push(rounded(p.z * scale, per_unit));
    }
    columns
}

/// `value` rounded to `1 / per_unit`: a plot shows no more, and the page stays small.
pub(in crate::report) fn rounded(value: f64, per_unit: f64) -> f64 {
    // Adding zero turns −0 into 0, one character less.
    (value * per_unit).round() / per_unit + 0.0
}

fn sorted(mut triangle: [u32; 3]) -> [u32; 3] {
    triangle.sort_unstable();
    triangle
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Block, block};

    fn slab() -> TetMesh {
        let mut mesh = block(&Block { size_m: [0.06, 0.04, 0.02], cells: [6, 4, 2] }).expect("a block");
        let bottom = mesh.surfaces.remove("z-").expect("a bottom");
        let (fixed, search) =
            bottom.into_iter().partition(|&t| mesh.triangle(t).0.iter().all(|p| p.x < 0.031));
        mesh.surfaces = [("fixed".to_owned(), fixed), ("search".to_owned(), search)].into();
        mesh
    }

    #[test]
    fn the_skin_is_the_closed_surface_with_its_groups() {
        let mesh = slab();
        let skin = Skin::new(&mesh).expect("a skin");
        // All 7 × 5 × 3 nodes but the 5 × 3 × 1 inside; two triangles for each square of the surface.
        assert_eq!(skin.nodes.len(), 7 * 5 * 3 - 5 * 3);
        let count = |name| skin.triangles[name][0].len();
        assert_eq!(count("fixed"), 2 * 3 * 4);
        assert_eq!(count("search"), 2 * 3 * 4);
        assert_eq!(count("free"), 2 * (6 * 4 + 2 * 6 * 2 + 2 * 4 * 2));
        assert!((skin.diagonal() - Vec3::new(0.06, 0.04, 0.02).norm()).abs() < 1e-15);
        // Gauss: the volume of a body is a third of the flux of the position through its surface.
        let volume: f64 = skin
            .triangles
            .values()
            .flat_map(|[i, j, k]| i.iter().zip(j).zip(k))
            .map(|((&i, &j), &k)| {
                let [a, b, c] = [i, j, k].map(|n| skin.nodes[n as usize]);
                a.dot(&b.cross(&c)) / 6.0
            })
            .sum();
        assert!((volume / mesh.volume() - 1.0).abs() < 1e-12, "{volume}");
        for (node, &origin) in skin.nodes.iter().zip(&skin.origin) {
            assert_eq!(*node, mesh.nodes[origin]);
        }
    }

    #[test]
    fn a_disc_lies_in_the_surface_over_its_node() {
        let skin = Skin::new(&slab()).expect("a skin");
        let centre = Vec3::new(0.041, 0.019, 0.0);
        let disc = skin.disc(&centre, 0.005, None);
        assert!((skin.nodes[disc.node] - Vec3::new(0.04, 0.02, 0.0)).norm() < 1e-12);
        assert!((Vec3::from(disc.normal) + Vec3::z()).norm() < 1e-12, "outward is down: {:?}", disc.normal);
        for span in disc.span {
            assert!(Vec3::from(span).z.abs() < 1e-12);
        }
        assert_eq!((disc.centre_mm, disc.radius_mm), ([41.0, 19.0, 0.0], 5.0));
    }
}
