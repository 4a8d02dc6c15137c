//! What becomes of each request? Every check in one order: version, session, sequence, then the request's own.

use super::motion::Purpose;
use super::session::{Answer, Arrival, Session};
use super::{Controller, Stream};
use crate::frame::{MAJOR, Stamp, Undecodable};
use crate::message::{
    AXES, Activity, Capability, DEFAULT_LEASE_MS, FROM_DEVICE, Fault, Identity, LEASE_BOUNDS_MS, Outcome,
    PERIOD_BOUNDS_MS, Reason, Refusal, Request, Response, SCHEMA_HASH,
};
use crate::profile::Line;

/// A refusal that concerns no axis.
fn refuse(reason: Reason, limit: impl Into<i64>, asked: impl Into<i64>) -> Refusal {
    Refusal { reason, axis: u8::MAX, limit: limit.into(), asked: asked.into() }
}

fn refuse_axis(reason: Reason, axis: usize, limit: impl Into<i64>, asked: impl Into<i64>) -> Refusal {
    Refusal { reason, axis: axis as u8, limit: limit.into(), asked: asked.into() }
}

fn within(reason: Reason, asked: u16, [low, high]: [u16; 2]) -> Result<(), Refusal> {
    match asked {
        _ if asked < low => Err(refuse(reason, low, asked)),
        _ if asked > high => Err(refuse(reason, high, asked)),
        _ => Ok(()),
    }
}

impl Controller {
    /// A whole frame has arrived.
    pub(super) fn handle(
        &mut self,
        major: u8,
        kind: u8,
        stamp: Stamp,
        request: Result<Request, Undecodable>,
    ) {
        if kind & FROM_DEVICE != 0 {
            return;
        }
        let lasting = matches!(request, Ok(Request::Hello { .. } | Request::Query {} | Request::Stop {}));
        if major != MAJOR && !lasting {
            self.answer(kind, stamp, Err(refuse(Reason::MajorMismatch, MAJOR, major)));
            return;
        }
        let ours = major == MAJOR && self.session.nonce != 0 && stamp.session == self.session.nonce;
        if ours {
            // Whatever it asks, and whether or not it is understood: the host is there.
            self.lease_left_us = self.lease_us;
        }
        let request = match request {
            Ok(request) => request,
            Err(Undecodable::UnknownKind { kind: asked }) => {
                self.answer(kind, stamp, Err(refuse(Reason::UnknownKind, 0, asked)));
                return;
            }
            Err(Undecodable::BadPayload { bytes, .. }) => {
                self.answer(kind, stamp, Err(refuse(Reason::BadPayload, 0, bytes as i64)));
                return;
            }
        };
        match request {
            Request::Hello { replaces, boot_count, schema_hash } => {
                if major == MAJOR && !ours {
                    self.hello(stamp, replaces, boot_count, schema_hash == SCHEMA_HASH);
                }
                let identity = self.identity();
                self.outbox.answer(stamp, Response::Identity { identity });
            }
            Request::Query {} | Request::Stop {} | Request::Ping { .. } | Request::Describe { .. } => {
                if ours {
                    // Moves the newest sequence on, so that what was sent before this comes too late.
                    self.session.arrive(stamp.sequence, kind);
                }
                self.always(stamp, request);
            }
            _ if !ours => {
                let refusal = refuse(Reason::NoSession, self.session.nonce, stamp.session);
                self.answer(kind, stamp, Err(refusal));
            }
            _ => self.once(kind, stamp, request),
        }
    }

    fn answer(&mut self, request: u8, stamp: Stamp, answer: Answer) {
        let response = match answer {
            Ok(motion) => Response::Accepted { request, motion },
            Err(refusal) => Response::Refused { request, refusal },
        };
        self.outbox.answer(stamp, response);
    }

    /// Opens a session if the host knows which one it replaces.
    fn hello(&mut self, stamp: Stamp, replaces: u32, boot_count: u32, same_schema: bool) {
        let current = replaces == self.session.nonce && boot_count == self.config.boot_count;
        if stamp.session == 0 || !current {
            return;
        }
        self.end_motion(0.0, Outcome::Stopped);
        self.session = Session::open(stamp.session, stamp.sequence, same_schema);
        self.lease_us = u32::from(DEFAULT_LEASE_MS) * 1000;
        self.stream = None;
        self.outbox.forget_telemetry();
        self.number = 0;
        self.outcome = Outcome::None;
    }

