//! Cameras that are not there, and options that make no sense.

use crate::driver::{DriverError, ImageFiles, Pace, V4l2Stream, VideoOptions, VideoSource, open_video};
use std::time::{Duration, Instant};

fn refused(options: &VideoOptions) -> DriverError {
    open_video(options).err().expect("refused")
}

fn of(source: VideoSource) -> VideoOptions {
    VideoOptions::new(source, [64, 48], 30.0)
}

fn pipelines(grey: &str, depth: &str) -> VideoOptions {
    of(VideoSource::GStreamer { grey: grey.to_owned(), depth: depth.to_owned() })
}

#[test]
fn devices_that_are_not_there_are_named() {
    let stream = |device: &str| V4l2Stream { device: device.into(), four_cc: Some(['Y', '1', '6', ' ']) };
    let source =
        VideoSource::V4l2 { grey: stream("/dev/no-such-camera"), depth: stream("/dev/no-such-depth") };
    let error = refused(&of(source));
    assert!(matches!(error, DriverError::VideoOpen { backend: "V4L2", .. }), "{error}");
    assert!(error.to_string().contains("/dev/no-such-"), "{error}");
}

#[test]
fn backends_that_opencv_was_built_without_are_named_with_those_that_are_there() {
    for (source, name) in
        [(VideoSource::OpenNi2 { index: 0 }, "OPENNI2"), (VideoSource::Obsensor { index: 0 }, "OBSENSOR")]
    {
        let error = refused(&of(source));
        // Where OpenCV has the backend, there is no such camera.
        let said = error.to_string();
        let missing = said.contains(&format!("it lacks {name}, and has ")) && said.contains("CV_IMAGES");
        assert!(missing || matches!(error, DriverError::VideoOpen { .. }), "{error}");
    }
}

#[test]
fn pipelines_that_are_none_are_refused() {
    let good = "videotestsrc num-buffers=9 ! video/x-raw,format=GRAY8,width=64,height=48 ! appsink";
    for bad in
        ["no-such-element ! appsink", "videotestsrc ! ! appsink", "filesrc location=/no/such ! appsink"]
    {
        let error = refused(&pipelines(bad, bad));
        assert!(matches!(error, DriverError::VideoOpen { backend: "GSTREAMER", .. }), "{bad}: {error}");
        assert!(error.to_string().contains(bad), "{error}");
    }
    let error = refused(&pipelines(good, "videotestsrc ! fakesink"));
    assert!(matches!(error, DriverError::VideoSetting { name: "pipeline", .. }), "{error}");
    // Grey levels where distances should be.
    let error = refused(&pipelines(good, good));
    assert!(error.to_string().contains("gives 8 bits in 1 channel, 64 × 48; expected 16 bits"), "{error}");
}

/// Nothing is ever written there: OpenCV waits without end, its caller does not.
#[test]
fn a_pipeline_that_nothing_comes_through_holds_nobody_up() {
    let mut options = pipelines("appsrc ! appsink", "appsrc ! appsink");
    options.patience = Duration::from_millis(300);
    let begun = Instant::now();
    let error = refused(&options);
    assert!(begun.elapsed() < Duration::from_secs(10), "{:?}", begun.elapsed());
    assert!(error.to_string().contains("being opened"), "{error}");
}

#[test]
fn options_that_make_no_sense_are_refused() {
    let files = || ImageFiles { pattern: "/no/%d.png".into(), times: "/no/times.csv".into() };
    let good = of(VideoSource::Files { grey: files(), depth: files(), pace: Pace::AsFetched });
    let named = |options: VideoOptions| match refused(&options) {
        DriverError::VideoSetting { name, .. } => name,
        other => panic!("{other}"),
    };
    assert_eq!(named(VideoOptions { size: [0, 48], ..good.clone() }), "size");
    assert_eq!(named(VideoOptions { size: [64, 99_999], ..good.clone() }), "size");
    assert_eq!(named(VideoOptions { rate_hz: f64::NAN, ..good.clone() }), "rate_hz");
    assert_eq!(named(VideoOptions { metres_per_unit: 0.0, ..good.clone() }), "metres_per_unit");
    assert_eq!(named(VideoOptions { metres_per_unit: 1.0, ..good.clone() }), "metres_per_unit");
    assert_eq!(named(VideoOptions { queue: 0, ..good.clone() }), "queue");
    assert_eq!(named(VideoOptions { silence: Duration::from_millis(40), ..good }), "silence");
}
