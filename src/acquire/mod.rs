//! How a protocol is checked, run and stopped.
//!
//! 1. `protocol`: a file that a person wrote becomes [`Protocol`], data; it is expanded into single steps.
//! 2. `plan`: steps become motions of the stage on a [`Bench`], with their times, and everything that speaks against them.
//!    Only a [`CheckedPlan`] is run.
//! 3. `run`: [`conduct`] carries it out. The force is watched by a thread of its own (`guard`), which stops the stage through the
//!    [`Latch`] before it does anything else.
//!
//! Absent on purpose: nothing here opens a port, knows a kind of device, or draws on a screen.

mod error;
mod glimpse;
mod guard;
mod latch;
mod live;
mod operator;
mod plan;
mod protocol;
mod resident;
mod run;
mod status;

pub use error::AcquireError;
pub use glimpse::SeenPicture;
pub use latch::{Cause, Latch, Tripped};
pub use live::LiveForce;
pub use operator::Operator;
pub use plan::{
    At, Bench, Breach, CheckedPlan, Contact, Latency, Leg, LoadLimits, PhantomBox, Phase, Plan, PlanStep,
    Stream, Trapezoid, Violation, pad_stiffness_n_per_m,
};
pub use protocol::{
    Action, FORMAT, Kind, ListedPoke, MOST_STROKES, Place, PlannedStep, Problem, Profile, Protocol, Refusal,
    Step, StepId, Stroke, Target, Task, Variable, from_poke,
};
pub use resident::stay_resident;
pub use run::{Conduct, Instruments, Planner, Ran, Stopped, Zero, conduct, record_pictures};
pub use status::{Doing, RunStatus, TRACE, Watched};
