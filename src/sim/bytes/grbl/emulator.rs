//! The emulated controller behind a serial port: a thread of its own that runs it at the pace of the clock.

use super::faults::GrblFaults;
use super::machine::GrblMachine;
use super::setup::GrblSetup;
use crate::clock::HostTime;
use crate::sim::bytes::serial::{Heard, SerialEnd};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

/// How often the machine is advanced, and its position told.
const TICK: Duration = Duration::from_millis(1);

/// A Grbl controller behind a pseudo-terminal. Dropping it ends its thread and pulls its plug.
#[derive(Debug)]
pub struct GrblEmulator {
    port: String,
    faults: GrblFaults,
    ended: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl GrblEmulator {
    /// Switches it on. `follow` is told where the stage's two axes were at a time (m, 0 at the upper limit switches), at least once for
    /// each millisecond, on the emulator's own thread. Times never go back.
    ///
    /// # Errors
    /// What the operating system says to a pseudo-terminal or a thread more.
    pub fn start(
        setup: GrblSetup,
        follow: impl FnMut(HostTime, [f64; 2]) + Send + 'static,
    ) -> io::Result<Self> {
        let cable = SerialEnd::new()?;
        let port = cable.path().to_owned();
        let (faults, ended) = (GrblFaults::default(), Arc::new(AtomicBool::new(false)));
        let (switches, end) = (faults.clone(), ended.clone());
        let thread = thread::Builder::new()
            .name("grbl-emulator".to_owned())
            .spawn(move || run(cable, setup, &switches, &end, follow))?;
        Ok(Self { port, faults, ended, thread: Some(thread) })
    }

    /// Path of its port.
    pub fn port(&self) -> &str {
        &self.port
    }

    /// What can go wrong with it.
    pub fn faults(&self) -> GrblFaults {
        self.faults.clone()
    }
}

impl Drop for GrblEmulator {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            // It has nothing to report but a panic, which has been printed.
            let _ = thread.join();
        }
    }
}

fn run(
    mut cable: SerialEnd,
    setup: GrblSetup,
    faults: &GrblFaults,
    ended: &AtomicBool,
    mut follow: impl FnMut(HostTime, [f64; 2]),
) {
    let mut rng = ChaCha8Rng::seed_from_u64(setup.seed);
    let resets_on_open = setup.resets_on_open;
    let mut machine = GrblMachine::new(setup);
    let (mut buffer, mut open) = ([0; 256], false);
    let mut last = HostTime::now();
    while !ended.load(Ordering::Acquire) {
        let heard = match cable.read(&mut buffer, TICK) {
            Ok(heard) => heard,
            // The cable is broken for good.
            Err(_) => return,
        };
        let now = HostTime::now();
        while last < now {
            let next = now.min(last + TICK);
            machine.advance(next.since(last));
            follow(next, machine.position_m());
            last = next;
        }
        let wrong = faults.take();
        if wrong.unplugged {
            return;
        }
        let opened = heard != Heard::Nobody && !open;
        open = heard != Heard::Nobody;
        if wrong.reset || (opened && resets_on_open) {
            machine.power_up();
        }
        if wrong.hit_limit {
            machine.hit_limit();
        }
        if wrong.break_switches {
            machine.break_switches();
        }
        if let Heard::Bytes(count) = heard
            && !wrong.deaf
        {
            machine.receive(&buffer[..count]);
        }
        let output = machine.take_output();
        if open && !output.is_empty() && cable.write(&faults.pass(&output, &mut rng)).is_err() {
            return;
        }
    }
}
