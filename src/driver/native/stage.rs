//! A stage with the rig's own firmware: what it is told, and how its states become reports.
//!
//! Before each motion it is asked where it stands, so that speeds are checked along the way that the motion will take. A motion whose
//! answer does not come is called off: nobody knows whether it runs.

use super::connect::{self, Connection, NativeOptions};
use super::link::{Answer, Link, NativeLosses, Trouble};
use super::units;
use super::words::{self, Task};
use crate::clock::HostTime;
use crate::device::{
    ClockComparison, DeviceError, Motion, Stage, StageIdentity, StageLimits, StageReport, Stopper, Stopping,
};
use crate::driver::DriverError;
use firmware_proto::{AxisSet, Fault, Identity, Reason, Request, Response, State};
use std::io;
use std::time::Duration;

/// The host's and the controller's time of one exchange. Both readings of the controller lie between those of the host.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ClockSample {
    /// Before the request was handed to the operating system, its first copy if it had to be sent again.
    pub sent: HostTime,
    /// Controller's time when the request had arrived (µs, wraps at 2³²).
    pub tick_us: u32,
    /// Controller's time when the answer left (µs, wraps at 2³²).
    pub left_us: u32,
    /// When the answer's bytes had arrived.
    pub received: HostTime,
}

/// A two-axis stage run by the rig's own firmware. Positions count from the low limit switches (m).
pub struct NativeStage {
    link: Link,
    identity: StageIdentity,
    limits: StageLimits,
    emergency_m_s2: f64,
    controller: Identity,
    options: NativeOptions,
    /// Stops that a person has cleared.
    cleared: u32,
}

impl NativeStage {
    /// Opens the port, finds out who answers, and opens a session. Moves nothing; a motion that another program left behind ends.
    ///
    /// # Errors
    /// [`DriverError`]: the port cannot be opened, nothing or something else answers, or its firmware was made from another table.
    pub fn connect(options: &NativeOptions) -> Result<Self, DriverError> {
        Ok(Self::new(connect::connect(options)?, options))
    }

    pub(super) fn new(connection: Connection, options: &NativeOptions) -> Self {
        let Connection { link, identity: controller, limits, emergency_m_s2 } = connection;
        let identity = StageIdentity {
            controller: controller.name.as_str().to_owned(),
            firmware: format!("{:016x}", controller.firmware_hash),
            port: options.port.clone(),
        };
        Self { link, identity, limits, emergency_m_s2, controller, options: options.clone(), cleared: 0 }
    }

    /// What the controller said of itself when the session was opened: versions, capabilities, boots, cause of the last one.
    pub fn controller(&self) -> &Identity {
        &self.controller
    }

    /// What the line did so far.
    pub fn losses(&self) -> NativeLosses {
        self.link.losses()
    }

    /// Compares clocks.
    ///
    /// # Errors
    /// [`DeviceError`]: silent, lost, reset.
    pub fn ping(&mut self) -> Result<ClockSample, DeviceError> {
        let host_tick_us = (HostTime::now().nanos() / 1000) as u32;
        let answer = self.ask(Request::Ping { host_tick_us }, words::COMPARE)?;
        let Answer { response, sent, tick_us: left_us, arrived: received } = answer;
        match response {
            Response::Pong { received_us, .. } => {
                Ok(ClockSample { sent, tick_us: received_us, left_us, received })
            }
            other => Err(self.answered(other, words::COMPARE)),
        }
    }

    fn ask(&mut self, request: Request, task: Task) -> Result<Answer, DeviceError> {
        let asked =
            if self.link.host().is_open() { self.link.ask(request) } else { Err(Trouble::SessionLost) };
        asked.map_err(|trouble| self.explain(trouble, task))
    }

    fn state(&mut self, task: Task) -> Result<State, DeviceError> {
        match self.ask(Request::Query {}, task)?.response {
            Response::State { state } => Ok(state),
            other => Err(self.answered(other, task)),
        }
    }

    /// The state, if it lets a motion begin.
    fn ready(&mut self, task: Task) -> Result<State, DeviceError> {
        let state = self.state(task)?;
        let device = self.link.device();
        if state.fault != Fault::None {
            return Err(words::fault(device, state.fault));
        }
        if self.link.stops() != self.cleared {
            return Err(words::fault(device, Fault::EmergencyStop));
        }
        Ok(state)
    }

    /// What became of a request that decides whether something moves. Nobody knows if there was no answer, for whatever reason: then it
    /// shall not move.
    fn accepted(&mut self, answer: Result<Answer, Trouble>, task: Task) -> Result<(), DeviceError> {
        if answer.is_err() {
            self.link.call_off();
        }
        let answer = answer.map_err(|trouble| self.explain(trouble, task))?;
        match answer.response {
            Response::Accepted { .. } => {
                self.link.forget_streamed();
                Ok(())
            }
            Response::Refused { refusal, .. } if refusal.reason == Reason::Faulted => {
                let fault = self.state(task)?.fault;
                Err(words::fault(self.link.device(), fault))
            }
            other => Err(self.answered(other, task)),
        }
    }

