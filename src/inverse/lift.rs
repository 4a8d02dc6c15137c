//! What of the stage's motion a tip answers to: displacement → entries of the drive.
//!
//! Everything observed in a poke is linear in the drive. A bonded tip answers to all of the displacement. One that
//! may lift off and slide, free of friction, answers to the depth alone: a pad or a flat face in proportion to it, a
//! sphere like `δ^1.5` at first (Hertz 1882), and, with the body's own give, as a power series in `√δ` that begins
//! there; four terms of it leave some 10⁻⁴.

use super::error::InverseError;
use super::evidence::{DRIVE, Drive, Driven};
use crate::fem::{FemError, Order, Space, Spot};
use crate::geometry::{Mat3, Vec3};
use crate::observation::{Contact, Poke, Recording, TipShape};
use nalgebra::SMatrix;

/// Covariance of the drive's own noise.
pub(super) type DriveNoise = SMatrix<f64, DRIVE, DRIVE>;

/// Terms of the series: `s³ … s⁶`, `s = √(δ / deepest)`.
pub(super) const TERMS: usize = 4;

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
    let unilateral = recording.tip.contact == Contact::Unilateral;
    let Some(stage) = recording.stage.as_ref().filter(|_| driven == Driven::ByStage && unilateral) else {
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
            Ok(match recording.tip.shape {
                TipShape::Pad | TipShape::Flat => Lift::Depth(inward),
                TipShape::Sphere { .. } => Lift::Series { inward, deepest_m },
            })
        })
        .collect()
}

impl Lift {
    /// Writes the entries that a displacement gives.
    pub fn write(&self, displacement: &Vec3, drive: &mut Drive) {
        match self {
            Self::Whole => drive.fixed_rows_mut::<3>(0).copy_from(displacement),
            Self::Depth(inward) => {
                let depth = displacement.dot(inward).max(0.0);
                drive.fixed_rows_mut::<3>(0).copy_from(&(inward * depth));
            }
            Self::Series { inward, deepest_m } => {
                let depth = displacement.dot(inward).max(0.0);
                drive.fixed_rows_mut::<TERMS>(0).copy_from_slice(&terms(depth / deepest_m));
            }
        }
    }

    /// Depth (m) along `direction`, or along the inward normal, to which a drive belongs.
    pub fn depth(&self, drive: &Drive, direction: &Vec3) -> f64 {
        match self {
            Self::Whole => drive.fixed_rows::<3>(0).dot(direction),
            Self::Depth(inward) => drive.fixed_rows::<3>(0).dot(inward),
            Self::Series { deepest_m, .. } => drive[0].max(0.0).cbrt().powi(2) * deepest_m,
        }
    }

    /// Covariance that the stage's noise (one standard deviation along each axis, m) gives to a drive, to first order.
    pub(super) fn noise(&self, stage_m: [f64; 3], drive: &Drive) -> DriveNoise {
        let variance = Mat3::from_diagonal(&Vec3::from(stage_m.map(|s| s * s)));
        let mut noise = DriveNoise::zeros();
        match self {
            Self::Whole => noise.fixed_view_mut::<3, 3>(0, 0).copy_from(&variance),
            Self::Depth(inward) => {
                let pressed = if drive.fixed_rows::<3>(0).norm_squared() > 0.0 { 1.0 } else { 0.0 };
                let along = inward.dot(&(variance * inward)) * pressed;
                noise.fixed_view_mut::<3, 3>(0, 0).copy_from(&(inward * inward.transpose() * along));
            }
            Self::Series { inward, deepest_m } => {
                let s = drive[0].max(0.0).cbrt();
                // d(sᵏ)/dδ = k sᵏ⁻² / 2 deepest.
                let slope = SMatrix::<f64, TERMS, 1>::from_fn(|j, _| {
                    0.5 * (j + 3) as f64 * s.powi(j as i32 + 1) / deepest_m
                });
                let along = inward.dot(&(variance * inward));
                noise.fixed_view_mut::<TERMS, TERMS>(0, 0).copy_from(&(slope * slope.transpose() * along));
            }
        }
        noise
    }
}

/// The terms at a share of the deepest depth.
pub(super) fn terms(share: f64) -> [f64; TERMS] {
    let s = share.sqrt();
    std::array::from_fn(|j| s.powi(j as i32 + 3))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The drive's noise is what a small error of the displacement does to the drive.
    #[test]
    fn noise_follows_the_slope() {
        let inward = Vec3::new(0.6, 0.0, -0.8);
        let displacement = Vec3::new(3e-4, 1e-4, -9e-4);
        let drive = |lift: &Lift, d: &Vec3| {
            let mut drive = Drive::zeros();
            lift.write(d, &mut drive);
            drive
        };
        let stage_m = [1e-5_f64, 2e-5, 3e-5];
        for lift in [Lift::Whole, Lift::Depth(inward), Lift::Series { inward, deepest_m: 2e-3 }] {
            let here = drive(&lift, &displacement);
            let mut expected = DriveNoise::zeros();
            for axis in 0..3 {
                let mut step = Vec3::zeros();
                step[axis] = 1e-9;
                let slope =
                    (drive(&lift, &(displacement + step)) - drive(&lift, &(displacement - step))) / 2e-9;
                expected += slope * slope.transpose() * stage_m[axis].powi(2);
            }
            let noise = lift.noise(stage_m, &here);
            assert!((noise - expected).norm() < 1e-6 * expected.norm(), "{lift:?}");
            let off = drive(&lift, &-displacement);
            assert_eq!(off.norm() > 0.0, lift == Lift::Whole);
            let depth = lift.depth(&here, &inward);
            assert!((depth / displacement.dot(&inward) - 1.0).abs() < 1e-12, "{lift:?}: {depth}");
        }
    }
}
