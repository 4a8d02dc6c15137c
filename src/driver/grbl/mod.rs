//! How a stage run by Grbl 1.1 or grblHAL speaks: G-code's jogging commands and status reports over a serial port.
//!
//! `line` and `status` say what the bytes of the controller mean, `command` makes the bytes that go to it, `settings` and `codes` say
//! what its numbers mean, `knowledge` keeps what is known of the machine; none of them does input or output. `link` carries lines,
//! `connect` finds out who answers, `stage` says what is to be done, `stopper` stops it from any thread.
//!
//! What to know before relying on it:
//!
//! - **Acceleration** is a setting of the controller (`$120…`), not part of a motion. A motion that asks for more than an axis has is
//!   refused; one that asks for less gets what the machine has, so that it stops at least as soon as asked.
//!   [`GrblStage::acceleration_along`] says what a motion will really have.
//! - **Position** is that of the controller's step counter, in machine coordinates to 1 µm; nothing measures where the stage is.
//! - **Homing** is what makes a position trustworthy, and only one that ended within this connection counts. While it homes, Grbl
//!   answers nothing and grblHAL as a rule nothing either: there are no reports until it is done, and its time is limited by what the
//!   settings say that it may take.
//! - **Stopping** by either way begins after [`GrblStage::braking_delay`] and goes by the machine's acceleration; `stopper` says why.
//! - **Motors** must keep their current between motions (`$1=255`): a tip that holds a poke without it would be pushed back, and steps
//!   lost that nobody counts. A controller that is set up otherwise is refused.
//! - **No watchdog**: when the host dies or the cable comes off, the controller finishes the motion under way.

mod codes;
mod command;
mod connect;
mod knowledge;
mod line;
mod link;
mod settings;
mod stage;
mod status;
mod stopper;

pub use connect::GrblOptions;
pub use stage::GrblStage;
