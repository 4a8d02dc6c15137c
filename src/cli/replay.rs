//! `replay`: a session's devices again, as they were, recorded anew.

use super::recorded_run::MESH;
use super::{Exit, Outcome, StagedSession, UsageError};
use crate::acquire::record_pictures;
use crate::clock::HostTime;
use crate::device::{ForceSensor, MarkerSource, Stage};
use crate::session::{Message, Replay, Session, SessionWriter, Speed, Topic};
use anyhow::Context as _;
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Feeds what a session recorded through the devices' own interfaces, and records it anew.
///
/// What comes out is what went in: exported as tables, the two sessions are the same byte for byte. Says where that is not so. The new
/// session appears when it is complete; a replay that is interrupted leaves none.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  phantom-rig replay sessions/monday --out sessions/monday-again
  phantom-rig replay sessions/monday --speed 4 --out sessions/monday-again")]
pub(super) struct ReplayArguments {
    /// The session's folder
    #[arg(value_name = "SESSION")]
    session: PathBuf,
    /// So many times as fast as it was recorded; by default as fast as it can be read
    #[arg(long, value_name = "TIMES", allow_negative_numbers = true)]
    speed: Option<f64>,
    /// The new session: a folder that does not exist yet
    #[arg(long, value_name = "SESSION")]
    out: PathBuf,
}

/// How long one wait for a device may take.
const WAIT: Duration = Duration::from_millis(50);

pub(super) fn run(arguments: &ReplayArguments) -> anyhow::Result<Outcome> {
    let session = Session::open(&arguments.session)?;
    let speed = arguments.speed.map_or(Speed::AsFastAsPossible, Speed::Times);
    if let Some(times) = arguments.speed.filter(|s| !(*s > 0.0 && s.is_finite())) {
        return Err(UsageError(format!("--speed takes a number above 0, got {times}")).into());
    }
    let staged = StagedSession::new(&arguments.out)?;
    for (number, part) in session.parts().iter().enumerate() {
        let writer = if number == 0 {
            let writer = SessionWriter::create(staged.path(), part.start().clone())?;
            copy_mesh(&arguments.session, staged.path())?;
            writer
        } else {
            SessionWriter::continue_session(staged.path(), part.start().clone())?
        };
        let losses = replay(part, speed, &writer)?;
        // What no device says is taken over as it is.
        let mut recorder = writer.recorder().patient();
        for recorded in part.messages(&[Topic::Event, Topic::ClockProbe]) {
            match recorded?.message {
                Message::Event(event) => recorder.event(event),
                Message::ClockProbe(probe) => recorder.clock_probe(probe),
                _ => true,
            };
        }
        drop(recorder);
        // A part that was interrupted has no end here either.
        if let Some(stop) = part.stop() {
            writer.finish(stop.outcome.clone(), losses, HostTime::from_nanos(stop.stopped_host_ns))?;
        }
    }
    let again = Session::open(staged.path())?;
    let streams = [
        Topic::Force,
        Topic::Stage,
        Topic::Markers,
        Topic::Frame,
        Topic::Grey,
        Topic::Depth,
        Topic::Event,
        Topic::ClockProbe,
    ];
    let differing: Vec<&str> =
        streams.into_iter().filter(|&topic| !same(&session, &again, topic)).map(Topic::name).collect();
    let name = arguments.out.display();
    let text = if differing.is_empty() {
        let info = again.info()?;
        let records = |topic: Topic| info.topics.get(&topic).map_or(0, |extent| extent.records);
        let pictures = match records(Topic::Frame) {
            0 => String::new(),
            frames => format!(" and {frames} with pictures"),
        };
        format!(
            "{name}: {} force records, {} reports of the stage, {} frames of markers{pictures}, the same one by one",
            records(Topic::Force),
            records(Topic::Stage),
            records(Topic::Markers)
        )
    } else {
        format!("{name}: {} differ from what was recorded", differing.join(", "))
    };
    staged.finish()?;
    Ok(Outcome {
        exit: if differing.is_empty() { Exit::Good } else { Exit::Degraded },
        text,
        json: json!({"format": "phantom-replay/1", "session": arguments.out, "differing": differing}),
    })
}

fn copy_mesh(from: &Path, to: &Path) -> anyhow::Result<()> {
    let mesh = from.join(MESH);
    if mesh.exists() {
        std::fs::copy(&mesh, to.join(MESH))
            .with_context(|| format!("{}: can't be copied", mesh.display()))?;
    }
    Ok(())
}

/// Lets the three devices run side by side until nothing is left.
fn replay(session: &Session, speed: Speed, writer: &SessionWriter) -> anyhow::Result<crate::device::Losses> {
    let replay = Replay::new(session, speed)?;
    let document = session.start();
    let mut stage = document.stage.is_some().then(|| replay.stage()).transpose()?;
    let mut force = document.force.is_some().then(|| replay.force()).transpose()?;
    let mut markers = document.markers.is_some().then(|| replay.markers()).transpose()?;
    // All are in use before the first is asked, so that they keep in step.
    if let Some(force) = &mut force {
        force.start()?;
    }
    std::thread::scope(|scope| {
        let staged = stage.as_mut().map(|device| {
            let mut recorder = writer.recorder().patient();
            scope.spawn(move || -> anyhow::Result<()> {
                while !device.is_over() {
                    if let Some(report) = device.report(HostTime::now() + WAIT)? {
                        recorder.stage(report);
                    }
                }
                Ok(())
            })
        });
        let framed = markers.as_mut().map(|device| {
            let mut recorder = writer.recorder().patient();
            scope.spawn(move || -> anyhow::Result<()> {
                while !device.is_over() {
                    if let Some(frame) = device.frame(HostTime::now() + WAIT)? {
                        recorder.markers(frame);
                    }
                    if let Some(pictures) = device.pictures() {
                        record_pictures(&pictures, &mut recorder);
                    }
                }
                Ok(())
            })
        });
        let mut losses = crate::device::Losses::default();
        if let Some(device) = &mut force {
            let mut recorder = writer.recorder().patient();
            let mut records = Vec::with_capacity(4096);
            while !device.is_over() {
                records.clear();
                device.receive(HostTime::now() + WAIT, &mut records)?;
                if let Some(last) = records.last() {
                    recorder.force(&records, last.host);
                }
            }
            device.stop()?;
            losses = device.losses();
        }
        for thread in [staged, framed].into_iter().flatten() {
            thread.join().map_err(|_| anyhow::anyhow!("a replayed device gave up"))??;
        }
        Ok(losses)
    })
}

/// Whether two sessions hold the same of a topic: the same messages; of force the same records, whatever batches they came in.
fn same(one: &Session, other: &Session, topic: Topic) -> bool {
    if topic == Topic::Force {
        let (mut a, mut b) = (one.force(), other.force());
        return loop {
            match (a.next(), b.next()) {
                (None, None) => break true,
                (Some(Ok(a)), Some(Ok(b))) if a == b => {}
                _ => break false,
            }
        };
    }
    let (mut a, mut b) = (one.messages(&[topic]), other.messages(&[topic]));
    loop {
        match (a.next(), b.next()) {
            (None, None) => return true,
            (Some(Ok(a)), Some(Ok(b))) if a.message == b.message => {}
            _ => return false,
        }
    }
}
