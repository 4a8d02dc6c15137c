//! `run`: a protocol carried out on a rig, watched, and recorded as a session.

use super::planned::PlannedArguments;
use super::recorded_run::{How, RecordedRun, passed_s, record, told, whereabouts};
use super::run_watch::Watch;
use super::{Context, Exit, Outcome, UsageError};
use crate::acquire::CheckedPlan;
use crate::device::Losses;
use crate::session::{Outcome as SessionOutcome, Session, StopDocument, Topic, utc_text};
use crate::units::counted;
use anyhow::bail;
use clap::Args;
use serde_json::json;
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Carries a protocol out on a rig and records everything that the devices say.
///
/// Checks the whole plan first, then the devices; homes the stage if it has not homed; reads the force sensor with nothing at the tip,
/// and takes that for the zero of its limits. While it runs, the force is watched on every single record: whatever goes wrong stops the
/// stage, is told, and is put down. Space, q or Ctrl-C stop it too. This program is no emergency stop: see the README on safety.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  phantom-rig run rigs/protocols/five-pokes.toml --rig rigs/sim.toml --yes
  phantom-rig run rigs/protocols/five-pokes.toml --rig rigs/sim.toml --out sessions/monday --from 3
  phantom-rig run rigs/protocols/five-pokes.toml --rig rigs/sim.toml --out sessions/monday --resume")]
pub(super) struct RunArguments {
    #[command(flatten)]
    planned: PlannedArguments,
    /// Where the session goes: a folder that does not exist yet; by default sessions/DATE-PROTOCOL
    #[arg(long, value_name = "SESSION")]
    out: Option<PathBuf>,
    /// Go on with a session that was interrupted or stopped, at the first poke that it did not finish
    #[arg(long, requires = "out", conflicts_with = "from")]
    resume: bool,
    /// Agree to every question of the protocol beforehand
    #[arg(long)]
    yes: bool,
    /// Clear a fault that the stage has latched: somebody has looked at the bench
    #[arg(long)]
    clear: bool,
    /// Have the force sensor take its reading for zero first, with nothing at the tip; what it read before is gone
    #[arg(long)]
    bias: bool,
    /// Print lines instead of a screen
    #[arg(long)]
    lines: bool,
    /// Write what the camera sees into SESSION-live.png every second, with rings around the dots; on the screen p writes one
    #[arg(long)]
    live: bool,
}

pub(super) fn run(arguments: &RunArguments, context: &Context) -> anyhow::Result<Outcome> {
    let mut planned = arguments.planned.read()?;
    let before = arguments.out.as_ref().filter(|_| arguments.resume).map(Session::open).transpose()?;
    if let Some(session) = &before {
        let folder = session.folder();
        if session.stop().is_some_and(|stop| stop.outcome == SessionOutcome::Success) {
            bail!("{}: the session came to its end; nothing is left to go on with", folder.display());
        }
        planned.same_as(session)?;
        planned.go_on_from(first_unfinished(session))?;
    }
    let watch = Watch::choose(context, arguments.lines);
    if planned.asks() && !arguments.yes && watch != Watch::Screen {
        return Err(UsageError(
            "the protocol asks questions and nobody is there to answer; pass --yes".to_owned(),
        )
        .into());
    }
    // Once without devices: what speaks against the plan is known before anything is opened.
    let plan = planned.plan([0.0, 0.0]).checked()?;
    for doubt in plan.plan().doubts().iter().filter(|_| context.shows) {
        eprintln!("  note: {doubt}");
    }
    let folder = match &arguments.out {
        Some(folder) => folder.clone(),
        None => default_folder(planned.protocol.name()),
    };
    if !arguments.resume && folder.exists() {
        bail!("{}: is there already; name a folder that is not, or pass --resume", folder.display());
    }
    let how = How {
        watch,
        yes: arguments.yes,
        clear: arguments.clear,
        bias: arguments.bias,
        at_rest_s: before.as_ref().map_or(0.0, |session| passed_s(session.start())),
        live: arguments.live,
    };
    let runs = before.as_ref().map_or(0, Session::segments);
    let bench = planned.rig.simulated(&planned.pokes())?.map(|bench| bench.later(runs.into()));
    let recorded = record(&planned, bench, &folder, arguments.resume, how, context)?;
    Ok(said(&folder, &recorded))
}

/// The pokes of its protocol that a session has finished, as far as it can be read.
pub(super) fn finished_pokes(session: &Session) -> BTreeSet<u32> {
    let ends = session.events().flatten().filter(|event| event.name == "stroke-end");
    ends.filter_map(|event| event.poke).collect()
}

/// The first poke that an interrupted session did not finish.
fn first_unfinished(session: &Session) -> u32 {
    finished_pokes(session).last().map_or(1, |last| last + 1)
}

