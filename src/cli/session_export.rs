//! `session export`: a session's data as tables, or sessions as a recording bundle to be fitted.

use super::look::{late, missing, seen};
use super::recorded_run::MESH;
use super::session::{SessionPath, and_damage, lacks};
use super::{Context, Exit, Kind, Outcome, StagedError, StagedFolder, UsageError};
use crate::dataset::{read_bundle, read_phantom, read_seen_sessions, write_bundle};
use crate::session::Session;
use crate::units::counted;
use anyhow::{Context as _, bail};
use clap::{ArgGroup, Args};
use serde_json::json;
use std::path::{Path, PathBuf};

/// What is to be written where.
#[derive(Debug, Args)]
#[command(group(ArgGroup::new("written").args(["bundle", "csv"]).required(true).multiple(true)))]
pub(super) struct ExportArguments {
    #[command(flatten)]
    path: SessionPath,
    /// Sessions that went on with it on the same rig, in order: they become part of the bundle
    #[arg(value_name = "SESSION")]
    more: Vec<PathBuf>,
    /// Write a recording bundle into this folder (this or --csv, or both)
    #[arg(long, value_name = "BUNDLE")]
    bundle: Option<PathBuf>,
    /// Write force.csv, stage.csv, markers.csv and events.csv into this folder
    #[arg(long, value_name = "DIR")]
    csv: Option<PathBuf>,
    /// The phantom's mesh; by default the one that the session keeps
    #[arg(long, value_name = "FILE")]
    mesh: Option<PathBuf>,
    /// Where the camera stood, in place of what the session says: a file of `calibrate registration`
    #[arg(long, value_name = "FILE", requires = "bundle")]
    registration: Option<PathBuf>,
    /// Replace whatever is there; without it only earlier tables
    #[arg(long)]
    force: bool,
}

/// In a bundle: the calibration set that its numbers were put right by.
pub(super) const CALIBRATION: &str = "calibration.toml";

/// A bundle that is written, and what is to be said of it.
struct Bundled {
    pokes: usize,
    /// Of each stretch: by how much its pictures came late, and the standard deviation of that (s).
    lags_s: Vec<Option<[f64; 2]>>,
    /// Pictures that did not come on the camera's beat; none where it kept none.
    missing_on_beat: Option<u64>,
    calibration: Vec<String>,
    remarks: Vec<String>,
}

pub(super) fn export(arguments: &ExportArguments, context: &Context) -> anyhow::Result<Outcome> {
    if arguments.bundle == arguments.csv {
        return Err(UsageError("--bundle and --csv name the same folder; name two".to_owned()).into());
    }
    let session = Session::open(&arguments.path.session)?;
    let mut sessions = vec![session.clone()];
    for folder in &arguments.more {
        sessions.push(Session::open(folder)?);
    }
    // A place that is taken is told before any pictures are followed, which takes a while.
    let place = |folder: &Option<PathBuf>, kind| -> Result<_, StagedError> {
        let Some(folder) = folder else { return Ok(None) };
        Ok(Some((folder.clone(), StagedFolder::new(folder, kind, arguments.force)?)))
    };
    let (into, tables) = (place(&arguments.bundle, Kind::Recording)?, place(&arguments.csv, Kind::Tables)?);
    let mut remarks = Vec::new();
    for session in &sessions {
        remarks.extend(lacks(session)?);
    }
    let mut told = Vec::new();
    // First: where it is refused, no tables are written either.
    let mut bundled = None;
    if let Some((folder, staged)) = into {
        let written = bundle(&folder, staged, &sessions, arguments, context, &mut told)?;
        remarks.extend(written.remarks.iter().cloned());
        bundled = Some(written);
    }
    if let Some((folder, staged)) = tables {
        let files = session.export_csv(staged.path())?.len();
        staged.finish()?;
        told.push(format!("{}: {files} tables", folder.display()));
    }
    told.extend(remarks.iter().map(|remark| format!("note: {remark}")));
    let of = bundled.as_ref();
    Ok(Outcome {
        exit: if remarks.is_empty() { Exit::Good } else { Exit::Degraded },
        text: told.join("\n"),
        json: json!({
            "format": "phantom-session-export/1",
            "bundle": arguments.bundle,
            "csv": arguments.csv,
            "pokes": of.map(|b| b.pokes),
            "camera_lags_s": of.map_or(&[][..], |b| b.lags_s.as_slice()),
            "missing_on_beat": of.and_then(|b| b.missing_on_beat),
            "calibration": of.map_or(&[][..], |b| b.calibration.as_slice()),
            "remarks": remarks,
        }),
    })
}

/// Writes sessions as one recording bundle, which is to appear at `folder`, and adds to `told` what became of it.
fn bundle(
    folder: &Path,
    staged: StagedFolder,
    sessions: &[Session],
    arguments: &ExportArguments,
    context: &Context,
    told: &mut Vec<String>,
) -> anyhow::Result<Bundled> {
    let first = &sessions[0];
    let mesh = arguments.mesh.clone().unwrap_or_else(|| first.folder().join(MESH));
    if !mesh.exists() {
        bail!("{}: the session keeps no mesh; name one with --mesh", mesh.display());
    }
    let mesh = read_phantom(&mesh)?;
    let seen = seen(sessions, &mesh, arguments.registration.as_deref(), context)?;
    let missing_on_beat = seen
        .iter()
        .filter_map(|(_, attached)| attached.as_ref()?.missing_on_beat)
        .reduce(|sum, more| sum + more);
    let from = read_seen_sessions(&seen, mesh).map_err(|error| and_damage(error.into(), sessions))?;
    write_bundle(&from.recording, staged.path()).context("the bundle")?;
    // A mesh of another phantom shows first where a fit reads the bundle.
    if let Err(error) = read_bundle(staged.path()) {
        let (here, there) = (staged.path().display().to_string(), folder.display().to_string());
        bail!("this makes no recording that can be read: {}", format!("{error:#}").replace(&here, &there));
    }
    if let Some(document) = &first.start().calibration {
        let kept = staged.path().join(CALIBRATION);
        std::fs::write(&kept, &document.set.text)
            .with_context(|| format!("{}: can't be written", kept.display()))?;
    }
    staged.finish()?;
    let pokes = from.recording.pokes.len();
    told.push(format!("{}: {}", folder.display(), counted(pokes, "poke", "pokes")));
    told.extend(from.calibration.iter().cloned());
    told.extend(from.camera_lags.iter().flatten().map(late));
    told.extend(missing(missing_on_beat));
    Ok(Bundled {
        pokes,
        lags_s: from.camera_lags.iter().map(|lag| lag.map(|l| [l.lag_s, l.sd_s])).collect(),
        missing_on_beat,
        calibration: from.calibration,
        remarks: from.remarks,
    })
}