    /// What a person should hear of an answer that is not the one hoped for.
    fn answered(&self, response: Response, task: Task) -> DeviceError {
        match response {
            Response::Refused { refusal, .. } => {
                words::refusal(self.link.device(), task, &refusal, &self.limits)
            }
            other => self.link.error(Trouble::Senseless(other), task),
        }
    }

    /// What a person should hear of a trouble. A session that was lost to a reset is opened anew, so that the stage can be homed.
    fn explain(&mut self, trouble: Trouble, task: Task) -> DeviceError {
        match trouble {
            Trouble::SessionLost => self.resume().unwrap_or_else(|trouble| self.link.error(trouble, task)),
            trouble => self.link.error(trouble, task),
        }
    }

    fn resume(&mut self) -> Result<DeviceError, Trouble> {
        let until = HostTime::now() + self.options.patience;
        let found = self.link.greet_anew(until)?;
        if found.session != 0 && !self.link.was_ours(found.session) {
            let kind = io::ErrorKind::ConnectionAborted;
            return Err(io::Error::new(kind, "another program has opened a session with it").into());
        }
        self.controller = connect::open_session(&mut self.link, &self.options, until)?;
        Ok(words::reset(self.link.device(), &self.controller))
    }

    fn next_report(&mut self) -> Option<StageReport> {
        let streamed = self.link.next_streamed()?;
        Some(units::report(&streamed.state, streamed.tick_us, streamed.arrived))
    }

    fn attend(&mut self, until: HostTime) -> Result<(), Trouble> {
        if !self.link.host().is_open() {
            return Err(Trouble::SessionLost);
        }
        self.link.keep_alive()?;
        self.link.attend(if self.link.has_streamed() { Duration::ZERO } else { until.remaining() })
    }
}

impl Stage for NativeStage {
    fn identity(&self) -> &StageIdentity {
        &self.identity
    }

    fn limits(&self) -> &StageLimits {
        &self.limits
    }

    /// Its firmware decelerates within one of its ticks.
    fn stopping(&self) -> Option<Stopping> {
        Some(Stopping { delay: Duration::from_millis(1), deceleration_m_s2: self.emergency_m_s2 })
    }

    fn home(&mut self) -> Result<(), DeviceError> {
        self.ready(words::HOME)?;
        let motion = self.link.host().next_motion();
        let answer = self.link.ask(Request::Home { motion, axes: AxisSet::ALL });
        self.accepted(answer, words::HOME)
    }

    fn move_to(&mut self, motion: Motion) -> Result<(), DeviceError> {
        let state = self.ready(words::MOVE)?;
        if state.homed != AxisSet::ALL {
            return Err(DeviceError::NotHomed { device: self.link.device().to_owned() });
        }
        let number = self.link.host().next_motion();
        let request = units::request(&motion, number, units::position_m(&state), &self.limits)?;
        let answer = self.link.ask(request);
        self.accepted(answer, words::MOVE)
    }

    fn stop(&mut self) -> Result<(), DeviceError> {
        let answer = self.link.stop();
        self.accepted(answer, words::STOP)
    }

    fn clear(&mut self) -> Result<(), DeviceError> {
        // Stops that come while this waits are not among those that were agreed to.
        let stops = self.link.stops();
        self.link.await_stops().map_err(|trouble| self.explain(trouble, words::CLEAR))?;
        let state = self.state(words::CLEAR)?;
        if state.fault != Fault::None {
            let answer = self.link.ask(Request::Clear { fault_ordinal: state.fault_ordinal });
            self.accepted(answer, words::CLEAR)?;
        }
        self.cleared = stops;
        Ok(())
    }

    fn report(&mut self, until: HostTime) -> Result<Option<StageReport>, DeviceError> {
        loop {
            let over = until.remaining().is_zero();
            self.attend(until).map_err(|trouble| self.explain(trouble, words::REPORT))?;
            let report = self.next_report();
            if report.is_some() || over {
                return Ok(report);
            }
        }
    }

    fn compare_clocks(&mut self) -> Result<Option<ClockComparison>, DeviceError> {
        let ClockSample { sent, tick_us, left_us, received } = self.ping()?;
        let ticks = tick_us.wrapping_add(left_us.wrapping_sub(tick_us) / 2);
        Ok(Some(ClockComparison { sent, received, ticks, tick_hz: 1e6 }))
    }

    fn meaning(&self, code: u8) -> String {
        words::meaning(&Fault::CODES, code)
    }

    fn line_counts(&self) -> Vec<(&'static str, u64)> {
        let NativeLosses { resent, streamed_lost, streamed_late, unfetched, damaged, unasked } =
            self.losses();
        vec![
            ("requests_resent", resent),
            ("reports_lost", streamed_lost),
            ("reports_late", streamed_late),
            ("reports_unfetched", unfetched),
            ("frames_damaged", damaged),
            ("frames_unasked", unasked),
        ]
    }

    fn stopper(&self) -> Result<Box<dyn Stopper>, DeviceError> {
        match self.link.stopper() {
            Ok(stopper) => Ok(Box::new(stopper)),
            Err(source) => Err(DeviceError::Lost { device: self.link.device().to_owned(), source }),
        }
    }
}
