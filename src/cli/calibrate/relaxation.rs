//! `calibrate relaxation`: how the force on a held specimen falls, from ramps and holds; what the model leaves out.

use super::instrument::{noted, write};
use super::specimen::{SpecimenArguments, contradictions, raw, read, sources, tables};
use crate::calib::coupon::{Fault, diagnose};
use crate::calib::relaxation::{Choice, Phase, Recording, Settings, choose};
use crate::cli::{Context, Exit, Outcome};
use crate::report::{Curve, SpecimenTable, specimen_page};
use clap::Args;
use serde_json::json;

/// Finds how the force on a held specimen falls: terms from ramps and holds, at one rate or several, the ramp as it was.
///
/// The number of terms by evidence on data that a fit did not see: the later hold, or another rate. What the model leaves out is named: sensor
/// zero, sticking, slip, slack, saturation, drift, or that it can't be explained. Writes relaxation.html and relaxation.json. Several exports are
/// rates of one material.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  phantom-rig calibrate relaxation raw/foam.csv --out calibration/foam
  phantom-rig calibrate relaxation raw/1s.csv raw/10s.csv raw/100s.csv --as raw/units.toml --out calibration/rates")]
pub(in crate::cli) struct RelaxationArguments {
    #[command(flatten)]
    read: SpecimenArguments,
}

pub(super) fn run(arguments: &RelaxationArguments, context: &Context) -> anyhow::Result<Outcome> {
    let exports = read(&arguments.read)?;
    let recordings: Vec<Recording> =
        tables(&exports).into_iter().map(Recording::from_table).collect::<Result<_, _>>()?;
    let bar = context.progress.spinner("models");
    let found = choose(&recordings, &Settings::default())?;
    drop(bar);
    let faults: Vec<Vec<Fault>> =
        recordings.iter().zip(&found.unseen).map(|(r, unseen)| diagnose(r, &found, unseen)).collect();
    let mut remarks = Vec::new();
    for (recording, faults) in recordings.iter().zip(&faults) {
        for fault in faults.iter().filter(|f| !f.name.is_material()) {
            let [first, last] = fault.lines;
            let (name, label) = (fault.name.words(), &recording.label);
            remarks.push(format!("{label}, lines {first} to {last}: {name}: {}", fault.shown));
        }
    }
    if !found.law.termination.is_answer() {
        remarks.push(format!(
            "the last search ended {}: terms are not told apart, though forces are predicted",
            found.law.termination.words()
        ));
    }
    remarks.extend(contradictions(&exports));
    let sentence = sentence(&found, &recordings);
    let terms = found.law.terms();
    let whole = found.law.lasting() + terms.iter().map(|t| t.amplitude).sum::<f64>();
    let json = json!({
        "format": "phantom-relaxation/1",
        "out": arguments.read.out,
        "model": found.law.kind.words(),
        "is_minimum": found.law.termination.is_answer(),
        "lasting_fraction": found.law.lasting() / whole,
        "terms": terms.iter().map(|t| json!({"relaxed_fraction": t.amplitude / whole, "time_constant_s": t.time_s})).collect::<Vec<_>>(),
        "evidence": found.tried.iter().map(|t| json!({"model": t.kind.words(), "missed_over_sd": t.score})).collect::<Vec<_>>(),
        "recordings": recordings.iter().zip(&faults).enumerate().map(|(i, (r, faults))| json!({
            "label": r.label,
            "peak": r.peak(),
            "unseen_rows": found.unseen[i].len(),
            "worst_unseen_over_peak": found.worst_share(&recordings)[i],
            "unseen_within_two_sd": found.within_two_sd(&recordings)[i],
            "left_out": faults.iter().map(|f| json!({
                "name": f.name.words(), "lines": f.lines, "shown": f.shown, "held_out": f.held_out,
            })).collect::<Vec<_>>(),
        })).collect::<Vec<_>>(),
        "raw": raw(&exports).iter().map(|r| json!({"file": r.file, "sha256": r.sha256})).collect::<Vec<_>>(),
        "remarks": remarks,
    });
    let page = specimen_page(
        ["Relaxation", &sources(&exports), &sentence],
        &remarks,
        &page_tables(&found, &recordings, &faults),
        ["time, s", if recordings[0].force_unit == "N" { "force, N" } else { "stress, Pa" }],
        false,
        &curves(&found, &recordings),
    )?;
    write(&arguments.read.out, arguments.read.force, "relaxation", &page, &json, "")?;
    let text = noted(&sentence, &remarks) + &format!("\n{}/relaxation.html", arguments.read.out.display());
    Ok(Outcome { exit: if remarks.is_empty() { Exit::Good } else { Exit::Degraded }, text, json })
}

