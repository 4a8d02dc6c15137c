//! `calibrate stage`: where the stage goes, sent to a known place, and how far it yields.

use super::instrument::{KeptArguments, day, hashed, noted, write};
use crate::calib::instruments::stage::{
    BlockPress, Compliance, ISO, Positioning, StageFile, StageRuns, TipCompliance, Uncertain, compliance,
    positioning,
};
use crate::cli::{Context, Exit, Outcome, UsageError};
use crate::report::stage_page;
use crate::units::{counted, with_sd};
use clap::Args;
use serde_json::{Value, json};
use std::path::PathBuf;

/// Finds out what the stage is worth: the figures of ISO 230-2, scale and backlash from runs against a gauge; yielding from a press on a block.
///
/// Runs: five or more targets, unevenly spaced, each approached from below and from above, five times; a table (CSV) with run, direction (up,
/// down), target_mm, reading_mm, and axis where it holds several. Press: the tip on a rigid block, a table with position_mm and force_n, from
/// before contact. A way that no stage makes is doubted, with the unit that explains it, and no set takes it. Writes stage.html, stage.json and stage.toml (for `calibrate set`).
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  phantom-rig calibrate stage calibration/raw/gauge.csv --out calibration/stage
  phantom-rig calibrate stage gauge.csv --block block.csv --tip-um-per-n 5 --tip-sd-um-per-n 0.5 --serial 2031 --out calibration/stage")]
pub(in crate::cli) struct StageArguments {
    /// The table of the gauge
    #[arg(value_name = "RUNS")]
    runs: PathBuf,
    /// The table of a press on a rigid block
    #[arg(long, value_name = "FILE")]
    block: Option<PathBuf>,
    /// What the tip itself yields (µm/N)
    #[arg(long, value_name = "UM_PER_N", default_value_t = 0.0, allow_negative_numbers = true)]
    tip_um_per_n: f64,
    /// Standard deviation of that
    #[arg(long, value_name = "UM_PER_N", default_value_t = 0.0, allow_negative_numbers = true)]
    tip_sd_um_per_n: f64,
    /// Standard deviation of the gauge's own scale (µm/m)
    #[arg(long, value_name = "UM_PER_M", default_value_t = 100.0, allow_negative_numbers = true)]
    gauge_um_per_m: f64,
    /// Which stage
    #[arg(long, value_name = "TEXT", default_value = "")]
    serial: String,
    #[command(flatten)]
    kept: KeptArguments,
}

