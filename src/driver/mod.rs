//! How real hardware speaks: linear stages on serial ports, the force sensor on the network, depth cameras through OpenCV.
//!
//! Each driver has two seams: what a device does ([`device`](crate::device)), and the bytes beneath. Pure codecs turn bytes into
//! meaning and back without input or output; the drivers around them own ports, sockets and time-outs.

mod error;

pub use error::DriverError;

mod net_ft;
pub use net_ft::{NetFt, NetFtConfiguration, NetFtInterference, NetFtProduct, NetFtSettings, NetFtSilence};

mod grbl;
mod port;
pub use grbl::{GrblOptions, GrblStage};

mod native;
pub use native::{ClockSample, NativeLosses, NativeOptions, NativeStage, NativeStopper};

mod ports;
pub use ports::serial_ports;

mod video;
pub use video::{ImageFiles, Pace, V4l2Stream, VideoOptions, VideoSource, open_video};
