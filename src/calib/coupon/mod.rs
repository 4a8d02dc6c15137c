//! What did a specimen's model leave out? A homogeneous specimen's answer to the question that the phantom gets, too.
//!
//! | question | answer |
//! | --- | --- |
//! | where does a held specimen's recording miss its model, and what could it be? | [`diagnose`] → [`Fault`]s |
//!
//! Each fault says where, with the numbers that show it, and what held-out data gained where it was modelled. What fits no name is called unexplained.

mod fault;
mod hold;
mod marks;

pub use fault::{Fault, Name};
pub use hold::diagnose;
