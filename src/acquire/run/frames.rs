//! Frames of markers, and the pictures that they were seen in, from their source to the recorder.

use super::event::event;
use crate::acquire::glimpse::SeenPicture;
use crate::acquire::latch::{Cause, Latch, StopOnPanic};
use crate::acquire::status::Watched;
use crate::clock::HostTime;
use crate::device::{DepthFrame, DeviceError, MarkerSource};
use crate::session::{CameraFrame, Picture, Recorder};
use serde_json::json;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// How long a frame is waited for at a time.
const FRAME: Duration = Duration::from_millis(100);

/// Fetches frames until it is over.
///
/// # Errors
/// What the source said when it failed. The latch was tripped then.
pub(super) fn fetch(
    source: &mut dyn MarkerSource,
    mut recorder: Recorder,
    latch: &Latch,
    watched: &Watched,
    over: &AtomicBool,
) -> Result<(), DeviceError> {
    let _stop = StopOnPanic(latch);
    let mut ended = Ok(());
    while ended.is_ok() && !over.load(Ordering::Acquire) {
        match source.frame(HostTime::now() + FRAME) {
            Ok(Some(frame)) => {
                recorder.markers(frame);
                if let Some(pictures) = source.pictures() {
                    watched.show_picture(|| SeenPicture {
                        host: pictures.host,
                        number: pictures.number,
                        grey: pictures.grey.clone(),
                        dots: source.dots().to_vec(),
                    });
                    record_pictures(&pictures, &mut recorder);
                    source.recycle(pictures);
                }
                watched.tell(|status| status.frames += 1);
            }
            Ok(None) => {}
            Err(error) => {
                latch.trip(Cause::CameraLost, HostTime::now());
                ended = Err(error);
            }
        }
    }
    if let Some(losses) = source.losses() {
        let detail = json!({
            "received": losses.received, "dropped": losses.dropped, "unpaired": losses.unpaired,
            "stale": losses.stale, "malformed": losses.malformed, "lost": losses.lost,
        });
        recorder.event(event("camera", None, detail));
    }
    ended
}

/// Records a frame of a camera with its pictures. What cannot be a picture leaves its frame without one.
pub fn record_pictures(frame: &DepthFrame, recorder: &mut Recorder) {
    let DepthFrame { host, number, device_s, grey, depth } = frame;
    recorder.frame(CameraFrame { host: *host, number: *number, device_s: *device_s });
    if let Some(picture) = Picture::of_grey(*host, [grey.width, grey.height], &grey.pixels) {
        recorder.grey(picture);
    }
    if let Some(picture) = Picture::of_depth(*host, [depth.width, depth.height], &depth.values) {
        recorder.depth(picture);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::acquire::latch::tests::Counted;
    use crate::device::{DepthPicture, GreyPicture, Losses, MarkerFrame};
    use crate::session::tests::fixtures::start;
    use crate::session::{Outcome, Session, SessionWriter};
    use std::sync::Arc;
    use std::sync::atomic::AtomicU32;

    /// Three frames with pictures, then nothing more.
    struct Unplugged {
        given: u32,
        pictures: Option<DepthFrame>,
        back: u32,
    }

    impl MarkerSource for Unplugged {
        fn rate_hz(&self) -> f64 {
            30.0
        }

        fn frame(&mut self, _: HostTime) -> Result<Option<MarkerFrame>, DeviceError> {
            if self.given == 3 {
                let source = std::io::ErrorKind::BrokenPipe.into();
                return Err(DeviceError::Lost { device: "camera on /dev/video7".to_owned(), source });
            }
            let (host, number) = (HostTime::now(), self.given);
            self.given += 1;
            self.pictures = Some(DepthFrame {
                host,
                number,
                device_s: None,
                grey: GreyPicture { width: 4, height: 2, pixels: vec![number as u8; 8] },
                depth: DepthPicture { width: 4, height: 2, values: vec![4000 + number as u16; 8] },
            });
            Ok(Some(MarkerFrame { host, number, markers: Vec::new() }))
        }

        fn pictures(&mut self) -> Option<DepthFrame> {
            self.pictures.take()
        }

        fn recycle(&mut self, _: DepthFrame) {
            self.back += 1;
        }
    }

    #[test]
    fn a_camera_that_fails_stops_the_stage_says_why_and_leaves_its_pictures() {
        let place = tempfile::tempdir().expect("a folder");
        let folder = place.path().join("session");
        let writer = SessionWriter::create(&folder, start()).expect("a new session");
        let stops = Arc::new(AtomicU32::new(0));
        let latch = Latch::new(Box::new(Counted(stops.clone())));
        let watched = Watched::default();
        watched.ask_picture();
        let mut source = Unplugged { given: 0, pictures: None, back: 0 };
        let ended = fetch(&mut source, writer.recorder(), &latch, &watched, &AtomicBool::new(false));
        let said = ended.expect_err("unplugged").to_string();
        assert!(said.contains("/dev/video7"), "{said}");
        assert_eq!(latch.tripped().map(|t| t.cause), Some(Cause::CameraLost));
        assert_eq!((stops.load(Ordering::SeqCst), source.back), (1, 3));
        // The first, for nobody has asked again.
        assert_eq!(watched.take_picture().map(|seen| (seen.number, seen.grey.pixels)), Some((0, vec![0; 8])));
        assert_eq!(watched.take_picture(), None);
        writer.finish(Outcome::Success, Losses::default(), HostTime::now()).expect("finished");
        let session = Session::open(&folder).expect("a session");
        let depths =
            session.frames().map(|f| f.expect("a frame").depth.and_then(|p| Some(p.depth()?.values[0])));
        assert_eq!(depths.collect::<Vec<_>>(), [4000, 4001, 4002].map(Some));
    }
}
