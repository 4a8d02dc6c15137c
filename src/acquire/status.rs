//! What somebody who watches a run wants to know now.

use super::glimpse::{Glimpse, SeenPicture};
use super::latch::Tripped;
use super::plan::Phase;
use crate::device::Losses;
use std::collections::VecDeque;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// Points of the force trace: ten seconds at 25 a second.
pub const TRACE: usize = 250;

/// What a run is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Doing {
    /// Devices are looked at.
    #[default]
    PreFlight,
    /// The stage looks for its switches.
    Homing,
    /// The force sensor is read with nothing at the tip.
    Zeroing,
    /// Part of a step.
    Leg(Phase),
    /// A person is asked.
    Asking,
    /// The stage has been stopped.
    Stopped,
    /// The tip is taken back out of the phantom.
    Retracting,
    /// Nothing moves any more, and the session is closed.
    Done,
}

impl Doing {
    /// In a word.
    pub fn word(self) -> &'static str {
        match self {
            Self::PreFlight => "pre-flight",
            Self::Homing => "homing",
            Self::Zeroing => "zero of the force sensor",
            Self::Leg(phase) => phase.name(),
            Self::Asking => "waiting for you",
            Self::Stopped => "stopped",
            Self::Retracting => "retracting",
            Self::Done => "done",
        }
    }
}

/// A run at one instant.
#[derive(Debug, Clone, Default)]
pub struct RunStatus {
    /// What it is doing.
    pub doing: Doing,
    /// Poke in progress, from 1; 0 before the first.
    pub poke: usize,
    /// Pokes in all.
    pub pokes: usize,
    /// Displacement of the tip from the site along the poke (m), during one.
    pub depth_m: Option<f64>,
    /// Since the start.
    pub elapsed: Duration,
    /// What the plan says is left.
    pub left: Duration,
    /// Reading less its zero (N, N·m), in the sensor's frame, in the mean of some 10 ms.
    pub wrench: [f64; 6],
    /// Size of the force lately (N), the oldest first, in the same mean.
    pub trace: VecDeque<f64>,
    /// What became of the force records.
    pub losses: Losses,
    /// Frames of marker positions so far.
    pub frames: u64,
    /// Records that did not fit into the recorder's queue.
    pub dropped: u64,
    /// Why it was stopped.
    pub tripped: Option<Tripped>,
    /// What a person is asked, or told.
    pub message: String,
}

impl RunStatus {
    /// Adds a point to the force trace (N).
    pub(super) fn point(&mut self, force_n: f64) {
        self.trace.push_back(force_n);
        while self.trace.len() > TRACE {
            self.trace.pop_front();
        }
    }
}

/// A status that one thread writes and others read.
#[derive(Debug, Default)]
pub struct Watched {
    status: Mutex<RunStatus>,
    glimpse: Glimpse,
}

impl Watched {
    /// As it is now.
    pub fn now(&self) -> RunStatus {
        self.status.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Changes it.
    pub(super) fn tell(&self, change: impl FnOnce(&mut RunStatus)) {
        change(&mut self.status.lock().unwrap_or_else(PoisonError::into_inner));
    }

    /// Asks for the next picture of the camera.
    pub fn ask_picture(&self) {
        self.glimpse.ask();
    }

    /// The picture that was asked for, once it is there.
    pub fn take_picture(&self) -> Option<SeenPicture> {
        self.glimpse.take()
    }

    /// Hands a picture to whoever has asked for it.
    pub(super) fn show_picture(&self, look: impl FnOnce() -> SeenPicture) {
        self.glimpse.answer(look);
    }
}