fn sentence(found: &Choice, recordings: &[Recording]) -> String {
    let worst = found.worst_share(recordings).into_iter().fold(0.0, f64::max);
    let within = found.within_two_sd(recordings).into_iter().fold(1.0, f64::min);
    let how = if recordings.len() == 1 {
        format!("the hold that the fit did not see is predicted within {:.2} % of the peak", 100.0 * worst)
    } else {
        format!(
            "of each rate, predicted from the others, at least {:.0} % lies within two deviations",
            100.0 * within
        )
    };
    format!("{}; {how}", found.law.kind.words())
}

fn page_tables(found: &Choice, recordings: &[Recording], faults: &[Vec<Fault>]) -> Vec<SpecimenTable> {
    let told_apart = if found.law.termination.is_answer() {
        ""
    } else {
        "The search came to no minimum: together they predict the force, one by one they are not told apart."
    };
    let terms = found.law.terms();
    let whole = found.law.lasting() + terms.iter().map(|t| t.amplitude).sum::<f64>();
    let share = |force: f64| format!("{:.4}", force / whole);
    let mut rows = vec![vec!["∞".to_owned(), share(found.law.lasting())]];
    rows.extend(terms.iter().map(|t| vec![format!("{:.4}", t.time_s), share(t.amplitude)]));
    let left_out = recordings.iter().zip(faults).flat_map(|(recording, faults)| {
        faults.iter().map(|f| {
            let held_out =
                f.held_out.map_or("–".to_owned(), |[a, b]| format!("{:.2} → {:.2}", 100.0 * a, 100.0 * b));
            let lines = format!("{} to {}", f.lines[0], f.lines[1]);
            vec![f.name.words().to_owned(), recording.label.clone(), lines, f.shown.clone(), held_out]
        })
    });
    vec![
        SpecimenTable {
            title: "What a plain spring leaves out",
            head: vec![
                "Name",
                "Recording",
                "Lines",
                "Shown by",
                "unseen data missed without → with it, % of the peak",
            ],
            rows: left_out.collect(),
            note: "What the machine itself yields can't be told from one specimen.",
        },
        SpecimenTable { title: "Terms", head: vec!["time constant, s", "share"], rows, note: told_apart },
        SpecimenTable {
            title: "Evidence",
            head: vec!["Model", "missed in unseen data, deviations"],
            rows: found
                .tried
                .iter()
                .map(|t| vec![t.kind.words(), t.score.map_or("no value".to_owned(), |s| format!("{s:.3}"))])
                .collect(),
            note: "Deviations are the stated ones, or one hundredth of the peak.",
        },
    ]
}

fn curves(found: &Choice, recordings: &[Recording]) -> Vec<Curve> {
    let mut curves = Vec::new();
    for recording in recordings {
        let measured = recording.time_s.iter().copied().zip(recording.force.iter().copied());
        curves.push(Curve { name: recording.label.clone(), points: measured.collect(), line: false });
        // On the way back the plate comes free, which is no part of the model.
        let modelled = recording.time_s.iter().copied().zip(found.law.force(recording));
        let held = modelled.zip(&recording.phase).filter(|(_, phase)| **phase != Phase::Unloading);
        let name = format!("{}, modelled", recording.label);
        curves.push(Curve { name, points: held.map(|(point, _)| point).collect(), line: true });
    }
    curves
}
