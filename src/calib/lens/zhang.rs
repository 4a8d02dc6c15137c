//! A camera without distortion, and the pose of each board, in closed form: where the adjustment starts.
//!
//! Zhang (2000, IEEE PAMI 22, 1330). A homography H = [h₁ h₂ h₃] ∝ K [r₁ r₂ t] has two orthonormal columns behind it, which binds the
//! symmetric matrix B = K⁻ᵀK⁻¹ (his equations 3 and 4):
//!
//! ```text
//! h₁ᵀ B h₂ = 0,   h₁ᵀ B h₁ − h₂ᵀ B h₂ = 0
//! ```
//!
//! Pixels are at right angles (B₁₂ = 0), so that five numbers are left up to a factor: the singular vector of the smallest singular value of
//! the two rows a picture (his 7 to 9). Their parts give the principal point and the focal lengths, and K⁻¹H the pose.

use super::Pose;
use super::homography::least_direction;
use crate::geometry::{Mat3, Vec3};
use crate::track::Camera;
use nalgebra::{DMatrix, SVector};

/// The camera without distortion that homographies from a board to its pictures belong to. Where they leave it open (boards that are
/// all parallel) or contradict a pinhole: the one with square pixels and its principal point in the middle, and where they leave
/// that open too a view of 60° or so, from which the adjustment will tell what it can.
pub(super) fn first_camera(maps: &[Mat3], size_px: [usize; 2]) -> Camera {
    let half = 0.5 * size_px[0].max(size_px[1]) as f64;
    let middle = size_px.map(|s| 0.5 * (s as f64 - 1.0));
    // Pixels from the middle in half widths, so that all numbers are about 1.
    let to = Mat3::new(1.0 / half, 0.0, -middle[0] / half, 0.0, 1.0 / half, -middle[1] / half, 0.0, 0.0, 1.0);
    let maps: Vec<Mat3> = maps
        .iter()
        .map(|map| {
            let map = to * map;
            map / map.norm()
        })
        .collect();
    let plausible = |focal: f64| (0.2..=50.0).contains(&focal);
    let closed = closed_form(&maps)
        .filter(|(focal, point)| focal.iter().all(|f| plausible(*f)) && point.iter().all(|p| p.abs() < 1.0));
    let (focal, point) = closed.unwrap_or_else(|| {
        let focal = focal_alone(&maps).filter(|f| plausible(*f)).unwrap_or(1.7);
        ([focal; 2], [0.0; 2])
    });
    Camera {
        size_px,
        focal_px: focal.map(|f| f * half),
        principal_px: [0, 1].map(|k| point[k] * half + middle[k]),
        radial: [0.0; 3],
        tangential: [0.0; 2],
    }
}

/// Focal lengths and principal point in the coordinates of the maps.
fn closed_form(maps: &[Mat3]) -> Option<([f64; 2], [f64; 2])> {
    let mut rows = DMatrix::zeros((2 * maps.len()).max(5), 5);
    for (k, map) in maps.iter().enumerate() {
        let (both, first, second) = (row(map, 0, 1), row(map, 0, 0), row(map, 1, 1));
        for i in 0..5 {
            rows[(2 * k, i)] = both[i];
            rows[(2 * k + 1, i)] = first[i] - second[i];
        }
    }
    let b = least_direction(rows)?;
    let [b11, b22, b13, b23, b33] = [b[0], b[1], b[2], b[3], b[4]];
    let point = [-b13 / b11, -b23 / b22];
    let scale = b33 - b13 * b13 / b11 - b23 * b23 / b22;
    let focal = [(scale / b11).sqrt(), (scale / b22).sqrt()];
    focal.iter().chain(&point).all(|x| x.is_finite()).then_some((focal, point))
}

/// hᵢᵀ B hⱼ as a row for (B₁₁, B₂₂, B₁₃, B₂₃, B₃₃).
fn row(map: &Mat3, i: usize, j: usize) -> SVector<f64, 5> {
    let (a, b) = (map.column(i), map.column(j));
    SVector::from([
        a[0] * b[0],
        a[1] * b[1],
        a[2] * b[0] + a[0] * b[2],
        a[2] * b[1] + a[1] * b[2],
        a[2] * b[2],
    ])
}

