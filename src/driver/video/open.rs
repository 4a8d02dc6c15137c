//! Opens what a source names, each stream in the thread that will grab from it, and checks a first picture of each.

use super::super::DriverError;
use super::backend::Backend;
use super::camera::VideoCamera;
use super::capture::{Capture, Opened};
use super::desk::Desk;
use super::feed::{Feed, Grab, Live};
use super::files::Recording;
use super::grab::Stream;
use super::pixels::Kind;
use super::{Pace, V4l2Stream, VideoOptions, VideoSource};
use crate::clock::HostTime;
use crate::device::{DepthCamera, DepthCameraFormat, DepthCameraIdentity, DeviceError};
use opencv::videoio::{
    CAP_OPENNI_BGR_IMAGE, CAP_OPENNI_DEPTH_MAP, CAP_PROP_CONVERT_RGB, CAP_PROP_FOURCC, CAP_PROP_FPS,
    CAP_PROP_FRAME_HEIGHT, CAP_PROP_FRAME_WIDTH, CAP_V4L2,
};
use std::sync::Arc;
use std::sync::mpsc::{self, Sender};
use std::thread;

/// Opens a depth camera and waits for a first picture of each stream, which is checked and thrown away.
///
/// # Errors
/// [`DriverError`]: options that make no sense, a backend that OpenCV was built without, no such device or pipeline, no picture within
/// [`VideoOptions::patience`], pictures of another kind or size, files without times.
pub fn open_video(options: &VideoOptions) -> Result<Box<dyn DepthCamera>, DriverError> {
    options.check()?;
    let backend = Backend::of(&options.source);
    backend.check()?;
    let plans = plan(options, backend)?;
    let recorded = matches!(options.source, VideoSource::Files { .. });
    let silence = (!recorded).then_some(options.silence);
    let desk = Arc::new(Desk::new(plans.len(), options.queue, options.interval_s(), silence));
    let [width, height] = options.size;
    let mut camera = VideoCamera {
        desk: Arc::clone(&desk),
        identity: DepthCameraIdentity {
            backend: backend.name.to_owned(),
            source: options.source.to_string(),
            description: String::new(),
        },
        format: DepthCameraFormat {
            width,
            height,
            rate_hz: options.rate_hz,
            metres_per_unit: options.metres_per_unit,
        },
        recorded,
    };
    let (told, telling) = mpsc::channel();
    let mut waiting = 0;
    for (number, (kind, plan)) in plans.into_iter().enumerate() {
        let interval = std::time::Duration::from_secs_f64(options.interval_s());
        let stream = Stream { desk: Arc::clone(&desk), number, kind, size: options.size, interval };
        let told = told.clone();
        let spawned =
            thread::Builder::new().name(format!("video-{number}")).spawn(move || plan.run(&stream, &told));
        spawned.map_err(|source| DeviceError::Lost { device: camera.identity.source.clone(), source })?;
        waiting += 1;
    }
    // Whoever holds the last of these has died without a word.
    drop(told);
    let opening = HostTime::now();
    let silent = || DeviceError::Silent {
        device: format!("depth camera at {}", options.source),
        waited: HostTime::now().since(opening),
        during: "being opened and asked for a first picture",
    };
    for _ in 0..waiting {
        let remaining = (opening + options.patience).remaining();
        let description = telling.recv_timeout(remaining).map_err(|_| silent())??;
        let all = &mut camera.identity.description;
        all.push_str(if all.is_empty() { "" } else { "; " });
        all.push_str(&description);
    }
    Ok(Box::new(camera))
}

/// What a stream's thread does.
enum Plan {
    Live { backend: Backend, name: Name, properties: Vec<[i32; 2]> },
    Play { recording: Box<Recording>, pace: Pace },
}

/// What OpenCV is asked to open.
enum Name {
    Text(String),
    Index(u32),
}

