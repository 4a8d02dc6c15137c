//! Which files a diagnosis leaves behind.

use super::document::DiagnosisDocument;
use super::page::diagnosis_page;
use super::protocol::write_pokes;
use crate::diagnose::Diagnosis;
use crate::observation::Recording;
use crate::report::ReportError;
use serde_json::{Map, Value};
use std::fs;
use std::path::{Path, PathBuf};

/// Writes `diagnosis.html` (the page), `diagnosis.json` and, where another poke would tell more, `next-poke.csv` into an
/// existing folder, and says what was written.
///
/// `settings` are those that made the diagnosis, by name with unit. The folder should be a staging folder: after an
/// error some of the files may be there.
///
/// # Errors
/// [`ReportError`] with the file.
pub fn write_diagnosis(
    folder: &Path,
    diagnosis: &Diagnosis,
    recording: &Recording,
    settings: &Map<String, Value>,
) -> Result<Vec<PathBuf>, ReportError> {
    let write = |name: &str, text: &str| {
        let path = folder.join(name);
        match fs::write(&path, text) {
            Ok(()) => Ok(path),
            Err(source) => Err(ReportError::Write { path, source }),
        }
    };
    let document = serde_json::to_string_pretty(&DiagnosisDocument::new(diagnosis, settings))? + "\n";
    let mut written = vec![
        write("diagnosis.html", &diagnosis_page(diagnosis, recording, settings)?)?,
        write("diagnosis.json", &document)?,
    ];
    if let Some(poke) = &diagnosis.next_poke {
        let path = folder.join("next-poke.csv");
        write_pokes(&path, &[poke.poke], recording)?;
        written.push(path);
    }
    Ok(written)
}
