//! `session`: what is in a session, whether all of it is there, what can be saved of a damaged one, and its data as tables or as a
//! recording bundle.

use super::look::{late, seen};
use super::recorded_run::MESH;
use super::run_protocol::finished_pokes;
use super::{Context, Exit, Kind, Outcome, StagedFolder};
use crate::dataset::{read_mesh, read_seen_sessions, write_bundle};
use crate::session::{Finding, Info, Outcome as SessionOutcome, Session, recover};
use crate::units::counted;
use anyhow::{Context as _, anyhow, bail};
use clap::{Args, Subcommand};
use serde_json::json;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// In a bundle: the calibration set that its numbers were put right by.
pub(super) const CALIBRATION: &str = "calibration.toml";

/// What may be done with a session.
#[derive(Debug, Subcommand)]
pub(super) enum SessionAction {
    /// Says what is in a session
    Info(SessionPath),
    /// Checks everything that a session says of itself: checksums, counters, times, counts; exit code 3 where something is missing
    Verify(SessionPath),
    /// Saves what is readable of a damaged session into a new one, and says what is lost
    Recover(RecoverArguments),
    /// Writes a session's data as tables (CSV) or as a recording bundle to be fitted
    Export(ExportArguments),
}

/// A session.
#[derive(Debug, Args)]
pub(super) struct SessionPath {
    /// The session's folder
    #[arg(value_name = "SESSION")]
    session: PathBuf,
}

/// What is to be saved where.
#[derive(Debug, Args)]
pub(super) struct RecoverArguments {
    #[command(flatten)]
    path: SessionPath,
    /// The new session: a folder that does not exist yet
    #[arg(long, value_name = "SESSION")]
    out: PathBuf,
}

/// What is to be written where.
#[derive(Debug, Args)]
pub(super) struct ExportArguments {
    #[command(flatten)]
    path: SessionPath,
    /// Sessions that went on with it on the same rig, in order: they become part of the bundle
    #[arg(value_name = "SESSION")]
    more: Vec<PathBuf>,
    /// Write a recording bundle into this folder (this or --csv, or both)
    #[arg(long, value_name = "BUNDLE", required_unless_present = "csv")]
    bundle: Option<PathBuf>,
    /// Write force.csv, stage.csv, markers.csv and events.csv into this folder
    #[arg(long, value_name = "DIR")]
    csv: Option<PathBuf>,
    /// The phantom's mesh; by default the one that the session keeps
    #[arg(long, value_name = "FILE")]
    mesh: Option<PathBuf>,
    /// Replace whatever is there; without it only earlier tables
    #[arg(long)]
    force: bool,
}

pub(super) fn run(action: &SessionAction, context: &Context) -> anyhow::Result<Outcome> {
    match action {
        SessionAction::Info(path) => info(path),
        SessionAction::Verify(path) => verify(path),
        SessionAction::Recover(arguments) => rescue(arguments),
        SessionAction::Export(arguments) => export(arguments, context),
    }
}

fn info(path: &SessionPath) -> anyhow::Result<Outcome> {
    let session = Session::open(&path.session)?;
    let info = session.info()?;
    let start = session.start();
    let mut text = format!("{}: {}\n", path.session.display(), info.name);
    let ended = ended(&info);
    let _ = writeln!(
        text,
        "{}, {:.1} s, {:.1} MB in {} file(s); {ended}",
        start.started_utc,
        info.duration_s,
        info.bytes as f64 / 1e6,
        info.segments
    );
    let finished = finished_pokes(&session).len();
    let _ = writeln!(
        text,
        "rig     {}; protocol {}, {} finished",
        start.phantom.description,
        start.name,
        counted(finished, "poke", "pokes")
    );
    if let Some(stage) = &start.stage {
        let _ = writeln!(text, "stage   {} at {}", stage.controller, stage.port);
    }
    if let Some(force) = &start.force {
        let _ = writeln!(
            text,
            "force   {} {} at {}, {} records a second",
            force.product, force.calibration, force.address, force.rate_hz
        );
    }
    for (topic, extent) in &info.topics {
        let rate = extent.rate_hz.map(|r| format!(", {r:.1} a second")).unwrap_or_default();
        let _ = writeln!(
            text,
            "{:<13} {} messages, {} records{rate}",
            topic.name(),
            extent.messages,
            extent.records
        );
    }
    let force = info.force;
    let _ = write!(
        text,
        "force records: {} lost, {} twice, {} late; {} gaps noticed while recording; {} bytes cannot be read",
        force.lost,
        force.duplicated,
        force.reordered,
        info.gaps.len(),
        info.unreadable_bytes
    );
    let topics: serde_json::Map<String, serde_json::Value> = (info.topics.iter())
        .map(|(topic, e)| {
            (
                topic.name().to_owned(),
                json!({"messages": e.messages, "records": e.records, "rate_hz": e.rate_hz, "lost": e.lost}),
            )
        })
        .collect();
    let json = json!({
        "format": "phantom-session-info/1",
        "name": info.name,
        "outcome": info.outcome,
        "rig": start.phantom.description,
        "pokes_finished": finished,
        "started_utc": start.started_utc,
        "segments": info.segments,
        "bytes": info.bytes,
        "unreadable_bytes": info.unreadable_bytes,
        "duration_s": info.duration_s,
        "topics": topics,
        "force": {"received": force.received, "lost": force.lost, "duplicated": force.duplicated, "reordered": force.reordered},
        "gaps": info.gaps.len(),
    });
    let whole = info.unreadable_bytes == 0;
    if !whole {
        let _ = write!(text, "\n{}", rescued(&path.session));
    }
    let sound = whole && matches!(info.outcome, Some(SessionOutcome::Success));
    Ok(Outcome { exit: if sound { Exit::Good } else { Exit::Degraded }, text, json })
}

