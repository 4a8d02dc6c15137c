//! How the camera frame lies in the phantom frame, from points known in both.
//!
//! `p = R c + t`, by least squares weighted with the covariances of both sides: Kabsch (1976, Acta Cryst. A32, 922) for a start, then
//! Gauss–Newton on a small turn about the points' centre and a shift, whose covariance is the answer's. Beside the rigid motion a
//! similarity (Umeyama 1991, IEEE PAMI 13, 376) says what scale the points would rather have: that of a camera or of a ruler that is off.

use super::CalibError;
use crate::geometry::{Mat3, Vec3};
use nalgebra::{Matrix6, Rotation3, SMatrix, SVector, Vector6};

/// One point in both frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// In the camera frame (m).
    pub seen_m: Vec3,
    /// Covariance of that (m²).
    pub seen_m2: Mat3,
    /// In the phantom frame (m).
    pub known_m: Vec3,
    /// Covariance of that (m²).
    pub known_m2: Mat3,
}

/// From the camera frame to the phantom frame, `p = rotation · c + translation`.
#[derive(Debug, Clone, PartialEq)]
pub struct Registration {
    /// Turns camera axes into phantom axes.
    pub rotation: Mat3,
    /// The camera's centre of projection in the phantom frame (m).
    pub translation_m: Vec3,
    /// About which point of the phantom frame the turn of `covariance` goes (m): the centre of the points.
    pub centre_m: Vec3,
    /// Covariance of a small turn about the phantom axes (rad), then a shift (m).
    pub covariance: Matrix6<f64>,
    /// Root mean square distance that is left between the points (m).
    pub rms_m: f64,
    /// χ² per degree of freedom: 1 where the stated covariances are true.
    pub chi2_per_dof: f64,
    /// Length in the phantom frame over length seen, less one, that the points would rather have.
    pub scale_error: f64,
    /// Standard deviation of that.
    pub scale_error_sd: f64,
    /// Points used.
    pub points: usize,
}

/// Points closer to a line than this share of their extent leave the turn about it open.
const LINE: f64 = 0.02;
/// A point this many standard deviations from where the others put it is not the one it is taken for.
const OUTLIER: f64 = 5.0;
/// Gauss–Newton steps; three reach rounding.
const STEPS: usize = 8;

/// Finds the rigid motion between points seen and known.
///
/// # Errors
/// [`CalibError`]: fewer than three points, points on a line, one that the others contradict, covariances that are none.
pub fn register(pairs: &[Pair]) -> Result<Registration, CalibError> {
    let found = solve(pairs)?;
    // With four points or more each can be held against the others.
    if pairs.len() > 3 {
        for index in 0..pairs.len() {
            let mut others = pairs.to_vec();
            let pair = others.remove(index);
            let Ok(without) = solve(&others) else { continue };
            let off = pair.known_m - without.apply(&pair.seen_m);
            let expected = without.covariance_of(&pair.seen_m, &pair.seen_m2) + pair.known_m2;
            let Some(inverse) = expected.try_inverse() else { continue };
            let sigmas = off.dot(&(inverse * off)).max(0.0).sqrt();
            // A bad point spoils what the others say of the good ones too: the worst is the one without which the rest agree.
            if sigmas > OUTLIER && without.chi2_per_dof < 0.5 * found.chi2_per_dof {
                return Err(CalibError::Outlier { index, distance_m: off.norm(), sigmas });
            }
        }
    }
    Ok(found)
}

impl Registration {
    /// A point of the camera frame in the phantom frame (m).
    pub fn apply(&self, seen_m: &Vec3) -> Vec3 {
        self.rotation * seen_m + self.translation_m
    }

    /// Covariance in the phantom frame (m²) of a point seen with a covariance, that of the registration included.
    pub fn covariance_of(&self, seen_m: &Vec3, seen_m2: &Mat3) -> Mat3 {
        let jacobian = turn_and_shift(&(self.apply(seen_m) - self.centre_m));
        self.rotation * seen_m2 * self.rotation.transpose()
            + jacobian * self.covariance * jacobian.transpose()
    }

    /// Standard deviations of the small turn (rad) and of the shift (m) along the phantom axes.
    pub fn deviations(&self) -> ([f64; 3], [f64; 3]) {
        let sd = |i: usize| self.covariance[(i, i)].max(0.0).sqrt();
        ([sd(0), sd(1), sd(2)], [sd(3), sd(4), sd(5)])
    }
}

/// How a point at `arm` from the centre moves with turn and shift: `ω × arm + s`.
fn turn_and_shift(arm: &Vec3) -> SMatrix<f64, 3, 6> {
    let mut jacobian = SMatrix::<f64, 3, 6>::zeros();
    jacobian.fixed_view_mut::<3, 3>(0, 0).copy_from(&-arm.cross_matrix());
    jacobian.fixed_view_mut::<3, 3>(0, 3).copy_from(&Mat3::identity());
    jacobian
}

