//! Which calibrations hold now, and for which devices: one file that a rig file names.
//!
//! | question | answer |
//! | --- | --- |
//! | which files belong together, until when, and are they still what they were? | [`CalibrationSet`] |
//! | may it be used today, with these devices? | [`CalibrationSet::doubts`] → [`Doubt`] |
//! | how is one put together? | [`Draft`] |

mod draft;
mod error;
mod file;

pub use draft::{Draft, Drafted};
pub use error::SetError;
pub use file::{CalibrationSet, Doubt, Part, valid_days};
