//! What do host and stage controller say to each other, and what does the controller do about it?
//!
//! One table of messages ([`Request`], [`Response`]) that host, simulator and firmware compile, the frames
//! that carry it, and the reference firmware's state machine without its hardware ([`Controller`]). Needs
//! neither the standard library nor an allocator: the same source runs on a microcontroller.
//!
//! ```text
//! driver ── Host ── Request ── Encoded ══ serial port ══ Decoder ── Controller ── step counters ── motors
//!            └───── Response ── Decoder ══ serial port ══ Encoded ─────┘   └── limit switches, tick
//!                       EMERGENCY_STOP ══ serial port ══ EmergencyWatch ────┘
//! ```
//!
//! # What to read
//!
//! The protocol below, then `message` (the table), [`Controller`], [`Host`]. Units are in the names.
//!
//! # Invariants
//!
//! * No input makes anything here panic, wait or allocate.
//! * Nothing moves without an accepted request; no request moves the stage twice; after a reboot, a fault, a
//!   stop or an emergency stop nothing moves again by itself.
//! * Absent on purpose: queued motions, arcs, a ring of planned moves, settings written over the wire.
//! * An emergency stop by software is not a safety function (ISO 13850 and IEC 60204-1 ask for one that needs
//!   none): a switch that cuts the drives belongs beside it.
//!
//! # A whole conversation
//!
//! ```
//! use firmware_proto::*;
//!
//! let axis = AxisLimits {
//!     travel_low_um: 500, travel_high_um: 50_000, max_speed_um_s: 20_000, max_acceleration_um_s2: 200_000,
//!     steps: 1600, per_mm: 1,
//! };
//! let config = Config {
//!     axes: [axis; 2],
//!     emergency_um_s2: 200_000,
//!     homing: HomingConfig {
//!         fast_um_s: 5000, slow_um_s: 250, acceleration_um_s2: 100_000, back_off_um: 1000,
//!     },
//!     unhomed_speed_um_s: 1000,
//!     unhomed_distance_um: 2000,
//!     name: Name::new("bench stage"),
//!     firmware_hash: 0,
//!     boot_count: 7,
//!     reset_cause: ResetCause::PowerOn,
//! };
//! let mut host = Host::new(0x5EED_0001, Patience::default());
//! let mut now_us = 0;
//! let mut stage = Controller::new(config, now_us)?;
//!
//! // Host → bytes → controller → bytes → host.
//! fn ask(host: &mut Host, stage: &mut Controller, request: Encoded, now_us: u32) -> Option<Response> {
//!     stage.receive(request.as_bytes(), now_us);
//!     let mut line = [0; 96];
//!     let bytes = stage.output(&mut line);
//!     line[..bytes].iter().find_map(|byte| match host.hear(*byte)? {
//!         Heard::Answer { response, .. } => Some(response),
//!         _ => None,
//!     })
//! }
//!
//! // The first greeting learns what the second must name.
//! for _ in 0..2 {
//!     let hello = host.hello(now_us);
//!     ask(&mut host, &mut stage, hello, now_us);
//! }
//! assert!(host.may_move());
//!
//! // Nothing moves before homing.
//! let to = |motion, x_nm| Request::Move {
//!     motion, target_nm: [x_nm, 500_000], speed_um_s: 10_000, acceleration_um_s2: 100_000,
//! };
//! let early = to(host.next_motion(), 2_000_000);
//! let early = host.send(early, now_us)?;
//! let answer = ask(&mut host, &mut stage, early, now_us);
//! assert!(matches!(answer, Some(Response::Refused { refusal, .. }) if refusal.reason == Reason::NotHomed));
//!
//! // Homing and a move; a PING in every lease keeps them going. The low switches are at counter −800.
//! let home = Request::Home { motion: host.next_motion(), axes: AxisSet::ALL };
//! for request in [home, to(host.next_motion(), 2_000_000)] {
//!     let request = host.send(request, now_us)?;
//!     let answer = ask(&mut host, &mut stage, request, now_us);
//!     assert!(matches!(answer, Some(Response::Accepted { .. })));
//!     while stage.state().activity != Activity::Idle {
//!         now_us += 1000;
//!         let low = AxisSet::of(stage.step_counters().map(|steps| steps <= -800));
//!         stage.advance(now_us, Switches { low, high: AxisSet::NONE });
//!         if host.silent_us(now_us) >= Some(30_000) {
//!             let ping = host.send(Request::Ping { host_tick_us: now_us }, now_us)?;
//!             ask(&mut host, &mut stage, ping, now_us);
//!         }
//!     }
//! }
//! assert_eq!(stage.state().position_nm, [2_000_000, 500_000]);
//! assert_eq!(stage.state().steps, [3200, 800]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![doc = include_str!("protocol.md")]
#![no_std]

mod config;
mod controller;
mod emergency;
mod frame;
mod host;
mod message;
mod profile;
mod table;
mod wire;

pub use config::{Config, ConfigError, HomingConfig};
pub use controller::{ANSWERS_KEPT, Controller};
pub use emergency::{EMERGENCY_STOP, EmergencyWatch};
pub use frame::{
    CHECKSUM_BYTES, Decoder, Dropped, Encoded, Frame, HEADER, HEADER_BYTES, MAJOR, MAX_FRAME, MAX_PAYLOAD,
    Stamp, Undecodable,
};
pub use host::{Due, Heard, Host, Patience, StillWaiting};
pub use message::{
    AXES, Activity, AxisLimits, AxisSet, CODE_LISTS, Capability, DEFAULT_LEASE_MS, FROM_DEVICE, Fault,
    Identity, LEASE_BOUNDS_MS, Name, Outcome, PERIOD_BOUNDS_MS, RECORDS, Reason, Refusal, Request,
    ResetCause, Response, SCHEMA_HASH, State, Switches,
};
pub use table::{Code, CodeList, Field, Layout, Record};
