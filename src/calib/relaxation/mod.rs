//! Relaxation: how does the force on a held specimen fall, and how does it depend on the rate?
//!
//! | question | answer |
//! | --- | --- |
//! | what was done to the specimen, and what did it answer? | [`Recording`], from a table of [`crate::calib::export`] |
//! | which model, with how many terms, by evidence on data that its fit did not see? | [`choose`] → [`Choice`] |
//! | which share of the force relaxes? | [`lost`] |
//! | what does it predict? | [`Law::force`], the finite ramp included |
//!
//! One recording: the later part of its hold is kept aside. Several rates: each is predicted from the others. A deformation counts from the start
//! and is positive in the direction of the first ramp, and so is the force. Units are those of the table in SI: m or 1, N or Pa.

mod choose;
mod convolution;
mod error;
mod law;
mod lost;
mod phases;
mod recording;
mod search;

pub use choose::{Choice, Settings, Tried, Unseen, choose};
pub use error::RelaxationError;
pub use law::{Kind, Law, Term};
pub use lost::{Lost, lost};
pub use recording::{Phase, Recording};
