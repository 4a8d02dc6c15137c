//! `track`: the dots in the pictures of a session, frame by frame, and pictures to look at.

use super::look::{Looked, ON_SURFACE_M, fiducials, look, missing, registration};
use super::recorded_run::MESH;
use super::seen_dots::{LEGEND, caption, marked};
use super::{Context, Exit, Kind, Outcome, StagedFolder};
use crate::clock::HostTime;
use crate::dataset::{Attached, FollowedFrame, attach_dots, read_phantom};
use crate::device::{DotInPicture, Sight};
use crate::report::{MarkedPicture, strip};
use crate::session::{Picture, Pixels, Session};
use crate::track::{Dot, Settings};
use anyhow::{Context as _, bail};
use clap::Args;
use serde_json::json;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

/// Follows the dots through the pictures of a session: 3-D paths in the phantom frame, how sure they are, and pictures to look at.
///
/// Writes markers.csv (paths), dots.csv (each dot: how often it was seen, how much it scatters at rest), overlay.png (what the tracker saw at
/// six times: seconds since the session began, the numbers of the dots, how sure they are) and track.json. A dot that is not certain is a
/// gap. `session export --bundle` does the same by itself.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  phantom-rig track sessions/monday --out sessions/monday-tracked
  phantom-rig track sessions/monday --out sessions/monday-tracked --registration rigs/registration.toml")]
pub(super) struct TrackArguments {
    /// The session's folder
    #[arg(value_name = "SESSION")]
    session: PathBuf,
    /// Where the results go; an earlier result there is replaced
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Where the camera stood, in place of what the session says
    #[arg(long, value_name = "FILE")]
    registration: Option<PathBuf>,
    /// Replace whatever is there
    #[arg(long)]
    force: bool,
}

/// Pictures in the strip.
const STRIP: usize = 6;
/// Fewer of the dots seen than this share are worth a word.
const SEEN: f64 = 0.9;
/// So are dots that were not there at rest in more than this share of the frames.
const OTHERS: f64 = 0.05;

pub(super) fn run(arguments: &TrackArguments, context: &Context) -> anyhow::Result<Outcome> {
    let session = Session::open(&arguments.session)?;
    let name = arguments.session.display();
    let Some(camera) = &session.start().camera else {
        bail!("{name}: it has no pictures: its rig had no camera");
    };
    let registration = registration(camera, arguments.registration.as_deref())?;
    let mesh = read_phantom(&arguments.session.join(MESH))?;
    let staged = StagedFolder::new(&arguments.out, Kind::Tracks, arguments.force)?;
    let looked =
        look(&session, Settings::default(), context)?.with_context(|| format!("{name}: no pictures"))?;
    let attached = attach_dots(
        &looked.followed,
        &looked.resting,
        &registration,
        &mesh,
        &fiducials(camera),
        ON_SURFACE_M,
    );
    write(&staged.path().join("markers.csv"), &paths(&attached))?;
    write(&staged.path().join("dots.csv"), &dots(&looked, &attached))?;
    fs::write(staged.path().join("overlay.png"), overlay(&session, &looked)?).context("the picture strip")?;
    let counts = &looked.followed.counts;
    let total = counts.seen + counts.unseen.values().sum::<u64>();
    let share = counts.seen as f64 / (total as f64).max(1.0);
    let hidden = looked.followed.hidden_at_first;
    let with_others = looked.followed.frames.iter().filter(|f| f.others > 0).count();
    let others_share = with_others as f64 / (looked.followed.frames.len() as f64).max(1.0);
    let most_others = looked.followed.frames.iter().map(|f| f.others).max().unwrap_or(0);
    let rest = rest_scatter_m(&looked, &attached);
    let json = json!({
        "format": "phantom-track/1",
        "out": arguments.out,
        "frames": counts.frames,
        "lost_frames": counts.lost_frames,
        "missing_on_beat": counts.missing_on_beat,
        "incomplete_frames": counts.incomplete,
        "dots": looked.followed.reference.len(),
        "hidden_at_first": hidden,
        "markers": attached.markers.len(),
        "elsewhere": attached.elsewhere,
        "seen_share": share,
        "unseen": counts.unseen,
        "other_dots": { "frames_share": others_share, "most": most_others },
        "rest_scatter_m": rest,
        "largest_standoff_m": attached.standoff_m.iter().copied().fold(0.0, f64::max),
    });
    write(&staged.path().join("track.json"), &format!("{json:#}\n"))?;
    staged.finish()?;
    let mut text = format!(
        "{} frames, {} lost, {} incomplete; {} dots, {} of them markers on the phantom\n\
         seen with their place in {:.1} % of all frames; at rest they scatter by {:.3} mm across and {:.3} mm along the view",
        counts.frames,
        counts.lost_frames,
        counts.incomplete,
        looked.followed.reference.len(),
        attached.markers.len(),
        1e2 * share,
        rest[0] * 1e3,
        rest[1] * 1e3
    );
    for (why, count) in &counts.unseen {
        let _ = write!(text, "\n  not: {why}: {:.2} %", 1e2 * *count as f64 / total as f64);
    }
    if let Some(said) = missing(counts.missing_on_beat) {
        let _ = write!(text, "\n{said}");
    }
    if hidden > 0 {
        let _ = write!(
            text,
            "\n{hidden} of the dots were hidden in the first picture at rest, and seen in others of that time"
        );
    }
    if others_share > OTHERS {
        let _ = write!(
            text,
            "\nin {:.0} % of the frames there are dots that were not seen at rest ({most_others} at most): hidden then, or glints. \
             They are not followed",
            1e2 * others_share
        );
    }
    let _ = write!(text, "\nLook at {}", arguments.out.join("overlay.png").display());
    let good = share >= SEEN && counts.incomplete == 0 && !attached.markers.is_empty();
    Ok(Outcome { exit: if good { Exit::Good } else { Exit::Degraded }, text, json })
}

