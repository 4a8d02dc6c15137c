//! Cameras from points that are known exactly, or with known errors.

use super::super::extent::apart_px;
use super::super::pose::parameters;
use super::super::{
    Board, BoardKind, BoardView, Distortion, Finding, Pose, calibrate_lens, calibrate_lens_with,
};
use super::scene::{BOARD, Random, SD_PX, TRUTH, corners, digits, mahalanobis_of, noisy, poses, view};
use crate::geometry::Vec3;
use crate::track::{Camera, DiscInSpace};

fn exact(camera: &Camera, board: &Board) -> Vec<BoardView> {
    poses().iter().map(|pose| view(camera, board, pose)).collect()
}

/// Focal lengths and principal point as shares of themselves, distortions as they are.
fn error(found: &Camera, truth: &Camera) -> f64 {
    let (found, truth) = (parameters(found), parameters(truth));
    (0..9).map(|k| (found[k] - truth[k]).abs() / if k < 4 { truth[k] } else { 1.0 }).fold(0.0, f64::max)
}

#[test]
fn exact_points_give_the_exact_camera() {
    let found = calibrate_lens(&exact(&TRUTH, &corners()), &corners(), TRUTH.size_px).expect("a camera");
    println!("exact points: error {:.1e}, rms {:.1e} px", error(&found.camera, &TRUTH), found.rms_px);
    assert!(error(&found.camera, &TRUTH) < 1e-9, "{:?}", found.camera);
    assert!(found.rms_px < 1e-9 && found.held_out_rms_px.expect("twelve pictures") < 1e-8);
    for (picture, pose) in found.pictures.iter().zip(poses()) {
        assert!((picture.pose.rotation - pose.rotation).norm() < 1e-8 && picture.outliers.is_empty());
    }
    // The boards tilt by 35° to opposite sides, and reach most of the picture.
    assert!((found.turned_rad.to_degrees() - 70.0).abs() < 0.1, "{}", found.turned_rad.to_degrees());
    assert!(found.covered_radius < found.corner_radius);
    let corner = TRUTH.undistort([-0.5, 479.5]).expect("a ray").norm();
    assert!((found.corner_radius - corner).abs() < 1e-6, "{} {corner}", found.corner_radius);
}

#[test]
fn a_third_radial_term_is_found_where_it_is_asked_for() {
    let bent = Camera { radial: [-0.18, 0.09, -0.05], ..TRUTH };
    let views = exact(&bent, &corners());
    let found = calibrate_lens_with(&views, &corners(), bent.size_px, Distortion::WithK3).expect("a camera");
    assert!(error(&found.camera, &bent) < 1e-8, "{:?}", found.camera);
    let without = calibrate_lens(&views, &corners(), bent.size_px).expect("a camera");
    assert_eq!((without.camera.radial[2], without.deviations()[8]), (0.0, 0.0));
}

/// Centres of area of the discs' pictures, which are up to a tenth of a pixel off the pictures of their centres.
#[test]
fn offsets_of_discs_are_taken_off() {
    let mut views = exact(&TRUTH, &BOARD);
    let BoardKind::Dots { radius_m } = BOARD.kind else { panic!("dots") };
    let mut largest = 0.0_f64;
    for (view, pose) in views.iter_mut().zip(poses()) {
        for point in &mut view.points {
            let disc = DiscInSpace { centre_m: pose.apply(point.board_m), normal: pose.normal(), radius_m };
            let offset = disc.image_offset(&TRUTH).expect("in front");
            largest = largest.max(offset.norm());
            point.pixel = [point.pixel[0] + offset.x, point.pixel[1] + offset.y];
        }
    }
    let found = calibrate_lens(&views, &BOARD, TRUTH.size_px).expect("a camera");
    let ignored = calibrate_lens(&views, &corners(), TRUTH.size_px).expect("a camera");
    println!(
        "offsets up to {largest:.3} px: error {:.1e}, ignored {:.1e}",
        error(&found.camera, &TRUTH),
        error(&ignored.camera, &TRUTH)
    );
    assert!(largest > 0.03 && error(&found.camera, &TRUTH) < 1e-6);
    assert!(error(&ignored.camera, &TRUTH) > 1e-4);
}

