//! What a stage with the rig's own firmware puts on the wire: the reference controller of `firmware_proto` with motors, limit switches
//! and a serial line that can fail.
//!
//! [`NativeStageEmulator`] stands behind a pseudo-terminal and tells its owner where the stage truly is. Beneath it is a board without
//! port or clock: elapsed time and bytes in, bytes out.

mod board;
mod emulator;
mod faults;
mod line;
mod setup;

pub use emulator::{NativeStageEmulator, NativeStageTruth};
pub use faults::{NativeStageFaultSwitch, NativeStageFaults};
pub use setup::NativeStageSetup;
