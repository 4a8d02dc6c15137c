//! What the program writes, it reads again as it was.

use crate::fixture;
use phantom_rig::dataset::{read_bundle, write_bundle};
use phantom_rig::geometry::Vec3;
use phantom_rig::observation::{Contact, Gravity, Recording, TipShape};

fn written_and_read(recording: &Recording) -> Recording {
    let folder = tempfile::tempdir().expect("a temporary folder");
    write_bundle(recording, folder.path()).expect("writable");
    let (read, suspicions) = read_bundle(folder.path()).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(suspicions, []);
    read
}

#[test]
fn a_small_bundle() {
    let recording = fixture::recording();
    assert_eq!(written_and_read(&recording), recording);
}

#[test]
fn a_bundle_with_every_optional_key_and_without_a_stage() {
    let mut recording = fixture::recording();
    recording.stage = None;
    recording.tip.contact = Contact::Unilateral;
    recording.tip.shape = TipShape::Sphere { radius_m: 0.005 };
    recording.max_standoff_m = 0.02;
    recording.phantom.gravity =
        Some(Gravity { acceleration_m_s2: Vec3::new(0.1, -1e-17, -9.81), at_rest: true });
    assert_eq!(written_and_read(&recording), recording);
}

/// Directions as rounded as 1/3 and 0.1 are, and positions with all their digits.
#[test]
fn numbers_keep_their_last_bit() {
    let mut recording = fixture::recording();
    recording.pokes[0].direction = Vec3::new(0.1, 0.3, -1.0).normalize();
    recording.pokes[0].site.x = 0.015 + 1.0 / 3.0 * 1e-3;
    recording.markers.rows[150].position_m = [1.0 / 30.0, 0.1 + 0.2 - 0.29, 0.02 + f64::EPSILON];
    recording.wrench.force_n[3] = [5e-324, -0.0, 1e-7 / 3.0];
    assert_eq!(written_and_read(&recording), recording);
}

/// A bundle without a stage written over one with a stage must not inherit it.
#[test]
fn an_old_stage_is_not_inherited() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut recording = fixture::recording();
    write_bundle(&recording, folder.path()).expect("writable");
    recording.stage = None;
    write_bundle(&recording, folder.path()).expect("writable");
    assert_eq!(read_bundle(folder.path()).expect("readable").0, recording);
}
