//! How the emulated stage stands behind a serial port: a pseudo-terminal and a thread that gives it its time.

use super::board::Board;
use super::faults::NativeStageFaultSwitch;
use super::setup::NativeStageSetup;
use crate::clock::HostTime;
use crate::device::AXES;
use serialport::{SerialPort, TTYPort};
use std::io::{self, Read, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

/// Wait for bytes while something moves or bytes are under way: 2000 steps a second, less what the system takes.
const BUSY: Duration = Duration::from_micros(450);
/// The same at rest.
const AT_REST: Duration = Duration::from_millis(2);
/// Longest time that passes at once where the lease allows no more. A computer that was busy elsewhere must not look like a controller
/// that was: beyond this the stage's time stands still, and is made up for little by little, so that its clock still is one.
const MOST: Duration = Duration::from_millis(20);
/// What is left of a long lease to a host that was held up together with the stage.
const LEFT: Duration = Duration::from_millis(500);
/// Share of the time that passes by which the stage's time is faster while it makes up for some.
const FASTER: f64 = 0.5;

/// What is true of the stage, whatever its controller believes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct NativeStageTruth {
    /// Where it is (m, from where the low switches trip if those are at zero).
    pub position_m: [f64; AXES],
    /// What each axis has gone, both ways (m).
    pub gone_m: [f64; AXES],
    /// Emergency patterns that the controller saw.
    pub patterns: u64,
    /// When an emergency stop was last latched, and where the stage was then (m).
    pub latched: Option<(HostTime, [f64; AXES])>,
    /// Controller's clock (µs), and the host's at the same time.
    pub clocks: Option<(u32, HostTime)>,
    /// How long the stage's time has stood still in all because the computer was busy, and how much of that it has made up for.
    pub stood_still: Duration,
    /// See [`stood_still`](Self::stood_still).
    pub made_up: Duration,
}

/// A stage behind a pseudo-terminal, running until it is dropped.
#[derive(Debug)]
pub struct NativeStageEmulator {
    port: String,
    faults: NativeStageFaultSwitch,
    truth: Arc<Mutex<NativeStageTruth>>,
    ended: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl NativeStageEmulator {
    /// Gives power to a stage. `position` is told where it truly was at a time (m), more than 1000 times for each second while it moves,
    /// on the emulator's own thread. Times never go back; between two it went straight.
    ///
    /// # Errors
    /// What the operating system says of pseudo-terminals and threads, and a firmware's configuration that cannot be driven.
    pub fn start(
        setup: NativeStageSetup,
        position: impl FnMut(HostTime, [f64; AXES]) + Send + 'static,
    ) -> io::Result<Self> {
        let rate = 1.0 + setup.clock_ppm * 1e-6;
        let board = Board::new(setup).map_err(io::Error::other)?;
        let (board_end, host_end) = TTYPort::pair()?;
        let port = host_end.name().ok_or(io::ErrorKind::NotFound)?;
        let faults = NativeStageFaultSwitch::default();
        let (truth, ended) = (Arc::default(), Arc::default());
        let run = Run {
            board,
            ends: Some([board_end, host_end]),
            faults: faults.clone(),
            truth: Arc::clone(&truth),
            ended: Arc::clone(&ended),
            rate,
        };
        let thread =
            std::thread::Builder::new().name("stage-emulator".to_owned()).spawn(move || run.run(position))?;
        Ok(Self { port, faults, truth, ended, thread: Some(thread) })
    }

    /// Path of the port to open.
    pub fn port(&self) -> &str {
        &self.port
    }

    /// What goes wrong, to be changed while it runs.
    pub fn faults(&self) -> &NativeStageFaultSwitch {
        &self.faults
    }

    /// What is true of the stage now.
    pub fn truth(&self) -> NativeStageTruth {
        *self.truth.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for NativeStageEmulator {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            // A panic of the owner's callback has been reported by its thread.
            let _ = thread.join();
        }
    }
}

struct Run {
    board: Board,
    /// The board's end of the cable until it is taken off, and the host's: a board does not see who has the port open, and hears what
    /// was sent before it was closed.
    ends: Option<[TTYPort; 2]>,
    faults: NativeStageFaultSwitch,
    truth: Arc<Mutex<NativeStageTruth>>,
    ended: Arc<AtomicBool>,
    /// Microseconds of the stage in one of the host.
    rate: f64,
}

impl Run {
    fn run(mut self, mut position: impl FnMut(HostTime, [f64; AXES])) {
        let (mut sent, mut said) = ([0; 1024], Vec::new());
        let mut truth = NativeStageTruth { position_m: self.board.position_m(), ..Default::default() };
        let mut last = HostTime::now();
        position(last, truth.position_m);
        let (mut owed_us, mut emergency) = (0.0, None);
        while !self.ended.load(Ordering::Acquire) {
            let count = self.wait(&mut sent);
            let now = HostTime::now();
            let waited = now.since(last);
            let most = MOST.max(self.board.lease().saturating_sub(LEFT));
            let passed = waited.min(most);
            truth.stood_still += waited - passed;
            let made_up = (truth.stood_still - truth.made_up).min(passed.mul_f64(FASTER)).min(most - passed);
            truth.made_up += made_up;
            let elapsed = passed + made_up;
            owed_us += elapsed.as_secs_f64() * 1e6 * self.rate;
            let elapsed_us = owed_us as u32;
            owed_us -= f64::from(elapsed_us);

            let (faults, events) = (self.faults.now(), self.faults.take_events());
            if events.unplug {
                self.ends = None;
            }
            self.board.step(elapsed_us, &sent[..count], &faults, &events, &mut said, |part_us, at| {
                position(last + waited.mul_f64(f64::from(part_us) / f64::from(elapsed_us)), at);
            });
            let at = self.board.position_m();
            let latched = self.board.emergency();
            if latched != emergency && latched.is_some() {
                truth.latched = Some((now, at));
            }
            emergency = latched;
            last = now;
            (truth.position_m, truth.gone_m, truth.patterns) =
                (at, self.board.gone_m(), self.board.patterns());
            truth.clocks = Some((self.board.tick_us(), now));
            *self.truth.lock().unwrap_or_else(PoisonError::into_inner) = truth;
            // Last, so that who hears of something finds it true.
            self.send(&said);
            said.clear();
        }
    }

    /// Bytes from the host, after waiting for them a while.
    fn wait(&mut self, into: &mut [u8]) -> usize {
        let wait = if self.board.is_busy() { BUSY } else { AT_REST };
        let Some([board, _]) = &mut self.ends else {
            std::thread::sleep(wait);
            return 0;
        };
        // A time-out is no error: nothing came.
        board.set_timeout(wait).and_then(|()| Ok(board.read(into)?)).unwrap_or(0)
    }

    /// Hands bytes to the host. What its side has no room for is lost, as on a line without flow control.
    fn send(&mut self, bytes: &[u8]) {
        if let Some([board, _]) = &mut self.ends
            && !bytes.is_empty()
            && board.set_timeout(Duration::ZERO).is_ok()
        {
            let _ = board.write_all(bytes);
        }
    }
}
