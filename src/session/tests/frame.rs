//! Is the picture that is handed out the one that was asked for, and is one that is not there named, with what is beside it?

use super::fixtures::{ORIGIN_NS, at, start};
use crate::clock::HostTime;
use crate::device::Losses;
use crate::session::{
    CameraFrame, FrameAsked, FrameStamp, Outcome, Picture, Session, SessionError, SessionWriter, Stream,
};
use std::path::Path;

const SIZE: [usize; 2] = [16, 12];

fn depths(number: u64) -> Vec<u16> {
    (0..SIZE[0] * SIZE[1]).map(|i| (300 * number + 7 * i as u64) as u16).collect()
}

/// 30 frames at 30 a second, number 10 on: 15 and 16 are lost, 20 has no depth, the grey picture of 25 is none.
fn recorded(folder: &Path) -> Session {
    let writer = SessionWriter::create(folder, start()).expect("a new session");
    let mut recorder = writer.recorder();
    for number in (10..40_u64).filter(|n| ![15, 16].contains(n)) {
        let host = at(number, 30);
        assert!(recorder.frame(CameraFrame { host, number: number as u32, device_s: None }));
        let mut grey =
            Picture::of_grey(host, SIZE, &[number as u8; 16 * 12]).expect("as many as the size says");
        if number == 25 {
            grey.png.truncate(40);
        }
        assert!(recorder.grey(grey));
        let depth = Picture::of_depth(host, SIZE, &depths(number)).expect("as many as the size says");
        assert!(number == 20 || recorder.depth(depth));
    }
    drop(recorder);
    writer.finish(Outcome::Success, Losses::default(), at(40, 30)).expect("written");
    Session::open(folder).expect("a session")
}

fn stamp(number: u32) -> FrameStamp {
    let began = HostTime::from_nanos(ORIGIN_NS);
    FrameStamp { number, time_s: at(u64::from(number), 30).seconds_after(began) }
}

#[test]
fn the_picture_asked_for_is_handed_out_to_the_last_bit() {
    let place = tempfile::tempdir().expect("a folder");
    let session = recorded(&place.path().join("session"));
    let asked = |number: u32| [FrameAsked::Number(number), FrameAsked::At(f64::from(number) / 30.0 + 0.012)];
    for number in [10, 14, 21, 39] {
        for asked in asked(number) {
            let grey = session.picture(asked, Stream::Grey).expect("there");
            assert_eq!((grey.stamp, grey.size_px), (stamp(number), SIZE), "{asked:?}");
            let levels = grey.picture.grey().expect("8 bits").values;
            assert_eq!(levels, [number as u8; 16 * 12]);
            let depth = session.picture(asked, Stream::Depth).expect("there");
            assert_eq!(depth.picture.depth().expect("16 bits").values, depths(u64::from(number)));
            assert_eq!(depth.frame.host, at(u64::from(number), 30));
        }
    }
    // The grey picture of a frame without depth is there.
    assert_eq!(session.picture(FrameAsked::Number(20), Stream::Grey).expect("there").stamp, stamp(20));
}

/// A camera of nominally 30 frames a second that delivers ten: none of them is lost.
#[test]
fn a_slow_camera_has_lost_nothing() {
    let place = tempfile::tempdir().expect("a folder");
    let folder = place.path().join("session");
    let writer = SessionWriter::create(&folder, start()).expect("a new session");
    let mut recorder = writer.recorder();
    for number in 0..5_u64 {
        let host = at(number, 10);
        assert!(recorder.frame(CameraFrame { host, number: number as u32, device_s: None }));
        assert!(recorder.grey(Picture::of_grey(host, SIZE, &[7; 16 * 12]).expect("as many")));
    }
    drop(recorder);
    writer.finish(Outcome::Success, Losses::default(), at(5, 10)).expect("written");
    let session = Session::open(&folder).expect("a session");
    for (time_s, number) in [(0.14, 1), (0.151, 2), (0.249, 2), (0.31, 3)] {
        let found = session.picture(FrameAsked::At(time_s), Stream::Grey).expect("there");
        assert_eq!(found.stamp.number, number, "{time_s}");
    }
}

#[test]
fn a_frame_that_is_not_there_is_named_with_those_beside_it() {
    let place = tempfile::tempdir().expect("a folder");
    let session = recorded(&place.path().join("session"));
    let refused = |asked, stream| session.picture(asked, stream).expect_err("not there");
    for asked in [FrameAsked::Number(15), FrameAsked::Number(16), FrameAsked::At(0.517), FrameAsked::At(0.5)]
    {
        let error = refused(asked, Stream::Grey);
        let beside = match error {
            SessionError::FrameLost { before, after, .. } => (before, after),
            other => panic!("{asked:?}: {other}"),
        };
        assert_eq!(beside, (stamp(14), stamp(17)), "{asked:?}");
    }
    // Less than one beat from a frame: that is the one.
    assert_eq!(session.picture(FrameAsked::At(0.48), Stream::Grey).expect("there").stamp, stamp(14));
    for asked in [FrameAsked::Number(9), FrameAsked::Number(40), FrameAsked::At(0.3), FrameAsked::At(99.0)] {
        let error = refused(asked, Stream::Depth);
        assert!(
            error.to_string().contains("frames go from frame 10 at 0.333 s to frame 39 at 1.300 s"),
            "{error}"
        );
        assert!(matches!(error, SessionError::OutsideFrames { .. }), "{error}");
    }
    for asked in [FrameAsked::Number(20), FrameAsked::At(0.67)] {
        match refused(asked, Stream::Depth) {
            SessionError::NoPicture { frame, nearest: Some(near), dropped: false, .. } => {
                assert_eq!(frame, stamp(20));
                assert!([stamp(19), stamp(21)].contains(&near), "{near}");
            }
            other => panic!("{other}"),
        }
    }
    assert!(matches!(refused(FrameAsked::Number(25), Stream::Grey), SessionError::BadPicture { .. }));
    let empty = place.path().join("empty");
    let writer = SessionWriter::create(&empty, start()).expect("a new session");
    writer.finish(Outcome::Success, Losses::default(), at(1, 1)).expect("written");
    let error = Session::open(&empty).expect("a session").picture(FrameAsked::At(0.0), Stream::Grey);
    assert!(matches!(error, Err(SessionError::NoFrames { .. })), "{error:?}");
}
