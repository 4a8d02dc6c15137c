//! What pictures are grabbed from, one after the other, each stamped with its times.

use super::capture::Capture;
use crate::clock::HostTime;

/// When a picture was taken, and which one it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stamp {
    /// When it was grabbed.
    pub(super) host: HostTime,
    /// The source's number.
    pub(super) number: u32,
    /// The source's time (s).
    pub(super) device_s: Option<f64>,
    /// Time on a clock that both streams share (s).
    pub(super) time_s: f64,
}

/// What came of waiting for the next picture.
#[derive(Debug)]
pub(super) enum Grab {
    /// It is there.
    Picture(Stamp),
    /// There is something that is no picture: its name.
    Unreadable(String),
    /// There is none any more, as it should be.
    Over,
    /// There is none any more: what OpenCV says.
    Gone(String),
}

/// A source of pictures.
pub(super) trait Feed {
    /// Waits for the next picture.
    fn grab(&mut self) -> Grab;

    /// What to retrieve the grabbed picture from.
    fn capture(&mut self) -> Option<&mut Capture>;

    /// How many pictures are missing by the source's own numbers since this was asked last.
    fn take_lost(&mut self) -> u64 {
        0
    }

    /// What it says of itself.
    fn description(&self) -> String;
}

/// A camera.
pub(super) struct Live {
    capture: Capture,
    /// Whether its own times are the kernel's.
    kernel_times: bool,
    grabbed: u32,
    /// Its last own time (s).
    last_s: f64,
}

/// A kernel's time of a picture lies no further than this before that of its arrival (s); otherwise it is on another clock, or stands still.
const MOST_DELAY_S: f64 = 1.0;

impl Live {
    pub(super) fn new(capture: Capture, kernel_times: bool) -> Self {
        Self { capture, kernel_times, grabbed: 0, last_s: f64::NEG_INFINITY }
    }

    /// When the kernel got the picture (s, the host's clock); none where it does not tell, as older drivers do not.
    fn kernel_s(&mut self, host_s: f64) -> Option<f64> {
        let time_s = self.kernel_times.then(|| self.capture.position_s()).flatten()?;
        let sound = time_s > self.last_s && (0.0..MOST_DELAY_S).contains(&(host_s - time_s));
        self.last_s = self.last_s.max(time_s);
        sound.then_some(time_s)
    }
}

impl Feed for Live {
    fn grab(&mut self) -> Grab {
        let grabbed = self.capture.grab();
        let host = HostTime::now();
        match grabbed {
            Ok(true) => {
                let host_s = 1e-9 * host.nanos() as f64;
                let device_s = self.kernel_s(host_s);
                let number = self.grabbed;
                self.grabbed = number.wrapping_add(1);
                Grab::Picture(Stamp { host, number, device_s, time_s: device_s.unwrap_or(host_s) })
            }
            Ok(false) => Grab::Gone("OpenCV gets no more pictures from it".to_owned()),
            Err(said) => Grab::Gone(said),
        }
    }

    fn capture(&mut self) -> Option<&mut Capture> {
        Some(&mut self.capture)
    }

    fn description(&self) -> String {
        self.capture.description()
    }
}
