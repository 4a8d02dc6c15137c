//! `poke`: more pokes for a session that was recorded, and all of it as one recording: what `diagnose --continue` has a rig do.

use super::look::{late, placed, seen};
use super::planned::Planned;
use super::recorded_run::{How, MESH, passed_s, record, told};
use super::run_watch::Watch;
use super::{Context, Exit, Kind, Outcome, StagedFolder};
use crate::dataset::{
    FromSession, read_phantom, read_planned_pokes, read_seen_sessions, read_sessions, write_bundle,
};
use crate::observation::{PlannedPoke, Recording};
use crate::report::write_pokes;
use crate::rig::RigFile;
use crate::session::{Session, StartDocument};
use crate::units::counted;
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

/// A poke that was asked for is the one asked for now within this (m, of a unit vector, and as a share): what writing loses.
const SAME: f64 = 1e-6;

pub(super) fn run(arguments: &PokeArguments, context: &Context) -> anyhow::Result<Outcome> {
    let asked = read_planned_pokes(&arguments.pokes)?;
    let first = Session::open(&arguments.session)?;
    let mesh_file = first.folder().join(MESH);
    if !mesh_file.exists() {
        bail!("{}: the session keeps no mesh", mesh_file.display());
    }
    let mesh = read_phantom(&mesh_file)?;
    placed(&first, None)?;
    let bundle = StagedFolder::new(&arguments.out, Kind::Recording, arguments.force)?;
    let into = arguments.into.clone().unwrap_or_else(|| beside(&arguments.session));
    let mut sessions = vec![first.clone()];
    let mut so_far = read_sessions(&sessions, mesh.clone())?.recording;
    let mut made = Vec::new();
    for number in 1.. {
        let folder = into.join(format!("{number:02}"));
        if !folder.exists() {
            break;
        }
        sessions.push(Session::open(folder)?);
        let before = so_far.pokes.len();
        so_far = read_sessions(&sessions, mesh.clone())?.recording;
        let wanted = read_planned_pokes(&table_of(&into, number))?;
        made.extend(wanted.into_iter().take(so_far.pokes.len() - before));
    }
    let left = left_to_make(&asked, &made, &into)?;
    if !left.is_empty() {
        let session = make(arguments, left, &so_far, &into, sessions.len(), first.start(), context)?;
        sessions.push(session);
    }
    let FromSession { recording, camera_lags, remarks, .. } =
        read_seen_sessions(&seen(&sessions, &mesh, None, context)?, mesh)?;
    write_bundle(&recording, bundle.path())?;
    bundle.finish()?;
    let pokes = recording.pokes.len();
    let mut text = format!(
        "{}: {}, {} of them new",
        arguments.out.display(),
        counted(pokes, "poke", "pokes"),
        left.len()
    );
    for lag in camera_lags.iter().flatten() {
        text.push_str(&format!("\n{}", late(lag)));
    }
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
    made: &[PlannedPoke],
    into: &Path,
) -> anyhow::Result<&'a [PlannedPoke]> {
    let close = |one: f64, other: f64| (one - other).abs() <= SAME * one.abs();
    let same = |(asked, made): (&PlannedPoke, &PlannedPoke)| {
        (asked.site - made.site).norm() <= SAME
            && (asked.direction - made.direction).norm() <= SAME
            && close(asked.radius_m, made.radius_m)
            && close(asked.depth_m, made.depth_m)
            && close(asked.rate_m_s, made.rate_m_s)
            && close(asked.hold_s, made.hold_s)
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
    let rig = RigFile::read(&arguments.rig)?;
    if rig.public_text() != first.rig.text {
        bail!(
            "{}: is not the rig file that {} was recorded with; nothing was moved",
            arguments.rig.display(),
            arguments.session.display()
        );
    }
    let left = || {
        let left = counted(pokes.len(), "poke", "pokes");
        format!("{}, {left} still to be made", arguments.pokes.display())
    };
    let title = format!("{number:02}");
    let mut planned = Planned::of_pokes(&arguments.pokes, &title, pokes, rig).with_context(left)?;
    // Before anything is opened, as `run` does.
    planned.plan([0.0, 0.0]).checked().with_context(left)?;
    // Nothing is left behind by what is refused up to here.
    std::fs::create_dir_all(into).with_context(|| format!("{}: can't be made", into.display()))?;
    let table = table_of(into, number);
    write_pokes(&table, pokes, so_far)?;
    planned.protocol_text =
        std::fs::read_to_string(&table).with_context(|| format!("{}: can't be read", table.display()))?;
    let bench = planned.rig.simulated(&planned.pokes())?.map(|bench| bench.later(number as u64));
    let how = How {
        watch: Watch::choose(context, true),
        yes: true,
        clear: arguments.clear,
        bias: false,
        at_rest_s: passed_s(first),
        live: false,
    };
    let folder = into.join(format!("{number:02}"));
    let recorded = record(&planned, bench, &folder, false, how, context).inspect_err(|_| {
        if !folder.exists() {
            // Nor by a device that refuses. A folder with sessions in it stays; what can't be removed is in nobody's way.
            let _ = std::fs::remove_file(&table).and_then(|()| std::fs::remove_dir(into));
        }
    })?;
    if let Some(stopped) = &recorded.ran.stopped {
        bail!("{}: stopped: {}", folder.display(), told(stopped, &recorded.ran));
    }
    Ok(Session::open(folder)?)
}

/// What a session of more pokes was asked for.
fn table_of(into: &Path, number: usize) -> PathBuf {
    into.join(format!("{number:02}.csv"))
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
        let made = asked;
        let (asked, place) = ([asked(0.01), asked(0.02)], Path::new("somewhere"));
        let left = |made: &[PlannedPoke]| left_to_make(&asked, made, place).map(<[PlannedPoke]>::len).ok();
        assert_eq!(
            [left(&[]), left(&[made(0.01)]), left(&[made(0.01), made(0.02)])],
            [Some(2), Some(1), Some(0)]
        );
        assert_eq!(left(&[made(0.02)]), None);
        assert_eq!(left(&[made(0.01), made(0.02), made(0.03)]), None);
        let first = made(0.01);
        for other in [
            PlannedPoke { direction: Vec3::x(), ..first },
            PlannedPoke { radius_m: 0.005, ..first },
            PlannedPoke { depth_m: 0.04, ..first },
            PlannedPoke { rate_m_s: 2e-3, ..first },
            PlannedPoke { hold_s: 1.0, ..first },
        ] {
            assert_eq!(left(&[other]), None, "{other:?}");
        }
    }
}
