//! Whose time a number is: instants of the recording's common clock, and values between its rows.

mod interpolate;

pub use interpolate::Rows;
