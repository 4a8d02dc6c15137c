//! `calibrate bands`: stiffness of rubber bands at the pull that they have on the rig.

use super::instrument::{day, noted, write};
use super::specimen::{
    SpecimenArguments, contradictions, faulty, left_out, left_out_table, raw, read, sources, tables, warmed,
    withheld, written,
};
use crate::calib::bands::{Line, Settings, Stiffness, Stretching, estimate};
use crate::calib::coupon::{Name, Specimen};
use crate::calib::reference::{Figure, ReferenceQuantity, ReferenceValue, Validity};
use crate::cli::{Context, Exit, Outcome, UsageError};
use crate::report::{Curve, SpecimenTable, specimen_page};
use crate::units::{counted, with_sd};
use clap::Args;
use serde_json::json;

/// Finds the stiffness of rubber bands: slack, slope, hysteresis, what cycles change, and the slope at the pull on the rig.
///
/// Straight, with a knee, or curved: by evidence on parts that a fit did not see. Writes bands.html, bands.json and bands.toml, the reference value;
/// none of a test that slipped, saturated, or contradicts itself. Exit code 3: something is named that does not belong to the material, or the
/// pull lies below where the loading begins.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  phantom-rig calibrate bands calibration/raw/band.csv --pretension-n 1.5 --out calibration/band
  phantom-rig calibrate bands calibration/raw/four-bands.csv --parallel 4 --pretension-n 6 --out calibration/bands")]
pub(in crate::cli) struct BandsArguments {
    #[command(flatten)]
    read: SpecimenArguments,
    /// Pull of all bands together on the rig (N); half of the greatest one when left out
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pretension_n: Option<f64>,
    /// Bands side by side in the machine
    #[arg(long, value_name = "COUNT", default_value_t = 1,
        value_parser = clap::value_parser!(u32).range(1..))]
    parallel: u32,
}

pub(super) fn run(arguments: &BandsArguments, _: &Context) -> anyhow::Result<Outcome> {
    if let Some(pull) = arguments.pretension_n.filter(|pull| !(pull.is_finite() && *pull > 0.0)) {
        return Err(UsageError(format!("--pretension-n {pull}: expected more than 0")).into());
    }
    let exports = read(&arguments.read)?;
    let all = tables(&exports);
    let [table] = all[..] else {
        let count = counted(all.len(), "table", "tables");
        return Err(UsageError(format!("{count}; one test of bands at a time")).into());
    };
    let stretching = Stretching::from_table(table)?;
    let settings = Settings {
        pretension_n: arguments.pretension_n,
        parallel: arguments.parallel,
        ..Settings::default()
    };
    let found = estimate(&stretching, &settings)?;
    let mut remarks = found.remarks.clone();
    let faults = Specimen::of_bands(&stretching).diagnose();
    let wrong = faulty(&stretching.label, &faults);
    // Softening is the material's own; but which cycle the value is of depends on it.
    let softer = faults.iter().filter(|f| f.is_material() && f.name == Name::Softening);
    remarks.extend(softer.map(|f| format!("{}: {}", f.words(), f.shown)));
    let contradictions = contradictions(&exports);
    // The procedure asks for a band that hangs slack at first.
    let doubtful = faults.iter().any(|f| !f.is_material() && f.name != Name::Slack);
    let degraded = doubtful || !contradictions.is_empty() || found.begins_at_n.is_some();
    let withheld = withheld(&contradictions, &faults.iter().collect::<Vec<_>>());
    remarks.extend(wrong.into_iter().chain(contradictions).chain(warmed(&exports)).chain(withheld.clone()));
    let line = &found.branches[found.chosen].line;
    let sentence = format!(
        "{} at a pull of {:.2} N{}, {} ({})",
        with_sd(found.stiffness_n_per_m, found.sd_n_per_m, 1.0, "N/m"),
        found.pretension_n,
        of_one(&found),
        slack(line, &stretching),
        line.bend.words()
    );
    let read = &arguments.read;
    let extension = stretching.extension_m.iter().copied();
    let value = ReferenceValue {
        name: if read.specimen.is_empty() { stretching.label.clone() } else { read.specimen.clone() },
        quantity: ReferenceQuantity::Stiffness,
        figure: Figure {
            value: found.stiffness_n_per_m,
            sd: found.sd_n_per_m,
            interval_90: Some(found.interval_90),
        },
        date: day(read.date.as_deref())?,
        source: "tensile test of bands".to_owned(),
        specimen: format!("{}, {} side by side", stretching.label, found.parallel),
        machine: read.machine.clone(),
        method: format!(
            "slope at the pull, loading of the last cycle, {}. {}",
            line.bend.words(),
            remarks.join("; ")
        ),
        validity: Validity {
            pretension_n: Some([found.pretension_n, found.pretension_n]),
            extension_m: Some([
                extension.clone().fold(f64::INFINITY, f64::min),
                extension.fold(f64::NEG_INFINITY, f64::max),
            ]),
            ..Validity::default()
        },
        raw: raw(&exports),
    };
    let json = json!({
        "format": "phantom-bands/1",
        "out": read.out,
        "stiffness_n_per_m": {"value": found.stiffness_n_per_m, "sd": found.sd_n_per_m, "interval_90": found.interval_90},
        "of_one_n_per_m": found.of_one_n_per_m(),
        "parallel": found.parallel,
        "pretension_n": found.pretension_n,
        "begins_at_n": found.begins_at_n,
        "slack_m": line.slack_m,
        "slack_sd_m": line.slack_sd_m,
        "knee_m": line.knee_m,
        "tare_n": line.tare_n,
        "evidence": found.tried.iter().map(|(b, m)| json!({"bend": b.words(), "missed_n": m})).collect::<Vec<_>>(),
        "branches": found.branches.iter().map(|b| json!({
            "cycle": b.branch.cycle, "loading": b.branch.loading, "slack_m": b.line.slack_m,
            "slope_n_per_m": b.line.slope_n_per_m, "slope_at_pull_n_per_m": b.slope_at_pull_n_per_m,
            "swallowed": b.swallowed, "left_n": b.line.left_n,
        })).collect::<Vec<_>>(),
        "raw": value.raw.iter().map(|r| json!({"file": r.file, "sha256": r.sha256})).collect::<Vec<_>>(),
        "left_out": left_out(&faults),
        "remarks": remarks,
    });
    let reference = if withheld.is_none() { value.text()? } else { String::new() };
    let page = specimen_page(
        ["Stiffness of bands", &sources(&exports), &sentence],
        &remarks,
        &[
            left_out_table(
                &[(&stretching.label, &faults)],
                "Against a straight line from where the file begins. What the machine itself yields can't be told from one test.",
            ),
            branches(&found),
        ],
        ["extension, mm", "force, N"],
        false,
        &curves(&found, &stretching),
    )?;
    write(&read.out, read.force, "bands", &page, &json, &reference)?;
    let text = noted(&sentence, &remarks) + &written(&read.out, "bands", !reference.is_empty());
    Ok(Outcome { exit: if degraded { Exit::Degraded } else { Exit::Good }, text, json })
}

