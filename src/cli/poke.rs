//! `poke`: more pokes for a session that was recorded, and all of it as one recording: what `diagnose --continue` has a rig do.

use super::planned::PlannedArguments;
use super::recorded_run::{How, MESH, passed_s, record, told};
use super::run_watch::Watch;
use super::{Context, Exit, Kind, Outcome, StagedFolder};
use crate::dataset::{FromSession, read_mesh, read_planned_pokes, read_sessions, write_bundle};
use crate::observation::{PlannedPoke, Poke, Recording};
use crate::report::write_pokes;
use crate::session::{Session, StartDocument};
use anyhow::{Context as _, bail};
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Makes more pokes after a session, on the rig that it was recorded on, and writes all of it as one recording.
///
/// The session stays as it is: the pokes become sessions of their own in SESSION-pokes. Of the table, those that were made already
/// are not made again.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  phantom-rig poke sessions/monday --rig rigs/sim.toml --pokes next-poke.csv --out monday-more
  phantom-rig diagnose monday-bundle --rig rigs/sim.toml --continue 'phantom-rig poke sessions/monday --rig rigs/sim.toml'")]
pub(super) struct PokeArguments {
    /// The session's folder
    #[arg(value_name = "SESSION")]
    session: PathBuf,
    /// The rig file that it was recorded with
    #[arg(long, value_name = "FILE")]
    rig: PathBuf,
    /// All pokes after those of the session: a table as `diagnose` writes it
    #[arg(long, value_name = "CSV")]
    pokes: PathBuf,
    /// The bundle to write
    #[arg(long, value_name = "BUNDLE")]
    out: PathBuf,
    /// Where the new sessions go; by default SESSION-pokes
    #[arg(long, value_name = "DIR")]
    into: Option<PathBuf>,
    /// Clear a fault that the stage has latched: somebody has looked at the bench
    #[arg(long)]
    clear: bool,
    /// Replace whatever is at BUNDLE
    #[arg(long)]
    force: bool,
}

/// A poke is the one asked for within this (m, and of a unit vector).
const SAME_PLACE_M: f64 = 1e-4;
const SAME_DIRECTION: f64 = 0.02;

pub(super) fn run(arguments: &PokeArguments, context: &Context) -> anyhow::Result<Outcome> {
    let asked = read_planned_pokes(&arguments.pokes)?;
    let first = Session::open(&arguments.session)?;
    let mesh_file = first.folder().join(MESH);
    let mesh = read_mesh(&mesh_file)
        .with_context(|| format!("{}: the session keeps no mesh", mesh_file.display()))?;
    let bundle = StagedFolder::new(&arguments.out, Kind::Recording, arguments.force)?;
    let into = arguments.into.clone().unwrap_or_else(|| beside(&arguments.session));
    let mut sessions = vec![first.clone()];
    for number in 1.. {
        let folder = into.join(format!("{number:02}"));
        if !folder.exists() {
            break;
        }
        sessions.push(Session::open(folder)?);
    }
    let before = read_sessions(&sessions[..1], mesh.clone())?.recording.pokes.len();
    let so_far = read_sessions(&sessions, mesh.clone())?.recording;
    let left = left_to_make(&asked, &so_far.pokes[before..], &into)?;
    if !left.is_empty() {
        let session = make(arguments, left, &so_far, &into, sessions.len(), first.start(), context)?;
        sessions.push(session);
    }
    let FromSession { recording, remarks, .. } = read_sessions(&sessions, mesh)?;
    write_bundle(&recording, bundle.path())?;
    bundle.finish()?;
    let pokes = recording.pokes.len();
    let mut text = format!("{}: {pokes} pokes, {} of them new", arguments.out.display(), left.len());
    for remark in &remarks {
        text.push_str(&format!("\nnote: {remark}"));
    }
    Ok(Outcome {
        exit: if remarks.is_empty() { Exit::Good } else { Exit::Degraded },
        text,
        json: json!({
            "format": "phantom-poke/1",
            "bundle": arguments.out,
            "pokes": pokes,
            "new": left.len(),
            "remarks": remarks,
        }),
    })
}

/// Of the pokes that are asked for, those that were not made yet. Those that were must be the first of them.
fn left_to_make<'a>(
    asked: &'a [PlannedPoke],
    made: &[Poke],
    into: &Path,
) -> anyhow::Result<&'a [PlannedPoke]> {
    let same = |(asked, made): (&PlannedPoke, &Poke)| {
        (asked.site - made.site).norm() <= SAME_PLACE_M
            && (asked.direction - made.direction).norm() <= SAME_DIRECTION
    };
    if made.len() > asked.len() || !asked.iter().zip(made).all(same) {
        bail!(
            "{}: holds {} pokes that are not the first of those asked for; name another place with --into",
            into.display(),
            made.len()
        );
    }
    Ok(&asked[made.len()..])
}

/// Makes pokes and records them as a session of their own.
fn make(
    arguments: &PokeArguments,
    pokes: &[PlannedPoke],
    so_far: &Recording,
    into: &Path,
    number: usize,
    first: &StartDocument,
    context: &Context,
) -> anyhow::Result<Session> {
    std::fs::create_dir_all(into).with_context(|| format!("{}: can't be made", into.display()))?;
    let table = into.join(format!("{number:02}.csv"));
    write_pokes(&table, pokes, so_far)?;
    let planned = PlannedArguments::of_table(&table, &arguments.rig).read()?;
    let bench = planned.rig.simulated(&planned.pokes())?.map(|bench| bench.later(number as u64));
    let how = How {
        watch: Watch::choose(context, true),
        yes: true,
        clear: arguments.clear,
        bias: false,
        at_rest_s: passed_s(first),
    };
    let folder = into.join(format!("{number:02}"));
    let recorded = record(&planned, bench, &folder, false, how, context)?;
    if let Some(stopped) = &recorded.ran.stopped {
        bail!("{}: stopped: {}", folder.display(), told(stopped, &recorded.ran));
    }
    Ok(Session::open(folder)?)
}

/// `SESSION-pokes`.
fn beside(session: &Path) -> PathBuf {
    let mut name = session.components().as_path().as_os_str().to_owned();
    name.push("-pokes");
    PathBuf::from(name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;

    #[test]
    fn pokes_that_were_made_are_not_made_again_and_others_are_not_taken_for_them() {
        let asked = |x: f64| PlannedPoke {
            site: Vec3::new(x, 0.0, 0.0),
            direction: Vec3::z(),
            radius_m: 0.008,
            depth_m: 1e-3,
            rate_m_s: 1e-3,
            hold_s: 0.0,
        };
        let made = |x: f64| Poke {
            number: 1,
            site: Vec3::new(x, 0.0, 0.0),
            direction: Vec3::z(),
            radius_m: 0.008,
            start_s: 0.0,
            end_s: 1.0,
        };
        let (asked, place) = ([asked(0.01), asked(0.02)], Path::new("somewhere"));
        let left = |made: &[Poke]| left_to_make(&asked, made, place).map(<[PlannedPoke]>::len).ok();
        assert_eq!(
            [left(&[]), left(&[made(0.01)]), left(&[made(0.01), made(0.02)])],
            [Some(2), Some(1), Some(0)]
        );
        assert_eq!(left(&[made(0.02)]), None);
        assert_eq!(left(&[made(0.01), made(0.02), made(0.03)]), None);
    }
}
