//! What the camera sees now, for somebody who asks while a run goes on.

use crate::clock::HostTime;
use crate::device::{DotInPicture, GreyPicture};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

/// A grey picture with its dots.
#[derive(Debug, Clone, PartialEq)]
pub struct SeenPicture {
    /// When its frame was grabbed.
    pub host: HostTime,
    /// The frame's number.
    pub number: u32,
    /// The picture.
    pub grey: GreyPicture,
    /// The dots that are followed, and what else looks like one.
    pub dots: Vec<DotInPicture>,
}

/// One thread asks for the next picture, another puts it down here.
#[derive(Debug, Default)]
pub(super) struct Glimpse {
    asked: AtomicBool,
    picture: Mutex<Option<SeenPicture>>,
}

impl Glimpse {
    pub(super) fn ask(&self) {
        self.asked.store(true, Ordering::Relaxed);
    }

    /// Puts down what `look` sees, if somebody has asked.
    pub(super) fn answer(&self, look: impl FnOnce() -> SeenPicture) {
        if self.asked.swap(false, Ordering::Relaxed) {
            *self.picture.lock().unwrap_or_else(PoisonError::into_inner) = Some(look());
        }
    }

    pub(super) fn take(&self) -> Option<SeenPicture> {
        self.picture.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}
