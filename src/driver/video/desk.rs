//! Where the threads that grab hand in their pictures, and where whole frames wait until they are fetched.

use super::feed::Stamp;
use super::pairing::{Pairing, WAITING};
use super::pixels::{Malformed, Pictures};
use crate::clock::HostTime;
use crate::device::{DepthFrame, DepthPicture, FrameLosses, GreyPicture};
use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// How a stream ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Ending {
    /// A recording's last picture has been handed in.
    Over,
    /// The camera is lost: what OpenCV says.
    Gone(String),
    /// It sends nothing but pictures that are none.
    Malformed(Malformed),
}

/// Why there is no frame and none to wait for.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Trouble {
    Ended(Ending),
    Silent(Duration),
}

/// Memory for the values of a grey picture and of a depth picture.
pub(super) type Buffers = (Vec<u8>, Vec<u16>);

#[derive(Debug)]
struct State {
    /// How often the stream was started; what was grabbed for an earlier one is not taken any more.
    run: u64,
    /// Since when it runs.
    started: Option<HostTime>,
    /// Nobody wants anything any more.
    over: bool,
    pairing: Pairing<(Stamp, GreyPicture), DepthPicture>,
    ready: VecDeque<DepthFrame>,
    losses: FrameLosses,
    /// When each stream last gave anything.
    alive: Vec<HostTime>,
    endings: Vec<Option<Ending>>,
    levels: Vec<Vec<u8>>,
    distances: Vec<Vec<u16>>,
}

/// One camera's.
#[derive(Debug)]
pub(super) struct Desk {
    state: Mutex<State>,
    changed: Condvar,
    queue: usize,
    interval_s: f64,
    /// How long a stream may be silent; recordings may as long as they like.
    silence: Option<Duration>,
}

impl Desk {
    pub(super) fn new(streams: usize, queue: usize, interval_s: f64, silence: Option<Duration>) -> Self {
        let state = State {
            run: 0,
            started: None,
            over: false,
            pairing: Pairing::new(interval_s),
            ready: VecDeque::with_capacity(queue),
            losses: FrameLosses::default(),
            alive: vec![HostTime::now(); streams],
            endings: vec![None; streams],
            levels: Vec::new(),
            distances: Vec::new(),
        };
        Self { state: Mutex::new(state), changed: Condvar::new(), queue, interval_s, silence }
    }

