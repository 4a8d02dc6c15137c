//! `calibrate force`: what the force sensor reads under dead weights.

use super::instrument::{KeptArguments, day, hashed, noted, write};
use crate::calib::instruments::force::{
    COMPONENTS, Drift, DriftLog, ForceFile, ForceFound, Frame, Known, Weights, calibrate_force, drift,
};
use crate::cli::{Context, Exit, Outcome, UsageError};
use crate::report::force_page;
use clap::{Args, ValueEnum};
use serde_json::json;
use std::path::PathBuf;

/// Finds out what the force sensor is worth: zero, gain, cross-talk and how its axes lie, from dead weights.
///
/// Hang weights in all three directions and at levers, and nothing between them; write each hold into a table (CSV): mass_g, dir_x, dir_y,
/// dir_z (where the weight pulls), lever_x_mm, lever_y_mm, lever_z_mm (a point of its line of pull, from the sensor's origin; may be left out
/// where all weights pull through it), the sensor's reading fx_n … fz_n, tx_nm … tz_nm with its own zero left as it is, and, if known, time_s and
/// temperature_c. A weight that the others contradict is named and kept: leave its line out by --leave-out. Gains that no sensor has are doubted,
/// with the unit that explains them, and no set takes them. Writes force.html, force.json and force.toml (for `calibrate set`). Exit code 3:
/// something is doubtful, also a zero that moves in the drift log; a line that was left out as asked is not.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  phantom-rig calibrate force calibration/raw/weights.csv --out calibration/force
  phantom-rig calibrate force weights.csv --drift-log night.csv --serial FT12345 --gravity 9.8072 --scale-share 0.0001 --out calibration/force
  phantom-rig calibrate force weights.csv --leave-out 17 --out calibration/force")]
