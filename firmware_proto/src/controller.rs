//! What does the stage controller do with the bytes, the switches and the time that it is given?
//!
//! [`Controller`] is the reference firmware without its hardware. A board calls it from its main loop, the
//! simulator from its manual clock:
//!
//! 1. `receive` what the serial port brought, with the tick;
//! 2. `advance` to the tick of now, with the limit switches as they are;
//! 3. drive the motors to `step_counters`;
//! 4. `output` into whatever room the serial port has.
//!
//! Motions are closed forms of the time since their beginning, so the result does not depend on how often
//! this is done, except that a limit switch counts from the call that shows it. Between two calls may pass
//! 71 minutes: the tick is a u32 of µs and wraps. A tick up to a second behind the last one (an interrupt's
//! beside the main loop's) lets no time pass.

mod homing;
mod motion;
mod outbox;
mod requests;
mod session;

use crate::config::{Config, ConfigError};
use crate::emergency::EmergencyWatch;
use crate::frame::{Decoder, Dropped, Stamp};
use crate::message::{
    AXES, Activity, AxisSet, DEFAULT_LEASE_MS, Fault, Outcome, Request, Response, State, Switches,
};
use crate::profile::round;
use motion::Motion;
use outbox::{Next, Outbox};
pub use session::ANSWERS_KEPT;
use session::Session;

/// How far a tick may lie behind the last one, µs. Why not half the range: a controller whose clock was set
/// back would hold still for half an hour; so it takes the step for a long one forward, and leases run out.
const BEHIND_US: u32 = 1_000_000;

/// Telemetry under way.
#[derive(Clone, Copy, Debug)]
struct Stream {
    period_us: u32,
    left_us: u32,
}

/// The reference firmware: bytes, ticks and switches in; bytes and step counters out.
#[derive(Debug)]
pub struct Controller {
    config: Config,
    now_us: u32,
    switches: Switches,
    /// Steps sent to the motors; never jumps.
    counters: [i32; AXES],
    /// Counters at position zero.
    zero: [i32; AXES],
    /// Counters where position was lost: jogs before homing stay around them.
    lost_at: [i32; AXES],
    homed: AxisSet,
    motion: Option<Motion>,
    /// Number of the newest accepted motion.
    number: u32,
    outcome: Outcome,
    fault: Fault,
    fault_ordinal: u32,
    /// The emergency pattern arrived during a motion that has not yet come to rest.
    emergency_at_rest: bool,
    lease_us: u32,
    lease_left_us: u32,
    stream: Option<Stream>,
    session: Session,
    watch: EmergencyWatch,
    decoder: Decoder,
    outbox: Outbox,
}

impl Controller {
    /// A controller that has just booted, with no axis homed and no session.
    ///
    /// # Errors
    /// When the configuration holds a value that cannot be driven.
    pub fn new(config: Config, now_us: u32) -> Result<Self, ConfigError> {
        config.check()?;
        Ok(Self {
            config,
            now_us,
            switches: Switches::default(),
            counters: [0; AXES],
            zero: [0; AXES],
            lost_at: [0; AXES],
            homed: AxisSet::NONE,
            motion: None,
            number: 0,
            outcome: Outcome::None,
            fault: Fault::None,
            fault_ordinal: 0,
            emergency_at_rest: false,
            lease_us: u32::from(DEFAULT_LEASE_MS) * 1000,
            lease_left_us: 0,
            stream: None,
            session: Session::NONE,
            watch: EmergencyWatch::new(),
            decoder: Decoder::new(),
            outbox: Outbox::EMPTY,
        })
    }

    /// Takes bytes that arrived by `now_us`.
    pub fn receive(&mut self, bytes: &[u8], now_us: u32) {
        self.pass(now_us);
        for byte in bytes {
            if self.watch.feed(*byte) {
                // The zero before the pattern's last byte has brought the decoder to a frame's beginning.
                self.emergency_stop();
                continue;
            }
            let Some(frame) = self.decoder.feed(*byte) else { continue };
            let (major, kind, stamp) = (frame.major, frame.kind, frame.stamp);
            let request = Request::decode(&frame);
            self.handle(major, kind, stamp, request);
        }
    }

    /// Lets time pass until `now_us`, when the limit switches were found as given.
    pub fn advance(&mut self, now_us: u32, switches: Switches) {
        self.pass(now_us);
        self.switches = switches;
        self.heed_switches();
    }

