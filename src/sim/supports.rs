//! What touches the phantom, as rows on the mesh: tips, spring patches and glued spots.
//!
//! Everything that touches does so over a flat disc on one side of the block. A support is a traction t(x) = λ φ(x)
//! on its disc, with ∫ φ = 1 for the first; it resists the displacement that does work on it, ∫ φ u. In the
//! equations of the bench every support obeys
//!
//!   ∫ φ u dA + D f = g,
//!
//! f the force that the phantom exerts on it along an axis (N): a tip has D = 0 and g the stage's displacement, a
//! spring patch D = 1/k and g = 0, a glued spot D = 0 and g = 0 for each of its functions.
//!
//! A disc is not meshed: its integrals are sums over polar points, each looked up in the mesh. The points are so
//! dense that what they get wrong where a shape function has a kink is far below the mesh's own error; force and
//! first moment are exact.

use super::SimError;
use super::hex_mesh::{Feature, Place, Slab};
use super::legendre::gauss_legendre;
use super::unknowns::{Row, Unknowns};
use crate::geometry::Vec3;
use std::f64::consts::TAU;

/// Points along the radius and around the disc.
const RADIAL: usize = 32;
const AROUND: usize = 160;
/// Highest power of x and y in the traction under a glued spot.
const GLUE_DEGREE: usize = 4;
/// Polynomials in two variables up to that degree.
const HELD: usize = 15;

/// What holds the underside besides the known glue.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Restraint {
    /// Springs that pull as a uniform traction over a disc, in proportion to its mean displacement.
    Springs {
        /// Centre of the disc (m).
        centre_m: [f64; 3],
        /// Radius of the disc (m).
        radius_m: f64,
        /// Total stiffness (N/m), the same along all three axes.
        stiffness_n_per_m: f64,
    },
    /// A disc that does not move.
    Glued {
        /// Centre of the disc (m).
        centre_m: [f64; 3],
        /// Radius of the disc (m).
        radius_m: f64,
    },
}

/// A disc on a side of the block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Patch {
    pub(super) centre: [f64; 3],
    /// The axis along the side's normal.
    pub(super) axis: usize,
    pub(super) radius: f64,
}

/// How a traction is spread over its disc.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shape {
    /// Evenly: a pad, a spring patch.
    Uniform,
    /// As it takes to hold the disc still: polynomials over √(1 − r²/a²).
    ///
    /// Under a rigid disc on a half-space a polynomial displacement comes with just such a traction (Galin 1946;
    /// Johnson 1985, section 3.2 and equation 3.34 for the flat punch), so a few of them converge fast although
    /// the traction is unbounded at the rim.
    Held,
}

impl Shape {
    /// Number of support functions.
    pub(super) fn functions(self) -> usize {
        match self {
            Self::Uniform => 1,
            Self::Held => HELD,
        }
    }

    /// The functions at `(x, y)` radii from the centre, relative to the weights of [`polar`].
    pub(super) fn values(self, x: f64, y: f64) -> Vec<f64> {
        match self {
            Self::Uniform => vec![1.0],
            Self::Held => {
                let (in_x, in_y) = (chebyshev(x), chebyshev(y));
                (0..=GLUE_DEGREE).flat_map(|n| (0..=n).map(move |p| in_x[n - p] * in_y[p])).collect()
            }
        }
    }
}

/// One support function: the row that gives ∫ φ u and the compliance D (m/N).
#[derive(Debug, Clone)]
pub(super) struct Support {
    pub(super) row: Row,
    pub(super) compliance: f64,
}

impl Patch {
    /// A disc on the side of the block whose normal is nearest to `normal`; refused when it lies off it or overhangs.
    pub(super) fn on(
        slab: &Slab,
        what: &'static str,
        centre_m: [f64; 3],
        normal: Vec3,
        radius_m: f64,
    ) -> Result<Self, SimError> {
        let axis = normal.abs().imax();
        // From the two sides that the disc may lie on, and how far it is from the edges, inwards.
        let room = |a: usize| [centre_m[a], slab.size_m[a] - centre_m[a]];
        let above_m = -room(axis).into_iter().min_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or_default();
        if above_m.is_nan() || above_m.abs() >= 1e-9 {
            return Err(SimError::DiscBesideSurface { what, centre_m, above_m });
        }
        let inside = (0..3).filter(|a| *a != axis).all(|a| room(a).into_iter().all(|m| m >= radius_m));
        if !inside || radius_m.is_nan() || radius_m <= 0.0 {
            return Err(SimError::DiscOffSurface { what, centre_m, radius_m, size_m: slab.size_m });
        }
        Ok(Self { centre: centre_m, axis, radius: radius_m })
    }

    /// Grades the mesh towards the rim: cells of `share` radii there, longer by `growth` of the distance elsewhere.
    pub(super) fn feature(&self, share: f64, growth: f64) -> Feature {
        let Self { centre, axis, radius } = *self;
        Feature { place: Place::Rim { centre, axis, radius }, cell_m: share * radius, growth }
    }