fn solve(pairs: &[Pair]) -> Result<Registration, CalibError> {
    if pairs.len() < 3 {
        return Err(CalibError::TooFew {
            what: "points known in both frames",
            found: pairs.len(),
            needed: 3,
        });
    }
    let finite = |pair: &Pair| {
        pair.seen_m
            .iter()
            .chain(&pair.known_m)
            .chain(&pair.seen_m2)
            .chain(&pair.known_m2)
            .all(|x| x.is_finite())
            && (pair.seen_m2 + pair.known_m2).cholesky().is_some()
    };
    if let Some(index) = pairs.iter().position(|pair| !finite(pair)) {
        return Err(CalibError::NotAPoint { what: "point", index });
    }
    let count = pairs.len() as f64;
    let centre = |point: fn(&Pair) -> Vec3| pairs.iter().map(point).sum::<Vec3>() / count;
    let (seen, known) = (centre(|p| p.seen_m), centre(|p| p.known_m));
    off_a_line(pairs, &known)?;

    // Kabsch: the turn that maximises the trace of R Σ c pᵀ.
    let cross: Mat3 = pairs.iter().map(|p| (p.known_m - known) * (p.seen_m - seen).transpose()).sum();
    let svd = cross.svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else {
        return Err(CalibError::NotAPoint { what: "point", index: 0 });
    };
    let mirrored = (u * v_t).determinant() < 0.0;
    let mut turn = Mat3::identity();
    // The smallest singular value comes last: there a mirror image costs least.
    turn[(2, 2)] = if mirrored { -1.0 } else { 1.0 };
    let mut rotation = u * turn * v_t;
    let mut translation = known - rotation * seen;

    let mut covariance = Matrix6::zeros();
    for _ in 0..STEPS {
        let (mut normal, mut right) = (Matrix6::zeros(), Vector6::zeros());
        for pair in pairs {
            let at = rotation * pair.seen_m + translation;
            let weight = weight(pair, &rotation);
            let jacobian = turn_and_shift(&(at - known));
            normal += jacobian.transpose() * weight * jacobian;
            right += jacobian.transpose() * weight * (pair.known_m - at);
        }
        let factor = normal.cholesky().ok_or(CalibError::OnALine { what: "points", spread_m: 0.0 })?;
        let step = factor.solve(&right);
        covariance = factor.inverse();
        let small = Rotation3::new(step.fixed_rows::<3>(0).into_owned());
        rotation = small.matrix() * rotation;
        translation = small * (translation - known) + known + step.fixed_rows::<3>(3);
    }

    let left = |pair: &Pair| pair.known_m - (rotation * pair.seen_m + translation);
    let chi2: f64 = pairs.iter().map(|p| (left(p).transpose() * weight(p, &rotation) * left(p))[0]).sum();
    let freedom = (3 * pairs.len() - 6) as f64;
    let rms_m = (pairs.iter().map(|p| left(p).norm_squared()).sum::<f64>() / count).sqrt();
    let (scale_error, scale_error_sd) = scale(pairs, &rotation, &translation, &known);
    Ok(Registration {
        rotation,
        translation_m: translation,
        centre_m: known,
        // Points that disagree more than their covariances say are known less well than these say.
        covariance: covariance * (chi2 / freedom).max(1.0),
        rms_m,
        chi2_per_dof: chi2 / freedom,
        scale_error,
        scale_error_sd,
        points: pairs.len(),
    })
}

/// Inverse covariance of a point's distance from where it belongs, in the phantom frame.
fn weight(pair: &Pair, rotation: &Mat3) -> Mat3 {
    let covariance = rotation * pair.seen_m2 * rotation.transpose() + pair.known_m2;
    // Checked before to be positive definite.
    covariance.try_inverse().unwrap_or_else(Mat3::zeros)
}

/// The scale that explains most of what a rigid motion leaves when turn and shift follow it, and its standard deviation, to first order.
fn scale(pairs: &[Pair], rotation: &Mat3, translation: &Vec3, centre: &Vec3) -> (f64, f64) {
    let (mut normal, mut right) = (SMatrix::<f64, 7, 7>::zeros(), SVector::<f64, 7>::zeros());
    for pair in pairs {
        let at = rotation * pair.seen_m + translation;
        let mut jacobian = SMatrix::<f64, 3, 7>::zeros();
        jacobian.fixed_view_mut::<3, 6>(0, 0).copy_from(&turn_and_shift(&(at - centre)));
        jacobian.set_column(6, &(at - centre));
        let weighed = jacobian.transpose() * weight(pair, rotation);
        normal += weighed * jacobian;
        right += weighed * (pair.known_m - at);
    }
    // Three points or more off a line fix a similarity as well.
    normal
        .cholesky()
        .map_or((0.0, f64::INFINITY), |factor| (factor.solve(&right)[6], factor.inverse()[(6, 6)].sqrt()))
}