    /// Fills the buffer with bytes to send, as many as there are; any size will do. Gives their number.
    pub fn output(&mut self, into: &mut [u8]) -> usize {
        let mut filled = 0;
        while !self.outbox.drain(into, &mut filled) {
            let Some(next) = self.outbox.next() else { break };
            let own = Stamp { sequence: 0, session: self.session.nonce, tick_us: self.now_us };
            let state = self.state();
            let frame = match next {
                Next::Answer(stamp, response) => response.encode(Stamp { tick_us: self.now_us, ..stamp }),
                Next::Emergency(counter) => Response::EmergencyStop { counter, state }.encode(own),
                Next::Fault(counter) => Response::FaultEvent { counter, state }.encode(own),
                Next::Telemetry(counter) => Response::Telemetry { counter, state }.encode(own),
            };
            self.outbox.begin(frame);
        }
        filled
    }

    /// Steps sent to the motors since boot, axis 0 first. Setting zero does not make them jump: they are what
    /// a motor follows. Positions (in [`State`]) count from zero.
    #[must_use]
    pub fn step_counters(&self) -> [i32; AXES] {
        self.counters
    }

    /// Where the stage is and how it fares, at the tick of the last call.
    #[must_use]
    pub fn state(&self) -> State {
        let steps = self.steps();
        let velocity = self.motion.as_ref().map_or([0.0; AXES], Motion::velocity);
        State {
            steps,
            position_nm: [0, 1].map(|axis| self.config.axes[axis].nm(steps[axis])),
            velocity_nm_s: velocity.map(|nm_s| round(nm_s).clamp(i32::MIN.into(), i32::MAX.into()) as i32),
            activity: self.motion.as_ref().map_or(Activity::Idle, Motion::activity),
            homed: self.homed,
            switches: self.switches,
            fault: self.fault,
            fault_ordinal: self.fault_ordinal,
            motion: self.number,
            outcome: self.outcome,
        }
    }

    /// Frames that the decoder dropped, by cause. The emergency pattern is not a frame and counts as three
    /// that were cut short, besides the one that it may have broken.
    #[must_use]
    pub const fn dropped(&self) -> Dropped {
        self.decoder.dropped()
    }

    /// Answers dropped because the line did not take them; the host asks again.
    #[must_use]
    pub const fn answers_dropped(&self) -> u32 {
        self.outbox.overflowed
    }

    /// Position in steps.
    fn steps(&self) -> [i32; AXES] {
        [0, 1].map(|axis| self.counters[axis].saturating_sub(self.zero[axis]))
    }

    /// How long a motion goes on without a word from the host (µs).
    pub fn lease_us(&self) -> u32 {
        self.lease_us
    }

    /// Lets time pass; a lease that runs out does so at its own tick, not at the end of the step.
    fn pass(&mut self, now_us: u32) {
        let step = now_us.wrapping_sub(self.now_us);
        if step > u32::MAX - BEHIND_US {
            return;
        }
        let leased = self.motion.as_ref().is_some_and(|motion| !motion.is_ending());
        if !leased || step < self.lease_left_us {
            self.lease_left_us = self.lease_left_us.saturating_sub(step);
            self.run(step);
            return;
        }
        let left = core::mem::take(&mut self.lease_left_us);
        self.run(left);
        if self.motion.as_ref().is_some_and(|motion| !motion.is_ending()) {
            self.latch(Fault::Comms);
            self.end_motion(0.0, Outcome::Faulted);
        }
        self.run(step - left);
    }

    fn run(&mut self, step_us: u32) {
        self.now_us = self.now_us.wrapping_add(step_us);
        if let Some(stream) = &mut self.stream {
            if step_us < stream.left_us {
                stream.left_us -= step_us;
            } else {
                let late = step_us - stream.left_us;
                stream.left_us = stream.period_us - late % stream.period_us;
                self.outbox.telemetry(1 + late / stream.period_us);
            }
        }
        if let Some(motion) = &mut self.motion {
            self.counters = motion.run(step_us);
            if motion.is_over() {
                self.arrive();
            }
        }
    }

    fn emergency_stop(&mut self) {
        self.outbox.emergency = true;
        self.latch(Fault::EmergencyStop);
        self.emergency_at_rest = self.motion.is_some();
        self.end_motion(f64::from(self.config.emergency_um_s2) * 1000.0, Outcome::Faulted);
    }

    /// Latches a fault unless one as grave is latched.
    fn latch(&mut self, fault: Fault) {
        if fault as u8 > self.fault as u8 {
            self.fault = fault;
            self.fault_ordinal = self.fault_ordinal.wrapping_add(1);
            self.outbox.fault = true;
        }
    }
}
