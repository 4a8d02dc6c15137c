//! Where a board is, and how its picture moves with the camera's parameters and with its pose.
//!
//! A board point X is seen at `pixel(R X + t)`. A small motion turns the board about its origin and shifts it, both in the camera frame:
//! R → exp([ω]) R, t → t + s. With a = R X and p = a + t
//!
//! ```text
//! ∂(u, v)/∂(ω, s) = ∂(u, v)/∂(x, y) · (1/Z) [1 0 −x; 0 1 −y] · [−[a]ₓ  I],   x = X/Z, y = Y/Z
//! ```
//!
//! and the derivatives by the camera's parameters are those of the formulas in [`Camera`]. Verified against central differences below.

use crate::geometry::{Mat3, Vec3};
use crate::track::Camera;
use nalgebra::{Matrix2x3, Rotation3, SMatrix, SVector, Vector2};

/// Parameters of a camera in the order fₓ, f_y, cₓ, c_y, k₁, k₂, p₁, p₂, k₃.
pub(super) const PARAMETERS: usize = 9;

/// One number for each parameter of a camera.
pub(super) type ByLens = SVector<f64, PARAMETERS>;

/// Where a board is in the camera frame: `p = rotation · x + shift`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Turns the board's axes into the camera's.
    pub rotation: Mat3,
    /// The board's origin in the camera frame (m).
    pub shift_m: Vec3,
}

/// A board point in the picture, with derivatives.
pub(super) struct Projected {
    /// Where it is seen (px).
    pub(super) pixel: Vector2<f64>,
    /// By the parameters of the camera.
    pub(super) by_lens: SMatrix<f64, 2, PARAMETERS>,
    /// By a small turn (rad) and shift (m) of the board.
    pub(super) by_pose: SMatrix<f64, 2, 6>,
}

impl Pose {
    /// A point of the board in the camera frame (m).
    pub fn apply(&self, board_m: [f64; 2]) -> Vec3 {
        self.rotation * Vec3::new(board_m[0], board_m[1], 0.0) + self.shift_m
    }

    /// The board's normal in the camera frame, away from who looks at its front.
    pub fn normal(&self) -> Vec3 {
        self.rotation.column(2).into()
    }

    /// Angle between the board and the picture plane (rad).
    pub fn tilt_rad(&self) -> f64 {
        self.normal().z.clamp(-1.0, 1.0).acos()
    }

    /// Whether the camera sees the front of the board.
    pub(super) fn faces_camera(&self) -> bool {
        self.normal().dot(&self.shift_m) > 0.0
    }

    /// The pose after a small turn and shift.
    pub(super) fn moved(&self, by: &SVector<f64, 6>) -> Self {
        let turn = Rotation3::new(by.fixed_rows::<3>(0).into_owned());
        Self { rotation: turn * self.rotation, shift_m: self.shift_m + by.fixed_rows::<3>(3) }
    }

    /// A board point in the picture; none behind the camera.
    pub(super) fn project(&self, camera: &Camera, board_m: [f64; 2]) -> Option<Projected> {
        let point = self.apply(board_m);
        let arm = point - self.shift_m;
        let pixel = Vector2::from(camera.project(point)?);
        let n = point.xy() / point.z;
        let to_normalised = Matrix2x3::new(1.0, 0.0, -n.x, 0.0, 1.0, -n.y) / point.z;
        let by_point = camera.pixel_jacobian(n) * to_normalised;
        let mut by_pose = SMatrix::<f64, 2, 6>::zeros();
        by_pose.fixed_view_mut::<2, 3>(0, 0).copy_from(&(-by_point * arm.cross_matrix()));
        by_pose.fixed_view_mut::<2, 3>(0, 3).copy_from(&by_point);
        Some(Projected { pixel, by_lens: by_lens(camera, n, pixel), by_pose })
    }
}

fn by_lens(camera: &Camera, n: Vector2<f64>, pixel: Vector2<f64>) -> SMatrix<f64, 2, PARAMETERS> {
    let ([fx, fy], [cx, cy]) = (camera.focal_px, camera.principal_px);
    let (x, y, r2) = (n.x, n.y, n.norm_squared());
    let u = [(pixel.x - cx) / fx, 0.0, 1.0, 0.0]
        .into_iter()
        .chain([x * r2, x * r2 * r2, 2.0 * x * y, r2 + 2.0 * x * x, x * r2 * r2 * r2].map(|d| fx * d));
    let v = [0.0, (pixel.y - cy) / fy, 0.0, 1.0]
        .into_iter()
        .chain([y * r2, y * r2 * r2, r2 + 2.0 * y * y, 2.0 * x * y, y * r2 * r2 * r2].map(|d| fy * d));
    SMatrix::from_row_iterator(u.chain(v))
}

/// The parameters of a camera.
pub(super) fn parameters(camera: &Camera) -> ByLens {
    let ([fx, fy], [cx, cy]) = (camera.focal_px, camera.principal_px);
    let ([k1, k2, k3], [p1, p2]) = (camera.radial, camera.tangential);
    ByLens::from([fx, fy, cx, cy, k1, k2, p1, p2, k3])
}

/// The camera with parameters.
pub(super) fn with_parameters(size_px: [usize; 2], p: &ByLens) -> Camera {
    Camera {
        size_px,
        focal_px: [p[0], p[1]],
        principal_px: [p[2], p[3]],
        radial: [p[4], p[5], p[8]],
        tangential: [p[6], p[7]],
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::scene::{TRUTH, poses};
    use super::*;

    #[test]
    fn derivatives_are_those_of_central_differences() {
        let camera = Camera { radial: [-0.2, 0.11, -0.05], ..TRUTH };
        let at = [0.031, -0.022];
        let pixel = |camera: &Camera, pose: &Pose| -> Vector2<f64> {
            camera.project(pose.apply(at)).expect("in front").into()
        };
        for pose in poses() {
            let seen = pose.project(&camera, at).expect("in front");
            assert!((seen.pixel - pixel(&camera, &pose)).norm() < 1e-12);
            for k in 0..PARAMETERS {
                let mut step = ByLens::zeros();
                step[k] = if k < 4 { 1e-3 } else { 1e-5 };
                let at = |sign: f64| with_parameters(TRUTH.size_px, &(parameters(&camera) + sign * step));
                let difference = (pixel(&at(1.0), &pose) - pixel(&at(-1.0), &pose)) / (2.0 * step[k]);
                let column = seen.by_lens.column(k);
                assert!((column - difference).norm() < 1e-6 * (1.0 + column.norm()), "parameter {k}");
            }
            for k in 0..6 {
                let mut step = SVector::<f64, 6>::zeros();
                step[k] = 1e-6;
                let difference =
                    (pixel(&camera, &pose.moved(&step)) - pixel(&camera, &pose.moved(&-step))) / 2e-6;
                let column = seen.by_pose.column(k);
                assert!((column - difference).norm() < 1e-6 * (1.0 + column.norm()), "motion {k}");
            }
        }
        let behind = Pose { rotation: Mat3::identity(), shift_m: Vec3::new(0.0, 0.0, -0.1) };
        assert!(behind.project(&camera, at).is_none() && behind.tilt_rad() == 0.0);
    }
}
