//! How acquiring fails: each with what a person needs to know to act.

use super::latch::component;
use super::plan::Violation;
use super::protocol::Refusal;
use std::fmt::Display;

/// Why a protocol cannot be run, or was not run to its end.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum AcquireError {
    /// The protocol is not what it should be.
    #[error("{}", lines(refusals))]
    Protocol {
        /// Everything that speaks against it, one line each.
        refusals: Vec<Refusal>,
    },
    /// The bench cannot do what the protocol asks for. Nothing has moved.
    #[error("the bench can't do this; nothing was moved\n{}", lines(violations))]
    Plan {
        /// Everything that speaks against it, one line each.
        violations: Vec<Violation>,
    },
    /// A device failed before anything moved.
    #[error(transparent)]
    Device(#[from] crate::device::DeviceError),
    /// The force sensor says that it is not to be trusted.
    #[error("the force sensor reports status {status:#010x}: {}", meaning.join(", "))]
    SensorUnsound {
        /// Status word.
        status: u32,
        /// What its bits say.
        meaning: Vec<&'static str>,
    },
    /// The force sensor delivers too little for a zero.
    #[error(
        "the force sensor delivered {records} records in {} s; {wanted} are needed for its zero", budget.as_secs_f64()
    )]
    TooFewRecords {
        /// What came.
        records: usize,
        /// What is needed.
        wanted: usize,
        /// How long was waited.
        budget: std::time::Duration,
    },
    /// The force sensor does not rest while its zero is taken.
    #[error(
        "{} of the force sensor moved by {moved:.3} {unit} within half a second while its zero was to be taken, three times in a row: nothing \
         may touch the tip, and the bench has to stand still", component(*axis).0, unit = component(*axis).1
    )]
    NotAtRest {
        /// Axis of the sensor.
        axis: usize,
        /// By how much (N or N·m).
        moved: f64,
    },
    /// The zero is so far off that the sensor cannot read what would stop the stage.
    #[error(
        "{} of the force sensor reads {reads:.3} {unit} with nothing at the tip; with the limit of {limit:.3} {unit} that leaves its range \
         of {range:.3} {unit}: bias it (--bias), or lower the limit", component(*axis).0, unit = component(*axis).1
    )]
    LimitOutOfRange {
        /// Axis of the sensor.
        axis: usize,
        /// What it reads at rest (N or N·m).
        reads: f64,
        /// The limit (N or N·m).
        limit: f64,
        /// What it can read (N or N·m).
        range: f64,
    },
    /// The stage does not say where it stands.
    #[error("the stage did not say where it stands for {} s", waited.as_secs_f64())]
    StageSaysNothing {
        /// How long was waited.
        waited: std::time::Duration,
    },
    /// A poke that the protocol does not have.
    #[error("there is no poke {poke}; the protocol's pokes are numbered from 1 to {pokes}")]
    NoSuchPoke {
        /// What was asked for.
        poke: u32,
        /// How many there are.
        pokes: u32,
    },
}

fn lines<T: Display>(items: &[T]) -> String {
    items.iter().map(T::to_string).collect::<Vec<_>>().join("\n")
}
