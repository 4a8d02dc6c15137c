//! Which messages exist, with which codes and fields? This file is the protocol's table: host, simulator and
//! controller compile it, the documentation prints it, and [`SCHEMA_HASH`] is worked out from it.

use crate::frame::{Encoded, Frame, HEADER, MAJOR, MAX_PAYLOAD, Stamp, Undecodable};
use crate::table::{Code, CodeList, Field, Hash, Layout, Record, codes, longest, messages, record};
use crate::wire::{Reader, Wire, Writer};

/// Axes of the stage.
pub const AXES: usize = 2;

/// Set in the kind of every message that the device sends.
///
/// Why: a transmitter wired to its own receiver, or a host that echoes, can never be taken for the other end.
pub const FROM_DEVICE: u8 = 0x80;

/// Lease after HELLO, ms.
pub const DEFAULT_LEASE_MS: u16 = 100;

/// Shortest and longest lease that can be set, ms. The shortest leaves room for two tries at 115 200 baud
/// (8.3 ms for a longest frame); at the longest, a stage at 10 mm/s goes 10 mm before it notices silence.
pub const LEASE_BOUNDS_MS: [u16; 2] = [20, 1000];

/// Shortest and longest telemetry period, ms. The shortest lets a telemetry frame (58 bytes, 5.0 ms) pass at
/// 115 200 baud.
pub const PERIOD_BOUNDS_MS: [u16; 2] = [6, 10_000];

codes! {
    /// Why a request was refused.
    Reason {
        /// The request's session is not the device's; limit: the device's session, 0 after a boot.
        NoSession = 1,
        /// Host and device were compiled from different tables.
        SchemaMismatch = 2,
        /// The frame's major differs; limit: the device's.
        MajorMismatch = 3,
        /// The sequence is behind the newest and its answer is no longer kept; limit: the newest sequence.
        StaleSequence = 4,
        /// The motion's number is not above the newest one seen; limit: that one.
        StaleMotion = 5,
        /// A motion is under way; limit: its number.
        Busy = 6,
        /// A fault is latched; limit: its ordinal.
        Faulted = 7,
        /// The axis is not homed.
        NotHomed = 8,
        /// Outside the travel, or unhomed and outside the jog's bound; nm.
        Travel = 9,
        /// Above the largest speed, or zero with limit 1; µm/s.
        Speed = 10,
        /// Above the largest acceleration, or zero with limit 1; µm/s².
        Acceleration = 11,
        /// The motion heads for a limit switch that is pressed.
        SwitchPressed = 12,
        /// Outside the bounds of leases; ms.
        Lease = 13,
        /// Outside the bounds of telemetry periods; ms.
        Period = 14,
        /// The fault to be cleared is not the latched one; limit: the newest ordinal.
        OtherFault = 15,
        /// The table has no such request; asked: its kind.
        UnknownKind = 16,
        /// The payload is not what the table says; asked: its bytes.
        BadPayload = 17,
        /// No such axis; limit: the last one.
        NoSuchAxis = 18,
    }
}

codes! {
    /// What the stage is doing.
    Activity {
        /// At rest.
        Idle = 0,
        /// On a straight line to a target.
        Moving = 1,
        /// On a jog.
        Jogging = 2,
        /// Looking for low switches.
        Homing = 3,
        /// Decelerating before the end of a motion.
        Stopping = 4,
    }
}

codes! {
    /// How the newest accepted motion went.
    Outcome {
        /// None was accepted in this session.
        None = 0,
        /// It is under way.
        Running = 1,
        /// It reached its end.
        Reached = 2,
        /// A request stopped it.
        Stopped = 3,
        /// A fault ended it.
        Faulted = 4,
    }
}

codes! {
    /// What is latched. A higher code replaces a lower one, never the reverse.
    Fault {
        /// Nothing.
        None = 0,
        /// The lease ran out during a motion: decelerated.
        Comms = 1,
        /// Homing did not find its switch, or could not leave it: position unknown.
        Homing = 2,
        /// A limit switch was hit outside homing: steps ceased at once, position unknown.
        LimitSwitch = 3,
        /// The emergency pattern was received: decelerated at the emergency deceleration.
        EmergencyStop = 4,
    }
}

