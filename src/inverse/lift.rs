//! What of the stage's motion a tip answers to: displacement → entries of the drive.
//!
//! Everything observed in a poke is linear in the drive. A bonded tip answers to all of the displacement. One that
//! may lift off and slide, free of friction, answers to the depth alone: a pad or a flat face in proportion to it, a
//! sphere like `δ^1.5` at first (Hertz 1882), and, with the body's own give, as a power series in `√δ` that begins
//! there; four terms of it leave some 10⁻⁴.
//!
//! A sphere to which the phantom sticks follows such a series while it is pressed deeper along its path. Drawn back it
//! keeps its contact, and answers along the series' tangent at the deepest place so far: with the same coefficients.
//! What the stage leaves its path aside moves the contact, whose radius grows like `√δ`, along as a rigid face.

use super::error::InverseError;
use super::evidence::{DRIVE, Drive, Driven};
use crate::fem::{FemError, Order, Space, Spot};
use crate::geometry::{Mat3, Vec3, basis_from_axis};
use crate::observation::{Contact, Poke, Recording, Tip, TipShape};
use nalgebra::{SMatrix, SVector};

/// Covariance of the drive's own noise.
pub type DriveNoise = SMatrix<f64, DRIVE, DRIVE>;

/// Terms of the series: `s³ … s⁶`, `s = √(δ / deepest)`.
pub(super) const TERMS: usize = 4;

/// Entry of the first of the two ways aside.
pub(super) const ASIDE: usize = TERMS;

/// From the stage's displacement, or the wrench, to the drive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Lift {
    /// All of it.
    Whole,
    /// The part that presses along this inward normal.
    Depth(Vec3),
    /// The series in the depth along an inward normal.
    Series {
        /// Unit normal into the body.
        inward: Vec3,
        /// Depth (m) at which every term is 1.
        deepest_m: f64,
    },
    /// The series along a path, its tangent on the way back, and the way aside.
    Sticking {
        /// Unit normal into the body.
        inward: Vec3,
        /// Displacement for a unit of depth.
        path: Vec3,
        /// Depth (m) at which every term is 1.
        deepest_m: f64,
    },
}

/// What a displacement of the tip gives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Driving {
    /// The drive.
    pub x: Drive,
    /// Covariance of its own noise, to first order.
    pub noise: DriveNoise,
    /// How deep the tip is (m), along the poke or the inward normal; 0 when the wrench drives the model.
    pub depth_m: f64,
}

/// A poke enters a face whose outward normal has less than this component along its direction.
const ENTERED: f64 = -0.2;

/// Faces that a poke in `direction` may enter: a site on an edge of the body belongs to one of these.
pub(super) fn entered(space: &Space, direction: &Vec3) -> Vec<usize> {
    (0..space.faces().len())
        .filter(|&face| space.face_triangle(face).normal().dot(direction) < ENTERED)
        .collect()
}

/// The lift of every poke.
pub(super) fn lifts(recording: &Recording, driven: Driven) -> Result<Vec<Lift>, InverseError> {
    let Tip { contact, shape } = recording.tip;
    let whole = contact == Contact::Bonded && !matches!(shape, TipShape::Sphere { .. });
    let Some(stage) = recording.stage.as_ref().filter(|_| driven == Driven::ByStage && !whole) else {
        return Ok(vec![Lift::Whole; recording.pokes.len()]);
    };
    let space = Space::new(&recording.mesh, Order::P1).map_err(FemError::from)?;
    let deepest_m =
        stage.displacement_m.iter().map(|d| Vec3::from(*d).norm()).fold(f64::MIN_POSITIVE, f64::max);
    recording
        .pokes
        .iter()
        .map(|poke: &Poke| {
            let spot = Spot::disc(&space, &entered(&space, &poke.direction), &poke.site, poke.radius_m)?;
            let inward = spot.as_disc().map_or(poke.direction, |(disc, _)| -disc.normal);
            let along = poke.direction.dot(&inward);
            Ok(match (shape, contact) {
                (TipShape::Pad | TipShape::Flat, _) => Lift::Depth(inward),
                (TipShape::Sphere { .. }, Contact::Unilateral) => Lift::Series { inward, deepest_m },
                (TipShape::Sphere { .. }, Contact::Bonded) => {
                    Lift::Sticking { inward, path: poke.direction / along, deepest_m }
                }
            })
        })
        .collect()
}

