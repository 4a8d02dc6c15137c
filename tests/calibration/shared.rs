//! Measurements of others, read in place: `PHANTOM_RIG_DATA`, or `../shared` beside the project.

use std::path::PathBuf;

/// A folder of measurements; says that a test is skipped where there is none.
pub(crate) fn folder(name: &str) -> Option<PathBuf> {
    let root = std::env::var_os("PHANTOM_RIG_DATA")
        .map(PathBuf::from)
        .unwrap_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared"));
    let found = [root.join("data").join(name), root.join(name)].into_iter().find(|f| f.is_dir());
    if found.is_none() {
        println!("skipped: no data");
    }
    found
}
