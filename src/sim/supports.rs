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
const GLUE_DEGREE: i32 = 4;

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
    centre: [f64; 3],
    /// The axis along the side's normal.
    axis: usize,
    radius: f64,
}

/// One support function: the row that gives ∫ φ u and the compliance D (m/N).
#[derive(Debug, Clone)]
pub(super) struct Support {
    pub(super) row: Row,
    pub(super) compliance: f64,
}

impl Patch {
    /// A disc on the side of the block whose normal is nearest to `normal`; refused when it overhangs.
    pub(super) fn on(
        slab: &Slab,
        what: &'static str,
        centre_m: [f64; 3],
        normal: Vec3,
        radius_m: f64,
    ) -> Result<Self, SimError> {
        let axis = normal.abs().imax();
        let inside = (0..3).all(|a| {
            let (low, high) = (centre_m[a], slab.size_m[a] - centre_m[a]);
            if a == axis { low.abs().min(high.abs()) < 1e-9 } else { low.min(high) >= radius_m }
        });
        if !inside || radius_m.is_nan() || radius_m <= 0.0 {
            return Err(SimError::DiscOffSurface { what, centre_m, radius_m, size_m: slab.size_m });
        }
        Ok(Self { centre: centre_m, axis, radius: radius_m })
    }

    /// Grades the mesh towards the rim: cells of `share` radii there.
    pub(super) fn feature(&self, share: f64) -> Feature {
        let Self { centre, axis, radius } = *self;
        Feature { place: Place::Rim { centre, axis, radius }, cell_m: share * radius }
    }

    /// The point at `(x, y)` radii from the centre.
    fn point(&self, x: f64, y: f64) -> [f64; 3] {
        let mut point = self.centre;
        point[(self.axis + 1) % 3] += self.radius * x;
        point[(self.axis + 2) % 3] += self.radius * y;
        point
    }

    /// ∫ φ u for several φ: `points` are `(x, y, weight)` in radii, `functions` their values times the weight.
    fn rows<const N: usize>(
        &self,
        unknowns: &Unknowns,
        points: impl Iterator<Item = (f64, f64, f64)>,
        functions: impl Fn(f64, f64) -> [f64; N],
    ) -> [Row; N] {
        let mut sums = vec![[0.0; N]; unknowns.position.len()];
        for (x, y, weight) in points {
            let values = functions(x, y);
            for (node, share) in unknowns.row_at(self.point(x, y)) {
                for (sum, value) in sums[node as usize].iter_mut().zip(values) {
                    *sum += weight * share * value;
                }
            }
        }
        std::array::from_fn(|f| {
            let entries = sums.iter().zip(0..).filter(|(s, _)| s[f] != 0.0);
            entries.map(|(s, node)| (node, s[f])).collect()
        })
    }

    /// The mean over the disc: a uniform traction.
    pub(super) fn mean(&self, unknowns: &Unknowns) -> Row {
        // Uniform in area: r² is uniform.
        let points = polar(|s| s.sqrt());
        let [row] = self.rows(unknowns, points, |_, _| [1.0]);
        row
    }

    /// Tractions that hold a disc still: polynomials over √(1 − r²/a²).
    ///
    /// Under a rigid disc on a half-space a polynomial displacement comes with just such a traction (Galin 1946;
    /// Johnson 1985, section 3.2 and equation 3.34 for the flat punch), so a few of them converge fast although
    /// the traction is unbounded at the rim.
    pub(super) fn hold(&self, unknowns: &Unknowns) -> Vec<Row> {
        // ∫ f / √(1 − r²) r dr = ∫ f(√(1 − m²)) dm: uniform in m = √(1 − r²).
        let points = polar(|m| (1.0 - m * m).sqrt());
        let rows = self.rows(unknowns, points, |x, y| {
            let mut values = [0.0; 15];
            let powers = (0..=GLUE_DEGREE).flat_map(|n| (0..=n).map(move |p| (n - p, p)));
            for (value, (p, q)) in values.iter_mut().zip(powers) {
                *value = chebyshev(p, x) * chebyshev(q, y);
            }
            values
        });
        rows.into()
    }
}

/// Chebyshev polynomial of the first kind on [−1, 1]: keeps the functions of `hold` well apart.
fn chebyshev(n: i32, x: f64) -> f64 {
    match n {
        0 => 1.0,
        1 => x,
        _ => 2.0 * x * chebyshev(n - 1, x) - chebyshev(n - 2, x),
    }
}

/// Points of the unit disc with weights of sum 1, uniform in the angle and in s ∈ [0, 1], r = `radius(s)`.
fn polar(radius: impl Fn(f64) -> f64) -> impl Iterator<Item = (f64, f64, f64)> {
    gauss_legendre(RADIAL).into_iter().enumerate().flat_map(move |(ring, (s, weight))| {
        let r = radius(s);
        (0..AROUND).map(move |i| {
            // Rings are turned against each other so that no row of points runs along a row of cells.
            let angle = TAU * (i as f64 + 0.382 * ring as f64) / AROUND as f64;
            (r * angle.cos(), r * angle.sin(), weight / AROUND as f64)
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

    /// Its support functions on a mesh of `slab`.
    pub(super) fn supports(&self, unknowns: &Unknowns) -> Result<Vec<Support>, SimError> {
        let patch = self.patch(&unknowns.mesh.slab)?;
        Ok(match *self {
            Self::Springs { stiffness_n_per_m, .. } => {
                vec![Support { row: patch.mean(unknowns), compliance: 1.0 / stiffness_n_per_m }]
            }
            Self::Glued { .. } => {
                patch.hold(unknowns).into_iter().map(|row| Support { row, compliance: 0.0 }).collect()
            }
        })
    }
}
