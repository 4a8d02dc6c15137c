//! Do pictures come back as they were, and do they leave room for everything else?

use super::fixtures::{at, force_record, scrambled, start};
use crate::clock::HostTime;
use crate::device::{Losses, MarkerFrame, MarkerSource};
use crate::session::{
    CameraFrame, Event, Finding, Outcome, Picture, RecordedFrame, Replay, Session, SessionWriter, Speed,
    Topic,
};
use std::sync::mpsc::sync_channel;
use std::time::Duration;

const SIZE: [usize; 2] = [64, 48];

fn levels(number: u64) -> Vec<u8> {
    (0..SIZE[0] * SIZE[1]).map(|i| scrambled(number * 10_000 + i as u64) as u8).collect()
}

fn depths(number: u64) -> Vec<u16> {
    (0..SIZE[0] * SIZE[1]).map(|i| scrambled(number * 10_000 + 5000 + i as u64) as u16).collect()
}

fn pictures(number: u64) -> (CameraFrame, Picture, Picture) {
    let host = at(number, 30);
    (
        CameraFrame {
            host,
            number: number as u32,
            device_s: (!number.is_multiple_of(2)).then_some(number as f64 / 30.0),
        },
        Picture::of_grey(host, SIZE, &levels(number)).expect("as many as the size says"),
        Picture::of_depth(host, SIZE, &depths(number)).expect("as many as the size says"),
    )
}

#[test]
fn pictures_come_back_to_the_last_bit() {
    let place = tempfile::tempdir().expect("a folder");
    let folder = place.path().join("session");
    let writer = SessionWriter::create(&folder, start()).expect("a new session");
    let mut recorder = writer.recorder();
    const FRAMES: u64 = 20;
    for number in (0..FRAMES).filter(|n| *n != 7) {
        let (frame, grey, depth) = pictures(number);
        assert!(recorder.frame(frame) && recorder.grey(grey));
        // One whose depth got lost.
        assert!(number == 11 || recorder.depth(depth));
    }
    drop(recorder);
    writer.finish(Outcome::Success, Losses::default(), at(FRAMES, 30)).expect("written");
    let session = Session::open(&folder).expect("a session");
    assert_eq!(session.verify().expect("readable"), [] as [Finding; 0]);
    let frames: Vec<RecordedFrame> = session.frames().map(|f| f.expect("a frame")).collect();
    assert_eq!(frames.len(), FRAMES as usize - 1);
    for (found, number) in frames.iter().zip((0..FRAMES).filter(|n| *n != 7)) {
        assert_eq!(found.frame, pictures(number).0);
        let grey = found.grey.as_ref().and_then(Picture::grey).expect("a grey picture");
        assert_eq!((grey.size_px, grey.values), (SIZE, levels(number)));
        let depth = found.depth.as_ref().map(|p| p.depth().expect("a depth picture"));
        assert_eq!(depth.map(|d| d.values), (number != 11).then(|| depths(number)));
        // Each is what it is.
        assert_eq!(found.grey.as_ref().and_then(Picture::depth), None);
    }
}

/// The writing thread is held up: pictures beyond a second's are dropped and counted, and force still has room.
#[test]
fn pictures_that_pile_up_do_not_crowd_out_force() {
    let place = tempfile::tempdir().expect("a folder");
    let folder = place.path().join("session");
    let (held_up, is_held_up) = sync_channel(1);
    let (gate, closed) = sync_channel::<()>(0);
    let writer = SessionWriter::create_held_up(&folder, start(), held_up, closed).expect("a new session");
    let mut recorder = writer.recorder();
    const FRAMES: u64 = 200;
    let (mut number, mut accepted) = (0, 0);
    while number < FRAMES {
        let (frame, grey, depth) = pictures(number);
        recorder.frame(frame);
        accepted += u64::from(recorder.grey(grey)) + u64::from(recorder.depth(depth));
        number += 1;
        if number == 1 {
            is_held_up.recv().expect("it writes the first out");
        }
    }
    assert!(recorder.force(&[force_record(0)], at(1000, 7000)), "there is room for force");
    assert!((60..70).contains(&accepted), "{accepted} pictures taken");
    drop(gate);
    drop(recorder);
    let stop = writer.finish(Outcome::Success, Losses::default(), at(FRAMES, 30)).expect("written");
    let dropped = |topic: Topic| stop.dropped.get(topic.name()).copied().unwrap_or(0);
    assert_eq!(dropped(Topic::Grey) + dropped(Topic::Depth) + accepted, 2 * FRAMES);
    assert_eq!((dropped(Topic::Force), dropped(Topic::Frame)), (0, 0));
}