fn default_folder(protocol: &str) -> PathBuf {
    let word: String = protocol.chars().map(|c| if c.is_alphanumeric() { c } else { '-' }).collect();
    let stamp = utc_text(SystemTime::now()).replace(':', "");
    Path::new("sessions")
        .join(format!("{}-{word}", stamp.split('.').next().unwrap_or(&stamp).trim_end_matches('Z')))
}

/// What was recorded, and what was not.
fn counts(losses: &Losses, stop: &StopDocument) -> String {
    let mut text = format!(
        "{} force records, {} lost, {} not recorded",
        stop.force_records,
        losses.lost + losses.malformed,
        stop.dropped.values().sum::<u64>()
    );
    let of = |topic: Topic| stop.messages.get(topic.name()).copied().unwrap_or(0);
    let others = [
        (of(Topic::Stage), "reports of the stage"),
        (of(Topic::Markers), "frames of markers"),
        (of(Topic::Frame), "frames with pictures"),
    ];
    for (count, what) in others.into_iter().filter(|(count, _)| *count > 0) {
        let _ = write!(text, "; {count} {what}");
    }
    for (topic, count) in &stop.dropped {
        let _ = write!(text, "; {count} of {topic} were not recorded");
    }
    text
}

/// What a run has to say.
pub(super) fn said(folder: &Path, recorded: &RecordedRun) -> Outcome {
    let RecordedRun { ran, stop, .. } = recorded;
    let plan = ran.plan.as_ref().map(CheckedPlan::plan);
    let (pokes, steps) = plan.map_or((0, 0), |plan| (plan.pokes(), plan.steps.len()));
    let lost = ran.losses.lost + ran.losses.malformed + stop.dropped.values().sum::<u64>();
    let records = counts(&ran.losses, stop);
    let (exit, first) = match &ran.stopped {
        Some(stopped) => {
            let sent = stopped.tripped.sent.map(|s| s.since(stopped.tripped.seen).as_secs_f64() * 1e3);
            let sent = sent.map_or("the stop could not be sent".to_owned(), |ms| {
                format!("the stop was on its way after {ms:.2} ms")
            });
            let text = format!(
                "stopped after {} of {steps} steps: {}\n{sent}; {}\n\
                 the stage stays latched: look at the bench, then go on with the same command and \
                 --out {} --resume --clear",
                ran.steps,
                told(stopped, ran),
                whereabouts(stopped),
                folder.display()
            );
            (Exit::Failed, text)
        }
        None if lost > 0 => {
            (Exit::Degraded, format!("{}; something was lost", counted(pokes, "poke", "pokes")))
        }
        None => (Exit::Good, counted(pokes, "poke", "pokes")),
    };
    let name = folder.display();
    let poked = Session::open(folder).is_ok_and(|session| !finished_pokes(&session).is_empty());
    let next = if poked {
        format!("session export {name} --bundle {name}-bundle")
    } else {
        format!("session info {name} (no poke was finished: there is nothing to be fitted yet)")
    };
    Outcome {
        exit,
        text: format!("{first}\n{records}\nSession: {name}\nNext: phantom-rig {next}"),
        json: json!({
            "format": "phantom-run/1",
            "session": folder,
            "pokes": pokes,
            "steps_done": ran.steps,
            "stopped": ran.stopped.as_ref().map(|stopped| json!({
                "cause": told(stopped, ran),
                "stop_bytes_after_s": stopped.tripped.sent.map(|s| s.since(stopped.tripped.seen).as_secs_f64()),
                "overshoot_m": stopped.overshoot_m,
                "peak_n": stopped.peak_n,
                "stands": stopped.stands,
                "retracted": stopped.retracted,
            })),
            "force_records": stop.force_records,
            "lost": ran.losses.lost,
            "duplicated": ran.losses.duplicated,
            "reordered": ran.losses.reordered,
            "malformed": ran.losses.malformed,
            "dropped": stop.dropped,
            "messages": stop.messages,
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_and_frames_are_counted_and_what_was_dropped_is_named() {
        let counted = |of: &[(Topic, u64)]| of.iter().map(|(t, n)| (t.name().to_owned(), *n)).collect();
        let mut stop = StopDocument {
            outcome: SessionOutcome::Success,
            stopped_host_ns: 1,
            messages: counted(&[(Topic::Force, 9), (Topic::Stage, 50), (Topic::Frame, 28)]),
            force_records: 7000,
            dropped: counted(&[]),
            sensor: Losses::default().into(),
        };
        let losses = Losses { lost: 2, malformed: 1, ..Losses::default() };
        let text = counts(&losses, &stop);
        assert_eq!(
            text,
            "7000 force records, 3 lost, 0 not recorded; 50 reports of the stage; 28 frames with pictures"
        );
        stop.dropped = counted(&[(Topic::Grey, 4)]);
        let text = counts(&losses, &stop);
        assert!(
            text.contains(", 4 not recorded;") && text.ends_with("; 4 of /camera/grey were not recorded"),
            "{text}"
        );
    }
}
