//! A depth camera and a tracker as one source of markers: what is seen now, and the pictures for the session.

use crate::calib::Registration;
use crate::clock::HostTime;
use crate::device::{
    DepthCamera, DepthCameraFormat, DepthCameraIdentity, DepthFrame, DeviceError, DotInPicture, FrameLosses,
    MarkerFrame, MarkerPosition, MarkerSource, with_causes,
};
use crate::track::{Camera, DepthView, GreyView, Settings, ShownDots, State, TrackError, Tracker};

/// Follows the dots of the first frame in which there are enough of them. Positions are for people who watch: offline the dots are followed
/// anew, from a better frame and with what is known later.
pub(super) struct CameraMarkers {
    camera: Box<dyn DepthCamera>,
    eye: Option<(Camera, Registration)>,
    tracker: Option<Tracker>,
    running: bool,
    pictures: Option<DepthFrame>,
    shown: ShownDots,
}

impl CameraMarkers {
    /// Without lens and registration there are pictures, but no positions.
    pub(super) fn new(camera: Box<dyn DepthCamera>, eye: Option<(Camera, Registration)>) -> Self {
        Self { camera, eye, tracker: None, running: false, pictures: None, shown: ShownDots::default() }
    }

    /// The markers of a frame; none where the pictures cannot be followed.
    fn followed(&mut self, frame: &DepthFrame) -> Result<Vec<MarkerPosition>, TrackError> {
        let Some((camera, registration)) = &self.eye else { return Ok(Vec::new()) };
        let grey = GreyView::new(frame.grey.width, frame.grey.height, frame.grey.width, &frame.grey.pixels)?;
        let unit_m = self.camera.format().metres_per_unit;
        let depth = DepthView::new(
            frame.depth.width,
            frame.depth.height,
            frame.depth.width,
            &frame.depth.values,
            unit_m,
        )?;
        let tracker = match &mut self.tracker {
            Some(tracker) => tracker,
            none => {
                let reference = Tracker::reference_dots(&grey, &Settings::default())?;
                self.shown = ShownDots::of_reference(&reference);
                none.insert(Tracker::new(*camera, Settings::default(), &reference)?)
            }
        };
        let seen = tracker.step(&grey, Some(&depth), frame.host.seconds_after(HostTime::from_nanos(0)))?;
        self.shown.take(&seen);
        let place = |state: &State| match state {
            State::Certain { place: Ok(place), .. } => Some(registration.apply(&place.position_m)),
            State::Certain { place: Err(_), .. } | State::Lost(_) => None,
        };
        let certain = (0..)
            .zip(&seen.dots)
            .filter_map(|(marker, state)| Some(MarkerPosition { marker, position_m: place(state)?.into() }));
        Ok(certain.collect())
    }
}

impl MarkerSource for CameraMarkers {
    fn rate_hz(&self) -> f64 {
        self.camera.format().rate_hz
    }

    fn frame(&mut self, until: HostTime) -> Result<Option<MarkerFrame>, DeviceError> {
        if !self.running {
            self.camera.start()?;
            self.running = true;
        }
        let Some(frame) = self.camera.frame(until)? else { return Ok(None) };
        self.shown.lose();
        let markers = match self.followed(&frame) {
            // A picture with too few dots is one without markers: it is recorded all the same.
            Err(TrackError::TooFewDots { .. }) => Vec::new(),
            followed => followed.map_err(|error| DeviceError::Nonsense {
                device: format!("camera {}", self.camera.identity().source),
                said: with_causes(&error),
                expected: "pictures in which dots can be followed",
            })?,
        };
        let seen = MarkerFrame { host: frame.host, number: frame.number, markers };
        self.pictures = Some(frame);
        Ok(Some(seen))
    }

    fn pictures(&mut self) -> Option<DepthFrame> {
        self.pictures.take()
    }

    fn dots(&self) -> &[DotInPicture] {
        self.shown.dots()
    }

    fn recycle(&mut self, pictures: DepthFrame) {
        self.camera.recycle(pictures);
    }

    fn camera(&self) -> Option<(&DepthCameraIdentity, &DepthCameraFormat)> {
        Some((self.camera.identity(), self.camera.format()))
    }

    fn losses(&self) -> Option<FrameLosses> {
        Some(self.camera.losses())
    }
}
