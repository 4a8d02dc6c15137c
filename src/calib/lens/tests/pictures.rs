//! Cameras from rendered pictures, and pictures without a whole board.

use super::super::extent::apart_px;
use super::super::smooth::noise;
use super::super::{Board, BoardKind, BoardPoint, BoardView, LensError, Pose, board_in, calibrate_lens};
use super::render::Studio;
use super::scene::{self, BOARD, Random, TRUTH, corners, mahalanobis_of, poses};
use crate::geometry::Vec3;
use crate::track::{Camera, DiscInSpace, GreyView};
use nalgebra::Vector2;

fn seen(pixels: &[u8], board: &Board) -> Result<BoardView, LensError> {
    let [width, height] = TRUTH.size_px;
    board_in(&GreyView::new(width, height, width, pixels).expect("a picture"), board)
}

/// Distances of found points from where they are (px, root mean square), and the mean of their squared normalised errors.
fn accuracy(views: &[BoardView], board: &Board) -> (f64, f64) {
    let (mut squared, mut normalised, mut count) = (0.0, 0.0, 0.0);
    for (view, pose) in views.iter().zip(shots()) {
        let truth: Vec<Vector2<f64>> = (0..board.points())
            .map(|k| {
                let centre_m = pose.apply(board.point_m(k % board.columns, k / board.columns));
                match board.kind {
                    BoardKind::Checkerboard => TRUTH.project(centre_m).expect("in front").into(),
                    BoardKind::Dots { radius_m } => {
                        let disc = DiscInSpace { centre_m, normal: pose.normal(), radius_m };
                        disc.image_centre(&TRUTH).expect("in front")
                    }
                }
            })
            .collect();
        for point in &view.points {
            // The board may be turned by 180°, or shifted.
            let errors = truth.iter().map(|t| Vector2::from(point.pixel) - t);
            let error = errors.min_by(|a, b| a.norm().total_cmp(&b.norm())).expect("points");
            squared += error.norm_squared();
            normalised += error.dot(&point.covariance_px2.cholesky().expect("positive").solve(&error));
            count += 1.0;
        }
    }
    (f64::sqrt(squared / count), normalised / count)
}

/// Pictures of whole boards and of boards that are partly outside, each taken several times with other noise.
fn calibrated_from_pictures(board: &Board, dark_dots: bool, most_rms_px: f64) {
    const DRAWS: usize = 4;
    let mut random = Random::seeded(21);
    let studio = Studio { dark_dots };
    let picture = studio.picture(Some((board, &shots()[0])), &mut random);
    let noise = noise(&GreyView::new(640, 480, 640, &picture).expect("a picture"));
    let true_noise = (4.0_f64 + 1.0 / 12.0).sqrt();
    println!("noise {noise:.3} of {true_noise:.3}");
    assert!((1.0..1.1).contains(&(noise / true_noise)), "{noise}");
    let light: Vec<_> = shots().iter().map(|pose| studio.light(Some((board, pose)))).collect();
    let (mut rms, mut normalised, mut mahalanobis, mut chi2, mut points) = (0.0, 0.0, 0.0, 0.0, 0);
    for draw in 0..DRAWS {
        let views: Vec<BoardView> =
            light.iter().map(|l| seen(&Studio::expose(l, &mut random), board).expect("a board")).collect();
        let found = calibrate_lens(&views, board, TRUTH.size_px).expect("a camera");
        let of_points = accuracy(&views, board);
        rms += of_points.0 / DRAWS as f64;
        normalised += of_points.1 / DRAWS as f64;
        mahalanobis += mahalanobis_of(&found) / DRAWS as f64;
        chi2 += found.chi2_per_dof / DRAWS as f64;
        points = views.iter().map(|v| v.points.len()).sum();
        let lens = apart_px(&found.camera, &TRUTH).into_iter().fold(0.0, f64::max);
        if draw == 0 {
            println!(
                "{board}: focal {:.2?}, principal {:.2?} px, deviations {}",
                found.camera.focal_px,
                found.camera.principal_px,
                scene::digits(found.deviations())
            );
            println!(
                "  residuals {:.4} px, held out {:.4?} px, lens off by {lens:.4} px where it is known to {:.4} px",
                found.rms_px, found.held_out_rms_px, found.lens_sd_px
            );
        }
        assert!(lens < 4.0 * found.lens_sd_px, "{lens} {}", found.lens_sd_px);
        assert_eq!(found.findings(), []);
    }
    println!(
        "  {points} points, rms {rms:.4} px, squared normalised errors {normalised:.2} of 2; parameters' χ² {mahalanobis:.2} of 8, χ²/dof {chi2:.3}"
    );
    assert!(rms < most_rms_px, "{rms}");
    // Thousands of points: the mean is known to a few hundredths. The noise of a picture counts some of the board's edges: it is 7 % too
    // large here, and variances are 14 % too large, so that 1.75 is right.
    assert!((1.6..2.2).contains(&normalised), "{normalised}");
    // The mean of four draws of χ² with 8 degrees of freedom has the standard deviation 2.
    assert!((2.5..16.0).contains(&mahalanobis), "{mahalanobis}");
}