pub(in crate::cli) struct ForceArguments {
    /// The table of weights and readings
    #[arg(value_name = "WEIGHTS")]
    weights: PathBuf,
    /// Readings over hours without load: time_s, temperature_c, fx_n … tz_nm
    #[arg(long, value_name = "FILE")]
    drift_log: Option<PathBuf>,
    /// Along which axes directions and levers are given
    #[arg(long, value_enum, default_value_t = FrameWord::Sensor)]
    frame: FrameWord,
    /// Serial number of the sensor's calibration, as `doctor` shows it: a set holds for this sensor only
    #[arg(long, value_name = "TEXT", default_value = "")]
    serial: String,
    /// Gravity at the bench (m/s²)
    #[arg(long, value_name = "M_S2", default_value_t = Known::default().gravity_m_s2, allow_negative_numbers = true)]
    gravity: f64,
    /// Standard deviation of each weight, over its mass
    #[arg(long, value_name = "SHARE", default_value_t = Known::default().mass_share, allow_negative_numbers = true)]
    mass_share: f64,
    /// Standard deviation of all weights together with gravity, over their size
    #[arg(long, value_name = "SHARE", default_value_t = Known::default().scale_share, allow_negative_numbers = true)]
    scale_share: f64,
    /// Standard deviation of each direction (degrees)
    #[arg(long, value_name = "DEG", default_value_t = 0.115, allow_negative_numbers = true)]
    direction_deg: f64,
    /// Standard deviation of each lever (mm)
    #[arg(long, value_name = "MM", default_value_t = 0.2, allow_negative_numbers = true)]
    lever_mm: f64,
    /// Lines of the table to leave out
    #[arg(long, value_name = "LINE", value_delimiter = ',')]
    leave_out: Vec<u64>,
    #[command(flatten)]
    kept: KeptArguments,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum FrameWord {
    /// The sensor's own, as the drawing of its mounting has them
    Sensor,
    /// The phantom's
    Phantom,
}

/// Refuses numbers that no bench has.
fn check(arguments: &ForceArguments) -> Result<(), UsageError> {
    if !(arguments.gravity.is_finite() && arguments.gravity > 0.0) {
        return Err(UsageError(format!("--gravity {}: expected more than 0, in m/s²", arguments.gravity)));
    }
    let deviations = [
        ("--mass-share", arguments.mass_share),
        ("--scale-share", arguments.scale_share),
        ("--direction-deg", arguments.direction_deg),
        ("--lever-mm", arguments.lever_mm),
    ];
    match deviations.into_iter().find(|(_, sd)| !(sd.is_finite() && *sd >= 0.0)) {
        Some((option, sd)) => Err(UsageError(format!("{option} {sd}: a standard deviation is 0 or more"))),
        None => Ok(()),
    }
}

pub(super) fn run(arguments: &ForceArguments, _: &Context) -> anyhow::Result<Outcome> {
    check(arguments)?;
    let known = Known {
        gravity_m_s2: arguments.gravity,
        mass_share: arguments.mass_share,
        scale_share: arguments.scale_share,
        direction_rad: arguments.direction_deg.to_radians(),
        lever_m: 1e-3 * arguments.lever_mm,
    };
    let weights = Weights::read(&arguments.weights)?.without(&arguments.leave_out)?;
    let [name, sha256] = hashed(&arguments.weights)?;
    let found = calibrate_force(&weights, &known)?;
    let log = arguments.drift_log.as_deref().map(DriftLog::read).transpose()?;
    let wander = log.as_ref().map(drift).transpose()?;
    let doubts = found.doubts();
    let doubtful = doubtful(&found, &doubts, wander.as_ref());
    let mut remarks = doubtful.clone();
    remarks.extend(arguments.leave_out.iter().map(|line| format!("line {line} was left out, as asked")));
    let sentence = sentence(&found);
    let frame = match arguments.frame {
        FrameWord::Sensor => Frame::Sensor,
        FrameWord::Phantom => Frame::Phantom,
    };
    let kept = &arguments.kept;
    let date = day(kept.date.as_deref())?;
    let (serial, note) = (arguments.serial.clone(), kept.note.clone());
    let table = (name, sha256.clone());
    let file = ForceFile::new(&found, frame, date, serial, note, table, &arguments.leave_out);
    let page = force_page(&found, &weights, wander.as_ref(), &sentence, &remarks, doubtful.is_empty())?;
    let json = json!({
        "format": "phantom-force-calibration-result/1",
        "out": kept.out,
        "table": arguments.weights,
        "sha256": sha256,
        "rows": found.rows,
        "told": found.told,
        "components": COMPONENTS,
        "bias": found.bias,
        "bias_sd": found.bias_sd,
        "per_second": found.per_second,
        "per_kelvin": found.per_kelvin,
        "sensitivity": found.sensitivity,
        "sensitivity_sd": found.sensitivity_sd,
        "correction": found.correction,
        "correction_sd": found.correction_sd,
        "noise": found.noise,
        "half_90_over_sd": found.half_90,
        "reads_pull": found.reads_pull,
        "turn_rad": found.turn_rad,
        "turn_sd_rad": found.turn_sd_rad,
        "misfits": found.misfits.iter().map(|m| json!({
            "line": m.line, "component": m.component, "off": m.off, "sigmas": m.sigmas, "p": m.p,
            "mass_kg": m.mass_kg, "as_mass_kg": m.as_mass_kg,
        })).collect::<Vec<_>>(),
        "drift": wander.as_ref().map(|d| json!({
            "length_s": d.length_s,
            "trends": d.trends.iter().map(|t| json!({
                "component": t.component, "per": t.per, "slope": t.slope, "sd": t.sd, "p": t.p, "there": t.is_there(),
            })).collect::<Vec<_>>(),
            "time_and_temperature_together": d.not_apart,
            "span_s": d.span_s,
            "allan": d.allan,
        })),
        "left_out": arguments.leave_out,
        "doubts": doubts,
        "remarks": remarks,
    });
    write(&kept.out, kept.force, "force", &page, &json, &file.text()?)?;
    let mut text = sentence;
    for (i, component) in COMPONENTS.iter().enumerate() {
        text += &format!(
            "\n{component}: zero {:+.5} ± {:.5}, gain {:.5} ± {:.5}, noise of a row {:.1e}",
            found.bias[i],
            found.bias_sd[i],
            found.sensitivity[i][i],
            found.sensitivity_sd[i][i],
            found.noise[i]
        );
    }
    text = noted(&text, &remarks);
    let out = kept.out.display();
    text += &format!("\n{out}/force.html");
    if doubts.is_empty() {
        text += &format!("\nNext: phantom-rig calibrate set --force {out}/force.toml …");
    }
    Ok(Outcome { exit: if doubtful.is_empty() { Exit::Good } else { Exit::Degraded }, text, json })
}

fn sentence(found: &ForceFound) -> String {
    let worst = |pairs: &dyn Fn(usize) -> f64| (0..3).map(pairs).fold(0.0, f64::max);
    let gain = worst(&|i| (found.sensitivity[i][i].abs() - 1.0).abs());
    let sd = worst(&|i| found.sensitivity_sd[i][i]);
    let turn = found.turn_rad.iter().map(|t| t * t).sum::<f64>().sqrt().to_degrees();
    format!(
        "{} rows tell {} components: force gains off by up to {:.2} % (each ± {:.2} % or better), axes turned by {turn:.2}°",
        found.rows,
        found.told,
        100.0 * gain,
        100.0 * sd
    )
}

/// What is doubtful, as sentences; first what speaks against the whole. A row that was left out on purpose is not.
fn doubtful(found: &ForceFound, doubts: &[String], wander: Option<&Drift>) -> Vec<String> {
    let mut remarks = doubts.to_vec();
    remarks.extend(found.misfits.iter().map(ToString::to_string));
    if let Some(first) = found.misfits.first() {
        remarks.push(match found.misfits.len() {
            1 => format!("this row is in the result; without it: --leave-out {}", first.line),
            _ => {
                format!("these rows are in the result; without the worst of them: --leave-out {}", first.line)
            }
        });
    }
    if let Some(wander) = wander {
        for trend in wander.trends.iter().filter(|t| t.is_there()) {
            let unit = if trend.component.starts_with('F') { "N" } else { "N·m" };
            remarks.push(format!(
                "the zero of {} moves by {:+.2e} ± {:.1e} {} per {}",
                trend.component, trend.slope, trend.sd, unit, trend.per
            ));
        }
        if wander.not_apart {
            remarks.push("in the drift log temperature went with time: they cannot be told apart".to_owned());
        }
    }
    remarks
}