/// What to do with a session that is damaged.
fn rescued(session: &Path) -> String {
    let name = session.display();
    format!("Next: phantom-rig session recover {name} --out {name}-recovered saves what can be read")
}

fn ended(info: &Info) -> String {
    match &info.outcome {
        Some(SessionOutcome::Success) => "finished".to_owned(),
        Some(SessionOutcome::Abort { cause }) => format!("ABORTED: {cause}"),
        Some(SessionOutcome::Fail { cause }) => format!("FAILED: {cause}"),
        None => "INTERRUPTED: it has no end".to_owned(),
    }
}

fn verify(path: &SessionPath) -> anyhow::Result<Outcome> {
    let session = Session::open(&path.session)?;
    let findings = session.verify()?;
    let told: Vec<String> = findings.iter().map(Finding::to_string).collect();
    let name = path.session.display();
    let text = if told.is_empty() {
        format!("{name}: everything is there")
    } else {
        let damaged = findings.iter().any(|f| matches!(f, Finding::Damaged { .. } | Finding::NoStart { .. }));
        let next = if damaged { format!("\n{}", rescued(&path.session)) } else { String::new() };
        format!("{name}:\n  {}{next}", told.join("\n  "))
    };
    Ok(Outcome {
        exit: if told.is_empty() { Exit::Good } else { Exit::Degraded },
        text,
        json: json!({"format": "phantom-session-check/1", "findings": told}),
    })
}

fn rescue(arguments: &RecoverArguments) -> anyhow::Result<Outcome> {
    let recovery = recover(&arguments.path.session, &arguments.out)?;
    let saved = recovery.segments.iter().any(|loss| !loss.saved.is_empty());
    let what = if saved { "saved" } else { "nothing but the start document could be saved" };
    let mut text = format!("{}: {what}", arguments.out.display());
    let mut whole = true;
    for (number, loss) in (1..).zip(&recovery.segments) {
        whole &= loss.is_none();
        let saved: u64 = loss.saved.values().sum();
        let lost: u64 = loss.lost.values().sum();
        let end = if loss.end_is_known { "" } else { "; what came after the last message is not known" };
        let _ = write!(
            text,
            "\nfile {number}: {saved} messages and {} force records saved; {lost} messages and {} force records known to be lost, \
             {} bytes unreadable, {:.3} s of damage between{end}",
            loss.saved_force_records, loss.lost_force_records, loss.bytes, loss.lost_s
        );
    }
    let exit = if whole { Exit::Good } else { Exit::Degraded };
    Ok(Outcome { exit, text, json: json!({"format": "phantom-recovery/1", "segments": recovery.segments}) })
}

fn export(arguments: &ExportArguments, context: &Context) -> anyhow::Result<Outcome> {
    let session = Session::open(&arguments.path.session)?;
    let mut sessions = vec![session.clone()];
    for folder in &arguments.more {
        sessions.push(Session::open(folder)?);
    }
    let mut told = Vec::new();
    let mut remarks = Vec::new();
    let mut lags_s = Vec::new();
    let mut calibration = Vec::new();
    if let Some(folder) = &arguments.csv {
        let staged = StagedFolder::new(folder, Kind::Tables, arguments.force)?;
        let files = session.export_csv(staged.path())?.len();
        staged.finish()?;
        told.push(format!("{}: {files} tables", folder.display()));
    }
    let mut pokes = None;
    if let Some(folder) = &arguments.bundle {
        let mesh = arguments.mesh.clone().unwrap_or_else(|| session.folder().join(MESH));
        if !mesh.exists() {
            bail!("{}: the session keeps no mesh; name one with --mesh", mesh.display());
        }
        let mesh = read_mesh(&mesh)?;
        let from = read_seen_sessions(&seen(&sessions, &mesh, context)?, mesh).map_err(|error| {
            let error = anyhow::Error::new(error);
            // Where a part cannot be read, what is missing may lie there.
            match sessions.iter().find(|s| s.info().is_ok_and(|info| info.unreadable_bytes > 0)) {
                Some(damaged) => anyhow!("{error:#}\n{}", rescued(damaged.folder())),
                None => error,
            }
        })?;
        let staged = StagedFolder::new(folder, Kind::Recording, arguments.force)?;
        write_bundle(&from.recording, staged.path()).context("the bundle")?;
        if let Some(document) = &session.start().calibration {
            let kept = staged.path().join(CALIBRATION);
            std::fs::write(&kept, &document.set.text)
                .with_context(|| format!("{}: can't be written", kept.display()))?;
        }
        staged.finish()?;
        told.push(format!("{}: {}", folder.display(), counted(from.recording.pokes.len(), "poke", "pokes")));
        pokes = Some(from.recording.pokes.len());
        remarks = from.remarks;
        lags_s = from.camera_lags.iter().map(|lag| lag.map(|l| [l.lag_s, l.sd_s])).collect();
        calibration = from.calibration;
        told.extend(calibration.iter().cloned());
        told.extend(from.camera_lags.iter().flatten().map(late));
    }
    told.extend(remarks.iter().map(|r| format!("note: {r}")));
    Ok(Outcome {
        exit: if remarks.is_empty() { Exit::Good } else { Exit::Degraded },
        text: told.join("\n"),
        json: json!({
            "format": "phantom-session-export/1",
            "bundle": arguments.bundle,
            "csv": arguments.csv,
            "pokes": pokes,
            "camera_lags_s": lags_s,
            "calibration": calibration,
            "remarks": remarks,
        }),
    })
}
