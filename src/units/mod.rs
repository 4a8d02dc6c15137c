//! What a number means: how SI values are shown to people.
//!
//! Inside the program every value is SI. Conversion happens once, at the edge, and the edge names the unit.

mod text;

pub use text::{counted, millimetres, newtons_per_metre, pascals, with_sd};
