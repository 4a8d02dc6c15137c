//! Do the dots of recorded pictures become markers where they are, and is what cannot be seen a gap?

use super::{Eye, attach_dots, dots_at_rest, follow};
use crate::calib::Registration;
use crate::clock::HostTime;
use crate::dataset::DatasetError;
use crate::device::{Losses, Sight};
use crate::geometry::{Mat3, Vec3};
use crate::mesh::{Block, TetMesh, block, boundary_triangles};
use crate::session::tests::fixtures::start;
use crate::session::{CameraFrame, Outcome, Picture, Recorder, Session, SessionWriter};
use crate::track::{Camera, Settings, TrackError};
use nalgebra::Matrix6;
use std::path::Path;

const SIZE: [usize; 2] = [320, 240];
/// The camera looks straight down from here (m) on a slab whose top is at 25 mm.
const EYE_M: Vec3 = Vec3::new(0.06, 0.045, 0.425);
const TOP_M: f64 = 0.025;
const UNIT_M: f64 = 1e-4;

fn camera() -> Camera {
    Camera {
        size_px: SIZE,
        focal_px: [800.0; 2],
        principal_px: [159.5, 119.5],
        radial: [0.0; 3],
        tangential: [0.0; 2],
    }
}

/// Camera x is phantom x; camera y and z point the other way.
fn registration() -> Registration {
    Registration {
        rotation: Mat3::from_diagonal(&Vec3::new(1.0, -1.0, -1.0)),
        translation_m: EYE_M,
        centre_m: EYE_M,
        covariance: Matrix6::identity() * 1e-12,
        rms_m: 0.0,
        chi2_per_dof: 1.0,
        scale_error: 0.0,
        scale_error_sd: 1.0,
        points: 4,
    }
}

/// Where the dots are (m, phantom frame) when they have gone `moved_m` along x: a grid without regularity. The last column lies beside the slab.
fn dots(moved_m: f64) -> Vec<Vec3> {
    let uneven = |i: usize| ((i * 7919) % 13) as f64 * 2e-4;
    (0..42)
        .map(|i| {
            let (column, row) = (i % 7, i / 7);
            let x = 0.006 + 0.017 * column as f64 + uneven(i);
            Vec3::new(x + moved_m, 0.006 + 0.0145 * row as f64 + uneven(i + 5), TOP_M)
        })
        .collect()
}

/// Blurred discs with grey noise that follows from the pixel.
fn grey(dots: &[Vec3], number: u64) -> Vec<u8> {
    let seen: Vec<[f64; 2]> = dots
        .iter()
        .map(|d| registration().rotation.transpose() * (d - EYE_M))
        .filter_map(|c| camera().project(c))
        .collect();
    let mut state = number + 1;
    (0..SIZE[0] * SIZE[1])
        .map(|i| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let noise = ((state >> 40) % 5) as f64 - 2.0;
            let (x, y) = ((i % SIZE[0]) as f64, (i / SIZE[0]) as f64);
            let cover: f64 = seen
                .iter()
                .map(|[u, v]| (x - u).hypot(y - v))
                .filter(|r| *r < 12.0)
                .map(|r| 0.5 - 0.5 * ((r - 5.0) / 0.8).tanh())
                .sum();
            (22.0 + 170.0 * cover.min(1.0) + noise).round() as u8
        })
        .collect()
}

fn at(number: u64) -> HostTime {
    HostTime::from_nanos(5_000_000_000 + number * 33_333_333)
}

fn record(folder: &Path, frames: impl FnOnce(&mut Recorder)) -> Session {
    let writer = SessionWriter::create(folder, start()).expect("a new session");
    let mut recorder = writer.recorder();
    frames(&mut recorder);
    drop(recorder);
    writer.finish(Outcome::Success, Losses::default(), at(1000)).expect("written");
    Session::open(folder).expect("a session")
}

fn hand(recorder: &mut Recorder, number: u64, levels: &[u8], with_depth: bool) {
    let host = at(number);
    recorder.frame(CameraFrame { host, number: number as u32, device_s: None });
    recorder.grey(Picture::of_grey(host, SIZE, levels).expect("a picture"));
    if with_depth {
        let far = ((EYE_M.z - TOP_M) / UNIT_M).round() as u16;
        recorder.depth(Picture::of_depth(host, SIZE, &vec![far; SIZE[0] * SIZE[1]]).expect("a picture"));
    }
}

fn slab() -> TetMesh {
    let mut mesh = block(&Block { size_m: [0.1, 0.09, TOP_M], cells: [6, 6, 2] }).expect("a block");
    let top = |t: &[u32; 3]| t.iter().all(|&n| mesh.nodes[n as usize].z > TOP_M - 1e-9);
    let observed: Vec<[u32; 3]> =
        boundary_triangles(&mesh).expect("closed").into_iter().filter(top).collect();
    mesh.surfaces.insert("observed".to_owned(), observed);
    mesh
}

