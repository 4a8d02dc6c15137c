//! Which dot is which, from frame to frame, or an honest gap.
//!
//! Most frames explain themselves: dots are near where they were, and those that moved farther are found from their neighbours. Where all
//! dots moved by a large part of their spacing at once, several shifts may explain the frame. Then each is tried, and one is believed only
//! when it explains the frame better than every other by a margin: dots that should be visible and are not, detections that are nobody,
//! and how well each dot fits its neighbours all count, in nats. A regular grid that fills the whole picture and moves by half a spacing
//! stays ambiguous, and its dots stay lost.

mod assignment;
mod linker;
mod matching;
mod near;
mod prediction;
mod reference;
mod triangulation;

#[cfg(test)]
mod chaos;
#[cfg(test)]
mod sequences;

pub(super) use linker::Linker;
pub use linker::Lost;
