//! Verdicts: made one by one in processes of their own, then closed.
//!
//! A process is given a copy of one recording, in a folder that says nothing of where it came from, and no environment.
//! What it prints is its verdict, be it a diagnosis or an error. Verdicts on disk are not made again.

use super::folder::{read, read_sums, replace, write_sums};
use super::{ProofError, ProofFolder, Sums, digest, hex};
use crate::cli::{Bar, Kind, StagedFolder};
use crate::report::scorecard::Said;
use anyhow::Context as _;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// One verdict as it lies on disk.
#[derive(Debug, Serialize, Deserialize)]
struct VerdictFile {
    format: String,
    draw: String,
    /// Time of the diagnosis (s).
    seconds: f64,
    /// Whether it is one of the quick kind.
    #[serde(default)]
    quick: bool,
    /// What the process printed.
    diagnosis: Value,
}

const FORMAT: &str = "phantom-verdict/1";

/// Folder that a process writes besides what it prints.
const DIAGNOSIS: &str = "diagnosis";

/// How verdicts are made.
#[derive(Debug, Clone, Copy)]
pub(in crate::cli) struct Making {
    /// Verdicts made at a time.
    pub jobs: usize,
    /// Their pages are kept.
    pub pages: bool,
    /// By `diagnose --quick`.
    pub quick: bool,
}

/// Makes the verdicts of those draws that have none.
///
/// # Errors
/// The first that could not be made, or was made in the other way; those made before stay.
pub(in crate::cli) fn make_verdicts(
    folder: &ProofFolder,
    draws: &[String],
    making: Making,
    bar: &Bar,
) -> anyhow::Result<()> {
    let next = AtomicUsize::new(0);
    let work = || -> anyhow::Result<()> {
        while let Some(draw) = draws.get(next.fetch_add(1, Ordering::Relaxed)) {
            let made = match folder.verdict(draw).is_file() {
                true => read_verdict(folder, draw, making.quick).map(|_| ()).map_err(Into::into),
                false => make(folder, draw, making),
            };
            if let Err(error) = made {
                // The others finish what they are at, and start nothing.
                next.store(draws.len(), Ordering::Relaxed);
                return Err(error);
            }
            bar.advance();
        }
        Ok(())
    };
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..making.jobs).map(|_| scope.spawn(work)).collect();
        // A worker that panicked has said why on standard error.
        workers.into_iter().try_for_each(|w| w.join().unwrap_or_else(|e| std::panic::resume_unwind(e)))
    })
}

fn make(folder: &ProofFolder, draw: &str, making: Making) -> anyhow::Result<()> {
    let Making { jobs, pages, quick } = making;
    let place = std::env::temp_dir().join(format!("phantom-rig-{}-{draw}", std::process::id()));
    let copy = StagedFolder::new(&place, Kind::Scratch, false)?;
    let bundle = copy.path().join("recording");
    copy_bundle(&folder.recording(draw), &bundle)?;
    let program = std::env::current_exe().context("can't find this program")?;
    let started = Instant::now();
    let mut command = Command::new(program);
    command.args(["diagnose", "recording", "--json"]).env_clear();
    match pages {
        true => command.args(["--out", DIAGNOSIS]),
        false => command.arg("--print-only"),
    };
    if quick {
        command.arg("--quick");
    }
    if jobs > 1 {
        command.env("RAYON_NUM_THREADS", "1");
    }
    let output = command
        .current_dir(copy.path())
        .stdin(Stdio::null())
        .output()
        .context("can't start a process that diagnoses")?;
    let seconds = started.elapsed().as_secs_f64();
    let diagnosis = match output.status.code() {
        Some(0 | 1 | 3) => serde_json::from_slice(&output.stdout).ok(),
        Some(130) | None => return Err(ProofError::Ended { draw: draw.to_owned() }.into()),
        Some(_) => None,
    };
    let diagnosis = diagnosis.unwrap_or_else(|| {
        let told = String::from_utf8_lossy(&output.stderr).trim().to_owned();
        json!({ "format": "phantom-error/1", "error": format!("{}: {told}", output.status) })
    });
    let file = VerdictFile { format: FORMAT.to_owned(), draw: draw.to_owned(), seconds, quick, diagnosis };
    let text = serde_json::to_string_pretty(&file)? + "\n";
    let page = copy.path().join(DIAGNOSIS).join("diagnosis.html");
    if pages && page.is_file() {
        let kept = folder.page(draw);
        if let Some(parent) = kept.parent() {
            fs::create_dir_all(parent).with_context(|| format!("can't make {}", parent.display()))?;
        }
        replace(&kept, &read(&page)?)?;
    }
    Ok(replace(&folder.verdict(draw), text.as_bytes())?)
}

fn copy_bundle(from: &Path, to: &PathBuf) -> Result<(), ProofError> {
    let copied = || -> std::io::Result<()> {
        fs::create_dir(to)?;
        for entry in fs::read_dir(from)? {
            let entry = entry?;
            if !entry.file_name().to_string_lossy().starts_with('.') {
                fs::copy(entry.path(), to.join(entry.file_name()))?;
            }
        }
        Ok(())
    };
    copied().map_err(|source| ProofError::System { place: from.to_owned(), action: "copied", source })
}

/// Closes the verdicts, unless they are closed, and checks that all are there as they were then.
///
/// # Errors
/// [`ProofError::MissingVerdict`], [`ProofError::ChangedVerdict`], and what reading and writing meets.
pub(in crate::cli) fn close_verdicts(folder: &ProofFolder, draws: &[String]) -> anyhow::Result<()> {
    let mut found = Sums::new();
    for draw in draws {
        let place = folder.verdict(draw);
        if !place.is_file() {
            return Err(ProofError::MissingVerdict { draw: draw.clone() }.into());
        }
        found.insert(draw.clone(), hex(&digest("phantom-rig verdict", &[&read(&place)?])));
    }
    let closed = folder.closed();
    if !closed.is_file() {
        return Ok(write_sums(&closed, &found)?);
    }
    let sums = read_sums(&closed)?;
    for (draw, sum) in &found {
        match sums.get(draw) {
            Some(then) if then == sum => {}
            Some(_) => return Err(ProofError::ChangedVerdict { draw: draw.clone() }.into()),
            None => return Err(ProofError::MissingVerdict { draw: draw.clone() }.into()),
        }
    }
    Ok(())
}

/// What a verdict on disk says, and how long it took (s).
///
/// # Errors
/// [`ProofError::NotAVerdict`], [`ProofError::OtherHaste`].
pub(in crate::cli) fn read_verdict(
    folder: &ProofFolder,
    draw: &str,
    quick: bool,
) -> Result<(Said, f64), ProofError> {
    let refused = |why: String| ProofError::NotAVerdict { draw: draw.to_owned(), why };
    let file: VerdictFile =
        serde_json::from_slice(&read(&folder.verdict(draw))?).map_err(|e| refused(e.to_string()))?;
    if file.format != FORMAT || file.draw != draw {
        return Err(refused(format!("it is {} of {}", file.format, file.draw)));
    }
    if file.quick != quick {
        return Err(ProofError::OtherHaste {
            draw: draw.to_owned(),
            how: if file.quick { "with" } else { "without" },
        });
    }
    let said = match file.diagnosis["format"].as_str() {
        Some("phantom-diagnosis/1") => {
            let verdict = serde_json::from_value(file.diagnosis).map_err(|e| refused(e.to_string()))?;
            Said::Verdict(Box::new(verdict))
        }
        _ => Said::Failed(file.diagnosis["error"].as_str().unwrap_or("it says nothing").to_owned()),
    };
    Ok((said, file.seconds))
}
