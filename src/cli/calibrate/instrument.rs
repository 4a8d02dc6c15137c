//! What `calibrate force` and `calibrate stage` share: a table with its hash, the day, and a folder with page, JSON and TOML.

use crate::calib::{Day, sha256_hex};
use crate::cli::{Kind, StagedFolder, UsageError};
use crate::session::utc_text;
use anyhow::Context as _;
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::time::SystemTime;

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
        None => Ok(Day::of_time(&utc_text(SystemTime::now()))?),
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
