//! `session`: what is in a session, whether all of it is there, and what can be saved of a damaged one. Its data as tables or as a recording
//! bundle: `session_export`; one of its pictures: `session_frame`.

use super::run_protocol::finished_pokes;
use super::session_export::{ExportArguments, export};
use super::session_frame::{FrameArguments, frame};
use super::{Context, Exit, Outcome, StagedSession};
use crate::session::{Finding, Info, Outcome as SessionOutcome, Session, recover};
use crate::units::counted;
use anyhow::anyhow;
use clap::{Args, Subcommand};
use serde_json::json;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// What may be done with a session.
#[derive(Debug, Subcommand)]
pub(super) enum SessionAction {
    /// Says what is in a session
    #[command(after_help = "Examples:
  phantom-rig session info sessions/monday
  phantom-rig session info sessions/monday --json

Exit code 3: a session that was stopped or interrupted, or of which a part can't be read.")]
    Info(SessionPath),
    /// Checks everything that a session says of itself: checksums, counters, times, counts; exit code 3 where something is missing
    #[command(after_help = "Examples:
  phantom-rig session verify sessions/monday
  phantom-rig session verify sessions/monday --json")]
    Verify(SessionPath),
    /// Saves what is readable of a damaged session into a new one, and says what is lost; exit code 3 where something is
    #[command(after_help = "Examples:
  phantom-rig session recover sessions/monday --out sessions/monday-recovered
  phantom-rig session recover sessions/monday --out sessions/monday-recovered --json")]
    Recover(RecoverArguments),
    /// Writes a session's data as tables (CSV) or as a recording bundle to be fitted
    #[command(after_help = "Examples:
  phantom-rig session export sessions/monday --bundle sessions/monday-bundle
  phantom-rig session export sessions/monday --csv sessions/monday-tables
  phantom-rig session export sessions/monday --bundle sessions/monday-bundle --registration rigs/registration.toml
  phantom-rig session export sessions/monday sessions/tuesday --bundle sessions/both

Exit code 3: something is missing in the session, was left out of the bundle or is doubtful; it is listed.")]
    Export(ExportArguments),
    /// Writes one picture of the camera as a PNG, without loss
    #[command(after_help = "Examples:
  phantom-rig session frame sessions/monday --at 12.5 --out monday.png
  phantom-rig session frame sessions/monday --number 370 --stream depth --out monday-depth.png

The strip of `track` says time and number of each of its pictures. A picture that is not there is not replaced by another: which frame
is the nearest is said.")]
    Frame(FrameArguments),
}

/// A session.
#[derive(Debug, Args)]
pub(super) struct SessionPath {
    /// The session's folder
    #[arg(value_name = "SESSION")]
    pub(super) session: PathBuf,
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

pub(super) fn run(action: &SessionAction, context: &Context) -> anyhow::Result<Outcome> {
    match action {
        SessionAction::Info(path) => info(path),
        SessionAction::Verify(path) => verify(path),
        SessionAction::Recover(arguments) => rescue(arguments),
        SessionAction::Export(arguments) => export(arguments, context),
        SessionAction::Frame(arguments) => frame(arguments),
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
    if !whole && holds_anything(&info) {
        let _ = write!(text, "\n{}", rescued(&path.session));
    }
    let sound = whole && matches!(info.outcome, Some(SessionOutcome::Success));
    Ok(Outcome { exit: if sound { Exit::Good } else { Exit::Degraded }, text, json })
}

/// Whether anything of a session can be read.
fn holds_anything(info: &Info) -> bool {
    info.topics.values().any(|extent| extent.messages > 0)
}

/// What is missing in whatever is made of a session, because it is missing there; nothing where the session is whole.
pub(super) fn lacks(session: &Session) -> anyhow::Result<Option<String>> {
    let (name, info) = (session.folder().display(), session.info()?);
    let mut lost = Vec::new();
    if info.outcome.is_none() {
        lost.push("it has no end, its recording was cut off".to_owned());
    }
    if info.unreadable_bytes > 0 {
        lost.push(format!("{} bytes of it can't be read", info.unreadable_bytes));
    }
    let says = || {
        format!(
            "{name}: {}: what is missing there is missing here; `phantom-rig session recover {name} --out {name}-recovered` says how \
             much that is",
            lost.join(", and ")
        )
    };
    Ok((!lost.is_empty()).then(says))
}

/// Where a part of a session cannot be read, what an error finds missing may lie there.
pub(super) fn and_damage(error: anyhow::Error, sessions: &[Session]) -> anyhow::Error {
    let damaged = |info: &Info| info.unreadable_bytes > 0 && holds_anything(info);
    match sessions.iter().find(|session| session.info().is_ok_and(|info| damaged(&info))) {
        Some(session) => anyhow!("{error:#}\n{}", rescued(session.folder())),
        None => error,
    }
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
        let empty = findings.iter().filter(|f| matches!(f, Finding::Empty { .. })).count();
        let next = if empty == session.segments() as usize {
            "\nNothing of what was recorded is left; there is nothing to recover".to_owned()
        } else if damaged {
            format!("\n{}", rescued(&path.session))
        } else {
            String::new()
        };
        format!("{name}:\n  {}{next}", told.join("\n  "))
    };
    Ok(Outcome {
        exit: if told.is_empty() { Exit::Good } else { Exit::Degraded },
        text,
        json: json!({"format": "phantom-session-check/1", "findings": told}),
    })
}

fn rescue(arguments: &RecoverArguments) -> anyhow::Result<Outcome> {
    let staged = StagedSession::new(&arguments.out)?;
    let recovery = recover(&arguments.path.session, staged.path())?;
    staged.finish()?;
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
