//! How devices fail: each with what a person needs to know to act.

use std::error::Error;
use std::iter::successors;
use std::time::Duration;

/// What went wrong with a device.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DeviceError {
    /// It is not there any more: unplugged, port closed, network down.
    #[error("{device} is lost")]
    Lost {
        /// Which device, and where.
        device: String,
        /// What the operating system says.
        source: std::io::Error,
    },
    /// It does not answer.
    #[error("{device} said nothing for {} ms while {during}", waited.as_millis())]
    Silent {
        /// Which device, and where.
        device: String,
        /// How long was waited.
        waited: Duration,
        /// What it was asked for.
        during: &'static str,
    },
    /// It started anew without having been asked to.
    #[error("{device} was reset{}: its position cannot be trusted until it has homed", because(cause))]
    Reset {
        /// Which device, and where.
        device: String,
        /// The cause, where it tells one.
        cause: Option<String>,
    },
    /// It refuses.
    #[error("{device} refuses to {what}: {reason}")]
    Refused {
        /// Which device, and where.
        device: String,
        /// What it was asked to do.
        what: &'static str,
        /// Its reason.
        reason: String,
    },
    /// It is latched in a fault.
    #[error("{device} has stopped with fault {code}: {meaning}")]
    Fault {
        /// Which device, and where.
        device: String,
        /// The controller's code.
        code: u8,
        /// What the code means.
        meaning: String,
    },
    /// The motion leaves the travel.
    #[error(
        "axis {axis} would go to {:.3} mm, outside its travel from {:.3} to {:.3} mm",
        target_m * 1e3, travel_m[0] * 1e3, travel_m[1] * 1e3
    )]
    OutsideTravel {
        /// Axis, from 0.
        axis: usize,
        /// Where it would go (m).
        target_m: f64,
        /// Where it may go (m).
        travel_m: [f64; 2],
    },
    /// A speed or an acceleration that is not positive, or more than an axis allows.
    #[error(
        "{what} of {asked} {unit} along axis {axis}; the stage allows more than 0 and up to {most} {unit}"
    )]
    TooFast {
        /// Speed or acceleration.
        what: &'static str,
        /// Axis, from 0.
        axis: usize,
        /// What was asked for.
        asked: f64,
        /// What is allowed.
        most: f64,
        /// m/s or m/s².
        unit: &'static str,
    },
    /// A motion before homing.
    #[error("{device} has not homed: its position is not known")]
    NotHomed {
        /// Which device, and where.
        device: String,
    },
    /// A recording in a device's place has come to its end.
    #[error("{device} has come to its end after {frames} frames")]
    Ended {
        /// Which recording, and where.
        device: String,
        /// Frames that it gave.
        frames: u64,
    },
    /// What it says makes no sense.
    #[error("{device} says {said:?}; expected {expected}")]
    Nonsense {
        /// Which device, and where.
        device: String,
        /// What it said, shortened.
        said: String,
        /// What was expected.
        expected: &'static str,
    },
}

fn because(cause: &Option<String>) -> String {
    cause.as_ref().map(|c| format!(" ({c})")).unwrap_or_default()
}

/// An error with its causes, for whoever keeps a text of it: what the operating system said is in a cause.
pub fn with_causes(error: &dyn Error) -> String {
    successors(Some(error), |cause| (*cause).source()).map(ToString::to_string).collect::<Vec<_>>().join(": ")
}
