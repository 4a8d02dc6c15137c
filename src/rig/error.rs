//! Why a rig file cannot be used, or the devices that it names cannot be had.

use crate::calib::CalibError;
use crate::calib::lens::LensError;
use crate::calib::set::SetError;
use crate::driver::DriverError;
use crate::sim::SimError;
use crate::sim::pixels::PixelError;
use std::io;
use std::path::PathBuf;

/// What is wrong with a rig.
#[derive(Debug, thiserror::Error)]
pub enum RigError {
    /// The file cannot be read.
    #[error("{}: can't be read", file.display())]
    Read {
        /// The rig file.
        file: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// It is no TOML, or a key is missing, unknown or of the wrong kind.
    #[error("{}: {reason}{}", file.display(), meant(nearest))]
    Refused {
        /// The rig file.
        file: PathBuf,
        /// What is wrong, with line and key.
        reason: String,
        /// The known key that looks most like an unknown one.
        nearest: Option<String>,
    },
    /// A value that makes no sense.
    #[error("{}: {key} is {found}; expected {expected}", file.display())]
    Value {
        /// The rig file.
        file: PathBuf,
        /// Section and key.
        key: &'static str,
        /// What it holds.
        found: String,
        /// What it should.
        expected: &'static str,
    },
    /// The simulated camera has a figure that means nothing.
    #[error("{}: simulation.camera", file.display())]
    Camera {
        /// The rig file.
        file: PathBuf,
        /// Which figure.
        source: PixelError,
    },
    /// The camera's lens cannot be used.
    #[error("{}: no lens", file.display())]
    Lens {
        /// The file.
        file: PathBuf,
        /// What is wrong with it.
        source: LensError,
    },
    /// The camera's registration cannot be used.
    #[error("{}: no registration", file.display())]
    Registration {
        /// The file.
        file: PathBuf,
        /// What is wrong with it.
        source: CalibError,
    },
    /// The calibration set cannot be used.
    #[error("{}: calibration", file.display())]
    Calibration {
        /// The rig file.
        file: PathBuf,
        /// What is wrong with the set.
        source: Box<SetError>,
    },
    /// The simulated camera cannot be put up.
    #[error("the simulated camera")]
    SimulatedCamera(#[from] PixelError),
    /// The phantom is larger than it is said to be: ways clear of it follow from its box.
    #[error(
        "the mesh reaches to {axis} = {:.2} mm; expected no more than the box of {} (low_mm, high_mm), from {:.2} to {:.2} mm there: ways \
         clear of the phantom follow from that",
        1e3 * reaches_m, file.display(), 1e3 * box_m[0], 1e3 * box_m[1]
    )]
    BeyondTheBox {
        /// The rig file.
        file: PathBuf,
        /// Along which axis of the phantom frame.
        axis: &'static str,
        /// How far the mesh reaches (m).
        reaches_m: f64,
        /// Where the box begins and ends there (m).
        box_m: [f64; 2],
    },
    /// A Prony series with unequal lists.
    #[error(
        "{effect}: {fractions} relaxed fractions and {times} time constants; expected as many of both, at least one"
    )]
    UnequalSeries {
        /// Entry of the physics catalogue.
        effect: &'static str,
        /// Fractions.
        fractions: usize,
        /// Time constants.
        times: usize,
    },
    /// A device cannot be had.
    #[error(transparent)]
    Driver(#[from] DriverError),
    /// The simulated bench cannot be made.
    #[error("the simulated bench")]
    Bench(#[from] SimError),
    /// A simulated device without a simulated bench.
    #[error("the {device} is simulated, but the rig file has no section [simulation]")]
    NoBench {
        /// Which device.
        device: &'static str,
    },
    /// The phantom is not a simulated one.
    #[error("the phantom's mesh is simulated, but the rig file has no section [simulation]")]
    NoSimulation,
    /// The simulated devices cannot be put on their ports.
    #[error("the simulated {device} has no port")]
    NoPort {
        /// Stage or force sensor.
        device: &'static str,
        /// Why.
        source: io::Error,
    },
}

fn meant(nearest: &Option<String>) -> String {
    nearest.as_ref().map(|n| format!("\n  did you mean {n}?")).unwrap_or_default()
}
