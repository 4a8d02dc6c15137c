//! `session frame`: a picture comes out of a session as it went in, or it is said why not, and nothing is left behind.

use super::sessions::{camera, start};
use super::{names, run, utf8};
use image::DynamicImage;
use phantom_rig::clock::HostTime;
use phantom_rig::device::Losses;
use phantom_rig::session::{CameraFrame, Outcome, Picture, Recorder, Session, SessionWriter};
use serde_json::Value;
use std::fs;
use std::path::Path;

const SIZE: [usize; 2] = [100, 80];
const PIXELS: usize = SIZE[0] * SIZE[1];

fn host(number: u64) -> HostTime {
    HostTime::from_nanos(1_100_000_000 + number * 33_333_333)
}

/// Depths of 16 bits, like noise, so that they fill more than one chunk of a session (SplitMix64's mixing, Steele et al. 2014).
fn depths(number: u64) -> Vec<u16> {
    let scrambled = |i: u64| {
        let z = i.wrapping_mul(0x9E37_79B9_7F4A_7C15);
        ((z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9) >> 40) as u16
    };
    (0..PIXELS as u64).map(|i| scrambled(number * 100_000 + i)).collect()
}

/// Frames 0 to 24 of a camera, 0.1 s after the start on: 10 is lost, 15 has no depth. As many as fit into the recorder's queue.
fn hand_over(recorder: &mut Recorder, brighter: u8) {
    for number in (0..25).filter(|n| *n != 10) {
        let host = host(number);
        recorder.frame(CameraFrame { host, number: number as u32, device_s: None });
        let levels = [number as u8 + brighter; PIXELS];
        assert!(recorder.grey(Picture::of_grey(host, SIZE, &levels).expect("a picture")));
        let depth = Picture::of_depth(host, SIZE, &depths(number)).expect("a picture");
        assert!(number == 15 || recorder.depth(depth));
    }
}

fn record(folder: &Path, has_camera: bool) {
    let writer =
        SessionWriter::create(folder, start(has_camera.then(|| camera(true)))).expect("a new session");
    let mut recorder = writer.recorder();
    if has_camera {
        hand_over(&mut recorder, 0);
    }
    drop(recorder);
    writer.finish(Outcome::Success, Losses::default(), host(25)).expect("written");
}

#[test]
fn a_picture_comes_out_of_a_session_without_loss() {
    let place = tempfile::tempdir().expect("a folder");
    let at = |name: &str| place.path().join(name);
    record(&at("seen"), true);
    let (session, grey, depth) = (at("seen"), at("grey.PNG"), at("depth.png"));
    let frame = |more: &[&str]| run(&[&["session", "frame", utf8(&session)], more].concat());

    let (code, text, stderr) = frame(&["--number", "12", "--stream", "depth", "--out", utf8(&depth)]);
    assert_eq!(code, 0, "{text}{stderr}");
    assert!(text.starts_with(utf8(&depth)), "{text}");
    for words in ["depth picture of frame 12 at 0.500 s", "100 × 80 px", "16 bits", "one count is 0.1 mm"] {
        assert!(text.contains(words), "{words:?} is not in {text}");
    }
    match image::open(&depth).expect("a PNG") {
        DynamicImage::ImageLuma16(picture) => assert_eq!(picture.into_raw(), depths(12)),
        other => panic!("{:?}", other.color()),
    }
    // 0.51 s is nearer to 12 than to 13.
    let (code, text, stderr) = frame(&["--at", "0.51", "--out", utf8(&grey), "--json"]);
    let json: Value = serde_json::from_str(&text).unwrap_or_else(|e| panic!("{e}: {text}{stderr}"));
    assert_eq!((code, &json["number"], &json["stream"]), (0, &Value::from(12), &Value::from("grey")));
    assert_eq!((&json["bits"], &json["metres_per_unit"]), (&Value::from(8), &Value::Null));
    assert!((json["time_s"].as_f64().expect("a time") - 0.5).abs() < 1e-6, "{json}");
    match image::open(&grey).expect("a PNG") {
        DynamicImage::ImageLuma8(picture) => assert_eq!(picture.into_raw(), [12; PIXELS]),
        other => panic!("{:?}", other.color()),
    }
    // The very bytes that were recorded.
    let mut frames = Session::open(&session).expect("a session").frames();
    let recorded = frames.find(|f| f.as_ref().is_ok_and(|f| f.frame.number == 12));
    let png = recorded.expect("a frame").expect("sound").grey.expect("a picture").png;
    assert_eq!(fs::read(&grey).expect("readable"), png);

    let before = fs::read(&grey).expect("readable");
    let (code, text, stderr) = frame(&["--number", "13", "--out", utf8(&grey)]);
    assert!(code == 1 && text.is_empty() && stderr.contains("exists"), "{text}{stderr}");
    assert_eq!(fs::read(&grey).expect("readable"), before);
    let (code, text, stderr) = frame(&["--number", "13", "--out", utf8(&grey), "--force", "--quiet"]);
    assert_eq!((code, text.as_str(), stderr.as_str()), (0, "", ""));
    assert_ne!(fs::read(&grey).expect("readable"), before);
    assert_eq!(names(place.path()), ["depth.png", "grey.PNG", "seen"]);
}

