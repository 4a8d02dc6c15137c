//! What the rig's instruments are worth: force sensor and stage, from what they showed where the truth was known.
//!
//! | question | answer |
//! | --- | --- |
//! | what does the force sensor read under a known load, and how does its zero wander? | [`force`] |
//! | where does the stage go, sent to a known place, and how far does it yield? | [`stage`] |
//! | can that be, or is a column in another unit than its heading says? | `doubts` of what was found |
//! | where in a table is something wrong? | [`InstrumentError`] |
//!
//! Tables are CSV with one row of headings that carry their units (`mass_g` or `mass_kg`); everything inside is SI.

mod doubt;
mod error;
pub mod force;
mod least_squares;
mod sheet;
pub mod stage;
mod toml_file;

pub use error::InstrumentError;
