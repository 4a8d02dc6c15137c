//! Reference values: what is known of a phantom's material or of its restraint without the rig, and how a fit agrees with it.
//!
//! | question | answer |
//! | --- | --- |
//! | what is known, from what, how surely, and within which limits? | [`ReferenceValue`], a file of `calibration/values` |
//! | does a fit agree with it? | [`compare`] → [`Comparison`] |
//!
//! SI units; a file names them in its keys.

mod comparison;
mod error;
mod quantity;
mod value;

pub use comparison::{Comparison, Fitted, compare};
pub use error::ReferenceError;
pub use quantity::{Figure, ReferenceQuantity};
pub use value::{RawFile, ReferenceValue, Validity};
