//! The command line: parse what was typed, run it, exit with the code that says how it went.

use std::process::ExitCode;

fn main() -> ExitCode {
    phantom_rig::cli::run()
}