/// 60 draws over twelve pictures: the errors of eight parameters, each alone and all together, are as large as the covariance says, and so
/// is the difference of the lenses where it is largest.
#[test]
fn errors_are_as_large_as_the_covariance_says() {
    const DRAWS: u64 = 60;
    let views = exact(&TRUTH, &corners());
    let (mut mahalanobis, mut chi2, mut rms, mut held_out) = (0.0, 0.0, 0.0, 0.0);
    let (mut squares, mut apart, mut known) = ([0.0; 8], Vec::new(), 0.0);
    for seed in 0..DRAWS {
        let views = noisy(&views, &mut Random::seeded(seed));
        let found = calibrate_lens(&views, &corners(), TRUTH.size_px).expect("a camera");
        mahalanobis += mahalanobis_of(&found) / DRAWS as f64;
        let error = parameters(&found.camera) - parameters(&TRUTH);
        for (k, sum) in squares.iter_mut().enumerate() {
            *sum += (error[k] / found.deviations()[k]).powi(2) / DRAWS as f64;
        }
        let lens = apart_px(&found.camera, &TRUTH);
        apart.resize(lens.len(), 0.0);
        apart.iter_mut().zip(lens).for_each(|(sum, d)| *sum += d * d / DRAWS as f64);
        known += found.lens_sd_px.powi(2) / DRAWS as f64;
        chi2 += found.chi2_per_dof / DRAWS as f64;
        rms += found.rms_px / DRAWS as f64;
        held_out += found.held_out_rms_px.expect("twelve pictures") / DRAWS as f64;
        if seed == 0 {
            println!("deviations {}", digits(found.deviations()));
        }
    }
    let lens = apart.into_iter().fold(0.0, f64::max) / known;
    println!("squared normalised errors {squares:.2?} of 1, lens {lens:.2} of 1 ({:.4} px)", known.sqrt());
    println!(
        "mean of parameters' χ² {mahalanobis:.2} of 8, χ²/dof {chi2:.3}, rms {rms:.4}, held out {held_out:.4} px"
    );
    // Mean 8 with the standard deviation √(16/60) = 0.52; each square 1 with √(2/60) = 0.18. χ² per degree of freedom is 1 with
    // √(2/1432/60) = 0.005, and as the larger of it and 1 widens the covariance, squares are 1 % less.
    assert!((mahalanobis - 8.0).abs() < 1.8, "{mahalanobis}");
    assert!(squares.iter().all(|s| (0.4..1.7).contains(s)), "{squares:?}");
    // The sum of some squares, of which one or two make up most.
    assert!((0.4..1.7).contains(&lens), "{lens}");
    assert!((chi2 - 1.0).abs() < 0.02, "{chi2}");
    let unknowns: f64 = (8.0 + 6.0 * 12.0) / (2.0 * 12.0 * 63.0);
    let expected = SD_PX * 2.0_f64.sqrt() * (1.0 - unknowns).sqrt();
    assert!((rms / expected - 1.0).abs() < 0.02, "{rms} {expected}");
    // The camera of six pictures explains the other six nearly as well as their own.
    assert!(held_out > rms && held_out < 1.1 * rms, "{held_out} {rms}");
}

/// Points that are as exact as doubles: the adjustment ends where rounding does.
#[test]
fn tiny_covariances_are_no_reason_to_go_on_for_ever() {
    let mut views = exact(&TRUTH, &corners());
    views.iter_mut().flat_map(|v| &mut v.points).for_each(|p| p.covariance_px2 *= 1e-20);
    let found = calibrate_lens(&views, &corners(), TRUTH.size_px).expect("a camera");
    assert!(error(&found.camera, &TRUTH) < 1e-9 && found.strangers().is_empty(), "{:?}", found.camera);
}

