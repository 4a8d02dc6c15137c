//! Who is behind the port, and whether it and this program speak from the same table: from a path to an open session.
//!
//! A board that resets when the port is opened (DTR) takes its time to answer; so it is asked again and again within a budget, and as
//! soon as it answers things go on. What answers otherwise is named for what it says. A firmware made from another table is told from
//! this one by its number and refused; asking who it is and stopping it remain possible.

use super::link::{Answer, Link, Trouble};
use super::{units, words};
use crate::clock::HostTime;
use crate::device::StageLimits;
use crate::driver::DriverError;
use crate::driver::port::{self, BytePort};
use firmware_proto::{AxisLimits, Capability, Code, Identity, MAJOR, Reason, Request, Response, SCHEMA_HASH};
use rand::TryRng;
use rand::rngs::SysRng;
use std::time::Duration;

/// How to reach a stage with the rig's own firmware and how to talk to it.
#[derive(Debug, Clone, PartialEq)]
pub struct NativeOptions {
    /// Path of the serial port.
    pub port: String,
    /// Baud; without meaning where USB goes right into the controller.
    pub baud: u32,
    /// How long a motion goes on without a word of this program.
    pub lease: Duration,
    /// Time from one report to the next.
    pub reports: Duration,
    /// After what time a request without an answer is sent again.
    pub resend: Duration,
    /// For how long a request is sent again before the stage counts as silent.
    pub patience: Duration,
    /// How long a board that resets on opening may take to answer.
    pub greeting: Duration,
}

impl NativeOptions {
    /// Usual values for a controller at `port`.
    ///
    /// Lease: the protocol's usual 100 ms, 1 mm at 10 mm/s. Reports every 20 ms are a quarter of what 115 200 baud carry. Sending again
    /// after 12 ms leaves six tries in a lease whose first third has passed, and time for a longest request and answer behind
    /// a report: 9 ms at 115 200 baud.
    pub fn new(port: impl Into<String>) -> Self {
        Self {
            port: port.into(),
            baud: 115_200,
            lease: Duration::from_millis(100),
            reports: Duration::from_millis(20),
            resend: Duration::from_millis(12),
            patience: Duration::from_millis(250),
            greeting: Duration::from_millis(4000),
        }
    }
}

/// What the rig cannot do without.
const NEEDED: [Capability; 3] = [Capability::Homing, Capability::Telemetry, Capability::EmergencyPattern];

/// An open session.
pub(super) struct Connection {
    pub(super) link: Link,
    pub(super) identity: Identity,
    pub(super) limits: StageLimits,
    /// Deceleration after a stop (m/s²).
    pub(super) emergency_m_s2: f64,
}

pub(super) fn connect(options: &NativeOptions) -> Result<Connection, DriverError> {
    connect_through(port::open(&options.port, options.baud)?, options)
}

/// As [`connect`], with a port that is open.
pub(super) fn connect_through(
    port: Box<dyn BytePort>,
    options: &NativeOptions,
) -> Result<Connection, DriverError> {
    let session = SysRng.try_next_u32().map_err(|source| DriverError::NoRandomNumber { source })?;
    let (mut link, identity) = greet(port, options, session.max(1))?;
    check(&mut link, &identity)?;
    let until = HostTime::now() + options.greeting;
    match open(&mut link, options, until) {
        Ok((identity, limits, emergency_m_s2)) => Ok(Connection { link, identity, limits, emergency_m_s2 }),
        Err(trouble) => Err(link.error(trouble, words::OPEN).into()),
    }
}

fn greet(
    port: Box<dyn BytePort>,
    options: &NativeOptions,
    session: u32,
) -> Result<(Link, Identity), DriverError> {
    let mut link = Link::new(port, options, session);
    let until = HostTime::now() + options.greeting;
    let greeted = link.clear_line().and_then(|()| link.greet(until));
    let identity = greeted.map_err(|trouble| link.error(trouble, words::IDENTIFY))?;
    Ok((link, identity))
}

/// Whether both ends were made from one table, and the controller can do what is needed.
fn check(link: &mut Link, identity: &Identity) -> Result<(), DriverError> {
    let device = format!("{} ({})", link.device(), identity.name.as_str());
    if identity.schema_hash != SCHEMA_HASH {
        // Another version refuses this, naming its own number; one of the same version says anything at all, or nothing.
        return match link.ask(Request::Describe { axis: 0 }) {
            Ok(Answer { response: Response::Refused { refusal, .. }, .. })
                if refusal.reason == Reason::MajorMismatch =>
            {
                Err(DriverError::NativeMajor { device, major: refusal.limit, ours: MAJOR })
            }
            Err(trouble @ Trouble::Lost(_)) => Err(link.error(trouble, words::IDENTIFY).into()),
            _ => Err(DriverError::NativeSchema {
                device,
                firmware: identity.firmware_hash,
                schema: identity.schema_hash,
                ours: SCHEMA_HASH,
            }),
        };
    }
    let lacks = |needed: &&Code| identity.capabilities >> needed.code & 1 == 0;
    let needed = NEEDED.map(|capability| Capability::CODES.codes[capability as usize]);
    match needed.iter().find(lacks) {
        Some(missing) => Err(DriverError::NativeCapability { device, missing: missing.name }),
        None => Ok(()),
    }
}

fn open(
    link: &mut Link,
    options: &NativeOptions,
    until: HostTime,
) -> Result<(Identity, StageLimits, f64), Trouble> {
    let identity = open_session(link, options, until)?;
    let axes = [describe(link, 0)?, describe(link, 1)?];
    let [(first, emergency_um_s2), (second, _)] = axes;
    Ok((identity, units::limits(&[first, second]), units::from_um(emergency_um_s2.into())))
}

/// An axis, and the deceleration of the whole stage after a stop (µm/s²).
fn describe(link: &mut Link, axis: u8) -> Result<(AxisLimits, u32), Trouble> {
    match link.set(Request::Describe { axis })? {
        Response::Axis { limits, emergency_um_s2, .. } => Ok((limits, emergency_um_s2)),
        other => Err(Trouble::Senseless(other)),
    }
}

/// Opens the session that was greeted for, with the lease and the reports that are wanted.
pub(super) fn open_session(
    link: &mut Link,
    options: &NativeOptions,
    until: HostTime,
) -> Result<Identity, Trouble> {
    let identity = link.open_session(until)?;
    let ms = |duration: Duration| u16::try_from(duration.as_millis()).unwrap_or(u16::MAX);
    link.set(Request::Lease { lease_ms: ms(options.lease) })?;
    link.set(Request::Telemetry { period_ms: ms(options.reports) })?;
    Ok(identity)
}
