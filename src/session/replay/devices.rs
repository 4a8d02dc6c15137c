//! Stage, force sensor and marker source as they were recorded.

use super::clock::{Line, ReplayClock, Seat, Speed};
use super::source::Source;
use crate::clock::HostTime;
use crate::device::{
    ClockComparison, DepthCameraFormat, DepthCameraIdentity, DepthFrame, DepthPicture, DeviceError,
    ForceFormat, ForceIdentity, ForceRecord, ForceSensor, GreyPicture, Losses, MarkerFrame, MarkerSource,
    Motion, SequenceTracker, Stage, StageIdentity, StageLimits, StageReport, Stopper, Stopping,
};
use crate::session::message::Message;
use crate::session::{CameraDocument, Frames, Session, SessionError, Topic};
use std::iter::Peekable;
use std::sync::Arc;

/// A session to be replayed: gives its devices, which keep in step with each other.
///
/// What they hand out carries the recorded times, untouched. How long a call waits is, as for any device, a matter of the present clock
/// of the host.
#[derive(Debug, Clone)]
pub struct Replay {
    session: Session,
    clock: Arc<ReplayClock>,
    line: Arc<Line>,
}

impl Replay {
    /// The session at that speed. Reads it once, so that damage shows here and not in the middle of a replay.
    ///
    /// # Errors
    /// [`SessionError`]: the speed is not positive, the recording is damaged (recover it first) or can't be read.
    pub fn new(session: &Session, speed: Speed) -> Result<Self, SessionError> {
        let clock = Arc::new(ReplayClock::new(speed)?);
        let line = Line::new(session, &[Topic::Stage, Topic::Force, Topic::Markers])?;
        Ok(Self { session: session.clone(), clock, line: Arc::new(line) })
    }

    /// The stage. In use, for the step of the others, until it is dropped.
    ///
    /// # Errors
    /// [`SessionError::NoDevice`]: the session was recorded without.
    pub fn stage(&self) -> Result<ReplayStage, SessionError> {
        let document = self.session.start().stage.as_ref().ok_or_else(|| self.without("stage"))?;
        let (identity, limits) = (document.identity(), document.limits());
        Ok(ReplayStage { source: self.source(Topic::Stage, Seat::Stage), identity, limits })
    }

    /// The force sensor. In use, for the step of the others, from its start to its stop.
    ///
    /// # Errors
    /// [`SessionError::NoDevice`]: the session was recorded without.
    pub fn force(&self) -> Result<ReplayForce, SessionError> {
        let document = self.session.start().force.as_ref().ok_or_else(|| self.without("force sensor"))?;
        let format = document.format();
        Ok(ReplayForce {
            source: self.source(Topic::Force, Seat::Force),
            identity: document.identity(),
            tracker: SequenceTracker::new(format.ticks_a_record()),
            format,
            is_on: false,
        })
    }

    /// The source of marker positions. In use, for the step of the others, until it is dropped.
    ///
    /// # Errors
    /// [`SessionError::NoDevice`]: the session was recorded without.
    pub fn markers(&self) -> Result<ReplayMarkers, SessionError> {
        let start = self.session.start();
        let document = start.markers.as_ref().ok_or_else(|| self.without("marker source"))?;
        Ok(ReplayMarkers {
            source: self.source(Topic::Markers, Seat::Markers),
            rate_hz: document.rate_hz,
            frames: self.session.frames().peekable(),
            pictures: None,
            camera: start.camera.as_ref().map(CameraDocument::device),
        })
    }

    fn source(&self, topic: Topic, seat: Seat) -> Source {
        let mut source = Source::new(&self.session, topic, seat, &self.clock, &self.line);
        if !matches!(seat, Seat::Force) {
            // What has become of the file since shows when it is read.
            let _ = source.join();
        }
        source
    }

    fn without(&self, device: &'static str) -> SessionError {
        SessionError::NoDevice { folder: self.session.folder().to_owned(), device }
    }
}

/// A stage that reports what was recorded. It accepts every command and follows none.
pub struct ReplayStage {
    source: Source,
    identity: StageIdentity,
    limits: StageLimits,
}

impl ReplayStage {
    /// Whether everything has been handed out.
    pub fn is_over(&self) -> bool {
        self.source.is_over()
    }
}

impl Stage for ReplayStage {
    fn identity(&self) -> &StageIdentity {
        &self.identity
    }

    fn limits(&self) -> &StageLimits {
        &self.limits
    }

    fn stopping(&self) -> Option<Stopping> {
        None
    }

    fn home(&mut self) -> Result<(), DeviceError> {
        Ok(())
    }

    fn move_to(&mut self, _motion: Motion) -> Result<(), DeviceError> {
        Ok(())
    }

    fn stop(&mut self) -> Result<(), DeviceError> {
        Ok(())
    }

    fn clear(&mut self) -> Result<(), DeviceError> {
        Ok(())
    }

    fn report(&mut self, until: HostTime) -> Result<Option<StageReport>, DeviceError> {
        Ok(self.source.take(until)?.and_then(|message| match message {
            Message::Stage(report) => Some(report),
            _ => None,
        }))
    }

