//! `calibrate` as a process: what it finds in pictures and exports that are made here, and what it refuses.

mod asked;
mod bench;
mod certified;
mod certified_models;
mod doubts;
mod faults;
mod force;
mod import;
mod instruments;
mod left_out;
mod lens;
#[path = "../support/program.rs"]
mod program;
mod refused;
mod shared;
mod specimen;
mod stage;
mod synthetic;

use program::{run, utf8};
use std::path::Path;

/// Names in a folder, hidden ones too.
fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("readable");
    let mut names: Vec<String> =
        entries.map(|e| e.expect("readable").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}
