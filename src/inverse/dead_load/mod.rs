//! What bodies under dead loads say of Young's modulus at finite strain, and where another load would take their markers.
//!
//! A beam that hangs by its own weight and one that a mass pulls down besides are the same beam. Rotations are large there, so that
//! the linear model of [`fit`](super::fit) is off by several per cent; here the body is neo-Hookean. Held is what the mesh says,
//! nothing else: no restraint is looked for. [`cases`] takes load cases out of recordings, [`hang`] finds the modulus from all of them and
//! says where a further load would take the markers.
//!
//! The white noise of such recordings is far below what differs between them (how the body was held at rest, creep, where the load
//! hangs). Deviations come therefore from what is left, axis by axis, with recordings as the independent units: the sandwich estimate by
//! clusters (Liang and Zeger 1986), with Student's distribution of one degree of freedom less than there are recordings.

mod case;
mod hang;
mod hung;

pub use case::{Case, CaseMarker, DeadLoad, cases};
pub use hang::{Alone, Hanging, Hung, MarkerAt, hang};
