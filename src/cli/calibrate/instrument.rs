//! What calibrations share: where the result goes and what is kept with it, a table with its hash, remarks, what comes next.

use crate::calib::Day;
use crate::cli::today::today;
use crate::cli::{Kind, StagedFolder, UsageError};
use crate::digest::sha256_hex;
use anyhow::Context as _;
use clap::Args;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

/// Where a calibration goes, and what is kept with it.
#[derive(Debug, Args)]
pub(in crate::cli) struct KeptArguments {
    /// When the table was made; today when left out
    #[arg(long, value_name = "DAY")]
    pub(super) date: Option<String>,
    /// What should be known of it; kept in the file
    #[arg(long, value_name = "TEXT", default_value = "")]
    pub(super) note: String,
    /// Where page, JSON and calibration go; an earlier result there is replaced
    #[arg(long, value_name = "DIR")]
    pub(super) out: PathBuf,
    /// Replace whatever is there
    #[arg(long)]
    pub(super) force: bool,
}

/// Name and SHA-256 of a file.
pub(super) fn hashed(file: &Path) -> anyhow::Result<[String; 2]> {
    let bytes = fs::read(file).with_context(|| file.display().to_string())?;
    let name = file.file_name().map_or_else(|| file.to_string_lossy(), |name| name.to_string_lossy());
    Ok([name.into_owned(), sha256_hex(&bytes)])
}

/// The day that was given, or today (UTC).
pub(super) fn day(given: Option<&str>) -> anyhow::Result<Day> {
    match given {
        Some(text) => Day::parse(text).map_err(|error| UsageError(error.to_string()).into()),
        None => Ok(today()?),
    }
}

/// Writes page, JSON and calibration file, whole or not at all.
pub(super) fn write(
    out: &Path,
    force: bool,
    name: &str,
    page: &str,
    json: &Value,
    calibration: &str,
) -> anyhow::Result<()> {
    let staged = StagedFolder::new(out, Kind::Calibration, force)?;
    let texts = [("html", page), ("json", &format!("{json:#}\n")), ("toml", calibration)];
    for (ending, text) in texts.into_iter().filter(|(_, text)| !text.is_empty()) {
        let file = staged.path().join(format!("{name}.{ending}"));
        fs::write(&file, text).with_context(|| format!("{}: can't be written", file.display()))?;
    }
    Ok(staged.finish()?)
}

/// The last line of a result that a rig file names, by a key of a section or, with none, of the file itself. Why the name alone: paths in a rig
/// file count from its own folder, which is not known here.
pub(super) fn next_in_rig(section: &str, key: &str, file: &Path) -> String {
    let name = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy();
    let place =
        if section.is_empty() { "above its sections".to_owned() } else { format!("under [{section}]") };
    format!(
        "\nNext: in a rig file beside it, {place}: {key} = \"{name}\" (from another folder: the path from the rig file's folder)"
    )
}

/// Text with each remark on a line.
pub(super) fn noted(sentence: &str, remarks: &[String]) -> String {
    remarks.iter().fold(sentence.to_owned(), |text, remark| text + "\nnote: " + remark)
}