codes! {
    /// Why the device last booted.
    ResetCause {
        /// Not known.
        Unknown = 0,
        /// Power came.
        PowerOn = 1,
        /// The supply dipped.
        BrownOut = 2,
        /// The watchdog bit.
        Watchdog = 3,
        /// The reset pin.
        Pin = 4,
        /// The firmware asked for it.
        Software = 5,
    }
}

codes! {
    /// Bit of a capability in the identity; a device without it refuses the requests as unknown.
    Capability {
        /// HOME.
        Homing = 0,
        /// JOG.
        Jogging = 1,
        /// TELEMETRY.
        Telemetry = 2,
        /// The emergency pattern is looked for before decoding.
        EmergencyPattern = 3,
        /// Both ends of both axes have limit switches.
        LimitSwitches = 4,
    }
}

/// A set of axes, bit 0 for axis 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AxisSet(u8);

impl AxisSet {
    /// No axis.
    pub const NONE: Self = Self(0);
    /// Both axes.
    pub const ALL: Self = Self(0b11);

    /// The set with these axes.
    #[must_use]
    pub const fn of(axes: [bool; AXES]) -> Self {
        Self(axes[0] as u8 | (axes[1] as u8) << 1)
    }

    /// Whether the axis is in the set.
    #[must_use]
    pub const fn contains(self, axis: usize) -> bool {
        axis < AXES && self.0 >> axis & 1 == 1
    }

    /// The set and this axis.
    #[must_use]
    pub(crate) const fn with(self, axis: usize) -> Self {
        Self(self.0 | 1 << axis)
    }

    /// The set without the other's axes.
    #[must_use]
    pub(crate) const fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// The highest axis of the set.
    #[must_use]
    pub(crate) fn last(self) -> Option<usize> {
        (0..AXES).rfind(|axis| self.contains(*axis))
    }
}

impl Wire for AxisSet {
    const NAME: &'static str = "axis bits";
    const SIZE: usize = 1;
    fn put(&self, to: &mut Writer<'_>) {
        self.0.put(to);
    }
    fn get(from: &mut Reader<'_>) -> Option<Self> {
        u8::get(from).filter(|bits| *bits <= Self::ALL.0).map(Self)
    }
}

/// Which limit switches are pressed. On the wire: bit 0 low of axis 0, bit 1 low of axis 1, bits 2 and 3 high.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Switches {
    /// At the negative ends.
    pub low: AxisSet,
    /// At the positive ends.
    pub high: AxisSet,
}

impl Wire for Switches {
    const NAME: &'static str = "switch bits";
    const SIZE: usize = 1;
    fn put(&self, to: &mut Writer<'_>) {
        (self.low.0 | self.high.0 << AXES).put(to);
    }
    fn get(from: &mut Reader<'_>) -> Option<Self> {
        let bits = u8::get(from).filter(|bits| *bits < 1 << (2 * AXES))?;
        Some(Self { low: AxisSet(bits & AxisSet::ALL.0), high: AxisSet(bits >> AXES) })
    }
}

/// A name of at most 24 bytes of UTF-8, filled up with zeros.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Name([u8; 24]);

impl Name {
    /// The name, cut after the last whole character that fits; at a zero character too.
    #[must_use]
    pub fn new(text: &str) -> Self {
        let mut bytes = [0; 24];
        let mut to = Writer::new(&mut bytes);
        for character in text.chars().take_while(|character| *character != '\0') {
            let before = to.length();
            to.bytes(character.encode_utf8(&mut [0; 4]).as_bytes());
            if to.length() == before {
                break;
            }
        }
        Self(bytes)
    }

    /// The name.
    #[must_use]
    pub fn as_str(&self) -> &str {
        let length = self.0.iter().position(|byte| *byte == 0).unwrap_or(self.0.len());
        core::str::from_utf8(&self.0[..length]).unwrap_or_default()
    }
}

impl core::fmt::Debug for Name {
    fn fmt(&self, to: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        core::fmt::Debug::fmt(self.as_str(), to)
    }
}

