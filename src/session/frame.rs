//! One picture out of a session: that of the frame with a number, or nearest to a time; or why there is none, and what there is instead.

use super::{CameraFrame, GapCause, Picture, RecordedFrame, Session, SessionError, Topic};
use crate::clock::HostTime;
use std::fmt;

/// Which of a frame's pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stream {
    /// Grey levels, 8 bits.
    Grey,
    /// Depths, 16 bits.
    Depth,
}

/// Which frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FrameAsked {
    /// The one with this number.
    Number(u32),
    /// The one nearest to this time since the session began (s).
    At(f64),
}

/// Number and time of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameStamp {
    /// Number that its source gives it.
    pub number: u32,
    /// Time since the session began (s).
    pub time_s: f64,
}

/// A picture with its frame.
#[derive(Debug, Clone, PartialEq)]
pub struct OnePicture {
    /// The frame as it was recorded.
    pub frame: CameraFrame,
    /// Its number and its time since the session began.
    pub stamp: FrameStamp,
    /// Width and height (px).
    pub size_px: [usize; 2],
    /// The picture.
    pub picture: Picture,
}

/// Frames that were looked through.
#[derive(Default)]
struct Looked {
    /// Each with whether it has the picture that is asked for.
    listed: Vec<(FrameStamp, bool)>,
    /// The one that comes nearest to what is asked for.
    best: Option<(FrameStamp, RecordedFrame)>,
}

/// A time so far (shares of the camera's interval) before the first frame or after the last is outside.
const OUTSIDE: f64 = 0.8;

impl Stream {
    /// Bits of a pixel.
    pub fn bits(self) -> u32 {
        match self {
            Self::Grey => 8,
            Self::Depth => 16,
        }
    }

    fn topic(self) -> Topic {
        match self {
            Self::Grey => Topic::Grey,
            Self::Depth => Topic::Depth,
        }
    }

    fn of(self, frame: RecordedFrame) -> Option<Picture> {
        match self {
            Self::Grey => frame.grey,
            Self::Depth => frame.depth,
        }
    }

    /// Width and height of a picture (px); none when it is not what it should be.
    fn size_px(self, picture: &Picture) -> Option<[usize; 2]> {
        match self {
            Self::Grey => Some(picture.grey()?.size_px),
            Self::Depth => Some(picture.depth()?.size_px),
        }
    }

    fn is_in(self, frame: &RecordedFrame) -> bool {
        match self {
            Self::Grey => frame.grey.is_some(),
            Self::Depth => frame.depth.is_some(),
        }
    }
}

impl fmt::Display for Stream {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Grey => "grey",
            Self::Depth => "depth",
        })
    }
}

impl fmt::Display for FrameAsked {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => write!(f, "{number}"),
            Self::At(time_s) => write!(f, "at {time_s:.3} s"),
        }
    }
}

impl fmt::Display for FrameStamp {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "frame {} at {:.3} s", self.number, self.time_s)
    }
}

impl Session {
    /// One picture of a session of one segment (see [`Session::parts`]): each segment has times and numbers of its own. Reads no farther than
    /// it must; what is damaged is passed over.
    ///
    /// # Errors
    /// [`SessionError`]: no frames, no such frame, the frame has no such picture or none that is one, the operating system refuses.
    pub fn picture(&self, asked: FrameAsked, stream: Stream) -> Result<OnePicture, SessionError> {
        let folder = || self.folder().to_owned();
        let Looked { listed, best } = self.nearest(asked, stream)?;
        let (Some((first, _)), Some((last, _))) = (listed.first().copied(), listed.last().copied()) else {
            return Err(SessionError::NoFrames { folder: folder() });
        };
        let Some((stamp, frame)) = best.filter(|(stamp, _)| self.is_meant(asked, *stamp, &listed)) else {
            let is_before = |stamp: &FrameStamp| match asked {
                FrameAsked::Number(number) => stamp.number < number,
                FrameAsked::At(time_s) => stamp.time_s < time_s,
            };
            let stamps = || listed.iter().map(|(stamp, _)| *stamp);
            let (before, after) = (stamps().rfind(&is_before), stamps().find(|stamp| !is_before(stamp)));
            return Err(match before.zip(after) {
                Some((before, after)) => SessionError::FrameLost { folder: folder(), asked, before, after },
                None => SessionError::OutsideFrames { folder: folder(), asked, first, last },
            });
        };
        let camera = frame.frame;
        let Some(picture) = stream.of(frame) else {
            let away = |other: &FrameStamp| (other.time_s - stamp.time_s).abs();
            let having = listed.iter().filter(|(_, has)| *has).map(|(stamp, _)| *stamp);
            let nearest = having.min_by(|a, b| away(a).total_cmp(&away(b)));
            let dropped = self.was_dropped(stream, camera.host);
            return Err(SessionError::NoPicture { folder: folder(), frame: stamp, stream, dropped, nearest });
        };
        match stream.size_px(&picture) {
            Some(size_px) => Ok(OnePicture { frame: camera, stamp, size_px, picture }),
            None => Err(SessionError::BadPicture { folder: folder(), frame: stamp, stream }),
        }
    }

