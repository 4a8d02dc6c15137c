//! Pictures of a bench that goes on, at the pace of the clock, in a thread of their own.

use super::camera::PixelCamera;
use super::sink::FrameSink;
use crate::clock::HostTime;
use crate::sim::LiveBench;
use crate::sim::pixels::{Frame, PixelError};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};
use std::thread::JoinHandle;
use std::time::Duration;

/// How long nobody is waited for before it is looked again.
const LOOK_AGAIN: Duration = Duration::from_millis(10);

/// A camera that runs until it is dropped.
pub struct LiveCamera {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

/// What the thread tells, and is told.
#[derive(Default)]
struct Shared {
    stop: AtomicBool,
    delivered: AtomicU64,
    dropped: AtomicU64,
    failure: OnceLock<PixelError>,
}

impl LiveCamera {
    /// Starts to take pictures of `bench` and to hand them to `sink`; `truth` is called with each frame that has been delivered.
    ///
    /// Pictures are due at the camera's rate from now on. One that would be made while the last is still on its way is dropped and counted,
    /// never made up for; numbers of frames count those that are made. Nobody else waits for the camera: it holds the bench only
    /// as long as it takes to see where everything is.
    pub fn start(
        camera: PixelCamera,
        bench: LiveBench,
        sink: impl FrameSink + 'static,
        truth: impl FnMut(&Frame) + Send + 'static,
    ) -> Self {
        let shared = Arc::new(Shared::default());
        let own = Arc::clone(&shared);
        let thread = std::thread::spawn(move || {
            if let Err(error) = run(camera, &bench, sink, truth, &own) {
                // The first stays, and there is no second.
                let _ = own.failure.set(error);
            }
        });
        Self { shared, thread: Some(thread) }
    }

    /// Frames that have been delivered.
    pub fn delivered(&self) -> u64 {
        self.shared.delivered.load(Ordering::Relaxed)
    }

    /// Frames that were due and not made because the last was still on its way, or that did not arrive.
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
        if let Some(thread) = self.thread.take() {
            // A thread that panicked has said so.
            let _ = thread.join();
        }
    }
}

fn run(
    mut camera: PixelCamera,
    bench: &LiveBench,
    mut sink: impl FrameSink,
    mut truth: impl FnMut(&Frame),
    shared: &Shared,
) -> Result<(), PixelError> {
    let period = Duration::from_secs_f64(1.0 / camera.rate_hz());
    let mut due = HostTime::now() + period;
    let mut number = 0;
    while !shared.stop.load(Ordering::Relaxed) {
        if !sink.wanted()? {
            std::thread::sleep(LOOK_AGAIN);
            due = HostTime::now();
            continue;
        }
        let late = missed(&mut due, HostTime::now(), period);
        shared.dropped.fetch_add(late, Ordering::Relaxed);
        std::thread::sleep(due.remaining());
        due = due + period;
        let glimpse = bench.glimpse(camera.sees_motion()).ok_or(PixelError::NoSkin)?;
        let frame = camera.frame(&glimpse, number)?;
        if sink.deliver(&frame, &shared.stop)? {
            shared.delivered.fetch_add(1, Ordering::Relaxed);
            truth(&frame);
            number += 1;
        } else if !shared.stop.load(Ordering::Relaxed) {
            shared.dropped.fetch_add(1, Ordering::Relaxed);
        }
        camera.take_back(frame);
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
