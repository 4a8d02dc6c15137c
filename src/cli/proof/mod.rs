//! What `conceal` and `prove` share: where the files of a proof lie, and how answers are sealed.

mod answers;
mod error;
mod folder;
mod seal;
mod verdicts;

pub(super) use answers::{open_answer, open_key};
pub(super) use error::ProofError;
pub(super) use folder::{Manifest, ProofFolder, Sums, bundle_sum, draw_name, read_sums, replace, write_sums};
pub(super) use seal::{Seal, digest, hex};
pub(super) use verdicts::{Making, close_verdicts, make_verdicts, read_verdict};