impl Lift {
    /// What a `displacement` (m) gives of a stage whose noise has this standard deviation (m) along each axis. Before
    /// it the tip was as deep as `deepest` (m) along the inward normal; `direction` is the poke's.
    pub(super) fn driving(
        &self,
        displacement: &Vec3,
        deepest: f64,
        stage_m: [f64; 3],
        direction: &Vec3,
    ) -> Driving {
        // Derivative of the drive along each axis of the displacement.
        let mut slope = SMatrix::<f64, DRIVE, 3>::zeros();
        let mut x = Drive::zeros();
        let depth = self.inward().map_or(displacement.dot(direction), |inward| displacement.dot(&inward));
        match self {
            Self::Whole => {
                x.fixed_rows_mut::<3>(0).copy_from(displacement);
                slope.fixed_rows_mut::<3>(0).fill_diagonal(1.0);
            }
            Self::Depth(inward) if depth > 0.0 => {
                x.fixed_rows_mut::<3>(0).copy_from(&(inward * depth));
                slope.fixed_rows_mut::<3>(0).copy_from(&(inward * inward.transpose()));
            }
            Self::Series { inward, deepest_m } if depth > 0.0 => {
                let rates = rates(depth / deepest_m) / *deepest_m;
                x.fixed_rows_mut::<TERMS>(0).copy_from_slice(&terms(depth / deepest_m));
                slope.fixed_rows_mut::<TERMS>(0).copy_from(&(rates * inward.transpose()));
            }
            Self::Sticking { inward, path, deepest_m } if depth.max(deepest) > 0.0 => {
                let most = depth.max(deepest);
                let rates = rates(most / deepest_m) / *deepest_m;
                let series = SVector::from(terms(most / deepest_m)) + rates * (depth - most);
                x.fixed_rows_mut::<TERMS>(0).copy_from(&series);
                slope.fixed_rows_mut::<TERMS>(0).copy_from(&(rates * inward.transpose()));
                // The contact's radius goes with √δ; the noise of the depth is left out of it.
                let size = (most / deepest_m).sqrt();
                let off_path = Mat3::identity() - path * inward.transpose();
                let basis = basis_from_axis(inward);
                let aside = basis.fixed_columns::<2>(0).transpose() * off_path * size;
                x.fixed_rows_mut::<2>(ASIDE).copy_from(&(aside * displacement));
                slope.fixed_rows_mut::<2>(ASIDE).copy_from(&aside);
            }
            // Off the phantom.
            Self::Depth(_) | Self::Series { .. } | Self::Sticking { .. } => {}
        }
        let variance = Mat3::from_diagonal(&Vec3::from(stage_m.map(|s| s * s)));
        Driving { x, noise: slope * variance * slope.transpose(), depth_m: depth }
    }

    /// The inward normal along which the depth counts, if it does.
    pub(super) fn inward(&self) -> Option<Vec3> {
        match self {
            Self::Whole => None,
            Self::Depth(inward) | Self::Series { inward, .. } | Self::Sticking { inward, .. } => {
                Some(*inward)
            }
        }
    }
}

/// The terms at a share of the deepest depth.
pub(super) fn terms(share: f64) -> [f64; TERMS] {
    let s = share.sqrt();
    std::array::from_fn(|j| s.powi(j as i32 + 3))
}

/// Their derivatives by that share.
fn rates(share: f64) -> SVector<f64, TERMS> {
    let s = share.sqrt();
    SVector::from_fn(|j, _| 0.5 * (j + 3) as f64 * s.powi(j as i32 + 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The drive's noise is what a small error of the displacement does to the drive, going deeper and drawn back; off
    /// the phantom only a tip that sticks answers.
    #[test]
    fn noise_follows_the_slope() {
        let inward = Vec3::new(0.6, 0.0, -0.8);
        let displacement = Vec3::new(3e-4, 1e-4, -9e-4);
        let stage_m = [1e-5_f64, 2e-5, 3e-5];
        let deepest_m = 2e-3;
        // On its path, where what the depth's noise does to the size of the contact moves nothing aside.
        let path = displacement / displacement.dot(&inward);
        let sticking = Lift::Sticking { inward, path, deepest_m };
        for lift in [Lift::Whole, Lift::Depth(inward), Lift::Series { inward, deepest_m }, sticking] {
            for before in [0.0, 1.5e-3] {
                let at = |d: Vec3| lift.driving(&d, before, stage_m, &inward);
                let mut expected = DriveNoise::zeros();
                for axis in 0..3 {
                    let mut step = Vec3::zeros();
                    step[axis] = 1e-9;
                    let slope = (at(displacement + step).x - at(displacement - step).x) / 2e-9;
                    expected += slope * slope.transpose() * stage_m[axis].powi(2);
                }
                let here = at(displacement);
                assert!((here.noise - expected).norm() < 1e-6 * expected.norm(), "{lift:?}");
                assert!((here.depth_m - displacement.dot(&inward)).abs() < 1e-18);
                let sticks = lift == Lift::Whole || lift == sticking && before > 0.0;
                assert_eq!(at(-displacement).x.norm() > 0.0, sticks, "{lift:?}");
            }
        }
    }
}
