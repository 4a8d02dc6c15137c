//! Pictures in, dots with identity and place out: one frame after another.

use super::depth::DepthReader;
use super::identity::Linker;
use super::light::LightOnDot;
use super::point::locate;
use super::{
    Camera, DepthView, Dot, DotInSpace, Finder, Found, GreyView, Lost, NoDepth, Settings, TrackError,
};

/// What is known of a dot in a frame: certain, or not at all.
// Why: nearly all dots are certain, so that a box around what is certain would cost an allocation a dot and save nothing.
#[allow(clippy::large_enum_variant)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum State {
    /// It is this dot.
    Certain {
        /// The dot in the picture.
        dot: Dot,
        /// The dot in space (camera frame), or why it has no depth.
        place: Result<DotInSpace, NoDepth>,
    },
    /// It was not seen, or may be another.
    Lost(Lost),
}

/// All dots at one time.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Time of the frame (s), as given.
    pub time_s: f64,
    /// The dots, in the order of the reference.
    pub dots: Vec<State>,
    /// Detections that are no dot of the reference, or not certainly one.
    pub strangers: Vec<Dot>,
    /// Standard deviation of the picture's noise (grey levels).
    pub noise: f64,
}

impl Frame {
    /// How many dots are certain.
    pub fn certain(&self) -> usize {
        self.dots.iter().filter(|d| matches!(d, State::Certain { .. })).count()
    }
}

/// A frame that comes later than this many times the usual interval follows lost ones.
const LATE: f64 = 1.6;

/// Follows dots through the frames of one camera.
pub struct Tracker {
    camera: Camera,
    settings: Settings,
    finder: Finder,
    reader: DepthReader,
    linker: Linker,
    /// For each dot of the reference.
    lights: Vec<LightOnDot>,
    last_s: Option<f64>,
    interval_s: Option<f64>,
}

impl Tracker {
    /// A tracker for the dots of a reference picture, numbered in the order of `reference`: those that [`Tracker::reference_dots`] gives,
    /// or some of them.
    ///
    /// # Errors
    /// [`TrackError`]: settings or a camera that make no sense, too few dots, too many, or two in one place.
    pub fn new(camera: Camera, settings: Settings, reference: &[Dot]) -> Result<Self, TrackError> {
        settings.check()?;
        camera.check()?;
        let linker = Linker::new(reference, settings.identity, camera.size_px)?;
        Ok(Self {
            camera,
            settings,
            finder: Finder::default(),
            reader: DepthReader::default(),
            linker,
            lights: (0..reference.len()).map(|_| LightOnDot::new()).collect(),
            last_s: None,
            interval_s: None,
        })
    }

    /// The dots of a picture that a tracker can be made for: whole ones, row by row in the order of their centres.
    ///
    /// # Errors
    /// [`TrackError::Setting`].
    pub fn reference_dots(grey: &GreyView<'_>, settings: &Settings) -> Result<Vec<Dot>, TrackError> {
        settings.check()?;
        let found = Finder::default().find(grey, &settings.dots);
        Ok(found.dots.into_iter().filter(Dot::is_whole).collect())
    }

    /// The next frame. Without a depth picture dots have identity but no place in space.
    ///
    /// # Errors
    /// [`TrackError`]: pictures of another size than the camera's, a depth picture of 8 bits, a time not after the last.
    pub fn step(
        &mut self,
        grey: &GreyView<'_>,
        depth: Option<&DepthView<'_>>,
        time_s: f64,
    ) -> Result<Frame, TrackError> {
        self.check(grey, depth)?;
        let skipped = self.skipped(time_s)?;
        let found = self.finder.find(grey, &self.settings.dots);
        let identity = self.linker.step(&found.dots, skipped);
        Ok(self.frame(&found, &identity, depth, time_s))
    }

    fn check(&self, grey: &GreyView<'_>, depth: Option<&DepthView<'_>>) -> Result<(), TrackError> {
        let expected = self.camera.size_px;
        let sizes = [("grey", Some(grey.size())), ("depth", depth.map(DepthView::size))];
        for (picture, size) in sizes {
            if let Some(found) = size.filter(|&s| s != expected) {
                return Err(TrackError::Size { picture, found, expected });
            }
        }
        match depth.map(DepthView::largest) {
            Some(largest @ 1..=255) => Err(TrackError::EightBitDepth { largest }),
            _ => Ok(()),
        }
    }

    /// Frames lost since the last one, judged by the shortest interval so far.
    fn skipped(&mut self, time_s: f64) -> Result<u32, TrackError> {
        let Some(last_s) = self.last_s else {
            if !time_s.is_finite() {
                return Err(TrackError::Time { time_s, last_s: time_s });
            }
            self.last_s = Some(time_s);
            return Ok(0);
        };
        let interval = time_s - last_s;
        if !interval.is_finite() || interval <= 0.0 {
            return Err(TrackError::Time { time_s, last_s });
        }
        self.last_s = Some(time_s);
        let usual = self.interval_s.map_or(interval, |i| i.min(interval));
        self.interval_s = Some(usual);
        let frames = interval / usual;
        Ok(if frames > LATE { (frames.round() - 1.0).min(1e6) as u32 } else { 0 })
    }

    fn frame(
        &mut self,
        found: &Found,
        identity: &[Result<usize, Lost>],
        depth: Option<&DepthView<'_>>,
        time_s: f64,
    ) -> Frame {
        let dots: Vec<State> = identity
            .iter()
            .enumerate()
            .map(|(i, known)| match known {
                Err(lost) => {
                    self.lights[i].interrupt();
                    State::Lost(*lost)
                }
                Ok(j) => {
                    let dot = self.lights[i].corrected(found.dots[*j]);
                    State::Certain { dot, place: self.place(&dot, &found.dots, depth) }
                }
            })
            .collect();
        let mut claimed = vec![false; found.dots.len()];
        identity.iter().flatten().for_each(|j| claimed[*j] = true);
        let strangers = found.dots.iter().zip(claimed).filter(|(_, claimed)| !claimed).map(|(dot, _)| *dot);
        Frame { time_s, dots, strangers: strangers.collect(), noise: found.noise }
    }

    fn place(
        &mut self,
        dot: &Dot,
        others: &[Dot],
        depth: Option<&DepthView<'_>>,
    ) -> Result<DotInSpace, NoDepth> {
        let view = depth.ok_or(NoDepth::NoPicture)?;
        let surface = self.reader.read(view, &self.camera, dot, others, &self.settings.depth)?;
        locate(&self.camera, dot, &surface).ok_or(NoDepth::Impossible)
    }
}
