//! Whether pokes and markers lie on the mesh, and which unit mistake would explain it when they do not.

use super::DatasetError;
use super::pokes::PokeFile;
use super::table::RowStart;
use crate::geometry::Vec3;
use crate::mesh::{MeshError, SurfaceIndex, TetMesh, boundary_triangles};
use crate::observation::{Poke, Recording};
use std::path::Path;

/// Metres a unit, and its name.
const UNITS: [(f64, &str); 4] =
    [(1e-3, "millimetres"), (1e-2, "centimetres"), (0.0254, "inches"), (1e-6, "micrometres")];

/// A body whose bounding box has a diagonal in this range (m) has the size of a phantom.
const BENCH_SIZES_M: std::ops::Range<f64> = 0.005..3.0;

/// Nearest-point look-ups on the whole boundary and on the observed surface of one mesh.
pub(super) struct Body<'a> {
    boundary: SurfaceIndex,
    observed: SurfaceIndex,
    diagonal_m: f64,
    mesh_file: &'a Path,
}

impl<'a> Body<'a> {
    pub(super) fn new(mesh: &TetMesh, mesh_file: &'a Path) -> Result<Self, MeshError> {
        Ok(Self {
            boundary: SurfaceIndex::new(mesh, &boundary_triangles(mesh)?),
            observed: SurfaceIndex::new(mesh, mesh.surface("observed")),
            diagonal_m: diagonal_m(mesh),
            mesh_file,
        })
    }

    /// Refuses a poke whose site is farther than its radius from the surface of the body.
    pub(super) fn check_sites(&self, file: &Path, read: &PokeFile) -> Result<(), DatasetError> {
        for (poke, &row) in read.pokes.iter().zip(&read.line) {
            let distance_m = distance(&self.boundary, &poke.site);
            if distance_m > poke.radius_m {
                let fits = |unit: f64| read.pokes.iter().all(|p| self.site_fits(p, unit));
                return Err(DatasetError::SiteOffSurface {
                    file: file.to_owned(),
                    row,
                    poke: poke.number,
                    site_m: poke.site.into(),
                    distance_m,
                    radius_m: poke.radius_m,
                    suspected: self.unit_mistake(file, "the sites", distance_m, fits),
                });
            }
        }
        Ok(())
    }

    /// Refuses a marker whose rest position is farther than the recording's limit from the observed surface.
    pub(super) fn check_markers(
        &self,
        file: &Path,
        first_row: &[RowStart],
        recording: &Recording,
        rest: &[(Vec3, usize)],
    ) -> Result<(), DatasetError> {
        let limit_m = recording.max_standoff_m;
        for (marker, (rest_position, _)) in rest.iter().enumerate() {
            let distance_m = distance(&self.observed, rest_position);
            if distance_m > limit_m {
                let fits = |unit: f64| {
                    let limit_m = limit_m * unit.max(1.0);
                    rest.iter().all(|(p, _)| distance(&self.observed, &(p * unit)) <= limit_m)
                };
                return Err(DatasetError::MarkerOffSurface {
                    file: file.to_owned(),
                    row: first_row[marker].line(file),
                    marker: recording.markers.numbers[marker],
                    rest_m: (*rest_position).into(),
                    distance_m,
                    limit_m,
                    suspected: self.unit_mistake(file, "the marker positions", distance_m, fits),
                });
            }
        }
        Ok(())
    }

    /// Whether the site would lie on the body if a unit of `pokes.csv` were `unit` units of the mesh. The
    /// radius may be in the sites' unit or in metres; one larger than the body is certainly in the sites'.
    fn site_fits(&self, poke: &Poke, unit: f64) -> bool {
        let same_unit = unit > 1.0 || poke.radius_m > self.diagonal_m;
        let radius = poke.radius_m * if same_unit { unit } else { 1.0 };
        distance(&self.boundary, &(poke.site * unit)) <= radius
    }

    /// Says which file has probably been written in which unit, when one factor makes every point of the other
    /// file fit. Of the two files the one is blamed whose lengths are not those of a bench.
    ///
    /// Points that would have to shrink must be farther off than the body is large: near the body any points
    /// fit when they are shrunk to the origin.
    fn unit_mistake(
        &self,
        file: &Path,
        points: &str,
        distance_m: f64,
        fits: impl Fn(f64) -> bool,
    ) -> Option<String> {
        let far = distance_m > self.diagonal_m;
        let plausible_mesh = BENCH_SIZES_M.contains(&self.diagonal_m);
        let (file, mesh) = (file.display(), self.mesh_file.display());
        UNITS.into_iter().find_map(|(metres, unit)| {
            if far && fits(metres) {
                Some(if plausible_mesh {
                    format!("{points} in {file} are in {unit}; expected metres")
                } else {
                    format!("{points} in {file} and the mesh {mesh} are in different units: times {metres} they fit")
                })
            } else if fits(1.0 / metres) {
                Some(format!(
                    "the mesh {mesh} is in {unit} (its diagonal is {}, and {points} in {file} fit it when multiplied by {}); expected metres",
                    self.diagonal_m,
                    1.0 / metres
                ))
            } else {
                None
            }
        })
    }
}

/// Diagonal of the mesh's bounding box (m).
pub(super) fn diagonal_m(mesh: &TetMesh) -> f64 {
    let mut low = Vec3::from_element(f64::INFINITY);
    let mut high = Vec3::from_element(f64::NEG_INFINITY);
    for p in &mesh.nodes {
        low = low.inf(p);
        high = high.sup(p);
    }
    (high - low).norm()
}

fn distance(surface: &SurfaceIndex, p: &Vec3) -> f64 {
    surface.nearest(p).map_or(f64::INFINITY, |a| a.distance_m)
}
