//! What is refused, and what is said of pictures that leave something open.

use super::super::pose::parameters;
use super::super::{BoardView, Finding, LensError, Pose, calibrate_lens};
use super::scene::{Random, TRUTH, corners, noisy, parallel, poses, view};
use crate::geometry::Mat3;
use crate::track::Camera;
use nalgebra::Matrix2;

fn views(poses: &[Pose]) -> Vec<BoardView> {
    let exact: Vec<BoardView> = poses.iter().map(|pose| view(&TRUTH, &corners(), pose)).collect();
    noisy(&exact, &mut Random::seeded(11))
}

#[test]
fn two_pictures_are_too_few() {
    let error = calibrate_lens(&views(&poses()[..2]), &corners(), TRUTH.size_px).expect_err("two");
    assert_eq!(error, LensError::TooFewPictures { found: 2, needed: 3 });
    // Three are enough, but not for holding any out.
    let found = calibrate_lens(&views(&poses()[1..4]), &corners(), TRUTH.size_px).expect("three");
    assert_eq!(found.held_out_rms_px, None);
    assert_eq!(found.findings()[0], Finding::FewPictures { found: 3, needed: 6 });
    let mut corner = views(&poses()[1..4]);
    let ends = [0, 8, 54, 62];
    corner.iter_mut().for_each(|v| v.points = ends.map(|k| v.points[k]).to_vec());
    let error = calibrate_lens(&corner, &corners(), TRUTH.size_px).expect_err("twelve points");
    assert_eq!(error, LensError::TooFewPoints { found: 12, needed: 14 });
    assert!((found.camera.focal_px[0] - TRUTH.focal_px[0]).abs() < 5.0 * found.deviations()[0]);
}

/// Boards parallel to the picture plane look the same from twice as far with twice the focal length.
#[test]
fn parallel_boards_leave_the_focal_length_open() {
    for tilt in [Mat3::identity(), poses()[0].rotation] {
        match calibrate_lens(&views(&parallel(tilt)), &corners(), TRUTH.size_px) {
            Err(error @ LensError::Undetermined { focal_px, sd_px, turned_deg }) => {
                println!("{error}");
                assert!(sd_px > 0.02 * focal_px && turned_deg < 5.0, "{error}");
            }
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn a_board_numbered_from_behind_is_mirrored() {
    let mut views = views(&poses());
    for point in &mut views[3].points {
        point.board_m[0] = -point.board_m[0];
    }
    assert_eq!(calibrate_lens(&views, &corners(), TRUTH.size_px), Err(LensError::Mirrored { picture: 3 }));
}

/// A picture that was mirrored, numbered again from its left, belongs to a camera whose principal point lies on the other side.
#[test]
fn a_mirrored_picture_among_others_is_a_stranger() {
    let aside = Camera { principal_px: [345.0, 235.8], ..TRUTH };
    let exact: Vec<BoardView> = poses().iter().map(|pose| view(&aside, &corners(), pose)).collect();
    let mut views = noisy(&exact, &mut Random::seeded(12));
    let right = corners().point_m(corners().columns - 1, 0)[0];
    for point in &mut views[6].points {
        point.pixel[0] = 639.0 - point.pixel[0];
        point.board_m[0] = right - point.board_m[0];
    }
    let found = calibrate_lens(&views, &corners(), TRUTH.size_px).expect("a camera");
    let rms: Vec<f64> = found.pictures.iter().map(|p| p.rms_px).collect();
    println!("picture 6 is mirrored: rms {rms:.3?} px");
    assert_eq!(found.strangers(), [6]);
    let named = Finding::Stranger { picture: 6, rms_px: rms[6] };
    assert_eq!(found.findings(), [named]);
    // It is left out: the camera is the one of the others.
    let mut others = views;
    others.remove(6);
    let without = calibrate_lens(&others, &corners(), TRUTH.size_px).expect("a camera");
    assert!((parameters(&found.camera) - parameters(&without.camera)).norm() < 1e-6);
    assert!((found.covariance - without.covariance).norm() < 1e-6 * without.covariance.norm());
}

#[test]
fn points_that_make_no_sense_are_named() {
    let size = TRUTH.size_px;
    let wrong = |change: &dyn Fn(&mut BoardView)| {
        let mut views = views(&poses()[..4]);
        change(&mut views[1]);
        calibrate_lens(&views, &corners(), size).expect_err("one is wrong")
    };
    let named = LensError::NotAPoint { picture: 1, index: 5 };
    assert_eq!(wrong(&|v| v.points[5].pixel[1] = f64::NAN), named);
    assert_eq!(wrong(&|v| v.points[5].pixel[0] = 640.0), named);
    assert_eq!(wrong(&|v| v.points[5].covariance_px2 = Matrix2::zeros()), named);
    let line = wrong(&|v| v.points.truncate(9));
    assert_eq!(line, LensError::NotABoard { picture: 1 });
}
