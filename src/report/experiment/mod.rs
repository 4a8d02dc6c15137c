//! What a person should see of the simulation experiment: the published tables with spreads, all trials as
//! CSV, and figures as SVG.

mod body;
mod nodes;
mod sheet;
mod tables;
mod verdicts;
mod write;

pub use tables::experiment_text;
pub use write::write_experiment;
