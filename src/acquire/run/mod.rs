//! How a plan is carried out: the stage is moved leg by leg, everything is recorded, and whatever goes wrong stops it.
//!
//! Three threads. One watches the force and may stop the stage at any time (`guard`); one fetches marker positions; the caller's own
//! leads the stage (`pilot`). They share a [`Latch`](super::Latch), which any of them may trip, and nothing waits for another.
//!
//! After a stop: the stage is watched until it stands; how far it went on and how high the force rose is put down. The tip is taken out
//! of the phantom where that is safe: the stage is sound and knows where it is, and no person asked for the stop, who may have had a
//! hand in between. Then the stage stays latched until a person clears it.

mod conduct;
mod event;
mod frames;
mod pilot;
mod zero;

pub use conduct::{Conduct, Instruments, Planner, Ran, Stopped, conduct};
pub use frames::record_pictures;
pub(in crate::acquire) use pilot::QUICK_LOOK;
pub use zero::Zero;
