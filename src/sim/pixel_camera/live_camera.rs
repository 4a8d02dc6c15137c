//! Pictures of a bench that goes on, at the pace of the clock: one thread takes them, another hands them over.
//!
//! As on a real camera's way from exposure to cable, a picture arrives some time after it was taken, and the next is taken meanwhile: none
//! leaves before the time that its stamp says ([`Frame::reported_s`]). A real camera keeps that time, and takes pictures at equal intervals
//! of its own clock; so does this one, whenever its threads get to run. Where this computer takes longer to make one it is dropped, so that
//! pictures say nothing of how busy the computer was. Only a camera without lateness hands over each as soon as it is made.

use super::camera::PixelCamera;
use super::sink::FrameSink;
use crate::clock::HostTime;
use crate::sim::LiveBench;
use crate::sim::pixels::{Frame, PixelError};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, SyncSender, TrySendError, channel, sync_channel};
use std::sync::{Arc, OnceLock};
use std::thread::JoinHandle;
use std::time::Duration;

/// How long nobody is waited for before it is looked again.
const LOOK_AGAIN: Duration = Duration::from_millis(10);
/// How long the bench is left alone before it is asked again whether it has come to a time.
const WAIT_FOR_BENCH: Duration = Duration::from_millis(1);
/// Pictures on their way at a time.
const UNDER_WAY: usize = 4;
/// A bench that nobody feels stands still in time; one whose time is further back than this is taken for one.
const STANDS: Duration = Duration::from_millis(100);
/// A picture leaves by no more than this after its time, as a share of the interval between two.
const PUNCTUAL: f64 = 0.15;

/// A camera that runs until it is dropped.
pub struct LiveCamera {
    shared: Arc<Shared>,
    threads: Vec<JoinHandle<()>>,
}

/// What the threads tell, and are told.
#[derive(Default)]
struct Shared {
    stop: AtomicBool,
    /// Whether anybody takes pictures.
    wanted: AtomicBool,
    delivered: AtomicU64,
    dropped: AtomicU64,
    failure: OnceLock<PixelError>,
}

impl LiveCamera {
    /// Starts to take pictures of `bench` and to hand them to `sink`; `truth` is called with each frame that has been delivered.
    ///
    /// Pictures are due at the camera's rate from now on. One that would be made while the last is not done is dropped and counted, never
    /// made up for; numbers of frames count those that are made. Nobody else waits for the camera: it holds the bench only
    /// as long as it takes to see where everything is.
    pub fn start(
        camera: PixelCamera,
        bench: LiveBench,
        sink: impl FrameSink + 'static,
        truth: impl FnMut(&Frame) -> Result<(), PixelError> + Send + 'static,
    ) -> Self {
        let shared = Arc::new(Shared::default());
        let ((taken, to_deliver), (done, back)) = (sync_channel(UNDER_WAY), channel());
        let watched = bench.clone();
        let slack = match camera.setup().shutter.late_s {
            0.0 => Duration::MAX,
            _ => Duration::from_secs_f64(PUNCTUAL / camera.rate_hz()),
        };
        let due = move |frame: &Frame, taken: HostTime| {
            let on_its_way = Duration::from_secs_f64((frame.reported_s - frame.time_s).max(0.0));
            let exposed = bench.host(frame.time_s);
            let due = if taken.since(exposed) > STANDS + on_its_way { taken } else { exposed } + on_its_way;
            std::thread::sleep(due.remaining());
            HostTime::now().since(due) <= slack
        };
        let take = spawn(&shared, move |shared| take(camera, &watched, &taken, &back, shared));
        let deliver = spawn(&shared, move |shared| deliver(due, &to_deliver, &done, sink, truth, shared));
        Self { shared, threads: vec![take, deliver] }
    }

    /// Frames that have been delivered.
    pub fn delivered(&self) -> u64 {
        self.shared.delivered.load(Ordering::Relaxed)
    }

    /// Frames that were due and not made because the last was not done, that could not leave in time, or that did not arrive.
    pub fn dropped(&self) -> u64 {
        self.shared.dropped.load(Ordering::Relaxed)
    }

