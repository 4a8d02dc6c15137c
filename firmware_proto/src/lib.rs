//! What host and stage controller say to each other: one table that host, simulator and firmware compile.
//!
//! This crate needs neither the standard library nor an allocator, so that the same source runs on the
//! controller. It holds the protocol's version; frames and commands join it together with the stage driver
//! that speaks them, never ahead of it.
#![no_std]

/// Version of the wire protocol. Two ends with different versions refuse to talk to each other.
pub const PROTOCOL_VERSION: u16 = 0;
