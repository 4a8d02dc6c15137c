//! The process boundary: exit codes, what is printed where, and that nothing half-written is left behind.

mod check;
mod completions;
mod diagnose;
mod dots;
#[path = "../bundles/fixture.rs"]
mod fixture;
mod mesh_block;
mod plan;
mod predict;
#[path = "../support/program.rs"]
mod program;
mod proof;
mod session_frame;
mod sessions;
mod usage;

use program::{phantom_rig, run, utf8};
use std::path::Path;

/// Names in a folder, hidden ones too.
fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .expect("readable")
        .map(|e| e.expect("readable").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// Interrupts a process as Ctrl-C does.
#[cfg(unix)]
fn interrupt(process: u32) {
    let sent =
        std::process::Command::new("kill").args(["-INT", &process.to_string()]).status().expect("kill");
    assert!(sent.success());
}