    fn identity(&self) -> Identity {
        let all = Capability::CODES.codes.iter().fold(0, |bits, capability| bits | 1 << capability.code);
        Identity {
            name: self.config.name,
            firmware_hash: self.config.firmware_hash,
            schema_hash: SCHEMA_HASH,
            capabilities: all,
            boot_count: self.config.boot_count,
            reset_cause: self.config.reset_cause,
            session: self.session.nonce,
        }
    }

    /// Requests that may be answered any number of times.
    fn always(&mut self, stamp: Stamp, request: Request) {
        let kind = request.kind();
        match request {
            Request::Query {} => {
                let state = self.state();
                self.outbox.answer(stamp, Response::State { state });
            }
            Request::Ping { host_tick_us } => {
                let (received_us, session) = (self.now_us, self.session.nonce);
                self.outbox.answer(stamp, Response::Pong { host_tick_us, received_us, session });
            }
            Request::Describe { axis } => match self.config.axes.get(usize::from(axis)) {
                Some(limits) => {
                    let response = Response::Axis {
                        axis,
                        limits: *limits,
                        emergency_um_s2: self.config.emergency_um_s2,
                        unhomed_speed_um_s: self.config.unhomed_speed_um_s,
                        unhomed_distance_um: self.config.unhomed_distance_um,
                    };
                    self.outbox.answer(stamp, response);
                }
                None => {
                    let last = AXES as u8 - 1;
                    self.answer(kind, stamp, Err(refuse(Reason::NoSuchAxis, last, axis)));
                }
            },
            _ => {
                self.end_motion(0.0, Outcome::Stopped);
                self.answer(kind, stamp, Ok(self.number));
            }
        }
    }

    /// Requests that must not be carried out twice.
    fn once(&mut self, kind: u8, stamp: Stamp, request: Request) {
        let answer = match self.session.arrive(stamp.sequence, kind) {
            Arrival::Again(answer) => answer,
            Arrival::Stale => Err(refuse(Reason::StaleSequence, self.session.newest, stamp.sequence)),
            Arrival::New => {
                let answer = self.carry_out(request);
                self.session.keep(stamp.sequence, kind, answer);
                answer
            }
        };
        self.answer(kind, stamp, answer);
    }

    fn carry_out(&mut self, request: Request) -> Answer {
        if !self.session.same_schema {
            return Err(refuse(Reason::SchemaMismatch, 0, 0));
        }
        match request {
            Request::Home { motion, axes } => {
                self.may_move(motion)?;
                self.number = motion;
                self.home(axes);
                Ok(motion)
            }
            Request::Move { motion, target_nm, speed_um_s, acceleration_um_s2 } => {
                self.may_move(motion)?;
                let line = self.check_move(target_nm, speed_um_s, acceleration_um_s2)?;
                self.number = motion;
                self.start(line, speed_um_s, acceleration_um_s2, Purpose::Move);
                Ok(motion)
            }
            Request::Jog { motion, axis, velocity_um_s, acceleration_um_s2 } => {
                self.may_move(motion)?;
                let line = self.check_jog(axis, velocity_um_s, acceleration_um_s2)?;
                self.number = motion;
                self.start(Some(line), velocity_um_s.unsigned_abs(), acceleration_um_s2, Purpose::Jog);
                Ok(motion)
            }
            Request::Clear { fault_ordinal } => {
                self.check_rest()?;
                if fault_ordinal != self.fault_ordinal {
                    return Err(refuse(Reason::OtherFault, self.fault_ordinal, fault_ordinal));
                }
                self.fault = Fault::None;
                Ok(0)
            }
            Request::Telemetry { period_ms } => {
                if period_ms != 0 {
                    within(Reason::Period, period_ms, PERIOD_BOUNDS_MS)?;
                }
                let period_us = u32::from(period_ms) * 1000;
                self.stream = (period_us > 0).then_some(Stream { period_us, left_us: period_us });
                self.outbox.forget_telemetry();
                Ok(0)
            }
            Request::Lease { lease_ms } => {
                within(Reason::Lease, lease_ms, LEASE_BOUNDS_MS)?;
                self.lease_us = u32::from(lease_ms) * 1000;
                self.lease_left_us = self.lease_us;
                Ok(0)
            }
            // The others never come here: `handle` answers them any number of times.
            Request::Hello { .. }
            | Request::Query {}
            | Request::Stop {}
            | Request::Ping { .. }
            | Request::Describe { .. } => Ok(0),
        }
    }

