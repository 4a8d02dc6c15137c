//! How a stage speaks that runs the rig's own firmware: the frames of `firmware_proto` over a serial port.
//!
//! `units` and `words` say what the wire's numbers and codes mean, without input or output. `link` carries requests, their answers and
//! what is streamed; `connect` finds out who answers; `stage` is what a protocol run holds; `stopper` stops it from any thread.
//!
//! What to know before relying on it:
//!
//! - **The lease**: a motion goes on only while the controller hears from this program. [`Stage::report`](crate::device::Stage::report)
//!   sends a word whenever a third of the lease has passed without one, so it has to be called more often than that while anything
//!   moves. Who calls it too rarely has a stage that decelerates by itself and latches a fault. That is what the lease is for.
//! - **Requests** are sent again until they are answered or the patience is over. The controller carries out each of them once, however
//!   many copies of it arrive. A motion whose answer never came is called off before the error is returned.
//! - **Resets** are noticed by the answer to the next word and told once, with their cause; then the stage can be homed again.
//! - **Faults** are reported as soon as they are latched, while the stage still decelerates; it stands once two
//!   reports a period apart have the same position.
//! - **Stops** from another thread hold until they are cleared, here and in the controller, whichever of the two forgets.
//! - **Position** is that of the controller's step counter; nothing measures where the stage is. Steps that a motor loses go unnoticed
//!   until the next homing.

mod connect;
mod link;
mod stage;
mod stopper;
mod units;
#[cfg(test)]
mod verification;
mod words;

pub use connect::NativeOptions;
pub use link::NativeLosses;
pub use stage::{ClockSample, NativeStage};
pub use stopper::NativeStopper;