    /// Whatever panicked elsewhere, each change here is whole.
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn wait<'a>(&self, state: MutexGuard<'a, State>, longest: Duration) -> MutexGuard<'a, State> {
        let waited = self.changed.wait_timeout(state, longest);
        waited.unwrap_or_else(PoisonError::into_inner).0
    }

    // For the threads that grab.

    /// Waits for a start after the `run`th; none when nobody wants anything any more.
    pub(super) fn next_run(&self, run: u64) -> Option<(u64, HostTime)> {
        let mut state = self.state();
        while !state.over {
            if let Some(started) = state.started.filter(|_| state.run > run) {
                return Some((state.run, started));
            }
            state = self.wait(state, Duration::MAX);
        }
        None
    }

    /// Waits until a picture of this stream would find room; false when the run has ended.
    pub(super) fn room(&self, stream: usize, run: u64) -> bool {
        let mut state = self.state();
        while state.runs(run) {
            let alone = state.endings.iter().enumerate().any(|(other, end)| other != stream && end.is_some());
            let paired = state.endings.len() > 1 && !alone && state.pairing.waiting()[stream] >= WAITING;
            if state.ready.len() < self.queue && !paired {
                return true;
            }
            state = self.wait(state, Duration::MAX);
        }
        false
    }

    /// Waits until that time; false when the run has ended.
    pub(super) fn until(&self, time: HostTime, run: u64) -> bool {
        let mut state = self.state();
        while state.runs(run) {
            let remaining = time.remaining();
            if remaining.is_zero() {
                return true;
            }
            state = self.wait(state, remaining);
        }
        false
    }

    /// Takes notice of a picture that was grabbed. What to unpack it into, and for which run; none when nobody wants it.
    pub(super) fn admit(&self, stream: usize, grabbed: HostTime, fresh: bool) -> Option<(u64, Buffers)> {
        let mut state = self.state();
        state.alive[stream] = grabbed;
        if !fresh || state.started.is_none_or(|started| grabbed < started) {
            state.losses.stale += 1;
            return None;
        }
        Some((state.run, state.buffers()))
    }

    /// What to unpack a picture into, while the run goes on.
    pub(super) fn buffers(&self, run: u64) -> Option<Buffers> {
        let mut state = self.state();
        state.runs(run).then(|| state.buffers())
    }

    /// Whether anybody wants anything.
    pub(super) fn is_over(&self) -> bool {
        self.state().over
    }

    /// Hands in what was unpacked.
    pub(super) fn put(&self, run: u64, stamp: Stamp, pictures: Pictures) {
        let mut state = self.state();
        if !state.runs(run) {
            return;
        }
        match pictures {
            Pictures { grey: Some(grey), depth: Some(depth) } => state.whole(self.queue, stamp, grey, depth),
            Pictures { grey: Some(grey), depth: None } => state.pairing.add_grey(stamp.time_s, (stamp, grey)),
            Pictures { grey: None, depth: Some(depth) } => state.pairing.add_depth(stamp.time_s, depth),
            Pictures { grey: None, depth: None } => {}
        }
        while let Some(((stamp, grey), depth)) = state.pairing.next() {
            state.whole(self.queue, stamp, grey, depth);
        }
        drop(state);
        self.changed.notify_all();
    }

    /// Counts a picture that is none.
    pub(super) fn malformed(&self, run: u64) {
        let mut state = self.state();
        state.losses.malformed += u64::from(state.runs(run));
    }

    /// Counts pictures that are missing by their numbers.
    pub(super) fn lost(&self, run: u64, pictures: u64) {
        let mut state = self.state();
        state.losses.lost += if state.runs(run) { pictures } else { 0 };
    }

    /// A stream has ended; a run's end does not concern the next one. None: whatever runs.
    pub(super) fn end(&self, stream: usize, run: Option<u64>, ending: Ending) {
        let mut state = self.state();
        if run.is_none_or(|run| state.runs(run)) {
            state.endings[stream] = Some(ending);
            if state.endings.iter().all(Option::is_some) {
                state.pairing.finish();
            }
        }
        drop(state);
        self.changed.notify_all();
    }

    // For the camera.

    /// Begins a run. `again`: what has ended begins anew.
    ///
    /// # Errors
    /// How a stream has ended that does not begin anew.
    pub(super) fn start(&self, again: bool) -> Result<(), Ending> {
        let mut state = self.state();
        if again {
            state.endings.fill(None);
        } else if let Some(ending) = state.endings.iter().flatten().next() {
            return Err(ending.clone());
        }
        let now = HostTime::now();
        state.clear(self.interval_s);
        state.losses = FrameLosses { stale: state.losses.stale, ..FrameLosses::default() };
        state.run += 1;
        state.started = Some(now);
        state.alive.fill(now);
        drop(state);
        self.changed.notify_all();
        Ok(())
    }

    /// Ends the run.
    pub(super) fn stop(&self) {
        let mut state = self.state();
        state.started = None;
        state.losses.unpaired = state.unpaired();
        state.clear(self.interval_s);
        drop(state);
        self.changed.notify_all();
    }

    /// Nobody wants anything any more.
    pub(super) fn close(&self) {
        self.state().over = true;
        self.changed.notify_all();
    }

    /// The next frame, or none when there was none until `until`.
    pub(super) fn take(&self, until: HostTime) -> Result<Option<DepthFrame>, Trouble> {
        let mut state = self.state();
        loop {
            if let Some(frame) = state.ready.pop_front() {
                drop(state);
                self.changed.notify_all();
                return Ok(Some(frame));
            }
            if let Some(ending) = state.ending() {
                return Err(Trouble::Ended(ending.clone()));
            }
            let mut longest = until.remaining();
            if let Some(silence) = self.silence.filter(|_| state.started.is_some()) {
                let now = HostTime::now();
                let waited = state.alive.iter().map(|&alive| now.since(alive)).max().unwrap_or_default();
                if waited > silence {
                    return Err(Trouble::Silent(waited));
                }
                longest = longest.min(silence - waited + Duration::from_millis(1));
            }
            if until.remaining().is_zero() {
                return Ok(None);
            }
            state = self.wait(state, longest);
        }
    }

    pub(super) fn losses(&self) -> FrameLosses {
        let state = self.state();
        FrameLosses { unpaired: state.unpaired(), ..state.losses }
    }

    /// Takes a frame's memory back.
    pub(super) fn recycle(&self, frame: DepthFrame) {
        let mut state = self.state();
        // More than are under way at a time are not needed.
        if state.levels.len() < self.queue + 2 * WAITING {
            state.levels.push(frame.grey.pixels);
            state.distances.push(frame.depth.values);
        }
    }
}

impl State {
    fn runs(&self, run: u64) -> bool {
        !self.over && self.started.is_some() && self.run == run
    }

    fn buffers(&mut self) -> Buffers {
        (self.levels.pop().unwrap_or_default(), self.distances.pop().unwrap_or_default())
    }

    fn whole(&mut self, queue: usize, stamp: Stamp, grey: GreyPicture, depth: DepthPicture) {
        let Stamp { host, number, device_s, .. } = stamp;
        let frame = DepthFrame { host, number, device_s, grey, depth };
        self.losses.received += 1;
        if self.ready.len() < queue {
            self.ready.push_back(frame);
        } else {
            self.losses.dropped += 1;
        }
    }

    fn unpaired(&self) -> u64 {
        self.losses.unpaired + self.pairing.unpaired()
    }

    fn clear(&mut self, interval_s: f64) {
        self.pairing = Pairing::new(interval_s);
        self.ready.clear();
    }

    /// How the camera has ended: as soon as one stream is lost, or when all are over.
    fn ending(&self) -> Option<&Ending> {
        let lost = self.endings.iter().flatten().find(|ending| **ending != Ending::Over);
        lost.or_else(|| self.endings.iter().all(Option::is_some).then_some(&Ending::Over))
    }
}
