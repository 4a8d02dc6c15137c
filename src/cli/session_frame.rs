//! `session frame`: one picture out of a session, as it was recorded.

use super::session::{SessionPath, and_damage};
use super::{Exit, Outcome, StagedFile, UsageError};
use crate::session::{FrameAsked, OnePicture, Session, Stream};
use anyhow::{Context as _, bail};
use clap::{Args, ValueEnum};
use serde_json::json;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Which picture is to be written where.
#[derive(Debug, Args)]
pub(super) struct FrameArguments {
    #[command(flatten)]
    path: SessionPath,
    /// The frame nearest to this time since the session began, or its segment (s)
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    #[arg(required_unless_present = "number", conflicts_with = "number")]
    at: Option<f64>,
    /// The frame with this number
    #[arg(long, value_name = "N")]
    number: Option<u32>,
    /// Which of its pictures: grey levels of 8 bits, or depths of 16
    #[arg(long, value_name = "STREAM", default_value = "grey")]
    stream: StreamArgument,
    /// Of a session that went on after an interruption: which stretch, from 1; each has times and numbers of its own
    #[arg(long, value_name = "N")]
    segment: Option<usize>,
    /// The file; its name ends in .png
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Replace whatever is there
    #[arg(long)]
    force: bool,
}

/// Which of a frame's pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum StreamArgument {
    Grey,
    Depth,
}

pub(super) fn frame(arguments: &FrameArguments) -> anyhow::Result<Outcome> {
    let asked = asked(arguments)?;
    is_png(&arguments.out)?;
    let session = Session::open(&arguments.path.session)?;
    let (segment, part) = part(&session, arguments.segment)?;
    let Some(camera) = &part.start().camera else {
        bail!("{}: it has no pictures: its rig had no camera", session.folder().display());
    };
    let staged = StagedFile::new(&arguments.out, arguments.force)?;
    let stream = match arguments.stream {
        StreamArgument::Grey => Stream::Grey,
        StreamArgument::Depth => Stream::Depth,
    };
    let found =
        part.picture(asked, stream).map_err(|error| and_damage(error.into(), std::slice::from_ref(&part)))?;
    std::fs::write(staged.path(), &found.picture.png)
        .with_context(|| format!("{}: can't be written", arguments.out.display()))?;
    staged.finish()?;
    let OnePicture { frame, stamp, size_px: [width, height], .. } = found;
    let metres_per_unit = (stream == Stream::Depth).then_some(camera.metres_per_unit);
    let mut text = format!("{}: {stream} picture of {stamp}", arguments.out.display());
    if session.segments() > 1 {
        let _ = write!(text, " of segment {segment}");
    }
    let _ = write!(text, ", {width} × {height} px, {} bits", stream.bits());
    if let Some(unit_m) = metres_per_unit {
        let _ = write!(text, ", one count is {} mm", (1e9 * unit_m).round() / 1e6);
    }
    let json = json!({
        "format": "phantom-session-frame/1",
        "out": arguments.out,
        "segment": segment,
        "number": stamp.number,
        "time_s": stamp.time_s,
        "host_ns": frame.host.nanos(),
        "device_s": frame.device_s,
        "stream": stream.to_string(),
        "size_px": [width, height],
        "bits": stream.bits(),
        "metres_per_unit": metres_per_unit,
    });
    Ok(Outcome { exit: Exit::Good, text, json })
}

/// The frame that was typed.
fn asked(arguments: &FrameArguments) -> Result<FrameAsked, UsageError> {
    match (arguments.at, arguments.number) {
        (Some(time_s), _) if time_s.is_finite() => Ok(FrameAsked::At(time_s)),
        (Some(time_s), _) => Err(UsageError(format!("--at {time_s}: expected a time in seconds"))),
        (None, Some(number)) => Ok(FrameAsked::Number(number)),
        (None, None) => Err(UsageError("say which frame by --at or --number".to_owned())),
    }
}

/// Refuses a name that says that the file is something else.
fn is_png(out: &Path) -> Result<(), UsageError> {
    if out.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("png")) {
        return Ok(());
    }
    Err(UsageError(format!(
        "--out {}: the picture is a PNG; expected a name that ends in .png",
        out.display()
    )))
}

/// The stretch that was typed, or the only one.
fn part(session: &Session, asked: Option<usize>) -> Result<(usize, Session), UsageError> {
    let mut parts = session.parts();
    let count = parts.len();
    match asked {
        None if count == 1 => Ok((1, parts.remove(0))),
        None => Err(UsageError(format!(
            "{}: it has {count} segments, each with times and numbers of its own: say which by --segment 1 to {count}",
            session.folder().display()
        ))),
        Some(segment) if (1..=count).contains(&segment) => Ok((segment, parts.remove(segment - 1))),
        Some(segment) => Err(UsageError(format!("--segment {segment}: the last is {count}"))),
    }
}
