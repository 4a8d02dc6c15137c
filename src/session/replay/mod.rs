//! A recorded session as devices: whoever runs against a stage, a force sensor and a marker source runs against a recording.

mod clock;
mod devices;
mod source;

pub use clock::Speed;
pub use devices::{Replay, ReplayForce, ReplayMarkers, ReplayStage};
