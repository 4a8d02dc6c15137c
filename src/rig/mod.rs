//! Which devices stand behind a configuration: a rig file → a stage, a force sensor and a source of marker positions.
//!
//! `simulated` in place of a port, an address or a file takes the simulated bench: the drivers are the same, what answers at the other
//! end of the port is this program. What such a file says of the simulated phantom stays here.

mod camera;
mod camera_markers;
mod depth_camera;
mod error;
mod facts;
mod file;
mod open;
mod reading;
mod simulation;

pub use error::RigError;
pub use facts::RigFile;
pub use open::{Devices, EachDevice, SimulatedBench};

use file::SIMULATED;
