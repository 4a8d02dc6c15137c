//! A disc of the half-space's surface cut into cells of even pressure, for contact that is not known beforehand.
//!
//! Cells lie in rings that crowd towards the rim, where a rigid face's pressure has no bound. The normal displacement
//! under an even pressure on a flat polygon is a sum over its edges (the potential of a polygon, Love 1929), averaged
//! here over every cell: Galerkin's conditions, so that the total force converges twice as fast as the pressure. On
//! the disc of unit radius the table is the same for every body; radius and material only scale it.

use super::element::gauss_legendre;
use nalgebra::DMatrix;
use std::f64::consts::{PI, TAU};

/// Cells on the disc of unit radius.
#[derive(Debug, Clone)]
pub(super) struct Cells {
    /// Points of every cell, with weights that sum to 1.
    pub points: Vec<Vec<([f64; 2], f64)>>,
    /// Whether a cell lies in the outermost ring.
    pub outermost: Vec<bool>,
    /// Area of every cell; the disc has π.
    pub areas: Vec<f64>,
    /// Mean over cell `i` of `∫ dA / |x − y|` over cell `j`, per area of `j`.
    potential: DMatrix<f64>,
}

/// Rings: a face pressed straight down is then right to 10⁻⁴, one that is tilted to 10⁻³, a sphere whose contact
/// covers four fifths of the disc's radius or more to 2·10⁻³.
const RINGS: u32 = 10;
/// Most cells of a ring; the inner ones have 6, 12, 18.
const MOST: usize = 24;
/// Rings crowd towards the rim by this power.
const CROWDING: i32 = 3;
/// Straight edges around the disc; every ring's cells end on their corners.
const EDGES: usize = 72;
/// Points along each side of a cell.
const POINTS: usize = 3;

impl Cells {
    /// Cuts the disc.
    pub(super) fn new() -> Self {
        // The polygon has the disc's area.
        let step = TAU / EDGES as f64;
        let swell = (step / step.sin()).sqrt();
        let at = |radius: f64, i: usize| {
            let (sin, cos) = (step * i as f64).sin_cos();
            [swell * radius * cos, swell * radius * sin]
        };
        let mut polygons = Vec::new();
        let mut areas = Vec::new();
        let mut points = Vec::new();
        let mut rings = Vec::new();
        let mut inner = 0.0_f64;
        for ring in 1..=RINGS {
            let outer = 1.0 - (1.0 - f64::from(ring) / f64::from(RINGS)).powi(CROWDING);
            let count = (6 * ring as usize).min(MOST);
            let each = EDGES / count;
            rings.push(Ring { first: polygons.len(), count });
            for cell in 0..count {
                let corners = cell * each..=(cell + 1) * each;
                let mut polygon: Vec<[f64; 2]> = corners.clone().map(|i| at(outer, i)).collect();
                if inner > 0.0 {
                    polygon.extend(corners.rev().map(|i| at(inner, i)));
                } else {
                    polygon.push([0.0, 0.0]);
                }
                polygons.push(polygon);
                areas.push(PI * (outer * outer - inner * inner) / count as f64);
                points.push(inside(inner, outer, TAU / count as f64 * cell as f64, TAU / count as f64));
            }
            inner = outer;
        }
        let outermost = (0..polygons.len()).map(|i| rings.last().is_some_and(|r| i >= r.first)).collect();
        let potential = table(&polygons, &areas, &points, &rings);
        Self { points, outermost, areas, potential }
    }

    /// Mean normal displacement of cell `i` under a unit force spread over cell `j` of the disc of `radius` (m) on
    /// the half-space, for a unit modulus (1/m): `(1 − ν²) / π` times the potential (Boussinesq 1885).
    pub(super) fn compliance(&self, radius: f64, nu: f64) -> DMatrix<f64> {
        &self.potential * ((1.0 - nu * nu) / (PI * radius))
    }
}

/// Cells of one ring.
struct Ring {
    first: usize,
    count: usize,
}

