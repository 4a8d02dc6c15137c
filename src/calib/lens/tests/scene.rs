//! A camera whose lens is known, and boards in front of it.

use super::super::pose::parameters;
use super::super::{Board, BoardKind, BoardPoint, BoardView, LensFound, Pose};
use crate::geometry::{Mat3, Vec3};
use crate::track::Camera;
use nalgebra::{Matrix2, Rotation3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The camera of the tests.
pub(crate) const TRUTH: Camera = Camera {
    size_px: [640, 480],
    focal_px: [812.0, 808.5],
    principal_px: [327.3, 235.8],
    radial: [-0.18, 0.09, 0.0],
    tangential: [8e-4, -5e-4],
};

/// The board of the tests.
pub(crate) const BOARD: Board =
    Board { kind: BoardKind::Dots { radius_m: 3e-3 }, columns: 9, rows: 7, pitch_m: 12e-3 };

/// Standard deviation of the noise of [`noisy`] along x and y (px).
pub(crate) const SD_PX: f64 = 0.02;

/// Where the board is held: tilt and the direction that it tilts to, turn about its normal (°), and the place of its middle (mm).
const HELD: [[f64; 6]; 12] = [
    [4.0, 10.0, 3.0, -21.0, -10.0, 180.0],
    [28.0, 5.0, -4.0, -26.0, -17.0, 210.0],
    [28.0, 95.0, 5.0, 22.0, -18.0, 205.0],
    [30.0, 185.0, 0.0, 23.0, 21.0, 208.0],
    [28.0, 275.0, 8.0, -24.0, 21.0, 205.0],
    [35.0, 45.0, -8.0, 26.0, 27.0, 215.0],
    [35.0, 135.0, 3.0, -38.0, 19.0, 215.0],
    [35.0, 225.0, 12.0, -23.0, -14.0, 215.0],
    [35.0, 315.0, -12.0, 39.0, -14.0, 215.0],
    [20.0, 60.0, 90.0, -3.0, 2.0, 245.0],
    [25.0, 200.0, 180.0, -25.0, 20.0, 205.0],
    [15.0, 330.0, 45.0, 0.0, 5.0, 255.0],
];

/// The poses of the board, its origin in its first point.
pub(crate) fn poses() -> Vec<Pose> {
    HELD.iter()
        .map(|&[tilt, towards, turn, x, y, z]| {
            let (sin, cos) = towards.to_radians().sin_cos();
            let tilted = Rotation3::new(Vec3::new(cos, sin, 0.0) * tilt.to_radians());
            let rotation = (tilted * Rotation3::new(Vec3::z() * turn.to_radians())).into_inner();
            let [right, down] = BOARD.point_m(BOARD.columns - 1, BOARD.rows - 1);
            let middle = Vec3::new(0.5 * right, 0.5 * down, 0.0);
            Pose { rotation, shift_m: Vec3::new(x, y, z) * 1e-3 - rotation * middle }
        })
        .collect()
}

/// Boards that are all turned in the same way, nearer to the optical axis than the others and farther away.
pub(crate) fn parallel(rotation: Mat3) -> Vec<Pose> {
    let middle = [0.5 * BOARD.point_m(BOARD.columns - 1, 0)[0], 0.5 * BOARD.point_m(0, BOARD.rows - 1)[1]];
    let arm = rotation * Vec3::new(middle[0], middle[1], 0.0);
    let place = |pose: Pose| pose.apply(middle).component_mul(&Vec3::new(0.5, 0.5, 1.1));
    poses().into_iter().map(|pose| Pose { rotation, shift_m: place(pose) - arm }).collect()
}

/// The points of a board as a camera sees them: the points themselves, without the offsets of discs.
pub(crate) fn view(camera: &Camera, board: &Board, pose: &Pose) -> BoardView {
    let point = |k: usize| {
        let board_m = board.point_m(k % board.columns, k / board.columns);
        let pixel = camera.project(pose.apply(board_m)).expect("in front");
        assert!(camera.sees(pixel, 0.0), "{pixel:?} is outside");
        BoardPoint { board_m, pixel, covariance_px2: Matrix2::identity() * SD_PX * SD_PX }
    };
    BoardView { points: (0..board.points()).map(point).collect() }
}

/// The same board with points instead of discs, which have no offsets.
pub(crate) fn corners() -> Board {
    Board { kind: BoardKind::Checkerboard, ..BOARD }
}

/// Views with normal errors of [`SD_PX`].
pub(crate) fn noisy(views: &[BoardView], random: &mut Random) -> Vec<BoardView> {
    let mut views = views.to_vec();
    for x in views.iter_mut().flat_map(|v| &mut v.points).flat_map(|p| &mut p.pixel) {
        *x += SD_PX * random.normal();
    }
    views
}

/// A stream of random numbers.
pub(crate) struct Random(ChaCha8Rng);

impl Random {
    pub(crate) fn seeded(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    /// Uniform in [0, 1).
    pub(crate) fn uniform(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 * (-53.0_f64).exp2()
    }

    /// Standard normal (Box & Muller 1958).
    pub(crate) fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

/// χ² of the errors of fₓ, f_y, cₓ, c_y, k₁, k₂, p₁ and p₂ for the covariance that is stated.
pub(crate) fn mahalanobis_of(found: &LensFound) -> f64 {
    let error = (parameters(&found.camera) - parameters(&TRUTH)).fixed_rows::<8>(0).into_owned();
    let covariance = found.covariance.fixed_view::<8, 8>(0, 0).into_owned();
    error.dot(&covariance.cholesky().expect("positive").solve(&error))
}

/// Numbers with three digits each.
pub(crate) fn digits<const N: usize>(numbers: [f64; N]) -> String {
    numbers.map(|x| format!("{x:.2e}")).join(" ")
}
