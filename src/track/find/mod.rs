//! Where dots are in a grey picture: white on a dark, uneven background with glare.
//!
//! Levels over blocks → runs → components → candidates on their own half-way levels → centres → those that are alike.

mod candidates;
mod finder;
mod noise;
mod population;
mod runs;
mod shape;
mod size;
mod threshold;

#[cfg(test)]
mod pictures;
#[cfg(test)]
mod pins;

pub use finder::{Finder, Found};