fn off_a_line(pairs: &[Pair], centre: &Vec3) -> Result<(), CalibError> {
    let spread: Mat3 = pairs.iter().map(|p| (p.known_m - centre) * (p.known_m - centre).transpose()).sum();
    let mut extents: Vec<f64> = spread.symmetric_eigenvalues().iter().map(|v| v.max(0.0).sqrt()).collect();
    extents.sort_by(f64::total_cmp);
    if extents[1] < LINE * extents[2] || extents[2] == 0.0 {
        return Err(CalibError::OnALine {
            what: "points",
            spread_m: extents[1] / (pairs.len() as f64).sqrt(),
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    const SD_M: [f64; 3] = [2e-5, 2e-5, 1e-4];

    fn truth() -> (Mat3, Vec3) {
        let rotation = Rotation3::from_euler_angles(3.0, 0.2, -0.4).into_inner();
        (rotation, Vec3::new(0.08, 0.05, 0.42))
    }

    /// Known points at the corners of the bench and above it, seen with noise that is larger in depth.
    fn pairs(count: usize, rng: &mut ChaCha8Rng) -> Vec<Pair> {
        let (rotation, translation) = truth();
        let covariance = Mat3::from_diagonal(&Vec3::from(SD_M).map(|s| s * s));
        (0..count)
            .map(|_| {
                let known_m = Vec3::new(
                    rng.random::<f64>() * 0.2,
                    rng.random::<f64>() * 0.15,
                    rng.random::<f64>() * 0.03,
                );
                let noise = Vec3::from_fn(|i, _| SD_M[i] * rng.sample::<f64, _>(StandardNormal));
                let seen_m = rotation.transpose() * (known_m - translation) + noise;
                Pair { seen_m, seen_m2: covariance, known_m, known_m2: Mat3::identity() * 1e-12 }
            })
            .collect()
    }

    /// 200 draws of eight points: the errors of turn and shift are as large as the covariance says (χ² of six degrees of freedom).
    #[test]
    fn errors_are_as_large_as_the_covariance_says() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let (rotation, translation) = truth();
        let (mut mahalanobis, mut scales) = (0.0, 0.0);
        const DRAWS: usize = 200;
        for _ in 0..DRAWS {
            let found = solve(&pairs(8, &mut rng)).expect("eight points");
            let turn = Rotation3::from_matrix(&(rotation * found.rotation.transpose())).scaled_axis();
            let back = rotation.transpose() * (found.centre_m - translation);
            let shift = found.centre_m - found.apply(&back);
            let mut error = Vector6::zeros();
            error.fixed_rows_mut::<3>(0).copy_from(&turn);
            error.fixed_rows_mut::<3>(3).copy_from(&shift);
            let inflation = found.chi2_per_dof.max(1.0);
            let inverse = (found.covariance / inflation).try_inverse().expect("regular");
            mahalanobis += (error.transpose() * inverse * error)[0];
            scales += (found.scale_error / found.scale_error_sd).powi(2);
        }
        let mean = mahalanobis / DRAWS as f64;
        // Mean 6, standard deviation √(12/200) = 0.24.
        assert!((mean - 6.0).abs() < 0.8, "mean χ² {mean}");
        let mean = scales / DRAWS as f64;
        assert!((mean - 1.0).abs() < 0.35, "mean χ² of the scale {mean}");
    }

    #[test]
    fn exact_points_give_the_exact_motion_and_scale() {
        let mut rng = ChaCha8Rng::seed_from_u64(6);
        let (rotation, translation) = truth();
        let mut exact = pairs(5, &mut rng);
        for pair in &mut exact {
            pair.seen_m = rotation.transpose() * (pair.known_m - translation);
        }
        let found = register(&exact).expect("five points");
        assert!(
            (found.rotation - rotation).norm() < 1e-12 && (found.translation_m - translation).norm() < 1e-12
        );
        assert!(found.scale_error.abs() < 1e-10, "{}", found.scale_error);
        for pair in &mut exact {
            pair.seen_m *= 1.0 / 1.002;
        }
        let found = register(&exact).expect("five points");
        assert!((found.scale_error - 0.002).abs() < 1e-5, "{}", found.scale_error);
    }

    #[test]
    fn a_point_that_the_others_contradict_is_named() {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let mut wrong = pairs(6, &mut rng);
        wrong[4].known_m.x += 3e-3;
        match register(&wrong) {
            Err(CalibError::Outlier { index: 4, distance_m, .. }) => {
                assert!((distance_m - 3e-3).abs() < 5e-4, "{distance_m}");
            }
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn what_leaves_a_turn_open_is_refused() {
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        let mut line = pairs(4, &mut rng);
        for (i, pair) in line.iter_mut().enumerate() {
            pair.known_m = Vec3::new(0.03 * i as f64, 0.02, 0.01);
        }
        assert!(matches!(register(&line), Err(CalibError::OnALine { .. })));
        assert!(matches!(register(&line[..2]), Err(CalibError::TooFew { found: 2, needed: 3, .. })));
        let mut bad = pairs(4, &mut rng);
        bad[2].seen_m2 = Mat3::zeros();
        bad[2].known_m2 = Mat3::zeros();
        assert_eq!(register(&bad), Err(CalibError::NotAPoint { what: "point", index: 2 }));
    }
}
