//! What a person and a program should see of a diagnosis: a sentence, a page, `diagnosis.json`, and the next poke as a
//! row that the rig's operator can add to a protocol.
//!
//! Nothing here computes a result: what is shown is what [`crate::diagnose::Diagnosis`] holds.

mod curves;
mod detail;
mod document;
mod figures;
mod folder;
mod names;
mod page;
mod protocol;
mod scene;
mod sentence;

pub use document::diagnosis_json;
pub use folder::write_diagnosis;
pub use page::diagnosis_page;
pub use protocol::write_pokes;
pub use sentence::{conclusion, evidence, is_sure};
