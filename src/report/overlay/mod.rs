//! What the tracker saw: pictures with a mark round every dot and its number beside it, over each what it shows and below all what the marks
//! mean, as one PNG.

mod letters;
mod mark;
mod numbers;
mod strip;

pub use mark::{Mark, MarkedDot};
pub use strip::{MarkedPicture, strip};