#[test]
fn a_picture_that_is_not_there_is_refused_with_what_is() {
    let place = tempfile::tempdir().expect("a folder");
    let at = |name: &str| place.path().join(name);
    record(&at("seen"), true);
    record(&at("blind"), false);
    let (seen, blind) = (at("seen"), at("blind"));
    let frame = |session: &Path, more: &[&str], out: &str| {
        let out = place.path().join(out);
        run(&[&["session", "frame", utf8(session), "--out", utf8(&out)], more].concat())
    };
    let range = "frames go from frame 0 at 0.100 s to frame 24 at 0.900 s";
    let beside = "it was lost; those beside it are frame 9 at 0.400 s and frame 11 at 0.467 s";
    for (more, words) in [
        (&["--at", "99"][..], ["no frame at 99.000 s", range]),
        (&["--at", "-1"], ["no frame at -1.000 s", range]),
        (&["--number", "40"], ["no frame 40", range]),
        (&["--number", "10"], ["no frame 10", beside]),
        (&["--at", "0.4333"], ["no frame at 0.433 s", beside]),
        (
            &["--number", "15", "--stream", "depth"],
            ["frame 15 at 0.600 s has no depth picture", "the nearest"],
        ),
    ] {
        let (code, text, stderr) = frame(&seen, more, "frame.png");
        assert_eq!((code, text.as_str()), (1, ""), "{more:?}: {stderr}");
        assert!(words.iter().all(|words| stderr.contains(words)), "{more:?}: {words:?} are not in {stderr}");
        assert!(!stderr.contains("recover"), "{stderr}");
    }
    let (code, _, stderr) = frame(&blind, &["--number", "1"], "frame.png");
    assert!(code == 1 && stderr.contains("it has no pictures: its rig had no camera"), "{stderr}");
    for (more, out) in [
        (&["--number", "1"][..], "frame.jpg"),
        (&["--number", "1"], "frame"),
        (&["--at", "nan"], "frame.png"),
        (&["--number", "1", "--at", "1"], "frame.png"),
        (&["--number", "1", "--segment", "2"], "frame.png"),
        (&["--number", "1", "--segment", "0"], "frame.png"),
        (&["--number", "1", "--stream", "colour"], "frame.png"),
        (&[], "frame.png"),
    ] {
        let (code, text, stderr) = frame(&seen, more, out);
        assert_eq!((code, text.as_str()), (2, ""), "{more:?}: {stderr}");
    }
    let (code, _, stderr) = frame(&seen, &["--number", "1"], "no/such/frame.png");
    assert!(code == 1 && stderr.contains("no/such"), "{stderr}");
    assert_eq!(names(place.path()), ["blind", "seen"], "nothing is left behind");
}

/// Two stretches with the same numbers, the second brighter: nothing is guessed.
#[test]
fn of_a_session_that_went_on_it_must_be_said_which_stretch() {
    let place = tempfile::tempdir().expect("a folder");
    let at = |name: &str| place.path().join(name);
    let (session, out) = (at("twice"), at("frame.png"));
    let writer = SessionWriter::create(&session, start(Some(camera(true)))).expect("a new session");
    hand_over(&mut writer.recorder(), 0);
    let stopped = Outcome::Abort { cause: "a hand".to_owned() };
    writer.finish(stopped, Losses::default(), host(25)).expect("written");
    let writer = SessionWriter::continue_session(&session, start(Some(camera(true)))).expect("goes on");
    hand_over(&mut writer.recorder(), 100);
    writer.finish(Outcome::Success, Losses::default(), host(25)).expect("written");
    let frame = |more: &[&str]| {
        run(&[&["session", "frame", utf8(&session), "--number", "5", "--out", utf8(&out)], more].concat())
    };
    let (code, _, stderr) = frame(&[]);
    assert!(code == 2 && stderr.contains("2 segments") && stderr.contains("--segment"), "{stderr}");
    for (segment, level) in [("1", 5), ("2", 105)] {
        let (code, text, stderr) = frame(&["--segment", segment, "--force"]);
        assert!(code == 0 && text.contains(&format!("of segment {segment}")), "{text}{stderr}");
        assert_eq!(image::open(&out).expect("a PNG").to_luma8().into_raw(), [level; PIXELS]);
    }
}

/// A byte is flipped in the middle of the file: what lies elsewhere is there, for what lies there something can be done.
#[test]
fn pictures_of_a_damaged_session_are_there_where_they_are_sound() {
    let place = tempfile::tempdir().expect("a folder");
    let at = |name: &str| place.path().join(name);
    record(&at("seen"), true);
    let (damaged, out) = (at("damaged"), at("frame.png"));
    fs::create_dir(&damaged).expect("writable");
    fs::copy(at("seen/manifest.json"), damaged.join("manifest.json")).expect("a copy");
    let mut bytes = fs::read(at("seen/session.mcap")).expect("readable");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 0xff;
    fs::write(damaged.join("session.mcap"), bytes).expect("writable");
    let there: Vec<u32> =
        Session::open(&damaged).expect("a session").frames().flatten().map(|f| f.frame.number).collect();
    let gone = (0..25).filter(|n| *n != 10).find(|n| !there.contains(n));
    let frame = |number: u32| {
        let number = number.to_string();
        run(&["session", "frame", utf8(&damaged), "--number", &number, "--out", utf8(&out)])
    };
    let (code, text, stderr) = frame(gone.expect("a frame in the middle"));
    assert!(code == 1 && text.is_empty() && stderr.contains("session recover"), "{text}{stderr}");
    let (code, text, stderr) = frame(*there.last().expect("a sound frame at the end"));
    assert_eq!(code, 0, "{text}{stderr}");
}
