//! What a stage, a force sensor, a depth camera and a source of marker positions are: traits, what they report, and how they fail.
//!
//! Real hardware (`driver`), recorded sessions (`session`) and the simulated bench behind the same drivers all stand behind these
//! traits; whoever runs a protocol knows nothing else of them.
//!
//! - Every report carries the host's time of its arrival and the device's own counter, untouched. Nobody corrects a time in place.
//! - What a device counts stays beside what it means: [`ForceRecord`] holds counts, [`ForceFormat`] says what they are worth.
//! - Nothing here waits without end: each call that waits says until when.
//! - Stopping works from any thread, beside whatever else is being said to the stage: [`Stopper`].
//!
//! Frames: a stage moves in coordinates of its own, metres along its two axes from where it homes. A [`Mounting`] says where the
//! axes point in the phantom frame, a [`SensorMounting`] how the sensor's axes lie in it.

mod compared;
mod depth_camera;
mod error;
mod force;
mod markers;
mod mounting;
mod sequence;
mod stage;

pub use compared::ClockComparison;
pub use depth_camera::{
    DepthCamera, DepthCameraFormat, DepthCameraIdentity, DepthFrame, DepthPicture, FrameLosses, GreyPicture,
};
pub use error::{DeviceError, with_causes};
pub use force::{ForceFormat, ForceIdentity, ForceRecord, ForceSensor, Losses};
pub use markers::{DotInPicture, MarkerFrame, MarkerPosition, MarkerSource, Sight};
pub use mounting::{Mounting, SensorMounting, UnreachableSite};
pub use sequence::{SequenceStep, SequenceTracker};
pub use stage::{
    AXES, Motion, Stage, StageIdentity, StageLimits, StageReport, StageState, Stopper, Stopping,
};