    /// What was asked is in the session; nobody asks again.
    fn compare_clocks(&mut self) -> Result<Option<ClockComparison>, DeviceError> {
        Ok(None)
    }

    /// What a code means depends on the controller, which a recording knows by name only.
    fn meaning(&self, code: u8) -> String {
        format!("code {code} of {}", self.identity.controller)
    }

    fn stopper(&self) -> Result<Box<dyn Stopper>, DeviceError> {
        Ok(Box::new(NothingMoves))
    }
}

/// Stops a recording of a stage: there is nothing to stop.
struct NothingMoves;

impl Stopper for NothingMoves {
    fn stop_now(&self) -> std::io::Result<HostTime> {
        Ok(HostTime::now())
    }
}

/// A force sensor that delivers what was recorded, batch by batch. It can neither be biased nor let a threshold go.
pub struct ReplayForce {
    source: Source,
    identity: ForceIdentity,
    format: ForceFormat,
    tracker: SequenceTracker,
    is_on: bool,
}

impl ReplayForce {
    /// Whether everything has been handed out.
    pub fn is_over(&self) -> bool {
        self.source.is_over()
    }
}

impl ForceSensor for ReplayForce {
    fn identity(&self) -> &ForceIdentity {
        &self.identity
    }

    fn format(&self) -> &ForceFormat {
        &self.format
    }

    fn start(&mut self) -> Result<(), DeviceError> {
        self.is_on = true;
        self.source.join()
    }

    fn clock_at_start(&self) -> Option<ClockComparison> {
        None
    }

    fn stop(&mut self) -> Result<(), DeviceError> {
        self.is_on = false;
        self.source.leave();
        Ok(())
    }

    fn bias(&mut self) -> Result<(), DeviceError> {
        Ok(())
    }

    fn clear_latch(&mut self) -> Result<(), DeviceError> {
        Ok(())
    }

    fn receive(&mut self, until: HostTime, records: &mut Vec<ForceRecord>) -> Result<(), DeviceError> {
        if !self.is_on {
            return Ok(());
        }
        if let Some(Message::Force(batch)) = self.source.take(until)? {
            for record in batch.records() {
                self.tracker.observe(record);
            }
            records.extend_from_slice(batch.records());
        }
        Ok(())
    }

    fn losses(&self) -> Losses {
        self.tracker.losses()
    }

    /// What a bit means depends on the product, which a recording knows by name only.
    fn explain(&self, status: u32) -> Vec<&'static str> {
        BITS.into_iter().enumerate().filter(|(bit, _)| status >> bit & 1 == 1).map(|(_, name)| name).collect()
    }
}

const BITS: [&str; 32] = [
    "bit 0", "bit 1", "bit 2", "bit 3", "bit 4", "bit 5", "bit 6", "bit 7", "bit 8", "bit 9", "bit 10",
    "bit 11", "bit 12", "bit 13", "bit 14", "bit 15", "bit 16", "bit 17", "bit 18", "bit 19", "bit 20",
    "bit 21", "bit 22", "bit 23", "bit 24", "bit 25", "bit 26", "bit 27", "bit 28", "bit 29", "bit 30",
    "bit 31",
];

/// Marker positions as they were recorded, with their pictures where there are any.
pub struct ReplayMarkers {
    source: Source,
    rate_hz: f64,
    frames: Peekable<Frames>,
    /// The pictures of the last frame of markers.
    pictures: Option<DepthFrame>,
    camera: Option<(DepthCameraIdentity, DepthCameraFormat)>,
}

impl ReplayMarkers {
    /// Whether everything has been handed out.
    pub fn is_over(&self) -> bool {
        self.source.is_over()
    }

    /// The pictures of the frame that was grabbed then, if both are there; what is older is passed over.
    fn pictures_of(&mut self, host: HostTime) -> Option<DepthFrame> {
        while self.frames.next_if(|f| f.as_ref().is_ok_and(|f| f.frame.host < host)).is_some() {}
        let recorded = self.frames.next_if(|f| f.as_ref().is_ok_and(|f| f.frame.host == host))?.ok()?;
        let (grey, depth) = (recorded.grey?.grey()?, recorded.depth?.depth()?);
        Some(DepthFrame {
            host,
            number: recorded.frame.number,
            device_s: recorded.frame.device_s,
            grey: GreyPicture { width: grey.size_px[0], height: grey.size_px[1], pixels: grey.values },
            depth: DepthPicture { width: depth.size_px[0], height: depth.size_px[1], values: depth.values },
        })
    }
}

impl MarkerSource for ReplayMarkers {
    fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    fn frame(&mut self, until: HostTime) -> Result<Option<MarkerFrame>, DeviceError> {
        let taken = self.source.take(until)?;
        let frame = taken.and_then(|message| match message {
            Message::Markers(frame) => Some(frame),
            _ => None,
        });
        if let Some(frame) = &frame {
            self.pictures = self.pictures_of(frame.host);
        }
        Ok(frame)
    }

    fn pictures(&mut self) -> Option<DepthFrame> {
        self.pictures.take()
    }

    fn camera(&self) -> Option<(&DepthCameraIdentity, &DepthCameraFormat)> {
        self.camera.as_ref().map(|(identity, format)| (identity, format))
    }
}
