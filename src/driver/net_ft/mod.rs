//! How an ATI Net F/T speaks: its configuration over HTTP, its readings over UDP.
//!
//! [`NetFt::open`] reads the configuration page and refuses what readings cannot be built upon; then the sensor is a
//! [`ForceSensor`](crate::device::ForceSensor). Records are passed on as they came, doubled, late and frozen ones too: what they are
//! is for a [`SequenceTracker`](crate::device::SequenceTracker) to say.
//!
//! Absent on purpose: nothing here changes a setting of the sensor, and nothing tares it unless asked.

mod configuration;
#[cfg(test)]
mod fuzz;
mod http;
mod interference;
mod page;
mod rdt;
mod sensor;
mod settings;
mod socket;
mod status;
mod units;

pub use configuration::NetFtConfiguration;
pub use interference::{NetFtInterference, NetFtSilence};
pub use sensor::NetFt;
pub use settings::NetFtSettings;
pub use status::NetFtProduct;
