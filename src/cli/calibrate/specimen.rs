//! What `calibrate tensile`, `bands` and `relaxation` share: exports as tables with hashes, the words of a reference value, and what was left
//! out of each specimen.

use crate::calib::coupon::{Fault, Name};
use crate::calib::export::{Export, Finding, Override, Quantity, Table, Weight, read_file, read_folder};
use crate::calib::reference::RawFile;
use crate::report::SpecimenTable;
use clap::Args;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// How much the temperature may move during a test (K).
const WARMED: f64 = 1.0;

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

/// Faults of the tests, as sentences: what belongs to the material is no reason for doubt.
pub(super) fn faulty(label: &str, faults: &[Fault]) -> Vec<String> {
    let say =
        |f: &Fault| format!("{label}, lines {} to {}: {}: {}", f.lines[0], f.lines[1], f.words(), f.shown);
    faults.iter().filter(|f| !f.is_material()).map(say).collect()
}

/// Whether a fault makes the value itself wrong, whichever of its names is right: no reference value comes from such a test.
pub(super) fn spoils(fault: &Fault) -> bool {
    let spoilt = |n: &Name| matches!(n, Name::Saturated | Name::Slipped | Name::WrongUnit);
    spoilt(&fault.name) && fault.or.iter().all(spoilt)
}

/// Why there is no reference value, as a sentence; none where there is no reason.
pub(super) fn withheld(contradictions: &[String], faults: &[&Fault]) -> Option<String> {
    let mut why: Vec<&str> = faults.iter().filter(|f| spoils(f)).map(|f| f.name.words()).collect();
    why.dedup();
    if !contradictions.is_empty() {
        why.push("the file contradicts itself");
    }
    (!why.is_empty()).then(|| format!("no reference value is written: {}", why.join(", ")))
}

/// Temperatures that move by more than the procedures allow, as sentences.
pub(super) fn warmed(exports: &[Export]) -> Vec<String> {
    let say = |table: &Table| {
        let kelvin = table.column(Quantity::Temperature).ok()?.si()?;
        let least = kelvin.iter().copied().fold(f64::INFINITY, f64::min);
        let moved = kelvin.iter().copied().fold(f64::NEG_INFINITY, f64::max) - least;
        let place = table.place.origin.file.file_stem().unwrap_or_default().to_string_lossy();
        let text = format!("{place}: the temperature moves by {moved:.1} K, the procedure allows {WARMED} K");
        (moved > WARMED).then_some(text)
    };
    tables(exports).into_iter().filter_map(say).collect()
}

/// The last line of a result.
pub(super) fn written(out: &Path, name: &str, value: bool) -> String {
    let out = out.display();
    let reference = if value { format!(", reference value {out}/{name}.toml") } else { String::new() };
    format!("\n{out}/{name}.html{reference}")
}

/// For other programs.
pub(super) fn left_out(faults: &[Fault]) -> Vec<Value> {
    let one = |f: &Fault| {
        let or: Vec<&str> = f.or.iter().map(|n| n.words()).collect();
        json!({"name": f.name.words(), "or": or, "lines": f.lines, "shown": f.shown, "held_out": f.held_out})
    };
    faults.iter().map(one).collect()
}

/// The table of a page; none where nothing was left out. `note`: what can't be told.
pub(super) fn left_out_table(found: &[(&str, &[Fault])], note: &'static str) -> SpecimenTable {
    let row = |label: &str, f: &Fault| {
        let held_out =
            f.held_out.map_or("–".to_owned(), |[a, b]| format!("{:.2} → {:.2}", 100.0 * a, 100.0 * b));
        let lines = format!("{} to {}", f.lines[0], f.lines[1]);
        vec![f.words(), label.to_owned(), lines, f.shown.clone(), held_out]
    };
    let rows = found.iter().flat_map(|(label, faults)| faults.iter().map(move |f| row(label, f)));
    SpecimenTable {
        title: "What a plain spring leaves out",
        head: vec![
            "Name",
            "Specimen",
            "Lines",
            "Shown by",
            "unseen rows missed without → with it, % of the peak",
        ],
        rows: rows.collect(),
        note,
    }
}
