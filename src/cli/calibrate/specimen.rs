//! What `calibrate tensile`, `bands` and `relaxation` share: exports as tables with hashes, and the words of a reference value.

use crate::calib::export::{Export, Finding, Override, Table, Weight, read_file, read_folder};
use crate::calib::reference::RawFile;
use clap::Args;
use std::path::PathBuf;

/// What is read, and how it is to be understood.
#[derive(Debug, Args)]
pub(in crate::cli) struct SpecimenArguments {
    /// Exports, or folders of them
    #[arg(value_name = "EXPORT", required = true, num_args = 1..)]
    pub(super) exports: Vec<PathBuf>,
    /// What is known better than can be inferred (keys: see calibrate import --help)
    #[arg(long = "as", value_name = "FILE")]
    pub(super) wish: Option<PathBuf>,
    /// When the specimens were measured; today when left out
    #[arg(long, value_name = "DAY")]
    pub(super) date: Option<String>,
    /// What was measured: material, batch
    #[arg(long, value_name = "TEXT", default_value = "")]
    pub(super) specimen: String,
    /// With which machine
    #[arg(long, value_name = "TEXT", default_value = "")]
    pub(super) machine: String,
    /// Where page, JSON and reference value go; an earlier result there is replaced
    #[arg(long, value_name = "DIR")]
    pub(super) out: PathBuf,
    /// Replace whatever is there
    #[arg(long)]
    pub(super) force: bool,
}

/// All exports; the first one that cannot be read refuses all.
pub(super) fn read(arguments: &SpecimenArguments) -> anyhow::Result<Vec<Export>> {
    let wish = arguments.wish.as_deref().map_or_else(|| Ok(Override::default()), Override::read)?;
    let mut exports = Vec::new();
    for source in &arguments.exports {
        if source.is_dir() {
            let folder = read_folder(source, &wish)?;
            if let Some((_, why)) = folder.refused.into_iter().next() {
                return Err(why.into());
            }
            exports.extend(folder.exports);
        } else {
            exports.push(read_file(source, &wish)?);
        }
    }
    Ok(exports)
}

/// All tables.
pub(super) fn tables(exports: &[Export]) -> Vec<&Table> {
    exports.iter().flat_map(|e| &e.tables).collect()
}

/// Names and hashes.
pub(super) fn raw(exports: &[Export]) -> Vec<RawFile> {
    let name = |e: &Export| e.source.file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    exports.iter().map(|e| RawFile { file: name(e), sha256: e.source.sha256.clone() }).collect()
}

/// Labels that contradict their numbers, as sentences.
pub(super) fn contradictions(exports: &[Export]) -> Vec<String> {
    let findings = exports.iter().flat_map(|e| &e.tables).flat_map(|t| &t.findings);
    let weighs = |f: &&Finding| f.weight == Weight::Contradiction;
    findings.filter(weighs).map(ToString::to_string).collect()
}

/// The files' names in one line.
pub(super) fn sources(exports: &[Export]) -> String {
    raw(exports).into_iter().map(|r| r.file).collect::<Vec<_>>().join(", ")
}