impl Wire for Name {
    const NAME: &'static str = "text";
    const SIZE: usize = 24;
    fn put(&self, to: &mut Writer<'_>) {
        to.bytes(&self.0);
    }
    fn get(from: &mut Reader<'_>) -> Option<Self> {
        let name = Self(from.array()?);
        (Self::new(core::str::from_utf8(&name.0).ok()?) == name).then_some(name)
    }
}

record! {
    /// Where the stage is and how it fares.
    State {
        /// Position, counted from zero.
        steps: [i32; 2], "step";
        /// The same, rounded to whole nanometres.
        position_nm: [i32; 2], "nm";
        /// Velocity.
        velocity_nm_s: [i32; 2], "nm/s";
        /// What it is doing.
        activity: Activity, "–";
        /// Axes whose position means something.
        homed: AxisSet, "–";
        /// Limit switches pressed.
        switches: Switches, "–";
        /// What is latched.
        fault: Fault, "–";
        /// Ordinal of the newest fault since boot, latched or cleared; CLEAR repeats it.
        fault_ordinal: u32, "–";
        /// Number of the newest accepted motion, 0 for none in this session.
        motion: u32, "–";
        /// How that motion went.
        outcome: Outcome, "–";
    }
}

record! {
    /// What one axis can do.
    AxisLimits {
        /// Lowest position.
        travel_low_um: i32, "µm";
        /// Highest position.
        travel_high_um: i32, "µm";
        /// Largest speed.
        max_speed_um_s: u32, "µm/s";
        /// Largest acceleration.
        max_acceleration_um_s2: u32, "µm/s²";
        /// Steps (micro-steps) in `per_mm` millimetres.
        steps: u32, "step";
        /// Millimetres in which `steps` steps lie; 1 unless the ratio is no whole number.
        per_mm: u32, "mm";
    }
}

record! {
    /// Why a request was refused, with the limit that it broke.
    Refusal {
        /// Why.
        reason: Reason, "–";
        /// Axis concerned, 255 for none.
        axis: u8, "–";
        /// The limit, in the reason's unit.
        limit: i64, "see Reason";
        /// What was asked, in the same unit.
        asked: i64, "see Reason";
    }
}

record! {
    /// Who the device is.
    Identity {
        /// Name of device and firmware.
        name: Name, "–";
        /// Hash of the firmware's image.
        firmware_hash: u64, "–";
        /// The device's schema hash.
        schema_hash: u64, "–";
        /// Bits as in the list of capabilities.
        capabilities: u32, "–";
        /// Boots counted so far.
        boot_count: u32, "–";
        /// Why the device last booted.
        reset_cause: ResetCause, "–";
        /// The session now open, 0 for none.
        session: u32, "–";
    }
}

messages! {
    /// What the host asks.
    Request {
        /// Who are you? With a session in the header that is not 0: and let this be our session. Never refused.
        Hello = 0x01 {
            /// The session that the new one replaces, as the last identity told.
            replaces: u32, "–";
            /// The boot count that the last identity told.
            boot_count: u32, "–";
            /// The host's schema hash.
            schema_hash: u64, "–";
        }
        /// Where are you? Answered by State. Never refused.
        Query = 0x02 {}
        /// Decelerate along the path at the motion's own acceleration and stay. Never refused.
        Stop = 0x03 {}
        /// What time is it? Answered by Pong. Never refused.
        Ping = 0x04 {
            /// The host's clock, repeated in the answer.
            host_tick_us: u32, "µs";
        }
        /// What can this axis do? Answered by Axis.
        Describe = 0x05 {
            /// 0 or 1.
            axis: u8, "–";
        }
        /// Find the low switches, one axis after the other, and set zero there.
        Home = 0x10 {
            /// Number of the motion, above every earlier one of the session.
            motion: u32, "–";
            /// Axes to home.
            axes: AxisSet, "–";
        }
        /// Go straight to a target.
        Move = 0x11 {
            /// Number of the motion, above every earlier one of the session.
            motion: u32, "–";
            /// Target, rounded to the nearest step.
            target_nm: [i32; 2], "nm";
            /// Speed along the path.
            speed_um_s: u32, "µm/s";
            /// Acceleration and deceleration along the path.
            acceleration_um_s2: u32, "µm/s²";
        }
        /// Run along one axis until stopped, or to the end of what is allowed.
        Jog = 0x12 {
            /// Number of the motion, above every earlier one of the session.
            motion: u32, "–";
            /// 0 or 1.
            axis: u8, "–";
            /// Speed with direction.
            velocity_um_s: i32, "µm/s";
            /// Acceleration and deceleration.
            acceleration_um_s2: u32, "µm/s²";
        }
        /// Forget a latched fault. Starts nothing.
        Clear = 0x13 {
            /// The fault's ordinal as State told it.
            fault_ordinal: u32, "–";
        }
        /// Send State every so often.
        Telemetry = 0x14 {
            /// Period, 0 for off.
            period_ms: u16, "ms";
        }
        /// How long a motion goes on without a word of the host.
        Lease = 0x15 {
            /// Length of the lease.
            lease_ms: u16, "ms";
        }
    }
}

