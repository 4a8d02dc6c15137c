//! What a number means: how SI values are shown to people.
//!
//! Inside the program every value is SI. Conversion happens once, at the edge, and the edge names the unit. What stands in a file in a value's
//! place and is none is told with line, key and what was expected.

mod text;
mod unread;

pub use text::{counted, millimetres, newtons_per_metre, pascals, three_digits, with_sd};
pub use unread::{unread_toml, unread_words};
