//! Recorded sessions → a recording: one clock, one frame, SI, and the zero of the force taken off.
//!
//! - **Clock.** Reports and records carry the host's time of their arrival, which is late by a different amount each time, and the
//!   device's own count, which is not. [`DeviceClock`](crate::clock::DeviceClock) puts the count on the host's clock (`times`).
//! - **Pokes.** The session says which strokes were made where; a contact lasts from the instant at which the reported stage passes
//!   the site on its way in to that at which it passes it on its way out (`contacts`).
//! - **Pictures.** Their stamps are those of their arrival. A camera that takes them at equal intervals tells by that when each was taken
//!   (`beat`), but for how late all of them are; that the markers tell, which follow the stage (`lag`).
//! - **Force.** Means of all raw records over equal spans of time, none of which reaches across a poke's limits (`rows`).
//!
//! What the session does not hold is not made up: a poke that was not finished is left out, and said so.

mod beat;
mod calibrated;
mod contacts;
mod lag;
mod part;
mod recorded;
mod rows;
mod times;

pub use part::first_rest;
pub use recorded::{FromSession, read_seen_sessions, read_sessions};
