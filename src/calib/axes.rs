//! Which way the stage's axes go in the camera frame, from a point that rides on the stage while it makes known steps.
//!
//! A linear stage never turns, so that its motions say nothing of where the camera is: `c = o + a₁ s₁ + a₂ s₂` has the two directions and
//! the two scales, and an offset `o` that is that of the point. Directions fix the turn from camera to phantom frame; the shift stays
//! undetermined until a point is known in both frames.

use super::CalibError;
use crate::geometry::{Mat3, Vec3};
use nalgebra::{SMatrix, SVector};

/// Where a point was seen while the stage stood somewhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeenStep {
    /// Position of the stage's two axes (m).
    pub stage_m: [f64; 2],
    /// The point in the camera frame (m).
    pub seen_m: Vec3,
    /// Covariance of that (m²).
    pub seen_m2: Mat3,
}

/// The stage's axes as a camera sees them.
#[derive(Debug, Clone, PartialEq)]
pub struct StageAxes {
    /// Directions in the camera frame (unit vectors).
    pub direction: [Vec3; 2],
    /// Way seen over way that the stage says.
    pub scale: [f64; 2],
    /// Standard deviation of that.
    pub scale_sd: [f64; 2],
    /// Angle between the axes less a right one (rad).
    pub skew_rad: f64,
    /// Standard deviation of that (rad).
    pub skew_sd_rad: f64,
    /// Root mean square distance between seen and modelled points (m).
    pub rms_m: f64,
    /// χ² per degree of freedom: 1 where the stated covariances are true.
    pub chi2_per_dof: f64,
}

type Unknowns = SVector<f64, 9>;
type Square = SMatrix<f64, 9, 9>;

/// Finds the axes by weighted least squares.
///
/// # Errors
/// [`CalibError`]: fewer than four steps, covariances that are none, an axis that did not move.
pub fn axes_of_motion(steps: &[SeenStep]) -> Result<StageAxes, CalibError> {
    if steps.len() < 4 {
        return Err(CalibError::TooFew { what: "positions of the stage", found: steps.len(), needed: 4 });
    }
    let (mut normal, mut right) = (Square::zeros(), Unknowns::zeros());
    let mut weights = Vec::with_capacity(steps.len());
    for (index, step) in steps.iter().enumerate() {
        let finite = step.seen_m.iter().chain(&step.stage_m).all(|x| x.is_finite());
        let weight = step.seen_m2.cholesky().filter(|_| finite).map(|factor| factor.inverse());
        let weight = weight.ok_or(CalibError::NotAPoint { what: "step", index })?;
        let jacobian = jacobian(step);
        normal += jacobian.transpose() * weight * jacobian;
        right += jacobian.transpose() * weight * step.seen_m;
        weights.push(weight);
    }
    let silent =
        CalibError::Silent { what: "an axis of the stage did not move, or both moved together only" };
    let factor = normal.cholesky().ok_or(silent.clone())?;
    let covariance = factor.inverse();
    let found = factor.solve(&right);
    let axis = |a: usize| Vec3::from(found.fixed_rows::<3>(3 + 3 * a));
    let [first, second] = [axis(0), axis(1)];
    let [length_1, length_2] = [first.norm(), second.norm()];
    let own = |a: usize| covariance.fixed_view::<3, 3>(3 + 3 * a, 3 + 3 * a).into_owned();
    let sd_along = |a: usize, unit: &Vec3| (unit.transpose() * own(a) * unit)[0].max(0.0).sqrt();
    let (u, v) = (first / length_1, second / length_2);
    let scale_sd = [sd_along(0, &u), sd_along(1, &v)];
    // An axis that hardly moved has any direction.
    if !(scale_sd[0] < 0.1 * length_1 && scale_sd[1] < 0.1 * length_2) {
        return Err(silent);
    }
    let cosine = u.dot(&v);
    // ∂(u·v)/∂a₁ = (v − u cos)/|a₁|, and the same the other way round.
    let mut slope = Unknowns::zeros();
    slope.fixed_rows_mut::<3>(3).copy_from(&((v - u * cosine) / length_1));
    slope.fixed_rows_mut::<3>(6).copy_from(&((u - v * cosine) / length_2));
    let sine = (1.0 - cosine * cosine).sqrt();

    let left = |step: &SeenStep| step.seen_m - jacobian(step) * found;
    let chi2: f64 = steps.iter().zip(&weights).map(|(s, w)| (left(s).transpose() * w * left(s))[0]).sum();
    let freedom = (3 * steps.len() - 9) as f64;
    let inflation = (chi2 / freedom).max(1.0).sqrt();
    Ok(StageAxes {
        direction: [u, v],
        scale: [length_1, length_2],
        scale_sd: scale_sd.map(|s| s * inflation),
        skew_rad: cosine.clamp(-1.0, 1.0).acos() - std::f64::consts::FRAC_PI_2,
        skew_sd_rad: inflation * (slope.transpose() * covariance * slope)[0].max(0.0).sqrt() / sine,
        rms_m: (steps.iter().map(|s| left(s).norm_squared()).sum::<f64>() / steps.len() as f64).sqrt(),
        chi2_per_dof: chi2 / freedom,
    })
}

