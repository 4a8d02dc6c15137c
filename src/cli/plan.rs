//! `plan`: what a protocol will do, how long it takes, and what speaks against it. Nothing moves.

use super::planned::{PlannedArguments, draw};
use super::today::today;
use super::{Context, Exit, Outcome};
use clap::Args;
use serde_json::json;
use std::fmt::Write as _;
use std::path::PathBuf;

/// Prints and draws what a protocol will do on a rig, and checks all of it.
///
/// Travel, speed and acceleration of the stage, sites on the phantom, ways clear of it, depths, predicted forces and what a stop
/// would still add, rest between pokes, and whether the phantom's mesh is there and within its box. Everything that speaks against it is listed; then the
/// exit code is 1. It is 3 where a depth is probably not meant, where the calibration does not hold today, or where pokes will
/// give no markers. How much is recorded is an estimate. Opens no device.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  phantom-rig plan rigs/protocols/five-pokes.toml --rig rigs/sim.toml
  phantom-rig plan rigs/protocols/five-pokes.toml --rig rigs/sim.toml --set deep_mm=4 --draw plan.svg")]
pub(super) struct PlanArguments {
    #[command(flatten)]
    planned: PlannedArguments,
    /// Draw it into this file (SVG); an earlier drawing of a plan there is replaced
    #[arg(long, value_name = "FILE")]
    draw: Option<PathBuf>,
    /// Replace whatever is at FILE
    #[arg(long, requires = "draw")]
    force: bool,
}

pub(super) fn run(arguments: &PlanArguments, _context: &Context) -> anyhow::Result<Outcome> {
    let planned = arguments.planned.read()?;
    let plan = planned.plan([0.0, 0.0]);
    if let Some(file) = &arguments.draw {
        draw(&plan, &planned.bench, file, arguments.force)?;
    }
    let missing = planned.rig.mesh().filter(|mesh| !mesh.is_file());
    let mut table = plan.table();
    if let Some(mesh) = &missing {
        let _ = write!(
            table,
            "\nThe phantom's mesh is missing: {}; `phantom-rig mesh block` makes one",
            mesh.display()
        );
    }
    let unusable = planned.mesh().err().filter(|_| missing.is_none()).map(|error| format!("{error:#}"));
    if let Some(reason) = &unusable {
        let _ = write!(table, "\nThe phantom's mesh can't be used: {reason}");
    }
    if let Some(file) = &arguments.draw {
        let _ = write!(table, "\nDrawn: {}", file.display());
    }
    let today = today()?;
    let doubts: Vec<String> = planned.rig.calibration().map_or_else(Vec::new, |set| {
        set.doubts(today, None).iter().map(|doubt| format!("{}: {doubt}", set.file.display())).collect()
    });
    let unplaced = planned.unplaced()?;
    let unmeant = plan.doubts();
    for note in unmeant.iter().chain(&doubts).map(String::as_str).chain(unplaced) {
        let _ = write!(table, "\nnote: {note}");
    }
    let json = json!({
        "format": "phantom-plan/1",
        "name": plan.name,
        "pokes": plan.pokes(),
        "duration_s": plan.duration_s,
        "data_bytes": plan.data_bytes(),
        "violations": plan.violations.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "missing_mesh": missing,
        "unusable_mesh": unusable,
        "drawing": arguments.draw,
        "doubts": unmeant,
        "calibration": planned.rig.calibration().map(|set| set.name.clone()),
        "calibration_doubts": doubts,
        "without_markers": unplaced,
    });
    let can = plan.violations.is_empty() && missing.is_none() && unusable.is_none();
    let exit = match (can, unmeant.is_empty() && doubts.is_empty() && unplaced.is_none()) {
        (false, _) => Exit::Failed,
        (true, false) => Exit::Degraded,
        (true, true) => Exit::Good,
    };
    Ok(Outcome { exit, text: table, json })
}
