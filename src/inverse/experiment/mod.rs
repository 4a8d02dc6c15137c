//! The published simulation experiment (section 3.1), on a mesh of its own.

mod block;

pub use block::{BlockExperiment, Restraint};
