//! How far the pictures reach, and how well the lens is known where they do not.

use super::adjust::{Sight, State};
use super::normal::LensSquare;
use super::pose::{PARAMETERS, Pose};
use crate::geometry::{Mat3, Vec3};
use crate::track::Camera;
use nalgebra::{Matrix2x3, Rotation3, SMatrix, Vector2};

/// Places along each edge of the picture at which the lens is looked at.
const PLACES: usize = 9;
/// Steps of Gauss and Newton to the turn between two cameras, which is small.
const TURNS: usize = 4;

/// Largest angle between the normals of two boards (rad).
pub(super) fn turned(poses: &[Pose]) -> f64 {
    let pairs = poses.iter().enumerate().flat_map(|(i, a)| poses[..i].iter().map(move |b| (a, b)));
    // The cross product tells small angles better than the cosine.
    let angle =
        |(a, b): (&Pose, &Pose)| a.normal().cross(&b.normal()).norm().atan2(a.normal().dot(&b.normal()));
    pairs.map(angle).fold(0.0, f64::max)
}

/// Largest distance of a point from the optical axis over its depth.
pub(super) fn covered(state: &State, seen: &[Vec<Sight>]) -> f64 {
    let points = state.poses.iter().zip(seen).flat_map(|(pose, s)| s.iter().map(|s| pose.apply(s.board_m)));
    points.map(|p| p.xy().norm() / p.z).fold(0.0, f64::max)
}

/// The same for the farthest corner of the picture; without distortion where the lens folds before it.
pub(super) fn corner_radius(camera: &Camera) -> f64 {
    rays(camera).iter().map(|ray| ray.norm()).fold(0.0, f64::max)
}

/// Whether the distortion, extrapolated, folds over within the picture: a pixel there would belong to two rays or none.
pub(super) fn folds(camera: &Camera) -> bool {
    pixels(camera).iter().any(|pixel| camera.undistort(*pixel).is_none())
}

/// Standard deviation of where the camera sees a ray (px), where it is largest in the picture: as far as a turn of the camera does not
/// make up for it, for whoever uses the camera has to find out how it stands anyway.
///
/// With J = ∂(u, v)/∂(parameters) and T = ∂(u, v)/∂(turn) over a mesh of pixels, J − T (TᵀT)⁻¹TᵀJ is what is left of J.
pub(super) fn lens_sd_px(camera: &Camera, covariance: &LensSquare) -> f64 {
    let at = |ray: &Vector2<f64>| {
        let pose = Pose { rotation: Mat3::identity(), shift_m: ray.push(1.0) };
        let seen = pose.project(camera, [0.0, 0.0])?;
        let by_ray = camera.pixel_jacobian(*ray) * Matrix2x3::new(1.0, 0.0, -ray.x, 0.0, 1.0, -ray.y);
        Some((seen.by_lens, -by_ray * ray.push(1.0).cross_matrix()))
    };
    let both: Vec<(SMatrix<f64, 2, PARAMETERS>, Matrix2x3<f64>)> =
        rays(camera).iter().filter_map(at).collect();
    let normal: Mat3 = both.iter().map(|(_, turn)| turn.transpose() * turn).sum();
    let right: SMatrix<f64, 3, PARAMETERS> = both.iter().map(|(lens, turn)| turn.transpose() * lens).sum();
    let Some(inverse) = normal.try_inverse() else { return f64::INFINITY };
    let made_up = inverse * right;
    let variance = |(lens, turn): &(SMatrix<f64, 2, PARAMETERS>, Matrix2x3<f64>)| {
        let left = lens - turn * made_up;
        (left * covariance * left.transpose()).trace()
    };
    both.iter().map(variance).fold(0.0, f64::max).sqrt()
}

/// Distances between where two cameras see rays over the whole picture of the second (px), after the small turn that brings them closest.
pub(super) fn apart_px(found: &Camera, other: &Camera) -> Vec<f64> {
    let rays: Vec<Vec3> = rays(other).iter().map(|ray| ray.push(1.0)).collect();
    let difference = |ray: &Vec3, turn: &Vec3| -> Option<Vector2<f64>> {
        let seen = found.project(Rotation3::new(*turn) * ray)?;
        Some(Vector2::from(seen) - Vector2::from(other.project(*ray)?))
    };
    let mut turn = Vec3::zeros();
    for _ in 0..TURNS {
        let (mut normal, mut right) = (Mat3::zeros(), Vec3::zeros());
        for ray in &rays {
            let Some(difference) = difference(ray, &turn) else { continue };
            let n = ray.xy();
            let by_ray = found.pixel_jacobian(n) * Matrix2x3::new(1.0, 0.0, -n.x, 0.0, 1.0, -n.y);
            let by_turn = -by_ray * ray.cross_matrix();
            normal += by_turn.transpose() * by_turn;
            right -= by_turn.transpose() * difference;
        }
        let Some(factor) = normal.cholesky() else { break };
        turn += factor.solve(&right);
    }
    rays.iter().filter_map(|ray| Some(difference(ray, &turn)?.norm())).collect()
}

/// A mesh of pixels over the whole picture, its corners included.
fn pixels(camera: &Camera) -> Vec<[f64; 2]> {
    let place = |k: usize, size: usize| size as f64 * k as f64 / (PLACES - 1) as f64 - 0.5;
    let [width, height] = camera.size_px;
    (0..PLACES * PLACES).map(|k| [place(k % PLACES, width), place(k / PLACES, height)]).collect()
}

/// The rays of those pixels; without distortion where the lens folds before them.
fn rays(camera: &Camera) -> Vec<Vector2<f64>> {
    let straight = Camera { radial: [0.0; 3], tangential: [0.0; 2], ..*camera };
    let ray = |pixel: [f64; 2]| camera.undistort(pixel).or_else(|| straight.undistort(pixel));
    pixels(camera).into_iter().filter_map(ray).collect()
}
