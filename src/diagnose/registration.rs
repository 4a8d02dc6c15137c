//! Where on the phantom the markers are: what they would show had the camera been registered elsewhere.
//!
//! A marker is attached to the body where the camera sees it at rest. A camera that is taken to stand elsewhere than it does
//! turns displacements, and besides attaches every marker beside its place, where the body moves otherwise: under a tip by
//! a tenth of a millimetre for half a millimetre. To first order in the shift, without what other effects add to the field.

use super::body::Shape;
use super::error::DiagnoseError;
use crate::fem::Spot;
use crate::geometry::Vec3;
use crate::inverse::{InverseError, Settled};
use crate::mesh::SurfaceIndex;
use nalgebra::DMatrix;
use rayon::prelude::*;

/// Name of the surface that markers are on.
const OBSERVED: &str = "observed";

/// Shift to either side over which the derivative is taken (m): that of a camera that was registered with some care.
const STEP_M: f64 = 5e-4;

/// Derivative of the markers' displacement under everything loaded (3 markers × (3 sites + 3 discs), for a unit modulus) by a shift of all
/// of their places along x, y and z.
///
/// # Errors
/// [`DiagnoseError::TipNotLinear`]; what the elements refuse.
pub(super) fn by_place(settled: &Settled<'_>) -> Result<[DMatrix<f64>; 3], DiagnoseError> {
    let bench = &settled.problem.bench;
    let (space, discs) = (bench.model.space(), &settled.at.mounted.discs);
    let shapes = Shape::all(&settled.at.mounted.blocks)?;
    let index =
        SurfaceIndex::of(space.surface(OBSERVED).iter().map(|&face| space.face_triangle(face)).collect());
    let shown = |rest: &Vec3| -> Result<DMatrix<f64>, DiagnoseError> {
        let (spot, _) = Spot::marker_in(space, &index, OBSERVED, rest).map_err(InverseError::from)?;
        let mut block = DMatrix::zeros(3, 3 * (shapes.len() + discs.len()));
        for (site, (response, shape)) in bench.tip_responses().iter().zip(&shapes).enumerate() {
            block.columns_mut(3 * site, 3).copy_from(&(response.at(&spot) * &shape.loads));
        }
        for (d, disc) in discs.iter().enumerate() {
            block.columns_mut(3 * (shapes.len() + d), 3).copy_from(&disc.response.at(&spot));
        }
        Ok(block)
    };
    let along = |axis: usize| -> Result<DMatrix<f64>, DiagnoseError> {
        let step = Vec3::ith(axis, STEP_M);
        let slope = |(rest, _): &(Vec3, usize)| {
            Ok((shown(&(rest + step))? - shown(&(rest - step))?) / (2.0 * STEP_M))
        };
        let slopes: Vec<_> =
            settled.evidence.rest.par_iter().map(slope).collect::<Result<_, DiagnoseError>>()?;
        let mut all = DMatrix::zeros(3 * slopes.len(), 3 * (shapes.len() + discs.len()));
        for (marker, slope) in slopes.iter().enumerate() {
            all.rows_mut(3 * marker, 3).copy_from(slope);
        }
        Ok(all)
    };
    Ok([along(0)?, along(1)?, along(2)?])
}
