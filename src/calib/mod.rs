//! Reference values and instrument calibration, each with its uncertainty.
//!
//! | question | answer |
//! | --- | --- |
//! | how does the camera frame lie in the phantom frame? | [`register`] on [`Pair`]s, which [`match_constellation`] finds; kept in a [`RegistrationFile`] |
//! | which way do the stage's axes go, seen by the camera, and how far is a millimetre of theirs? | [`axes_of_motion`] |
//! | how much later than the force are the pictures? | [`lag_between`] |
//! | what does the camera's lens do? | [`lens`] |
//! | what does the export of a testing machine hold? | [`export`] |
//! | what are force sensor and stage worth? | [`instruments`] |
//! | which of all these hold now, and for which devices? | [`set`] |
//! | what is known without the rig, and does a fit agree with it? | [`mod@reference`] |
//! | which modulus has the material, pulled as dumb-bells? | [`dumbbell`] |
//! | how stiff are bands, at the pull that they have on the rig? | [`bands`] |
//! | how does a held specimen's force fall, at any rate? | [`relaxation`] |
//! | what did a specimen's model leave out? | [`coupon`] |
//! | which parameters fit a model to data, to how many digits? | [`regression`] |
//!
//! Frames: the camera frame has x to the right, y down and z forward; the phantom frame is that of a recording. Metres and seconds.

mod axes;
pub mod bands;
mod constellation;
pub mod coupon;
mod coverage;
mod day;
pub mod dumbbell;
mod error;
pub mod export;
pub mod instruments;
mod lag;
pub mod lens;
mod noise;
pub mod reference;
mod registration;
mod registration_file;
pub mod regression;
pub mod relaxation;
pub mod set;
mod slip;

pub use axes::{SeenStep, StageAxes, axes_of_motion};
pub use constellation::match_constellation;
pub use day::{Day, NoDay};
pub use error::CalibError;
pub use lag::{Lag, Track, lag_between};
pub use registration::{Pair, Registration, register};
pub use registration_file::RegistrationFile;