    /// Why it has given up, if it has.
    pub fn failure(&self) -> Option<&PixelError> {
        self.shared.failure.get()
    }
}

impl Drop for LiveCamera {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            // A thread that panicked has said so.
            let _ = thread.join();
        }
    }
}

/// A thread that ends all when it fails.
fn spawn(
    shared: &Arc<Shared>,
    body: impl FnOnce(&Shared) -> Result<(), PixelError> + Send + 'static,
) -> JoinHandle<()> {
    let shared = Arc::clone(shared);
    std::thread::spawn(move || {
        if let Err(error) = body(&shared) {
            // The first stays.
            let _ = shared.failure.set(error);
            shared.stop.store(true, Ordering::Relaxed);
        }
    })
}

/// Takes pictures while somebody wants them. Those that have arrived come `back` to be used again.
fn take(
    mut camera: PixelCamera,
    bench: &LiveBench,
    taken: &SyncSender<(Frame, HostTime)>,
    back: &Receiver<Frame>,
    shared: &Shared,
) -> Result<(), PixelError> {
    let period = Duration::from_secs_f64(1.0 / camera.rate_hz());
    let mut due = HostTime::now() + period;
    let mut number = 0;
    while !shared.stop.load(Ordering::Relaxed) {
        if !shared.wanted.load(Ordering::Relaxed) {
            std::thread::sleep(LOOK_AGAIN);
            due = HostTime::now();
            continue;
        }
        let late = missed(&mut due, HostTime::now(), period);
        shared.dropped.fetch_add(late, Ordering::Relaxed);
        std::thread::sleep(due.remaining());
        let exposed = due;
        due = due + period;
        // The bench comes to a time a little later than the clock does; one that nobody feels never does.
        while !bench.has_come_to(exposed) && HostTime::now() < due {
            std::thread::sleep(WAIT_FOR_BENCH);
        }
        let glimpse = bench.glimpse(exposed, camera.sees_motion()).ok_or(PixelError::NoSkin)?;
        let frame = camera.frame(&glimpse, number)?;
        number += 1;
        match taken.try_send((frame, exposed)) {
            Ok(()) => {}
            Err(TrySendError::Full((frame, _))) => {
                shared.dropped.fetch_add(1, Ordering::Relaxed);
                camera.take_back(frame);
            }
            // Whoever hands them over has stopped.
            Err(TrySendError::Disconnected(_)) => break,
        }
        back.try_iter().for_each(|frame| camera.take_back(frame));
    }
    Ok(())
}

/// Hands pictures over. `due` waits until it is time for one, and says whether it is not past.
fn deliver(
    due: impl Fn(&Frame, HostTime) -> bool,
    taken: &Receiver<(Frame, HostTime)>,
    done: &Sender<Frame>,
    mut sink: impl FrameSink,
    mut truth: impl FnMut(&Frame) -> Result<(), PixelError>,
    shared: &Shared,
) -> Result<(), PixelError> {
    while !shared.stop.load(Ordering::Relaxed) {
        let wanted = sink.wanted()?;
        shared.wanted.store(wanted, Ordering::Relaxed);
        let (frame, at) = match taken.recv_timeout(LOOK_AGAIN) {
            Ok(taken) => taken,
            Err(RecvTimeoutError::Timeout) => continue,
            Err(RecvTimeoutError::Disconnected) => break,
        };
        if wanted && due(&frame, at) && sink.deliver(&frame, &shared.stop)? {
            shared.delivered.fetch_add(1, Ordering::Relaxed);
            truth(&frame)?;
        } else if !shared.stop.load(Ordering::Relaxed) {
            shared.dropped.fetch_add(1, Ordering::Relaxed);
        }
        // Whoever takes them may have stopped.
        let _ = done.send(frame);
    }
    Ok(())
}

/// How many pictures should have been taken by now; `due` becomes the time of the next. A picture that is late by less than a period is
/// still taken.
fn missed(due: &mut HostTime, now: HostTime, period: Duration) -> u64 {
    let mut missed = 0;
    while *due + period <= now {
        *due = *due + period;
        missed += 1;
    }
    missed
}