#[test]
fn dots_on_the_slab_become_markers_where_they_are() {
    let place = tempfile::tempdir().expect("a folder");
    const STEP_M: f64 = 1e-4;
    let session = record(&place.path().join("session"), |recorder| {
        for number in (0..30).filter(|n| *n != 14) {
            let moved_m = STEP_M * number.max(10) as f64 - STEP_M * 10.0;
            hand(recorder, number, &grey(&dots(moved_m), number), number != 20);
        }
    });
    let eye = Eye { camera: camera(), metres_per_unit: UNIT_M, settings: Settings::default() };
    let mut told = 0;
    let followed = follow(&session, &eye, [at(3), at(10)], &mut || told += 1).expect("dots");
    assert_eq!(told, 29);
    let counts = &followed.counts;
    assert_eq!((counts.frames, counts.lost_frames, counts.incomplete), (28, 1, 1));
    // Number 14 is told by the beat as well; one without depth has come.
    assert_eq!(counts.missing_on_beat, Some(1));
    assert_eq!((followed.reference.len(), counts.seen), (42, 42 * 28), "{:?}", counts.unseen);

    let resting = dots_at_rest(&followed, at(0), at(10));
    assert_eq!(resting.len(), 42);
    let attached = attach_dots(&followed, &resting, &registration(), &slab(), &[], 0.005);
    // Six columns on the slab; the seventh is beside it.
    assert_eq!((attached.markers.len(), attached.elsewhere), (36, 6));
    assert_eq!(attached.missing_on_beat, Some(1));
    assert!(attached.standoff_m.iter().all(|d| *d < 1e-4), "{:?}", attached.standoff_m);
    let frames = &attached.segments[0];
    assert_eq!(frames.len(), 28);
    let mut worst = 0.0_f64;
    for frame in frames {
        let truth = dots(STEP_M * u64::from(frame.number).max(10) as f64 - STEP_M * 10.0);
        assert_eq!(frame.markers.len(), 36);
        for marker in &frame.markers {
            let nearest =
                truth.iter().map(|t| (t - Vec3::from(marker.position_m)).norm()).fold(f64::MAX, f64::min);
            worst = worst.max(nearest);
        }
    }
    // A pixel is half a millimetre there; centres are found to a few hundredths of one.
    assert!(worst < 5e-5, "{worst}");
    // The scatter at rest is what the tracker expects of it, to a factor of two.
    for dot in &resting {
        let scatter = (dot.covariance_m2[(0, 0)] * dot.frames as f64).sqrt();
        let expected = dot.expected_m2[(0, 0)].sqrt();
        assert!(scatter < 3.0 * expected, "dot {}: {scatter} against {expected}", dot.dot);
    }
    // A known point of the bench is no marker.
    let known = registration().apply(&resting[0].mean_m);
    let without = attach_dots(&followed, &resting, &registration(), &slab(), &[known], 0.005);
    assert_eq!(without.markers.len(), 35);
}

/// One dot is hidden in the first picture and then seen at rest, another as long as nothing moves: the one is followed, the other counted.
#[test]
fn a_dot_that_the_first_picture_hides_is_followed_or_counted() {
    let place = tempfile::tempdir().expect("a folder");
    let (late, later) = (16, 25);
    let session = record(&place.path().join("session"), |recorder| {
        for number in 0..30_u64 {
            let moved_m = 1e-4 * number.max(15) as f64 - 15e-4;
            let all = dots(moved_m);
            let seen = |i: &usize| (*i != late || number >= 5) && (*i != later || number >= 18);
            let visible: Vec<Vec3> = (0..all.len()).filter(seen).map(|i| all[i]).collect();
            hand(recorder, number, &grey(&visible, number), true);
        }
    });
    let eye = Eye { camera: camera(), metres_per_unit: UNIT_M, settings: Settings::default() };
    let followed = follow(&session, &eye, [at(0), at(15)], &mut || {}).expect("dots");
    assert_eq!((followed.reference.len(), followed.hidden_at_first), (41, 1));
    for frame in &followed.frames {
        let seen = frame.places.iter().flatten().count();
        assert_eq!(seen, if frame.number < 5 { 40 } else { 41 }, "frame {}", frame.number);
        assert_eq!(frame.others, usize::from(frame.number >= 18), "frame {}", frame.number);
        // Whoever looks at it is shown the one as lost, the other as new.
        let unplaced: Vec<_> = frame.unplaced.iter().map(|dot| (dot.number, dot.sight)).collect();
        let expected = match frame.number {
            0..5 => vec![(Some(40), Sight::Lost)],
            5..18 => vec![],
            _ => vec![(None, Sight::New)],
        };
        assert_eq!(unplaced, expected, "frame {}", frame.number);
    }
    let resting = dots_at_rest(&followed, at(0), at(15));
    let attached = attach_dots(&followed, &resting, &registration(), &slab(), &[], 0.005);
    let rests = |i: usize| attached.rest_m.iter().any(|r| (r - dots(0.0)[i]).norm() < 1e-4);
    assert!(rests(late) && !rests(later) && attached.markers.len() == 35, "{}", attached.markers.len());
}

#[test]
fn pictures_that_show_no_dots_are_refused() {
    let place = tempfile::tempdir().expect("a folder");
    let eye = Eye { camera: camera(), metres_per_unit: UNIT_M, settings: Settings::default() };
    let dark = record(&place.path().join("dark"), |recorder| {
        (0..5).for_each(|n| hand(recorder, n, &[20; SIZE[0] * SIZE[1]], true));
    });
    let refused = follow(&dark, &eye, [at(0), at(4)], &mut || {}).expect_err("no dots");
    assert!(matches!(refused, DatasetError::Track(TrackError::TooFewDots { found: 0, .. })), "{refused:?}");
    let flat = record(&place.path().join("flat"), |recorder| {
        (0..5).for_each(|n| hand(recorder, n, &grey(&dots(0.0), n), false));
    });
    assert!(matches!(follow(&flat, &eye, [at(0), at(4)], &mut || {}), Err(DatasetError::NoPictures)));
}
