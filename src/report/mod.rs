//! What a person should see of a fit: a page to look at, `fit.json` for programs, tables and VTK files for
//! people who plot for themselves; and of a diagnosis: a sentence, a page, `diagnosis.json`, the next poke.
//!
//! [`write_fit`] and [`write_diagnosis`] write all of them. Nothing here computes a result: what is shown is what
//! [`crate::inverse::Fit`] and [`crate::diagnose::Diagnosis`] hold.

mod diagnosis;
mod document;
mod error;
mod experiment;
mod folder;
mod instrument;
mod overlay;
mod page;
pub mod scorecard;
mod tables;
mod vtk;
mod words;

pub use diagnosis::{
    conclusion, diagnosis_json, diagnosis_page, evidence, is_sure, write_diagnosis, write_pokes,
};
pub use document::to_json;
pub use error::ReportError;
pub use experiment::{experiment_text, write_experiment};
pub use folder::write_fit;
pub use instrument::{Curve, SpecimenTable, comparison_page, force_page, specimen_page, stage_page};
pub use overlay::{Mark, MarkedDot, MarkedPicture, strip};
pub use page::page;
pub use vtk::{Cells, Field, FieldValues, Grid, write_vtp, write_vtu};
pub use words::{Verdict, finding, trust, verdict};
