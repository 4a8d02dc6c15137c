//! What did a specimen's model leave out? A homogeneous specimen's answer to the question that the phantom gets, too.
//!
//! | question | answer |
//! | --- | --- |
//! | where does a held specimen's recording miss its model, and what could it be? | [`diagnose`] → [`Fault`]s |
//! | what does a plain spring leave out of dumb-bells and bands? | [`Specimen::diagnose`] |
//! | what do grips and machine give way, beside an extensometer? | [`compliance`] |
//! | which of several specimens is in another unit? | [`wrong_units`] |
//!
//! Each fault says where, with the numbers that show it, and what rows that no fit saw gained by it: without a gain there is no name. What several
//! names predict alike is said with all of them; what none predicts can't be told.

mod curve;
mod cycles;
mod events;
mod fault;
mod held_out;
mod hold;
mod lead;
mod machine;
mod marks;
mod plateau;
mod specimen;
mod steps;
mod turning;

pub use fault::{Fault, Name};
pub use hold::diagnose;
pub use machine::{compliance, wrong_units};
pub use specimen::Specimen;