/// One for each stream: grey pictures first.
fn plan(options: &VideoOptions, backend: Backend) -> Result<Vec<(Kind, Plan)>, DriverError> {
    let live = |kind, name, properties| (kind, Plan::Live { backend, name, properties });
    let text = |text: &str| Name::Text(text.to_owned());
    Ok(match &options.source {
        VideoSource::V4l2 { grey, depth } => {
            let path = |stream: &V4l2Stream| Name::Text(stream.device.to_string_lossy().into_owned());
            let mut raw = properties(options, depth);
            raw.push([CAP_PROP_CONVERT_RGB, 0]);
            vec![
                live(Kind::Grey, path(grey), properties(options, grey)),
                live(Kind::DepthOrBytes, path(depth), raw),
            ]
        }
        VideoSource::GStreamer { grey, depth } => {
            vec![live(Kind::Grey, text(grey), vec![]), live(Kind::Depth, text(depth), vec![])]
        }
        VideoSource::Stacked { pipeline } => vec![live(Kind::Stacked, text(pipeline), vec![])],
        VideoSource::OpenNi2 { index } => {
            let kind = Kind::Both { grey: CAP_OPENNI_BGR_IMAGE, depth: CAP_OPENNI_DEPTH_MAP };
            vec![live(kind, Name::Index(*index), vec![])]
        }
        VideoSource::Obsensor { index } => {
            let kind = Kind::Both { grey: CAP_OBSENSOR_BGR_IMAGE, depth: CAP_OBSENSOR_DEPTH_MAP };
            vec![live(kind, Name::Index(*index), vec![])]
        }
        VideoSource::Files { grey, depth, pace } => {
            let mut both = [Recording::new(grey, backend)?, Recording::new(depth, backend)?];
            let zero_s = both[0].first_s().min(both[1].first_s());
            both.iter_mut().for_each(|recording| recording.set_zero(zero_s));
            let plans = both.map(|recording| Plan::Play { recording: Box::new(recording), pace: *pace });
            [Kind::Grey, Kind::Depth].into_iter().zip(plans).collect()
        }
    })
}

/// Channels of OpenCV's backend for Orbbec cameras (`videoio.hpp`, from 4.7 on).
const CAP_OBSENSOR_DEPTH_MAP: i32 = 0;
const CAP_OBSENSOR_BGR_IMAGE: i32 = 1;

/// What a device of Video4Linux is asked for: the format first, for it decides which sizes there are.
fn properties(options: &VideoOptions, stream: &V4l2Stream) -> Vec<[i32; 2]> {
    let four_cc = stream.four_cc.map(|letters| {
        let code = letters.iter().rev().fold(0, |code, &letter| (code << 8) | (letter as i32 & 0xff));
        [CAP_PROP_FOURCC, code]
    });
    let [width, height] = options.size.map(|n| n as i32);
    let rate = options.rate_hz.round().max(1.0) as i32;
    let mut all: Vec<[i32; 2]> = four_cc.into_iter().collect();
    all.extend([[CAP_PROP_FRAME_WIDTH, width], [CAP_PROP_FRAME_HEIGHT, height], [CAP_PROP_FPS, rate]]);
    all
}

impl Plan {
    /// Opens the stream, tells how that went, and grabs from it from then on.
    fn run(self, stream: &Stream, told: &Sender<Result<String, DriverError>>) {
        // Whatever was opened is let go of after that was told: it may take as long as a camera is silent.
        let tell = |feed: &mut dyn Feed, device: &str| {
            let checked = first(feed, stream, device);
            let sound = checked.is_ok();
            // An error: nobody waits for it any more.
            told.send(checked.map(|()| feed.description())).is_ok() && sound
        };
        match self {
            Self::Live { backend, name, properties } => {
                let opened = match &name {
                    Name::Text(text) => Opened::Text(text),
                    Name::Index(index) => Opened::Index(*index),
                };
                let device = name.to_string();
                match Capture::open(backend, &opened, &properties) {
                    Ok(capture) => {
                        let mut feed = Live::new(capture, backend.api == CAP_V4L2);
                        if tell(&mut feed, &device) {
                            stream.grab_live(&mut feed);
                        }
                    }
                    Err(said) => {
                        let error = DriverError::VideoOpen { device, backend: backend.name, said };
                        // Nobody waits for it any more.
                        let _ = told.send(Err(error));
                    }
                }
            }
            Self::Play { mut recording, pace } => {
                if tell(&mut *recording, "the first image file") {
                    stream.play(&mut recording, pace);
                }
            }
        }
    }
}

/// A first picture, checked.
fn first(feed: &mut dyn Feed, stream: &Stream, device: &str) -> Result<(), DriverError> {
    let refused = |found, expected| DriverError::VideoPicture { device: device.to_owned(), found, expected };
    match feed.grab() {
        Grab::Picture(_) => match stream.unpack(feed, <_>::default()) {
            Ok(_) => Ok(()),
            Err(malformed) => Err(refused(malformed.found, malformed.expected)),
        },
        Grab::Unreadable(file) => {
            Err(refused(format!("{file}, which OpenCV cannot read"), "an image file".into()))
        }
        Grab::Over => Err(refused("nothing".to_owned(), "a picture".into())),
        Grab::Gone(said) => Err(refused(format!("no picture ({said})"), "a picture".into())),
    }
}

impl std::fmt::Display for Name {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Text(text) => f.write_str(text),
            Self::Index(index) => write!(f, "camera {index}"),
        }
    }
}