/// Boards near the middle of the picture leave open how the lens bends at its corners.
#[test]
fn points_in_the_middle_leave_distortion_open() {
    let near = |pose: &Pose| Pose { shift_m: pose.shift_m + Vec3::new(0.0, 0.0, 0.5), ..*pose };
    let middle: Vec<BoardView> = poses()
        .iter()
        .map(|pose| {
            let [x, y] = [48e-3, 36e-3];
            let centre = pose.apply([x, y]);
            let pose = near(&Pose { shift_m: pose.shift_m - Vec3::new(centre.x, centre.y, 0.0), ..*pose });
            view(&TRUTH, &corners(), &pose)
        })
        .collect();
    let views = noisy(&middle, &mut Random::seeded(5));
    let found = calibrate_lens(&views, &corners(), TRUTH.size_px).expect("a camera");
    let apart = apart_px(&found.camera, &TRUTH).into_iter().fold(0.0, f64::max);
    for finding in found.findings() {
        println!("{finding}");
    }
    println!("off by {apart:.2} px, known to {:.2} px", found.lens_sd_px);
    assert!(found.findings().contains(&Finding::Distortion { sd_px: found.lens_sd_px }));
    assert!(found.findings().iter().any(|f| matches!(f, Finding::Coverage { .. })));
    assert!(apart < 4.0 * found.lens_sd_px && found.covariance.iter().all(|c| c.is_finite()));
}

/// Wrong points, from a sixth of a pixel to twelve: each is named, and the camera is the one of the other points alone.
#[test]
fn outliers_are_named_and_do_not_shape_the_lens() {
    let good = noisy(&exact(&TRUTH, &corners()), &mut Random::seeded(3));
    let wrong = [(4, 17, 4.0), (4, 40, -12.0), (7, 0, 2.0), (8, 62, 0.17), (8, 54, -0.6), (9, 31, 0.3)];
    let (mut views, mut without) = (good.clone(), good);
    for (picture, point, by) in wrong {
        views[picture].points[point].pixel[0] += by;
        // Compared by place, as points that are taken away change the numbers of the others.
        let board_m = corners().point_m(point % 9, point / 9);
        without[picture].points.retain(|p| p.board_m != board_m);
    }
    let found = calibrate_lens(&views, &corners(), TRUTH.size_px).expect("a camera");
    let expected = calibrate_lens(&without, &corners(), TRUTH.size_px).expect("a camera");
    for (k, picture) in found.pictures.iter().enumerate() {
        let named: Vec<usize> = wrong.iter().filter(|w| w.0 == k).map(|w| w.1).collect();
        let mut outliers = picture.outliers.clone();
        outliers.sort_by_key(|i| named.iter().position(|n| n == i));
        assert_eq!(outliers, named, "picture {k}");
    }
    let shift = parameters(&found.camera) - parameters(&expected.camera);
    for (k, sd) in expected.deviations().into_iter().enumerate().take(8) {
        assert!(shift[k].abs() < 1e-4 * sd, "parameter {k} moved by {} with a deviation of {sd}", shift[k]);
    }
    assert!(
        (found.rms_px - expected.rms_px).abs() < 1e-6
            && (found.chi2_per_dof - expected.chi2_per_dof).abs() < 1e-4
    );
    let left_out = found.left_out.as_ref().expect("outliers");
    let moved = apart_px(&left_out.with_them, &expected.camera).into_iter().fold(0.0, f64::max);
    println!(
        "with six wrong points a ray is seen up to {moved:.4} px elsewhere ({:.4} said)",
        left_out.moved_px
    );
    assert!(left_out.points == wrong.len() && moved > 1e-3 && (left_out.moved_px / moved - 1.0).abs() < 0.01);
    assert!(found.strangers().is_empty() && expected.left_out.is_none());
    let named =
        [(4, 2), (7, 1), (8, 2), (9, 1)].map(|(picture, points)| Finding::Outliers { picture, points });
    assert_eq!(found.findings(), named);
    assert_eq!(found.findings()[0].to_string(), "picture 5: points not where they should be: 2");
}

/// Where a lens bends as no camera of the model does, points far out fit badly. They are not taken for wrong ones, or the model would fit
/// the rest of the picture only.
#[test]
fn a_lens_that_the_model_does_not_fit_keeps_its_points() {
    let bent = Camera { radial: [-0.3, 0.2, -6.0], ..TRUTH };
    let found = calibrate_lens(&exact(&bent, &corners()), &corners(), bent.size_px).expect("a camera");
    let count: usize = found.pictures.iter().map(|p| p.outliers.len()).sum();
    println!("{count} outliers, {:?}", found.findings());
    assert!(count > 0 && found.left_out.is_none(), "{count} {:?}", found.left_out);
}
