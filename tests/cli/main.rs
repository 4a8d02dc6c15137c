//! The process boundary: exit codes, what is printed where, and that nothing half-written is left behind.

mod check;
mod completions;
mod diagnose;
#[path = "../bundles/fixture.rs"]
mod fixture;
mod mesh_block;
mod proof;
mod rig;
#[path = "../support/steady.rs"]
mod steady;
mod usage;

use std::path::Path;
use std::process::{Command, Output};

/// The program under test.
fn phantom_rig() -> Command {
    Command::new(assert_cmd::cargo::cargo_bin!("phantom-rig"))
}

/// Runs the program and returns exit code, standard output and standard error.
fn run(arguments: &[&str]) -> (i32, String, String) {
    let Output { status, stdout, stderr } =
        phantom_rig().args(arguments).output().expect("the program starts");
    let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
    (status.code().expect("an exit code"), text(stdout), text(stderr))
}

fn utf8(path: &Path) -> &str {
    path.to_str().expect("a path in UTF-8")
}

/// Names in a folder, hidden ones too.
fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .expect("readable")
        .map(|e| e.expect("readable").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}