messages! {
    /// What the device answers (0x80 to 0xBF) and streams (from 0xC0).
    Response {
        /// Answer to Hello.
        Identity = 0x81 {
            /// Who the device is.
            identity: Identity, "–";
        }
        /// Answer to Query.
        State = 0x82 {
            /// At the frame's tick.
            state: State, "–";
        }
        /// The request was accepted.
        Accepted = 0x83 {
            /// Kind of the request.
            request: u8, "–";
            /// Number of the motion concerned, 0 for none.
            motion: u32, "–";
        }
        /// Answer to Ping.
        Pong = 0x84 {
            /// The host's clock as received.
            host_tick_us: u32, "µs";
            /// The device's clock when the request had arrived; the frame's tick is when the answer left.
            received_us: u32, "µs";
            /// The session now open, 0 for none: shows a reboot.
            session: u32, "–";
        }
        /// Answer to Describe.
        Axis = 0x85 {
            /// 0 or 1.
            axis: u8, "–";
            /// What it can do.
            limits: AxisLimits, "–";
            /// Deceleration after the emergency pattern, along the path.
            emergency_um_s2: u32, "µm/s²";
            /// Largest speed of a jog before homing.
            unhomed_speed_um_s: u32, "µm/s";
            /// Distance that jogs before homing may lead from where position was lost.
            unhomed_distance_um: u32, "µm";
        }
        /// The request was refused; nothing changed.
        Refused = 0x86 {
            /// Kind of the request.
            request: u8, "–";
            /// Why.
            refusal: Refusal, "–";
        }
        /// Streamed as asked by Telemetry.
        Telemetry = 0xC0 {
            /// Counts every streamed frame, also those lost.
            counter: u32, "–";
            /// At the frame's tick.
            state: State, "–";
        }
        /// Streamed when a fault is latched.
        FaultEvent = 0xC1 {
            /// Counts every streamed frame, also those lost.
            counter: u32, "–";
            /// At the frame's tick.
            state: State, "–";
        }
        /// Streamed when the emergency pattern arrived, and again when the stage has come to rest after it.
        EmergencyStop = 0xC2 {
            /// Counts every streamed frame, also those lost.
            counter: u32, "–";
            /// At the frame's tick; the stopped position once its activity is Idle.
            state: State, "–";
        }
    }
}

/// Every code list.
pub const CODE_LISTS: &[CodeList] =
    &[Reason::CODES, Activity::CODES, Outcome::CODES, Fault::CODES, ResetCause::CODES, Capability::CODES];

/// Every record.
pub const RECORDS: &[Record] = &[State::LAYOUT, AxisLimits::LAYOUT, Refusal::LAYOUT, Identity::LAYOUT];

/// Number of the table: names, codes, types, units and order of everything above and of the header. Two ends
/// with different numbers do not move.
pub const SCHEMA_HASH: u64 = Hash::START
    .byte(MAJOR)
    .fields(HEADER)
    .messages(Request::TABLE)
    .messages(Response::TABLE)
    .records(RECORDS)
    .lists(CODE_LISTS)
    .0;
