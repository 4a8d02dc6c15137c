//! Whose time a number is: the host's monotonic clock, instants of a recording's common clock, beats of a device that tells no time, and
//! values between rows.

mod beat;
mod device_clock;
mod host;
mod interpolate;

#[cfg(test)]
#[path = "../../tests/support/steady.rs"]
pub(crate) mod steady;

pub use beat::Beat;
pub use device_clock::DeviceClock;
pub use host::HostTime;
pub use interpolate::Rows;