/// Ten whole boards, and four that each cover a corner of the picture and lie partly outside.
fn shots() -> Vec<Pose> {
    let corner = |(k, [x, y]): (usize, [f64; 2])| {
        let pose = poses()[5 + k];
        Pose { shift_m: pose.shift_m + Vec3::new(x, y, 0.0), ..pose }
    };
    let corners = [[20e-3, 14e-3], [-20e-3, 14e-3], [-24e-3, -20e-3], [20e-3, -20e-3]];
    poses()[..10].iter().copied().chain(corners.into_iter().enumerate().map(corner)).collect()
}

#[test]
fn pictures_of_light_dots_give_the_camera() {
    calibrated_from_pictures(&BOARD, false, 0.02);
}

#[test]
fn pictures_of_dark_dots_give_the_camera() {
    calibrated_from_pictures(&BOARD, true, 0.02);
}

#[test]
fn pictures_of_squares_give_the_camera() {
    calibrated_from_pictures(&corners(), false, 0.02);
}

/// The middle of the board at a place in space (m), parallel to the picture.
fn held_at(x: f64, y: f64, z: f64) -> Pose {
    let [right, down] = BOARD.point_m(BOARD.columns - 1, BOARD.rows - 1);
    let shift_m = Vec3::new(x - 0.5 * right, y - 0.5 * down, z);
    Pose { rotation: nalgebra::Matrix3::identity(), shift_m }
}

#[test]
fn half_of_a_board_is_enough_and_less_is_refused_with_numbers() {
    let studio = Studio::default();
    let mut random = Random::seeded(22);
    for board in [BOARD, corners()] {
        // From the middle of the board to the border it is 2.7 pitches: the last two of nine columns are outside.
        let cut = studio.picture(Some((&board, &held_at(45e-3, 0.0, 0.2))), &mut random);
        assert_eq!(seen(&cut, &board).expect("seven columns").points.len(), 49);
        let cut = studio.picture(Some((&board, &held_at(80e-3, 0.0, 0.2))), &mut random);
        match seen(&cut, &board) {
            Err(error @ LensError::Partial { .. }) => {
                println!("{board}: {error}");
                assert!(error.to_string().starts_with("28 of 63"), "{error}");
            }
            other => panic!("{other:?}"),
        }
        // One point is painted over.
        let paint = if board.kind == BoardKind::Checkerboard { 120 } else { 35 };
        let pose = held_at(0.0, 0.0, 0.2);
        let mut hidden = studio.picture(Some((&board, &pose)), &mut random);
        let at = TRUTH.project(pose.apply(board.point_m(3, 2))).expect("in front");
        for (k, level) in hidden.iter_mut().enumerate() {
            let apart = ((k % 640) as f64 - at[0]).hypot((k / 640) as f64 - at[1]);
            *level = if apart < 16.0 { paint } else { *level };
        }
        let rest = seen(&hidden, &board).expect("62 points");
        let place = |p: &BoardPoint| Vector2::from(p.pixel) - Vector2::from(at);
        assert_eq!(rest.points.len(), 62);
        assert!(rest.points.iter().all(|p| place(p).norm() > 16.0));
        // No board at all.
        match seen(&studio.picture(None, &mut random), &board) {
            Err(LensError::Partial { found, least: 32, points: 63, .. }) => assert!(found < 4, "{found}"),
            other => panic!("{other:?}"),
        }
        // More points than it should have.
        let fewer = Board { columns: 8, ..board };
        let whole = studio.picture(Some((&board, &pose)), &mut random);
        assert!(matches!(
            seen(&whole, &fewer),
            Err(LensError::Larger { seen: [9, 7] | [7, 9], ways: 2, .. })
        ));
    }
}

/// Mirrored pictures are numbered without mirroring the board, so that all of them together give the mirrored camera.
#[test]
fn pictures_that_are_all_mirrored_give_the_mirrored_camera() {
    let studio = Studio::default();
    let mut random = Random::seeded(23);
    let views: Vec<BoardView> = poses()[..6]
        .iter()
        .map(|pose| {
            let mut pixels = studio.picture(Some((&BOARD, pose)), &mut random);
            pixels.chunks_exact_mut(640).for_each(<[u8]>::reverse);
            seen(&pixels, &BOARD).expect("the whole board")
        })
        .collect();
    let found = calibrate_lens(&views, &BOARD, TRUTH.size_px).expect("a camera");
    let mirrored = Camera { principal_px: [639.0 - TRUTH.principal_px[0], TRUTH.principal_px[1]], ..TRUTH };
    for k in 0..2 {
        let error = found.camera.principal_px[k] - mirrored.principal_px[k];
        assert!(error.abs() < 5.0 * found.deviations()[2 + k], "{error} {:?}", found.deviations());
    }
}
