//! The tracker on the frames of a session.

use super::clear::{Unclear, leave_out_unclear};
use super::reference::Thinned;
use crate::clock::{Beat, HostTime};
use crate::dataset::DatasetError;
use crate::device::{DotInPicture, Sight};
use crate::geometry::{Mat3, Vec3};
use crate::session::{CameraDocument, Pixels, RecordedFrame, Session, SessionError};
use crate::track::{
    Camera, DepthView, Dot, Frame, GreyView, Lost, NoDepth, Settings, ShownDots, State, Tracker,
};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// How pictures are to be read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Eye {
    /// Pinhole and lens.
    pub camera: Camera,
    /// One unit of depth (m).
    pub metres_per_unit: f64,
    /// What dots look like and how far they move.
    pub settings: Settings,
}

impl Eye {
    /// That of a recorded camera; none where its lens is not known.
    pub fn of(document: &CameraDocument, settings: Settings) -> Option<Self> {
        let lens = document.lens?;
        let camera = Camera {
            size_px: document.size_px,
            focal_px: lens.focal_px,
            principal_px: lens.principal_px,
            radial: lens.radial,
            tangential: lens.tangential,
        };
        Some(Self { camera, metres_per_unit: document.metres_per_unit, settings })
    }
}

/// Where a dot was in one frame, in the camera frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Centre (m).
    pub position_m: Vec3,
    /// Covariance (m²).
    pub covariance_m2: Mat3,
    /// Centre in the grey picture (px).
    pub centre_px: [f64; 2],
    /// Share of the variance around it in the grey picture that a disc does not explain.
    pub unexplained: f64,
}

/// One frame, followed.
#[derive(Debug, Clone, PartialEq)]
pub struct FollowedFrame {
    /// Stretch of the session, from 1.
    pub segment: u32,
    /// When it was grabbed.
    pub host: HostTime,
    /// Its number at the source.
    pub number: u32,
    /// Each dot of the reference where it is certain, in full view, and has a depth.
    pub places: Vec<Option<Place>>,
    /// Those that have none, where the picture shows them or showed them last; and what looks like a dot and is none of the reference, or
    /// not certainly one.
    pub unplaced: Vec<DotInPicture>,
    /// What looks like a dot, and is none of the reference nor may be one.
    pub others: usize,
}

/// What became of frames and dots, counted.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FrameCounts {
    /// Frames with both pictures.
    pub frames: u64,
    /// Frames that the source's numbers miss.
    pub lost_frames: u64,
    /// Beats of the camera for which no frame came, whatever its numbers say; none where it keeps no beat.
    pub missing_on_beat: Option<u64>,
    /// Frames without a grey or a depth picture that can be read.
    pub incomplete: u64,
    /// Dots seen with place, over all frames.
    pub seen: u64,
    /// Dots not seen with place, over all frames, by reason.
    pub unseen: BTreeMap<&'static str, u64>,
}

/// All frames, followed.
#[derive(Debug, Clone, PartialEq)]
pub struct Followed {
    /// The dots at rest; everything else is in their order.
    pub reference: Vec<Dot>,
    /// How many of them, the last ones, the reference picture did not show.
    pub hidden_at_first: usize,
    /// The reference picture.
    pub picture: Pixels<u8>,
    /// The frames in their order.
    pub frames: Vec<FollowedFrame>,
    /// What became of frames and dots.
    pub counts: FrameCounts,
}

/// Follows the dots of the first whole frame in which nothing moves, between the two times of `rest`, and those that other frames of that
/// time show beside them, through all frames of a session, also those before it. `tell` hears of every frame.
///
/// # Errors
/// [`DatasetError`]: the session cannot be read, no frame after the first time has both pictures, the tracker refuses them.
pub fn follow(
    session: &Session,
    eye: &Eye,
    rest: [HostTime; 2],
    tell: &mut (dyn FnMut() + Send),
) -> Result<Followed, DatasetError> {
    let mut picture = None;
    let mut resting = Thinned::default();
    for frame in session.frames() {
        let frame = frame?;
        let host = frame.frame.host;
        if picture.is_some() && host > rest[1] {
            break;
        }
        if host < rest[0] || !resting.takes_next() {
            continue;
        }
        let Some((grey, _)) = decoded(&frame) else { continue };
        let [width, height] = grey.size_px;
        let view = GreyView::new(width, height, width, &grey.values)?;
        resting.put(Tracker::reference_dots(&view, &eye.settings)?);
        picture.get_or_insert(grey);
    }
    let picture = picture.ok_or(DatasetError::NoPictures)?;
    let (reference, hidden_at_first) = resting.reference();
    let mut walk = Walk {
        eye,
        reference: &reference,
        tracker: None,
        shown: ShownDots::default(),
        last: None,
        arrivals_s: Vec::new(),
        counts: FrameCounts::default(),
    };
    let mut followed = Vec::new();
    let mut frames = session.frames();
    let mut ready = next_decoded(&mut frames);
    // Pictures are decoded while the tracker walks through those before: that takes twice as long as to follow dots.
    while !ready.is_empty() {
        let (walked, next) = rayon::join(
            || {
                ready.drain(..).try_for_each(|frame| {
                    walk.step(frame?).map(|step| followed.extend(step)).map(|()| tell())
                })
            },
            || next_decoded(&mut frames),
        );
        walked?;
        ready = next;
    }
    let mut counts = walk.counts;
    counts.missing_on_beat = missing_on_beat(&walk.arrivals_s);
    let unclear = leave_out_unclear(&mut followed);
    if !unclear.is_empty() {
        counts.seen -= unclear.len() as u64;
        counts.unseen.insert("partly covered, or a shadow's edge across it", unclear.len() as u64);
    }
    for Unclear { frame, dot, place } in unclear {
        followed[frame].unplaced.push(DotInPicture {
            number: Some(dot as u32),
            centre_px: place.centre_px,
            radius_px: reference[dot].radius_px(),
            sight: Sight::Uncertain,
        });
    }
    Ok(Followed { reference, hidden_at_first, picture, frames: followed, counts })
}