/// How the seen point depends on offset and axes.
fn jacobian(step: &SeenStep) -> SMatrix<f64, 3, 9> {
    let mut jacobian = SMatrix::<f64, 3, 9>::zeros();
    for (block, factor) in [1.0, step.stage_m[0], step.stage_m[1]].into_iter().enumerate() {
        jacobian.fixed_view_mut::<3, 3>(0, 3 * block).copy_from(&(Mat3::identity() * factor));
    }
    jacobian
}

impl StageAxes {
    /// The turn from the camera frame to a frame in which the axes have these directions (unit vectors), both treated alike.
    pub fn rotation(&self, axes: [Vec3; 2]) -> Option<Mat3> {
        let frame = |[a, b]: [Vec3; 2]| {
            let (middle, across) = ((a + b).try_normalize(0.0)?, (a - b).try_normalize(0.0)?);
            Some(Mat3::from_columns(&[middle, across, middle.cross(&across)]))
        };
        Some(frame(axes)? * frame(self.direction)?.transpose())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    /// A grid of positions, with axes 2 mrad off a right angle and a first one that goes 0.3 % too far.
    fn steps(rng: &mut ChaCha8Rng, sd_m: [f64; 3]) -> Vec<SeenStep> {
        let turn = Rotation3::from_euler_angles(2.9, -0.3, 0.7);
        let axes = [turn * Vec3::x() * 1.003, turn * Vec3::new(0.002_f64.sin(), 0.0, 0.002_f64.cos())];
        let covariance = Mat3::from_diagonal(&Vec3::from(sd_m).map(|s| s * s));
        (0..30)
            .map(|i| {
                let stage_m = [0.02 * f64::from(i % 6), 0.005 * f64::from(i / 6)];
                let noise = Vec3::from_fn(|k, _| sd_m[k] * rng.sample::<f64, _>(StandardNormal));
                let seen_m = Vec3::new(0.01, 0.02, 0.4) + axes[0] * stage_m[0] + axes[1] * stage_m[1] + noise;
                SeenStep { stage_m, seen_m, seen_m2: covariance }
            })
            .collect()
    }

    #[test]
    fn scale_and_skew_come_out_within_their_deviations() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut chi2 = [0.0; 3];
        const DRAWS: usize = 200;
        for _ in 0..DRAWS {
            let found = axes_of_motion(&steps(&mut rng, [2e-5, 2e-5, 8e-5])).expect("thirty steps");
            let inflation = found.chi2_per_dof.max(1.0).sqrt();
            chi2[0] += ((found.scale[0] - 1.003) / found.scale_sd[0] * inflation).powi(2);
            chi2[1] += ((found.scale[1] - 1.0) / found.scale_sd[1] * inflation).powi(2);
            // The second axis leans towards the first: less than a right angle.
            chi2[2] += ((found.skew_rad + 0.002) / found.skew_sd_rad * inflation).powi(2);
        }
        for mean in chi2.map(|c| c / DRAWS as f64) {
            // Standard deviation √(2/200) = 0.1.
            assert!((mean - 1.0).abs() < 0.35, "{chi2:?}");
        }
    }

    #[test]
    fn the_turn_to_the_stage_axes_is_found() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let found = axes_of_motion(&steps(&mut rng, [1e-9; 3])).expect("thirty steps");
        let turn = found.rotation([Vec3::x(), Vec3::z()]).expect("two directions");
        let truth = Rotation3::from_euler_angles(2.9, -0.3, 0.7).inverse();
        // The skew is shared between the axes.
        let off = Rotation3::from_matrix(&(turn * truth.matrix().transpose())).angle();
        assert!((off - 0.001).abs() < 1e-5, "{off}");
    }

    #[test]
    fn an_axis_that_did_not_move_is_told() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let mut still = steps(&mut rng, [2e-5; 3]);
        still.iter_mut().for_each(|s| s.stage_m[1] = 0.01);
        assert!(matches!(axes_of_motion(&still), Err(CalibError::Silent { .. })));
        assert!(matches!(axes_of_motion(&still[..3]), Err(CalibError::TooFew { .. })));
    }
}