fn write(file: &Path, text: &str) -> anyhow::Result<()> {
    fs::write(file, text).with_context(|| format!("{}: can't be written", file.display()))
}

fn paths(attached: &Attached) -> String {
    let mut text = "segment,host_time,frame,marker,x,y,z\n1,ns,1,1,m,m,m\n".to_owned();
    for (segment, frames) in (1..).zip(&attached.segments) {
        for frame in frames {
            for marker in &frame.markers {
                let [x, y, z] = marker.position_m;
                let (host, number, marker) = (frame.host.nanos(), frame.number, marker.marker);
                let _ = writeln!(text, "{segment},{host},{number},{marker},{x:.7},{y:.7},{z:.7}");
            }
        }
    }
    text
}

fn dots(looked: &Looked, attached: &Attached) -> String {
    let mut text = "dot,column,row,radius,is_marker,standoff,frames_seen,scatter_x,scatter_y,scatter_z,expected_x,expected_y,expected_z\n\
                    1,px,px,px,-,m,1,m,m,m,m,m,m\n"
        .to_owned();
    for (number, dot) in looked.followed.reference.iter().enumerate() {
        let marker = attached.markers.iter().position(|m| *m == number);
        let standoff = marker.map_or(String::new(), |m| format!("{:.6}", attached.standoff_m[m]));
        let frames = looked.followed.frames.iter().filter(|f| f.places[number].is_some()).count();
        let resting = looked.resting.iter().find(|r| r.dot == number);
        let spreads = resting.map_or(",,,,,".to_owned(), |r| {
            let one = r.frames as f64;
            let scatter = (0..3).map(|a| (r.covariance_m2[(a, a)] * one).sqrt());
            let expected = (0..3).map(|a| r.expected_m2[(a, a)].sqrt());
            scatter.chain(expected).map(|s| format!("{s:.7}")).collect::<Vec<_>>().join(",")
        });
        let [x, y] = dot.centre_px;
        let radius = dot.radius_px();
        let _ = writeln!(
            text,
            "{number},{x:.3},{y:.3},{radius:.3},{},{standoff},{frames},{spreads}",
            marker.is_some()
        );
    }
    text
}

/// Root mean square scatter of a marker at rest across and along the camera's view (m).
fn rest_scatter_m(looked: &Looked, attached: &Attached) -> [f64; 2] {
    let markers = || looked.resting.iter().filter(|r| attached.markers.contains(&r.dot));
    let count = markers().count().max(1) as f64;
    let mean = |of: fn(&crate::geometry::Mat3) -> f64| {
        (markers().map(|r| of(&r.covariance_m2) * r.frames as f64).sum::<f64>() / count).sqrt()
    };
    [mean(|c| 0.5 * (c[(0, 0)] + c[(1, 1)])), mean(|c| c[(2, 2)])]
}

/// What the tracker saw at some times from the first to the last frame.
fn overlay(session: &Session, looked: &Looked) -> anyhow::Result<Vec<u8>> {
    let frames = &looked.followed.frames;
    let chosen: Vec<usize> = (0..STRIP).map(|i| i * frames.len().saturating_sub(1) / (STRIP - 1)).collect();
    let wanted: Vec<_> = chosen.iter().filter_map(|i| frames.get(*i)).collect();
    let began: Vec<HostTime> =
        session.parts().iter().map(|part| HostTime::from_nanos(part.start().started_host_ns)).collect();
    let mut pictures: Vec<(Pixels<u8>, Vec<DotInPicture>, String)> = Vec::new();
    for recorded in session.frames() {
        let recorded = recorded?;
        let Some(frame) =
            wanted.iter().find(|f| f.host == recorded.frame.host && f.segment == recorded.segment)
        else {
            continue;
        };
        let Some(picture) = recorded.grey.as_ref().and_then(Picture::grey) else { continue };
        let dots = shown(frame, &looked.followed.reference);
        let began = began.get(frame.segment as usize - 1).copied().unwrap_or(frame.host);
        let mut said = caption(frame.host.seconds_after(began), frame.number, &dots);
        if session.segments() > 1 {
            said = format!("segment {}, {said}", frame.segment);
        }
        pictures.push((picture, dots, said));
    }
    let marked = pictures.iter().map(|(picture, dots, said)| MarkedPicture {
        size_px: picture.size_px,
        levels: &picture.values,
        dots: marked(dots),
        caption: said.clone(),
    });
    Ok(strip(&marked.collect::<Vec<_>>(), &LEGEND)?)
}

/// All dots of a frame: those with a place, then the others.
fn shown(frame: &FollowedFrame, reference: &[Dot]) -> Vec<DotInPicture> {
    let placed = (0..).zip(&frame.places).zip(reference).filter_map(|((number, place), dot)| {
        Some(DotInPicture {
            number: Some(number),
            centre_px: place.as_ref()?.centre_px,
            radius_px: dot.radius_px(),
            sight: Sight::Certain,
        })
    });
    placed.chain(frame.unplaced.iter().copied()).collect()
}
