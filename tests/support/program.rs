//! The program under test as a process.

use std::path::Path;
use std::process::{Command, Output};

/// The program under test.
pub(crate) fn phantom_rig() -> Command {
    Command::new(assert_cmd::cargo::cargo_bin!("phantom-rig"))
}

/// Runs the program and returns exit code, standard output and standard error.
pub(crate) fn run(arguments: &[&str]) -> (i32, String, String) {
    let Output { status, stdout, stderr } =
        phantom_rig().args(arguments).output().expect("the program starts");
    let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
    (status.code().expect("an exit code"), text(stdout), text(stderr))
}

/// A path as an argument.
pub(crate) fn utf8(path: &Path) -> &str {
    path.to_str().expect("a path in UTF-8")
}