/// What one of several bands has.
fn of_one(found: &Stiffness) -> String {
    if found.parallel == 1 {
        return String::new();
    }
    let sd = found.sd_n_per_m / f64::from(found.parallel);
    let one = with_sd(found.of_one_n_per_m(), sd, 1.0, "N/m");
    format!(" of {} bands together, {one} each", found.parallel)
}

/// The slack, if rows lie in it.
fn slack(line: &Line, stretching: &Stretching) -> String {
    let first = stretching.extension_m.iter().copied().fold(f64::INFINITY, f64::min);
    if line.slack_m > first {
        return format!("slack {:.2} mm", 1e3 * line.slack_m);
    }
    format!("already pulled {:.2} mm long where the file begins", 1e3 * (first - line.slack_m))
}

fn branches(found: &Stiffness) -> SpecimenTable {
    let or =
        |value: Option<f64>, decimals: usize| value.map_or("–".to_owned(), |v| format!("{v:.decimals$}"));
    let row = |b: &crate::calib::bands::OfBranch| {
        let way = if b.branch.loading { "loading" } else { "unloading" };
        vec![
            format!("{}, {way}", b.branch.cycle),
            format!("{:.3}", 1e3 * b.line.slack_m),
            format!("{:.1}", b.line.slope_n_per_m),
            or(b.slope_at_pull_n_per_m, 1),
            or(b.swallowed.map(|s| 100.0 * s), 1),
            format!("{:.3}", b.line.left_n),
        ]
    };
    SpecimenTable {
        title: "Cycles",
        head: vec![
            "Cycle",
            "slack, mm",
            "first slope, N/m",
            "slope at the pull, N/m",
            "work swallowed, %",
            "left, N",
        ],
        rows: found.branches.iter().map(row).collect(),
        note: "",
    }
}

fn curves(found: &Stiffness, stretching: &Stretching) -> Vec<Curve> {
    let (x, f) = (&stretching.extension_m, &stretching.force_n);
    let measured = x.iter().zip(f).map(|(x, f)| (1e3 * x, *f)).collect();
    let mut curves = vec![Curve { name: "measured".to_owned(), points: measured, line: false }];
    for b in &found.branches {
        let rows = b.branch.from..=b.branch.to;
        let way = if b.branch.loading { "loading" } else { "unloading" };
        let points = rows.map(|r| (1e3 * x[r], b.line.force(x[r]))).collect();
        curves.push(Curve { name: format!("cycle {}, {way}", b.branch.cycle), points, line: true });
    }
    curves
}
