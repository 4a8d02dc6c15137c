//! The published simulation experiment (section 3.1), on a mesh of its own: the two-step method in all its
//! variants beside the default nodal estimate, over noise levels and seeds.

mod bars;
mod block;
mod shape;
mod study;
mod summary;

pub use bars::{AT_BOUND, Bar, EFFICIENT_DB, OF_PUBLISHED, bars};
pub use block::{BlockExperiment, Restraint};
pub use shape::{Shape, shapes};
pub use study::{Method, StepTwo, Study, StudySettings, Trial, study};
pub use summary::{Spread, Summary, summarise};
