//! A stage against a gauge, and against a rigid block.
//!
//! | question | answer |
//! | --- | --- |
//! | where was it sent, from which side, and what did the gauge read? | [`StageRuns`] |
//! | how far off does it stop, how far apart, and by how much differently from both sides? | [`positioning`] → [`Positioning`] |
//! | how far do stage, sensor and frame yield to a force? | [`compliance`] of a [`BlockPress`] → [`Compliance`] |
//! | where is that kept? | [`StageFile`] |
//!
//! Deviation: where it is less where it was sent (m), positive along the axis.

mod compliance;
mod file;
mod positioning;
mod runs;

pub use compliance::{BlockPress, Compliance, TipCompliance, compliance};
pub use file::{AxisFile, StageFile};
pub use positioning::{At, ISO, Positioning, Strange, Uncertain, positioning};
pub use runs::{Approach, StageReading, StageRuns};
