//! Texts that are read as files.

use crate::calib::export::{Export, ExportError, Override, read_bytes};
use std::path::Path;

/// Reads a text as a file of the name a.csv.
pub(super) fn read(text: &str) -> Result<Export, ExportError> {
    read_with(text, "")
}

/// The same with an override.
pub(super) fn read_with(text: &str, wish: &str) -> Result<Export, ExportError> {
    let wish = Override::parse(Path::new("wishes.toml"), wish)?;
    read_bytes(Path::new("a.csv"), text.as_bytes().to_vec(), &wish)
}
