//! How far the camera moves as a whole: what all markers do in common while nothing touches the phantom.
//!
//! Between pokes the common motion is measured against what the markers' own noise makes of it. During a poke it is not known; readings of
//! one place are then whitened against a motion that all of its markers have in common as long as that place is poked, each place by itself.
//! Motion of markers against each other keeps its weight. What a phantom with a memory still moves between pokes counts as sway here.

use super::evidence::{Driven, Evidence};
use crate::geometry::Vec3;
use crate::observation::Recording;
use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Rows so close to a poke (s) do not count as rest.
pub const MARGIN_S: f64 = 0.05;
/// Nor do markers so soon after one: when and how fast the surface leaves the tip no model here says.
pub const SETTLED_S: f64 = 0.3;
/// Fewer frames than this say nothing.
const FEWEST: usize = 6;
/// Chance raises a variance of so many degrees of freedom by this many standard deviations, once in a thousand times.
const CHANCE: f64 = 3.1;

/// A ratio of variances, or 1 where chance may have made it.
pub fn beyond_chance(ratio: f64, freedom: f64) -> f64 {
    if ratio > 1.0 + CHANCE * (2.0 / freedom).sqrt() { ratio } else { 1.0 }
}

/// Variance (m²) of the markers' common motion between pokes along each axis, beyond what their own noise `sd_m` makes. `rest`: rest position (m)
/// and rows of every marker; `crept`: displacement (m) of a marker at a frame that is no motion of the camera, none where that is not known.
pub fn sway_m2(
    recording: &Recording,
    rest: &[(Vec3, usize)],
    sd_m: [f64; 3],
    crept: impl Fn(usize, usize) -> Option<Vec3>,
) -> [f64; 3] {
    let markers = &recording.markers;
    // Sum over all markers of their displacement from rest, frame by frame, and so many markers.
    let mut frames = vec![(Vec3::zeros(), 0.0); markers.frame_time_s.len()];
    for row in &markers.rows {
        let (at, rows) = rest[row.marker as usize];
        if rows > 0
            && let Some(crept) = crept(row.frame as usize, row.marker as usize)
        {
            let frame = &mut frames[row.frame as usize];
            frame.0 += Vec3::from(row.position_m) - at - crept;
            frame.1 += 1.0;
        }
    }
    let touched =
        |t: f64| recording.pokes.iter().any(|p| t >= p.start_s - MARGIN_S && t <= p.end_s + SETTLED_S);
    let still = |t: f64| t >= recording.rest_until_s && !touched(t);
    let rest_frames =
        markers.frame_time_s.iter().filter(|t| **t < recording.rest_until_s).count().max(1) as f64;
    let rows =
        || frames.iter().zip(&markers.frame_time_s).filter(|(f, t)| f.1 > 0.0 && still(**t)).map(|(f, _)| f);
    let n = rows().count() as f64;
    if (n as usize) < FEWEST {
        return [0.0; 3];
    }
    std::array::from_fn(|axis| {
        let white = |f: &(Vec3, f64)| sd_m[axis].powi(2) * (1.0 + 1.0 / rest_frames) / f.1;
        let ratio = rows().map(|f| (f.0[axis] / f.1).powi(2) / white(f)).sum::<f64>() / n;
        (beyond_chance(ratio, n) - 1.0) * n / rows().map(|f| white(f).recip()).sum::<f64>()
    })
}

/// Whitening against a few directions of readings that have unit variance besides.
pub(super) struct Common {
    /// Orthonormal directions, in columns.
    directions: DMatrix<f64>,
    /// What is taken off along each.
    off: DVector<f64>,
}

impl Common {
    /// Of errors `columns` with one standard deviation each: the covariance is 1 + C Cᵀ. None where there is no error.
    pub(super) fn of(columns: &[DVector<f64>]) -> Option<Self> {
        let errors = DMatrix::from_columns(columns);
        let eigen = SymmetricEigen::new(errors.transpose() * &errors);
        let largest = eigen.eigenvalues.amax();
        let kept: Vec<usize> =
            (0..columns.len()).filter(|&i| eigen.eigenvalues[i] > NEGLIGIBLE * largest).collect();
        let variance = DVector::from_iterator(kept.len(), kept.iter().map(|&i| eigen.eigenvalues[i]));
        let mut directions = &errors * eigen.eigenvectors.select_columns(&kept);
        for (mut direction, variance) in directions.column_iter_mut().zip(variance.iter()) {
            direction /= variance.sqrt();
        }
        let off = variance.map(|v| 1.0 - (1.0 + v).sqrt().recip());
        (!kept.is_empty()).then_some(Self { directions, off })
    }

    /// (1 + C Cᵀ)^(−1/2) of readings.
    pub(super) fn take_off(&self, readings: &mut DVector<f64>) {
        let along = self.directions.tr_mul(readings).component_mul(&self.off);
        readings.gemv(-1.0, &self.directions, &along, 1.0);
    }
}

/// Share of the largest variance that is none.
const NEGLIGIBLE: f64 = 1e-12;

/// Along which axes the camera sways, with the standard deviation (m): where the stage drives the model. What hangs on a known wrench and comes back
/// elsewhere moves as one as well.
pub(super) fn swaying(evidence: &Evidence) -> impl Iterator<Item = (usize, f64)> + '_ {
    let driven = evidence.driven == Driven::ByStage;
    let sways = move |axis: &usize| driven && evidence.sway_m2[*axis] > 0.0;
    (0..3).filter(sways).map(|axis| (axis, evidence.sway_m2[axis].sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against two directions that are not at right angles: what is taken off whitens the covariance 1 + C Cᵀ.
    #[test]
    fn what_is_taken_off_whitens() {
        let columns =
            [DVector::from_vec(vec![3.0, 4.0, 0.0, 0.0]), DVector::from_vec(vec![1.0, 0.0, 2.0, 0.0])];
        let errors = DMatrix::from_columns(&columns);
        let covariance = DMatrix::identity(4, 4) + &errors * errors.transpose();
        let common = Common::of(&columns).expect("two directions");
        let whitening: Vec<DVector<f64>> = (0..4)
            .map(|i| {
                let mut unit = DVector::zeros(4);
                unit[i] = 1.0;
                common.take_off(&mut unit);
                unit
            })
            .collect();
        let whitening = DMatrix::from_columns(&whitening);
        let white = &whitening * covariance * whitening.transpose();
        assert!((white - DMatrix::<f64>::identity(4, 4)).amax() < 1e-12);
        assert!(Common::of(&[DVector::zeros(4)]).is_none());
    }
}