    fn check_rest(&self) -> Result<(), Refusal> {
        match self.state().activity {
            Activity::Idle => Ok(()),
            _ => Err(refuse(Reason::Busy, self.number, 0)),
        }
    }

    /// What every motion needs: a number of its own, rest, and no fault.
    fn may_move(&mut self, motion: u32) -> Result<(), Refusal> {
        self.session.name_motion(motion).map_err(|seen| refuse(Reason::StaleMotion, seen, motion))?;
        self.check_rest()?;
        match self.fault {
            Fault::None => Ok(()),
            _ => Err(refuse(Reason::Faulted, self.fault_ordinal, 0)),
        }
    }

    /// The line to a target; `None` if the stage is there.
    fn check_move(&self, target_nm: [i32; AXES], um_s: u32, um_s2: u32) -> Result<Option<Line>, Refusal> {
        let mut to = self.counters;
        for axis in 0..AXES {
            let limits = &self.config.axes[axis];
            let target = i64::from(target_nm[axis]);
            if !self.homed.contains(axis) {
                return Err(refuse_axis(Reason::NotHomed, axis, 0, target));
            }
            let [low, high] = limits.travel_nm();
            if target < low || target > high {
                let limit = if target < low { low } else { high };
                return Err(refuse_axis(Reason::Travel, axis, limit, target));
            }
            to[axis] = self.zero[axis].saturating_add(limits.steps_at(target));
        }
        let line = Line::between(&self.config.axes, self.counters, to);
        for axis in 0..AXES {
            let limits = &self.config.axes[axis];
            self.check_part(line, axis, um_s, limits.max_speed_um_s, Reason::Speed)?;
            self.check_part(line, axis, um_s2, limits.max_acceleration_um_s2, Reason::Acceleration)?;
        }
        self.check_switches(line)?;
        Ok(line)
    }

    /// The line to the end of what a jog may do.
    fn check_jog(&self, axis: u8, um_s: i32, um_s2: u32) -> Result<Line, Refusal> {
        let index = usize::from(axis);
        let Some(limits) = self.config.axes.get(index) else {
            return Err(refuse(Reason::NoSuchAxis, AXES as u8 - 1, axis));
        };
        let distance = i64::from(self.config.unhomed_distance_um) * 1000;
        let (fastest, around, bounds) = if self.homed.contains(index) {
            (limits.max_speed_um_s, self.zero[index], limits.travel_nm())
        } else {
            (self.config.unhomed_speed_um_s, self.lost_at[index], [-distance, distance])
        };
        let bound = bounds[usize::from(um_s > 0)];
        let mut to = self.counters;
        to[index] = around.saturating_add(limits.steps_at(bound));
        let ahead = i64::from(to[index]) - i64::from(self.counters[index]);
        if um_s != 0 && ahead.signum() != i64::from(um_s.signum()) {
            return Err(refuse_axis(Reason::Travel, index, bound, bound));
        }
        let line = Line::between(&self.config.axes, self.counters, to);
        self.check_part(line, index, um_s.unsigned_abs(), fastest, Reason::Speed)?;
        self.check_part(line, index, um_s2, limits.max_acceleration_um_s2, Reason::Acceleration)?;
        self.check_switches(line)?;
        line.ok_or_else(|| refuse_axis(Reason::Travel, index, bound, bound))
    }

    /// Whether the axis's part of a speed or acceleration along the path is within its limit; both in µm.
    fn check_part(
        &self,
        line: Option<Line>,
        axis: usize,
        along: u32,
        limit: u32,
        reason: Reason,
    ) -> Result<(), Refusal> {
        let part = line.map_or(0.0, |line| line.part(axis, along.into()));
        let part = if part < 0.0 { -part } else { part };
        match along {
            0 => Err(refuse_axis(reason, axis, 1, 0)),
            // Told in whole units, rounded up: what is refused never reads like its limit.
            _ if part > f64::from(limit) => {
                let whole = part as i64;
                Err(refuse_axis(reason, axis, limit, whole + i64::from(part > whole as f64)))
            }
            _ => Ok(()),
        }
    }

    fn check_switches(&self, line: Option<Line>) -> Result<(), Refusal> {
        let Some(line) = line else { return Ok(()) };
        for axis in 0..AXES {
            let way = line.part(axis, 1.0);
            let ahead = if way > 0.0 { self.switches.high } else { self.switches.low };
            if way != 0.0 && ahead.contains(axis) {
                return Err(refuse_axis(Reason::SwitchPressed, axis, 0, 0));
            }
        }
        Ok(())
    }
}
