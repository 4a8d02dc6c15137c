//! A force sensor under dead weights: bias, gain and cross-talk, how its axes lie, and how its zero wanders.
//!
//! | question | answer |
//! | --- | --- |
//! | what was hung where, and what did the sensor read? | [`Weights`] |
//! | what does it read under a known wrench, and which weight does not fit? | [`calibrate_force`] → [`ForceFound`] |
//! | how does its zero wander? | [`drift`] → [`Drift`] |
//! | where is that kept, and how is a reading corrected? | [`ForceFile`] |
//!
//! Wrench: force (N) and moment about the sensor's origin (N·m) on the tool, along the axes that directions and levers are given in.

mod calibration;
mod drift;
mod file;
mod outlier;
mod two_sizes;
mod weights;

pub use calibration::{ForceFound, Known, calibrate_force};
pub use drift::{Drift, DriftLog, Trend, drift};
pub use file::{ForceFile, Frame};
pub use outlier::Misfit;
pub use weights::{Hold, Weights};

/// Names of a wrench's components.
pub const COMPONENTS: [&str; 6] = ["Fx", "Fy", "Fz", "Mx", "My", "Mz"];