/// Frame 3 has no depth, frame 5 no markers: what a source of markers hands out has both pictures and markers.
#[test]
fn a_replay_hands_out_the_pictures_of_each_frame() {
    let place = tempfile::tempdir().expect("a folder");
    let folder = place.path().join("session");
    let writer = SessionWriter::create(&folder, start()).expect("a new session");
    let mut recorder = writer.recorder();
    for n in 0..8 {
        let (frame, grey, depth) = pictures(n);
        let seen = MarkerFrame { host: frame.host, number: frame.number, markers: Vec::new() };
        assert!(n == 5 || recorder.markers(seen));
        assert!(recorder.frame(frame) && recorder.grey(grey) && (n == 3 || recorder.depth(depth)));
    }
    drop(recorder);
    writer.finish(Outcome::Success, Losses::default(), at(8, 30)).expect("written");
    let session = Session::open(&folder).expect("a session");
    let replay = Replay::new(&session, Speed::AsFastAsPossible).expect("a replay");
    let mut source = replay.markers().expect("markers");
    let mut found = Vec::new();
    while !source.is_over() {
        let Some(seen) = source.frame(HostTime::now()).expect("readable") else { continue };
        let found_pictures = source.pictures();
        assert_eq!(source.pictures(), None, "once");
        let same = found_pictures.map(|p| {
            let number = u64::from(p.number);
            assert_eq!((p.host, p.device_s), (seen.host, pictures(number).0.device_s));
            (number, p.grey.pixels == levels(number) && p.depth.values == depths(number))
        });
        found.push((seen.number, same));
    }
    let expected = [0, 1, 2, 3, 4, 6, 7].map(|n| (n, (n != 3).then_some((u64::from(n), true))));
    assert_eq!(found, expected);
}

/// What another thread hands over late may begin the chunk that a frame's pictures are in.
#[test]
fn a_frame_has_its_pictures_when_they_are_in_a_chunk_that_begins_earlier() {
    let place = tempfile::tempdir().expect("a folder");
    let folder = place.path().join("session");
    let writer = SessionWriter::create(&folder, start()).expect("a new session");
    let mut recorder = writer.recorder();
    let (frame, grey, depth) = pictures(5);
    assert!(recorder.event(Event::new(at(1, 30), "early")) && recorder.frame(frame));
    // A chunk ends after a tenth of a second.
    std::thread::sleep(Duration::from_millis(400));
    assert!(recorder.event(Event::new(at(0, 30), "late")) && recorder.grey(grey) && recorder.depth(depth));
    drop(recorder);
    writer.finish(Outcome::Success, Losses::default(), at(8, 30)).expect("written");
    let session = Session::open(&folder).expect("a session");
    let found: Vec<RecordedFrame> = session.frames().map(|f| f.expect("sound")).collect();
    assert!(matches!(found.as_slice(), [RecordedFrame { grey: Some(_), depth: Some(_), .. }]), "{found:?}");
}

#[test]
fn what_is_no_picture_is_none() {
    assert_eq!(Picture::of_grey(at(0, 1), [4, 4], &[0; 15]), None);
    assert_eq!(Picture::of_depth(at(0, 1), [0, 4], &[]), None);
    assert_eq!(Picture::of_grey(at(0, 1), [usize::MAX, 2], &[0; 15]), None);
    let broken = Picture { host: at(0, 1), png: b"\x89PNG\r\n".to_vec() };
    assert_eq!((broken.grey(), broken.depth()), (None, None));
}
