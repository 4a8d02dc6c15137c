//! What an ATI Net F/T puts on the wire: its configuration page and its stream of records, with faults on demand.
//!
//! [`NetFtEmulator`] stands on loopback and asks its owner for the wrench. Beneath it is a sensor without sockets or clock: requests and
//! ticks in, datagrams out. One client at a time; who asks last has the stream.

mod emulator;
mod faults;
mod page;
mod sensor;
mod setup;

pub use emulator::NetFtEmulator;
pub use faults::{NetFtFaultSwitch, NetFtFaults, NetFtPageFault};
pub use setup::{NetFtFamily, NetFtSetup, PageUnit};
