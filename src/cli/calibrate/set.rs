//! `calibrate set`: which calibrations hold together, in one file for the rig.

use super::instrument::{day, next_in_rig, noted};
use crate::calib::Day;
use crate::calib::set::{CalibrationSet, Draft, Drafted};
use crate::cli::{Context, Exit, Outcome, StagedError, StagedFile, UsageError};
use anyhow::{Context as _, anyhow};
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Puts calibrations together into one file that a rig file names (calibration = "…").
///
/// Files are named from where the set lies, with their hashes: one that is changed later is refused. So is a calibration that cannot be, such as
/// gains of 1000. Exit code 3: a calibration holds rows that its other rows contradict.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  phantom-rig calibrate set --name 'bench 2' --force calibration/force/force.toml --stage calibration/stage/stage.toml \\
      --until 2027-11-24 --out calibration/bench-2.toml")]
pub(in crate::cli) struct SetArguments {
    /// Its name
    #[arg(long, value_name = "TEXT")]
    name: String,
    /// The force sensor's calibration
    #[arg(long = "force", value_name = "FILE")]
    force_file: Option<PathBuf>,
    /// The stage's
    #[arg(long, value_name = "FILE")]
    stage: Option<PathBuf>,
    /// The lens
    #[arg(long, value_name = "FILE")]
    lens: Option<PathBuf>,
    /// Where the camera stands
    #[arg(long, value_name = "FILE")]
    registration: Option<PathBuf>,
    /// A reference value
    #[arg(long, value_name = "FILE")]
    reference: Vec<PathBuf>,
    /// First day on which it holds; today when left out
    #[arg(long, value_name = "DAY")]
    from: Option<String>,
    /// Last day on which it holds
    #[arg(long, value_name = "DAY")]
    until: String,
    /// The file to write
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Replace the file when it exists
    #[arg(long)]
    replace: bool,
}

pub(super) fn run(arguments: &SetArguments, _: &Context) -> anyhow::Result<Outcome> {
    let from = day(arguments.from.as_deref())?;
    let until = Day::parse(&arguments.until).map_err(|error| UsageError(error.to_string()))?;
    if until < from {
        return Err(UsageError(format!("--until {until} is before --from {from}")).into());
    }
    let given = [&arguments.force_file, &arguments.stage, &arguments.lens, &arguments.registration];
    if given.iter().all(|file| file.is_none()) && arguments.reference.is_empty() {
        let words =
            "a set of nothing; name at least one of --force, --stage, --lens, --registration and --reference";
        return Err(UsageError(words.to_owned()).into());
    }
    let folder = arguments.out.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let folder = folder.canonicalize().with_context(|| folder.display().to_string())?;
    let beside = |file: &PathBuf| -> anyhow::Result<PathBuf> {
        let whole = file.canonicalize().with_context(|| file.display().to_string())?;
        Ok(from_folder(&folder, &whole))
    };
    let draft = Draft {
        name: arguments.name.clone(),
        valid: [from, until],
        force: arguments.force_file.as_ref().map(beside).transpose()?,
        stage: arguments.stage.as_ref().map(beside).transpose()?,
        lens: arguments.lens.as_ref().map(beside).transpose()?,
        registration: arguments.registration.as_ref().map(beside).transpose()?,
        references: arguments.reference.iter().map(beside).collect::<anyhow::Result<_>>()?,
    };
    let Drafted { text, remarks } = draft.text(&folder)?;
    let out = arguments.out.display();
    // --force names the sensor's file here.
    let staged = StagedFile::new(&arguments.out, arguments.replace).map_err(|error| match error {
        StagedError::Exists { place } => {
            anyhow!("{} exists; choose another name or pass --replace", place.display())
        }
        other => other.into(),
    })?;
    std::fs::write(staged.path(), &text).with_context(|| format!("{out}: can't be written"))?;
    staged.finish()?;
    let set = CalibrationSet::read(&arguments.out)?;
    let json = json!({
        "format": "phantom-calibration-set-result/1",
        "file": arguments.out,
        "name": set.name,
        "valid": set.valid.map(|day| day.to_string()),
        "references": set.references.len(),
        "remarks": remarks,
    });
    let exit = if remarks.is_empty() { Exit::Good } else { Exit::Degraded };
    let text = noted(text.trim_end(), &remarks) + &next_in_rig("", "calibration", &arguments.out);
    Ok(Outcome { exit, text, json })
}

/// A path from a folder to a file, both whole.
fn from_folder(folder: &Path, file: &Path) -> PathBuf {
    let shared = folder.components().zip(file.components()).take_while(|(a, b)| a == b).count();
    let up = folder.components().skip(shared).map(|_| "..");
    let down = file.components().skip(shared);
    up.map(PathBuf::from).chain(down.map(|c| PathBuf::from(c.as_os_str()))).collect()
}
