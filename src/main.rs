//! The command line: parse what was typed, run it, exit with the code that says how it went.
fn main() {}