pub(super) fn run(arguments: &StageArguments, _: &Context) -> anyhow::Result<Outcome> {
    let tip = [arguments.tip_um_per_n, arguments.tip_sd_um_per_n, arguments.gauge_um_per_m];
    if tip.iter().any(|x| !(x.is_finite() && *x >= 0.0)) {
        return Err(UsageError(
            "--tip-um-per-n, --tip-sd-um-per-n and --gauge-um-per-m are 0 or more".to_owned(),
        )
        .into());
    }
    let runs = StageRuns::read(&arguments.runs)?;
    let axes: Vec<Positioning> = runs
        .iter()
        .map(|axis| positioning(axis, 1e-6 * arguments.gauge_um_per_m))
        .collect::<Result<_, _>>()?;
    let press = arguments.block.as_deref().map(BlockPress::read).transpose()?;
    let tip = TipCompliance { m_per_n: 1e-6 * tip[0], sd_m_per_n: 1e-6 * tip[1] };
    let yielding = press.as_ref().map(|press| compliance(press, tip)).transpose()?;
    let mut tables = vec![hashed(&arguments.runs)?];
    tables.extend(arguments.block.as_deref().map(hashed).transpose()?);
    let mut doubts: Vec<String> = axes.iter().flat_map(Positioning::doubts).collect();
    doubts.extend(press.as_ref().and_then(BlockPress::doubt));
    let mut remarks = doubts.clone();
    remarks.extend(doubtful(&axes, yielding.as_ref()));
    let sentence = axes.iter().map(sentence).collect::<Vec<_>>().join("; ");
    let kept = &arguments.kept;
    let date = day(kept.date.as_deref())?;
    let (serial, note) = (arguments.serial.clone(), kept.note.clone());
    let file = StageFile::new(&axes, yielding.as_ref(), date, serial, note, tables.clone(), doubts.clone());
    let source = arguments.runs.display().to_string();
    let page = stage_page(&axes, press.as_ref().zip(yielding.as_ref()), &source, &sentence, &remarks)?;
    let json = json!({
        "format": "phantom-stage-calibration-result/1",
        "out": kept.out,
        "tables": tables.iter().map(|[name, sha256]| json!({"file": name, "sha256": sha256})).collect::<Vec<_>>(),
        "axes": axes.iter().map(of_axis).collect::<Vec<_>>(),
        "compliance": yielding.as_ref().map(|c| json!({
            "m_per_n": c.m_per_n, "sd_m_per_n": c.sd_m_per_n, "half_90_m_per_n": c.half_90_m_per_n,
            "slope_n_per_m": c.slope_n_per_m, "slope_sd_n_per_m": c.slope_sd_n_per_m,
            "contact_m": c.contact_m, "contact_sd_m": c.contact_sd_m, "noise_n": c.noise_n, "bent_p": c.bent_p,
        })),
        "doubts": doubts,
        "remarks": remarks,
    });
    write(&kept.out, kept.force, "stage", &page, &json, &file.text()?)?;
    let mut text = sentence;
    if let Some(c) = &yielding {
        text += &format!("\nit yields by {} without the tip", with_sd(c.m_per_n, c.sd_m_per_n, 1e6, "µm/N"));
    }
    text = noted(&text, &remarks);
    let out = kept.out.display();
    text += &format!("\n{out}/stage.html");
    if doubts.is_empty() {
        text += &format!("\nNext: phantom-rig calibrate set --stage {out}/stage.toml …");
    }
    Ok(Outcome { exit: if remarks.is_empty() { Exit::Good } else { Exit::Degraded }, text, json })
}

fn of_axis(axis: &Positioning) -> Value {
    let figure = |f: &Uncertain| json!({"value": f.value, "sd": f.sd, "half_90": f.half_90});
    let mut all = serde_json::Map::new();
    for (letter, found) in ISO.iter().zip(&axis.iso) {
        all.insert(format!("{letter}_m"), figure(found));
    }
    json!({
        "axis": axis.axis,
        "runs": axis.runs,
        "targets": axis.at.len(),
        "iso_230_2": all,
        "scale": figure(&axis.scale),
        "backlash_m": figure(&axis.backlash),
        "scatter_m": axis.scatter_m,
        "misfits": axis.strange.iter().map(|s| json!({"line": s.line, "off_m": s.off_m, "sigmas": s.sigmas})).collect::<Vec<_>>(),
    })
}

fn sentence(axis: &Positioning) -> String {
    let um = |figure: &Uncertain| with_sd(figure.value, figure.sd, 1e6, "µm");
    let name = if axis.axis.is_empty() { String::new() } else { format!("axis {}: ", axis.axis) };
    format!(
        "{name}A {}, R {}, B {}; scale {}, backlash {}",
        um(&axis.iso[0]),
        um(&axis.iso[1]),
        um(&axis.iso[2]),
        with_sd(axis.scale.value, axis.scale.sd, 1e6, "µm/m"),
        um(&axis.backlash)
    )
}

/// What is doubtful though it may be, as sentences.
fn doubtful(axes: &[Positioning], yielding: Option<&Compliance>) -> Vec<String> {
    let mut remarks = Vec::new();
    for axis in axes {
        remarks.extend(axis.strange.iter().map(|s| {
            format!(
                "line {}: {:+.1} µm off the other runs, {:.0} standard deviations; it is kept",
                s.line,
                1e6 * s.off_m,
                s.sigmas
            )
        }));
        if axis.runs < 5 || axis.at.len() < 5 {
            remarks.push(format!(
                "{} at {}; ISO 230-2 asks for five of both",
                counted(axis.runs, "run", "runs"),
                counted(axis.at.len(), "target", "targets")
            ));
        }
    }
    if let Some(c) = yielding.filter(|c| c.is_bent()) {
        remarks.push(format!("the press bends (p = {:.1e}): the contact stiffens, or slips", c.bent_p));
    }
    remarks
}