    /// The point at `(x, y)` radii from the centre.
    pub(super) fn point(&self, x: f64, y: f64) -> [f64; 3] {
        let mut point = self.centre;
        point[(self.axis + 1) % 3] += self.radius * x;
        point[(self.axis + 2) % 3] += self.radius * y;
        point
    }

    /// ∫ φ u for each support function.
    pub(super) fn rows(&self, shape: Shape, unknowns: &Unknowns) -> Vec<Row> {
        let count = shape.functions();
        let mut sums = vec![0.0; count * unknowns.position.len()];
        for (x, y, weight) in polar(RADIAL, AROUND, shape) {
            let values = shape.values(x, y);
            for (node, share) in unknowns.row_at(self.point(x, y)) {
                for (sum, value) in sums[count * node as usize..].iter_mut().zip(&values) {
                    *sum += weight * share * value;
                }
            }
        }
        let row = |f: usize| {
            let entries = sums.chunks_exact(count).zip(0..).filter(|(s, _)| s[f] != 0.0);
            entries.map(|(s, node)| (node, s[f])).collect()
        };
        (0..count).map(row).collect()
    }
}

/// Chebyshev polynomials of the first kind on [−1, 1], by degree: they keep the functions of `hold` well apart.
fn chebyshev(x: f64) -> [f64; GLUE_DEGREE + 1] {
    let mut values = [1.0; GLUE_DEGREE + 1];
    values[1] = x;
    for n in 2..=GLUE_DEGREE {
        values[n] = 2.0 * x * values[n - 1] - values[n - 2];
    }
    values
}

/// Points of the unit disc with weights of sum 1, uniform in the angle and, for an even traction, in r²: uniform in
/// area. For that of a held disc they are uniform in m = √(1 − r²), as ∫ f / √(1 − r²) r dr = ∫ f dm.
pub(super) fn polar(radial: usize, around: usize, shape: Shape) -> impl Iterator<Item = (f64, f64, f64)> {
    gauss_legendre(radial).into_iter().enumerate().flat_map(move |(ring, (s, weight))| {
        let r = match shape {
            Shape::Uniform => s.sqrt(),
            Shape::Held => (1.0 - s * s).sqrt(),
        };
        (0..around).map(move |i| {
            // Rings are turned against each other so that no row of points runs along a row of cells.
            let angle = TAU * (i as f64 + 0.382 * ring as f64) / around as f64;
            (r * angle.cos(), r * angle.sin(), weight / around as f64)
        })
    })
}

impl Restraint {
    /// The disc on the underside that the restraint acts on.
    pub(super) fn patch(&self, slab: &Slab) -> Result<Patch, SimError> {
        match *self {
            Self::Springs { centre_m, radius_m, .. } => {
                Patch::on(slab, "spring patch", centre_m, -Vec3::z(), radius_m)
            }
            Self::Glued { centre_m, radius_m } => {
                Patch::on(slab, "glued spot", centre_m, -Vec3::z(), radius_m)
            }
        }
    }

    /// How its traction is spread.
    pub(super) fn shape(&self) -> Shape {
        match self {
            Self::Springs { .. } => Shape::Uniform,
            Self::Glued { .. } => Shape::Held,
        }
    }

    /// Compliance D of each of its support functions (m/N).
    pub(super) fn compliance(&self) -> f64 {
        match *self {
            Self::Springs { stiffness_n_per_m, .. } => 1.0 / stiffness_n_per_m,
            Self::Glued { .. } => 0.0,
        }
    }

    /// Its support functions on a mesh of `slab`.
    pub(super) fn supports(&self, unknowns: &Unknowns) -> Result<Vec<Support>, SimError> {
        let rows = self.patch(&unknowns.mesh.slab)?.rows(self.shape(), unknowns);
        Ok(rows.into_iter().map(|row| Support { row, compliance: self.compliance() }).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_disc_off_the_surface_and_one_over_an_edge_are_told_apart() {
        let slab = Slab { size_m: [0.1, 0.15, 0.025], glue_end_m: 0.04 };
        let on = |centre_m: [f64; 3]| Patch::on(&slab, "tip", centre_m, Vec3::z(), 0.008);
        let said = |centre_m| on(centre_m).expect_err("refused").to_string();
        assert!(on([0.05, 0.07, 0.025]).is_ok() && on([0.05, 0.07, 0.0]).is_ok());
        let above = said([0.05, 0.07, 0.025_071]);
        assert!(
            above.starts_with("the tip at (50.000, 70.000, 25.071) mm lies 0.071 mm above the surface"),
            "{above}"
        );
        assert!(said([0.05, 0.07, 0.024]).contains("lies 1.000 mm below the surface"));
        assert!(said([0.005, 0.07, 0.025]).contains("does not lie wholly on one side"));
        assert!(on([0.05, 0.07, f64::NAN]).is_err() && on([f64::NAN, 0.07, 0.025]).is_err());
    }
}