/// Frames that are decoded together.
const AHEAD: usize = 16;

/// A frame of a session with its pictures.
struct DecodedFrame {
    segment: u32,
    number: u32,
    host: HostTime,
    pictures: Option<(Pixels<u8>, Pixels<u16>)>,
}

/// The next frames; an empty list after the last.
fn next_decoded(
    frames: &mut (impl Iterator<Item = Result<RecordedFrame, SessionError>> + Send),
) -> Vec<Result<DecodedFrame, SessionError>> {
    let read: Vec<_> = frames.take(AHEAD).collect();
    let decode = |frame: RecordedFrame| DecodedFrame {
        segment: frame.segment,
        number: frame.frame.number,
        host: frame.frame.host,
        pictures: decoded(&frame),
    };
    read.into_par_iter().map(|frame| frame.map(decode)).collect()
}

/// Both pictures of a frame; none when one is missing or unreadable.
fn decoded(frame: &RecordedFrame) -> Option<(Pixels<u8>, Pixels<u16>)> {
    Some((frame.grey.as_ref()?.grey()?, frame.depth.as_ref()?.depth()?))
}

struct Walk<'a> {
    eye: &'a Eye,
    reference: &'a [Dot],
    tracker: Option<Tracker>,
    shown: ShownDots,
    /// Stretch and number of the last frame.
    last: Option<(u32, u32)>,
    /// When the frames of each stretch came (s).
    arrivals_s: Vec<Vec<f64>>,
    counts: FrameCounts,
}

/// Beats without a frame in all stretches that keep one; none where no stretch does.
fn missing_on_beat(stretches_s: &[Vec<f64>]) -> Option<u64> {
    let missing = |arrivals_s: &Vec<f64>| Some(Beat::of(arrivals_s)?.missing(arrivals_s));
    stretches_s.iter().filter_map(missing).reduce(|sum, more| sum + more)
}

impl Walk<'_> {
    fn step(&mut self, frame: DecodedFrame) -> Result<Option<FollowedFrame>, DatasetError> {
        let DecodedFrame { segment, number, host, pictures } = frame;
        let before = self.last.replace((segment, number)).filter(|last| last.0 == segment);
        if let Some((_, before)) = before {
            self.counts.lost_frames += u64::from(number.saturating_sub(before).saturating_sub(1));
        } else {
            self.arrivals_s.push(Vec::new());
        }
        let time_s = host.seconds_after(HostTime::from_nanos(0));
        if let Some(stretch) = self.arrivals_s.last_mut() {
            stretch.push(time_s);
        }
        let Some((grey, depth)) = pictures else {
            self.counts.incomplete += 1;
            return Ok(None);
        };
        // A stretch has a camera that was started anew: nothing is known of how far dots moved meanwhile.
        let tracker = match &mut self.tracker {
            Some(tracker) if before.is_some() => tracker,
            other => {
                self.shown = ShownDots::of_reference(self.reference);
                other.insert(Tracker::new(self.eye.camera, self.eye.settings, self.reference)?)
            }
        };
        let [width, height] = grey.size_px;
        let grey = GreyView::new(width, height, width, &grey.values)?;
        let [width, height] = depth.size_px;
        let depth = DepthView::new(width, height, width, &depth.values, self.eye.metres_per_unit)?;
        let found = tracker.step(&grey, Some(&depth), time_s)?;
        self.counts.frames += 1;
        self.shown.take(&found);
        let unplaced = self.shown.dots().iter().filter(|dot| dot.sight != Sight::Certain).copied().collect();
        let places = found.dots.iter().map(|state| self.counts.place(state)).collect();
        let others = others(&found);
        Ok(Some(FollowedFrame { segment, host, number, places, unplaced, others }))
    }
}

/// Detections that are no dot of the reference, less those that may be one: as many as the dots that may be several. Where it is not known
/// how all dots moved, nothing is known of any.
fn others(found: &Frame) -> usize {
    let lost = |why: Lost| found.dots.iter().filter(|d| **d == State::Lost(why)).count();
    if lost(Lost::Ambiguous) > 0 { 0 } else { found.strangers.len().saturating_sub(lost(Lost::Doubtful)) }
}

impl FrameCounts {
    fn place(&mut self, state: &State) -> Option<Place> {
        let why = match state {
            State::Certain { place: Ok(place), dot } => {
                self.seen += 1;
                return Some(Place {
                    position_m: place.position_m,
                    covariance_m2: place.covariance_m2,
                    centre_px: dot.centre_px,
                    unexplained: 1.0 - dot.quality,
                });
            }
            State::Certain { place: Err(why), .. } => match why {
                NoDepth::NoPicture => "no depth picture",
                NoDepth::AtBorder => "at the border of the depth picture",
                NoDepth::Holes { .. } => "holes in the depth around it",
                NoDepth::Jump { .. } => "a step in the depth around it",
                NoDepth::OneSided { .. } => "depth on one side of it only",
                NoDepth::Leaning { .. } => "depths that lean from one surface to another",
                NoDepth::Rough { .. } => "rough depth around it",
                NoDepth::Impossible => "a depth that cannot be",
            },
            State::Lost(why) => match why {
                Lost::NotSeen => "not seen",
                Lost::Doubtful => "something else may be taken for it",
                Lost::Ambiguous => "all dots may have moved in several ways",
                Lost::Alone => "too few dots seen around it",
            },
        };
        *self.unseen.entry(why).or_default() += 1;
        None
    }
}