/// The focal length alone: both equations are linear in B₁₁ = B₂₂ = 1/f² with B₁₃ = B₂₃ = 0 and B₃₃ = 1.
fn focal_alone(maps: &[Mat3]) -> Option<f64> {
    let (mut both, mut own) = (0.0, 0.0);
    for map in maps {
        let (product, difference) = (row(map, 0, 1), row(map, 0, 0) - row(map, 1, 1));
        for r in [product, difference] {
            both -= (r[0] + r[1]) * r[4];
            own += (r[0] + r[1]).powi(2);
        }
    }
    let inverse_square = both / own;
    (inverse_square > 0.0 && inverse_square.is_finite()).then(|| 1.0 / inverse_square.sqrt())
}

/// The pose of a board in front of a camera, from the map from the board (m) to the picture (px) without distortion; none where the map
/// is none of a plane in front. Whether it is seen from its front is for [`Pose::faces_camera`] to tell.
pub(super) fn first_pose(map: &Mat3, camera: &Camera) -> Option<Pose> {
    let [fx, fy] = camera.focal_px;
    let [cx, cy] = camera.principal_px;
    let inverse = Mat3::new(1.0 / fx, 0.0, -cx / fx, 0.0, 1.0 / fy, -cy / fy, 0.0, 0.0, 1.0);
    let columns = inverse * map;
    let length = 0.5 * (columns.column(0).norm() + columns.column(1).norm());
    let sign = if columns[(2, 2)] < 0.0 { -1.0 } else { 1.0 };
    let columns = columns * (sign / length);
    let (r1, r2): (Vec3, Vec3) = (columns.column(0).into(), columns.column(1).into());
    let svd = Mat3::from_columns(&[r1, r2, r1.cross(&r2)]).try_svd(true, true, f64::EPSILON, 0)?;
    let rotation = svd.u? * svd.v_t?;
    let shift_m: Vec3 = columns.column(2).into();
    let sound = shift_m.z > 0.0 && shift_m.iter().chain(rotation.iter()).all(|x| x.is_finite());
    sound.then_some(Pose { rotation, shift_m })
}

#[cfg(test)]
mod tests {
    use super::super::homography::homography;
    use super::super::tests::scene::{BOARD, TRUTH, parallel, poses, view};
    use super::*;
    use nalgebra::Vector2;

    fn maps(camera: &Camera, poses: &[Pose]) -> Vec<Mat3> {
        let seen = poses.iter().map(|pose| view(camera, &BOARD, pose));
        seen.map(|view| {
            let pairs: Vec<_> =
                view.points.iter().map(|p| (Vector2::from(p.board_m), Vector2::from(p.pixel))).collect();
            homography(&pairs).expect("a plane")
        })
        .collect()
    }

    #[test]
    fn exact_points_without_distortion_give_the_exact_camera_and_poses() {
        let pinhole = Camera { radial: [0.0; 3], tangential: [0.0; 2], ..TRUTH };
        let maps = maps(&pinhole, &poses());
        let found = first_camera(&maps, TRUTH.size_px);
        for k in 0..2 {
            assert!((found.focal_px[k] / TRUTH.focal_px[k] - 1.0).abs() < 1e-9, "{found:?}");
            assert!((found.principal_px[k] / TRUTH.principal_px[k] - 1.0).abs() < 1e-9, "{found:?}");
        }
        for (map, pose) in maps.iter().zip(poses()) {
            let found = first_pose(map, &found).expect("in front");
            assert!((found.rotation - pose.rotation).norm() < 1e-8 && found.faces_camera());
            assert!((found.shift_m - pose.shift_m).norm() < 1e-9);
        }
    }

    #[test]
    fn parallel_boards_start_from_a_guess() {
        let flat = Camera { radial: [0.0; 3], tangential: [0.0; 2], ..TRUTH };
        let found = first_camera(&maps(&flat, &parallel(Mat3::identity())), TRUTH.size_px);
        assert!(found.check().is_ok(), "{found:?}");
    }
}