impl Ring {
    /// The cell `sixths` of a turn further on.
    fn turned(&self, cell: usize, sixths: usize) -> usize {
        self.first + (cell - self.first + sixths * self.count / 6) % self.count
    }
}

/// Points of the part of a ring that starts at the angle `from` and is `wide`.
fn inside(inner: f64, outer: f64, from: f64, wide: f64) -> Vec<([f64; 2], f64)> {
    let line = gauss_legendre(POINTS);
    let along = line.clone();
    line.iter()
        .flat_map(|&(u, wu)| {
            let rho = (inner * inner + u * (outer * outer - inner * inner)).sqrt();
            along.iter().map(move |&(v, wv)| {
                let (sin, cos) = (from + wide * v).sin_cos();
                ([rho * cos, rho * sin], wu * wv)
            })
        })
        .collect()
}

/// The table of mean potentials: sources in the first sixth of the disc, the rest by turning.
fn table(
    polygons: &[Vec<[f64; 2]>],
    areas: &[f64],
    points: &[Vec<([f64; 2], f64)>],
    rings: &[Ring],
) -> DMatrix<f64> {
    let mut table = DMatrix::zeros(polygons.len(), polygons.len());
    for source in rings {
        for from in source.first..source.first + source.count / 6 {
            for target in rings {
                for to in target.first..target.first + target.count {
                    let mean: f64 = points[to].iter().map(|&(p, w)| w * potential(&polygons[from], p)).sum();
                    for sixths in 0..6 {
                        table[(target.turned(to, sixths), source.turned(from, sixths))] = mean / areas[from];
                    }
                }
            }
        }
    }
    // The means are taken by a rule over the seeing cell only; the mean of both readings is symmetric exactly.
    (&table + table.transpose()) * 0.5
}

/// `∫ dA / |x − p|` over a polygon, anticlockwise: every edge at distance `d` (positive to its left) contributes
/// `d [asinh(t/|d|)]` between its ends.
fn potential(polygon: &[[f64; 2]], p: [f64; 2]) -> f64 {
    let mut sum = 0.0;
    for (k, a) in polygon.iter().enumerate() {
        let b = polygon[(k + 1) % polygon.len()];
        let along = [b[0] - a[0], b[1] - a[1]];
        let length = along[0].hypot(along[1]);
        let arm = [a[0] - p[0], a[1] - p[1]];
        let distance = (arm[0] * along[1] - arm[1] * along[0]) / length;
        if distance.abs() > 1e-13 {
            let start = (arm[0] * along[0] + arm[1] * along[1]) / length;
            sum +=
                distance * (((start + length) / distance.abs()).asinh() - (start / distance.abs()).asinh());
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DVector;

    /// A square's potential at its middle is `4 ln(1 + √2)` times its side.
    #[test]
    fn a_square_has_its_closed_form() {
        let square = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];
        assert!((potential(&square, [1.0, 1.0]) - 8.0 * (1.0 + 2.0_f64.sqrt()).ln()).abs() < 1e-13);
    }

    /// A rigid face: `2a / (1 − ν²)` for a unit displacement (Boussinesq 1885), `4a³ / 3(1 − ν²)` for a unit tilt
    /// (Borowicka 1943).
    #[test]
    fn a_rigid_face_has_its_closed_forms() {
        let (cells, radius, nu) = (Cells::new(), 0.005, 0.47);
        let factor = cells.compliance(radius, nu).cholesky().expect("positive definite");
        let n = cells.points.len();
        let straight = factor.solve(&DVector::from_element(n, 1.0)).sum();
        assert!((straight * (1.0 - nu * nu) / (2.0 * radius) - 1.0).abs() < 5e-4, "{straight}");
        let mean = |c: usize| cells.points[c].iter().map(|(p, w)| radius * p[0] * w).sum::<f64>();
        let x = DVector::from_fn(n, |c, _| mean(c));
        let tilted = factor.solve(&x).dot(&x);
        let closed = 4.0 * radius.powi(3) / (3.0 * (1.0 - nu * nu));
        assert!((tilted / closed - 1.0).abs() < 2e-3, "{}", tilted / closed);
    }
}