    /// Looks through the frames up to the one that is asked for, or through all if that is not clear before the end.
    fn nearest(&self, asked: FrameAsked, stream: Stream) -> Result<Looked, SessionError> {
        let began = HostTime::from_nanos(self.start().started_host_ns);
        let away = |stamp: FrameStamp| match asked {
            FrameAsked::Number(number) => f64::from(stamp.number.abs_diff(number)),
            FrameAsked::At(time_s) => (stamp.time_s - time_s).abs(),
        };
        let Looked { mut listed, mut best } = Looked::default();
        for frame in self.frames() {
            let frame = match frame {
                Ok(frame) => frame,
                Err(SessionError::Damaged { .. } | SessionError::Payload { .. }) => continue,
                Err(error) => return Err(error),
            };
            let time_s = frame.frame.host.seconds_after(began);
            let stamp = FrameStamp { number: frame.frame.number, time_s };
            listed.push((stamp, stream.is_in(&frame)));
            match &best {
                // Frames come in the order of their times: it only gets farther.
                Some((near, found)) if away(stamp) >= away(*near) => {
                    if stream.is_in(found) && self.is_meant(asked, *near, &listed) {
                        break;
                    }
                }
                _ => best = Some((stamp, frame)),
            }
        }
        Ok(Looked { listed, best })
    }

    /// Whether the frame that comes nearest is the one that is asked for, of those listed.
    fn is_meant(&self, asked: FrameAsked, stamp: FrameStamp, listed: &[(FrameStamp, bool)]) -> bool {
        match asked {
            FrameAsked::Number(number) => stamp.number == number,
            FrameAsked::At(time_s) => {
                let stamps = || listed.iter().map(|(stamp, _)| *stamp);
                let before = stamps().rfind(|stamp| stamp.time_s <= time_s);
                if let Some((before, after)) = before.zip(stamps().find(|stamp| stamp.time_s > time_s)) {
                    // Whatever the camera's rate really was: those that were lost lie evenly between their neighbours.
                    let steps = f64::from(after.number.saturating_sub(before.number).max(1));
                    let place = (time_s - before.time_s) / (after.time_s - before.time_s) * steps;
                    return [0.0, steps].contains(&place.round());
                }
                let start = self.start();
                let camera = start.camera.as_ref().map(|camera| camera.rate_hz);
                let rate_hz = camera.or(start.markers.as_ref().map(|markers| markers.rate_hz));
                // Of a camera that nothing is known of, any frame is as good as the nearest.
                let interval_s = rate_hz.map_or(f64::INFINITY, |rate_hz| 1.0 / rate_hz);
                (stamp.time_s - time_s).abs() <= OUTSIDE * interval_s
            }
        }
    }

    /// Whether the recorder had to leave out a picture then.
    fn was_dropped(&self, stream: Stream, host: HostTime) -> bool {
        self.gaps().flatten().any(|gap| {
            gap.topic == stream.topic()
                && gap.cause == GapCause::QueueFull
                && (gap.first..=gap.last).contains(&host)
        })
    }
}
