//! Image files in place of a camera: all of them, bit by bit, at their times.

use super::recorded::{HEIGHT, RATE_HZ, Recorded, WIDTH, time_s};
use crate::clock::HostTime;
use crate::device::{DeviceError, FrameLosses};
use crate::driver::{Pace, open_video};
use std::time::Duration;

#[test]
fn every_value_comes_as_it_was_written_and_again_after_a_restart() {
    let recorded = Recorded::new(0..40);
    let mut camera = recorded.open().expect("open");
    assert_eq!(camera.identity().backend, "CV_IMAGES");
    assert!(camera.identity().description.contains("40 image files"), "{:?}", camera.identity());
    let format = *camera.format();
    assert_eq!((format.width, format.height, format.rate_hz), (WIDTH, HEIGHT, RATE_HZ));
    assert_eq!(format.metres_per_unit, 1e-3);
    assert_eq!(camera.frame(HostTime::now()).expect("not started"), None);
    for _ in 0..2 {
        let before = HostTime::now();
        camera.start().expect("started");
        let (frames, end) = Recorded::play(&mut *camera);
        assert_eq!(Recorded::sound_numbers(&frames), (0..40).collect::<Vec<_>>());
        assert!(matches!(end, DeviceError::Ended { frames: 40, .. }), "{end}");
        let losses = FrameLosses { received: 40, ..FrameLosses::default() };
        assert_eq!(camera.losses(), losses);
        // On the host's clock as they were taken, from the start on.
        let first = frames[0].host;
        assert!(first >= before && first <= HostTime::now());
        for frame in &frames {
            let (after, taken) = (frame.host.seconds_after(first), time_s(frame.number) - time_s(0));
            assert!((after - taken).abs() < 1e-6, "{after} s, {taken} s");
        }
    }
}

#[test]
fn memory_that_was_given_back_is_used_again() {
    let recorded = Recorded::new(0..40);
    let mut camera = recorded.open().expect("open");
    camera.start().expect("started");
    let mut addresses = std::collections::BTreeSet::new();
    while let Ok(Some(frame)) = camera.frame(HostTime::now() + Duration::from_secs(20)) {
        Recorded::sound_numbers(std::slice::from_ref(&frame));
        addresses.insert(frame.depth.values.as_ptr() as usize);
        camera.recycle(frame);
    }
    assert_eq!(camera.losses().received, 40);
    assert!(addresses.len() < 30, "{} pieces of memory for 40 frames", addresses.len());
}

#[test]
fn colours_become_grey() {
    let recorded = Recorded::new(1..4);
    for number in 1..4 {
        Recorded::colour(recorded.grey_path(number), [255, 0, 0]);
    }
    let mut camera = recorded.open().expect("open");
    camera.start().expect("started");
    let (frames, _) = Recorded::play(&mut *camera);
    assert_eq!(frames.len(), 3);
    // ITU-R BT.601: 0.299 of red.
    assert!(frames.iter().all(|frame| frame.grey.pixels == [76; WIDTH * HEIGHT]));
}

/// Who does not fetch a live camera's frames loses them; so it is with files at their own pace. Twelve frames take 0.4 s.
#[test]
fn files_as_they_were_taken_do_not_wait_for_anybody() {
    let recorded = Recorded::new(0..12);
    let mut options = recorded.options(Pace::AsTaken);
    options.queue = 2;
    let mut camera = open_video(&options).expect("open");
    let begun = HostTime::now();
    camera.start().expect("started");
    while camera.losses().received < 12 && HostTime::now().since(begun) < Duration::from_secs(20) {
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(HostTime::now().since(begun) >= Duration::from_secs_f64(11.0 / RATE_HZ));
    let (frames, end) = Recorded::play(&mut *camera);
    assert_eq!(Recorded::sound_numbers(&frames), [0, 1]);
    assert!(matches!(end, DeviceError::Ended { frames: 12, .. }), "{end}");
    assert_eq!(camera.losses(), FrameLosses { received: 12, dropped: 10, ..FrameLosses::default() });
}

#[test]
fn a_stopped_recording_begins_anew() {
    let recorded = Recorded::new(0..40);
    let mut camera = recorded.open().expect("open");
    camera.start().expect("started");
    for expected in 0..5 {
        let frame = camera.frame(HostTime::now() + Duration::from_secs(20)).expect("plays").expect("a frame");
        assert_eq!(frame.number, expected);
    }
    camera.stop().expect("stopped");
    assert_eq!(camera.frame(HostTime::now()).expect("stopped"), None);
    camera.start().expect("started");
    let (frames, _) = Recorded::play(&mut *camera);
    assert_eq!(Recorded::sound_numbers(&frames), (0..40).collect::<Vec<_>>());
}
