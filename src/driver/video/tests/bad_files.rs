//! Image files that are not as they should be: refused with their names, or counted.

use super::recorded::{HEIGHT, Recorded, WIDTH, time_s};
use crate::device::{DeviceError, FrameLosses};
use std::fs;

/// What is played of a recording, and what is counted.
fn played(recorded: &Recorded) -> (Vec<u32>, FrameLosses, DeviceError) {
    let mut camera = recorded.open().expect("open");
    camera.start().expect("started");
    let (frames, end) = Recorded::play(&mut *camera);
    (Recorded::sound_numbers(&frames), camera.losses(), end)
}

fn times(numbers: impl Iterator<Item = u32>) -> Vec<(u32, f64)> {
    numbers.map(|number| (number, time_s(number))).collect()
}

#[test]
fn numbers_that_are_missing_are_lost_frames() {
    let numbers = [3, 4, 5, 8, 9, 11];
    // The table has them, or has them not: both show that they are missing.
    for rows in [times(numbers.into_iter()), times(3..12)] {
        let recorded = Recorded::new(numbers);
        recorded.times(rows);
        let (played, losses, end) = played(&recorded);
        assert_eq!(played, numbers);
        assert_eq!(losses, FrameLosses { received: 6, lost: 6, ..FrameLosses::default() });
        assert!(matches!(end, DeviceError::Ended { frames: 6, .. }), "{end}");
    }
}

#[test]
fn files_missing_at_either_end_of_the_table_are_lost_frames() {
    let recorded = Recorded::new(2..6);
    recorded.times(times(0..9));
    let (played, losses, _) = played(&recorded);
    assert_eq!(played, [2, 3, 4, 5]);
    assert_eq!(losses, FrameLosses { received: 4, lost: 10, ..FrameLosses::default() });
}

#[test]
fn a_picture_without_its_partner_is_counted_and_shifts_nobody() {
    let recorded = Recorded::new(0..10);
    fs::remove_file(recorded.depth_path(4)).expect("removed");
    fs::remove_file(recorded.grey_path(9)).expect("removed");
    let (played, losses, _) = played(&recorded);
    assert_eq!(played, [0, 1, 2, 3, 5, 6, 7, 8]);
    assert_eq!(losses, FrameLosses { received: 8, lost: 2, unpaired: 2, ..FrameLosses::default() });
}

#[test]
fn pictures_that_are_none_are_counted() {
    let recorded = Recorded::new(0..12);
    fs::write(recorded.depth_path(2), b"").expect("written");
    let whole = fs::read(recorded.grey_path(4)).expect("read");
    fs::write(recorded.grey_path(4), &whole[..whole.len() / 2]).expect("written");
    recorded.grey(6, [WIDTH + 1, HEIGHT]);
    recorded.depth(7, [WIDTH, HEIGHT - 1]);
    fs::copy(recorded.grey_path(0), recorded.depth_path(9)).expect("copied");
    Recorded::colour(recorded.depth_path(10), [9, 9, 9]);
    let (played, losses, end) = played(&recorded);
    assert_eq!(played, [0, 1, 3, 5, 8, 11]);
    assert_eq!(losses, FrameLosses { received: 6, malformed: 6, unpaired: 6, ..FrameLosses::default() });
    assert!(matches!(end, DeviceError::Ended { frames: 6, .. }), "{end}");
}

#[test]
fn nothing_but_pictures_that_are_none_is_no_camera() {
    let recorded = Recorded::new(0..30);
    for number in 5..30 {
        recorded.depth(number, [WIDTH, HEIGHT + 1]);
    }
    let (played, losses, end) = played(&recorded);
    // Whatever of the sound ones was together by then.
    assert!([0, 1, 2, 3, 4].starts_with(&played), "{played:?}");
    assert_eq!(losses.malformed, 10);
    let said = end.to_string();
    assert!(said.contains("16 bits in 1 channel, 33 × 22, not 16 bits in 1 channel, 33 × 21"), "{said}");
}

#[test]
fn first_pictures_of_another_kind_are_refused() {
    let expected = "expected 16 bits in 1 channel, 33 × 21";
    let refused = |change: &dyn Fn(&Recorded), found: &str, expected: &str| {
        let recorded = Recorded::new(0..3);
        change(&recorded);
        let said = recorded.refusal();
        assert!(said.contains(found) && said.contains(expected), "{said}");
    };
    let eight_bits = |recorded: &Recorded| {
        fs::copy(recorded.grey_path(0), recorded.depth_path(0)).expect("copied");
    };
    refused(&eight_bits, "8 bits in 1 channel, 33 × 21", expected);
    refused(&|r| Recorded::colour(r.depth_path(0), [1, 2, 3]), "8 bits in 3 channels", expected);
    refused(&|r| r.depth(0, [WIDTH, HEIGHT + 2]), "16 bits in 1 channel, 33 × 23", expected);
    let deep = |recorded: &Recorded| {
        fs::copy(recorded.depth_path(0), recorded.grey_path(0)).expect("copied");
    };
    refused(&deep, "16 bits in 1 channel", "expected 8 bits in 1 channel, or in 3 of a colour picture");
    refused(&|r| fs::write(r.depth_path(0), b"").expect("written"), "depth_0000.png", "an image file");
}

#[test]
fn tables_of_times_are_checked() {
    let refused = |table: Option<&str>, expected: &[&str]| {
        let recorded = Recorded::new(0..4);
        match table {
            Some(text) => recorded.table(text),
            None => fs::remove_file(recorded.path("times.csv")).expect("removed"),
        }
        let said = recorded.refusal();
        assert!(expected.iter().all(|part| said.contains(part)), "{said}");
    };
    refused(None, &["times.csv", "when each image file was taken", "No such file"]);
    refused(Some("frame,time_s\n0,1\n1,2\n2,3\n"), &["has no row for", "grey_0003.png"]);
    refused(Some("frame,time_s\n0,1\n1,2\n2,1.5\n3,4\n"), &["line 4", "\"1.5\"", "later than 2 s"]);
    refused(Some("frame,time_s\n0,1\n1,1\n2,2\n3,4\n"), &["line 3", "later than 1 s"]);
    refused(Some("frame,time_s\n0,1\n2,2\n1,3\n3,4\n"), &["line 4", "frame \"1\"", "more than 2"]);
    refused(Some("frame,time_s\n0,1\n1,nan\n2,3\n3,4\n"), &["line 3", "\"nan\"", "a time in seconds"]);
    refused(Some("frame,time_s\n0,1\n1,\n2,3\n3,4\n"), &["line 3", "\"\"", "a time in seconds"]);
    refused(Some("frame,time_s\n0,1\n-1,2\n2,3\n3,4\n"), &["line 3", "\"-1\"", "a whole number"]);
    refused(Some("frame,time_s\n0,1\n1,2,9\n2,3\n3,4\n"), &["line: 3"]);
    refused(Some("frame,seconds\n0,1\n"), &["has no column time_s"]);
    refused(Some("frame,time_s\n"), &["a row for each frame"]);
    refused(Some(""), &["has no column frame"]);
}

#[test]
fn a_table_of_other_files_is_refused() {
    let recorded = Recorded::new(0..4);
    for number in 0..4 {
        fs::remove_file(recorded.grey_path(number)).expect("removed");
    }
    let said = recorded.refusal();
    assert!(said.contains("there is no file") && said.contains("grey_%04d.png"), "{said}");
}
