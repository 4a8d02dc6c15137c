//! `calibrate relaxation`: how the force on a held specimen falls, from ramps and holds; what the model leaves out.

use super::instrument::{day, noted, write};
use super::specimen::{
    SpecimenArguments, contradictions, faulty, left_out, left_out_table, raw, read, sources, tables, warmed,
    withheld, written,
};
use crate::calib::coupon::{Fault, diagnose};
use crate::calib::reference::{Figure, RawFile, ReferenceQuantity, ReferenceValue, Validity};
use crate::calib::relaxation::{Choice, Lost, Phase, Recording, Settings, choose, lost};
use crate::cli::{Context, Exit, Outcome};
use crate::report::{Curve, SpecimenTable, specimen_page};
use crate::units::with_sd;
use clap::Args;
use serde_json::json;

/// Finds how the force on a held specimen falls: terms from ramps and holds, at one rate or several, the ramp as it was.
///
/// The number of terms by evidence on data that a fit did not see: the later hold, or another rate. What the model leaves out is named: sensor
/// zero, sticking, slip, slack, saturation, drift, or that it can't be explained. Writes relaxation.html, relaxation.json and relaxation.toml, the
/// reference value: the share that relaxes between the ramp's duration and the hold's; none of a test that slipped, saturated, or contradicts itself.
/// Several exports are rates of one material.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  phantom-rig calibrate relaxation calibration/raw/foam.csv --out calibration/foam
  phantom-rig calibrate relaxation calibration/raw/{1s,10s,100s}.csv --as calibration/raw/units.toml --out calibration/rates")]
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
        remarks.extend(faulty(&recording.label, faults));
    }
    if !found.law.termination.is_answer() {
        remarks.push(format!(
            "the last search ended {}: terms are not told apart, though forces are predicted",
            found.law.termination.words()
        ));
    }
    for r in recordings.iter().filter(|r| r.later_rows > 0) {
        remarks.push(format!("{}: later cycles are left out ({} rows)", r.label, r.later_rows));
    }
    remarks.extend(warmed(&exports));
    let contradictions = contradictions(&exports);
    remarks.extend(contradictions.iter().cloned());
    let share = lost(&found, &recordings);
    let withheld = match &share {
        Ok(_) => withheld(&contradictions, &faults.iter().flatten().collect::<Vec<_>>()),
        Err(why) => Some(format!("no reference value is written: {why}")),
    };
    remarks.extend(withheld.clone());
    let share = share.ok();
    let sentence = sentence(&found, &recordings, share.as_ref());
    let value = match share.filter(|_| withheld.is_none()) {
        Some(share) => {
            value(&arguments.read, &found, &recordings, &share, &remarks, raw(&exports))?.text()?
        }
        None => String::new(),
    };
    let terms = found.law.terms();
    let whole = found.law.lasting() + terms.iter().map(|t| t.amplitude).sum::<f64>();
    let json = json!({
        "format": "phantom-relaxation/1",
        "out": arguments.read.out,
        "model": found.law.kind.words(),
        "is_minimum": found.law.termination.is_answer(),
        "relaxed_fraction": share.map(|s| {
            json!({"value": s.fraction, "sd": s.sd, "measured": s.measured, "time_s": s.window_s, "models": s.models})
        }),
        "lasting_fraction": found.law.lasting() / whole,
        "terms": terms.iter().map(|t| json!({"relaxed_fraction": t.amplitude / whole, "time_constant_s": t.time_s})).collect::<Vec<_>>(),
        "evidence": found.tried.iter().map(|t| json!({"model": t.kind.words(), "missed_over_sd": t.score})).collect::<Vec<_>>(),
        "recordings": recordings.iter().zip(&faults).enumerate().map(|(i, (r, faults))| json!({
            "label": r.label,
            "peak": r.peak(),
            "unseen_rows": found.unseen[i].len(),
            "worst_unseen_over_peak": found.worst_share(&recordings)[i],
            "unseen_within_two_sd": found.within_two_sd(&recordings)[i],
            "left_out": left_out(faults),
        })).collect::<Vec<_>>(),
        "raw": raw(&exports).iter().map(|r| json!({"file": r.file, "sha256": r.sha256})).collect::<Vec<_>>(),
        "remarks": remarks,
    });
    let newtons = recordings[0].force_unit == "N";
    let page = specimen_page(
        ["Relaxation", &sources(&exports), &sentence],
        &remarks,
        &page_tables(&found, &recordings, &faults),
        ["time since the ramp began, s", if newtons { "force, N" } else { "stress, kPa" }],
        true,
        &curves(&found, &recordings),
    )?;
    write(&arguments.read.out, arguments.read.force, "relaxation", &page, &json, &value)?;
    let text = noted(&sentence, &remarks) + &written(&arguments.read.out, "relaxation", !value.is_empty());
    Ok(Outcome { exit: if remarks.is_empty() { Exit::Good } else { Exit::Degraded }, text, json })
}

/// The share that relaxes, as a reference value: what several terms of a sum that are not told apart leave sure.
fn value(
    read: &SpecimenArguments,
    found: &Choice,
    recordings: &[Recording],
    share: &Lost,
    remarks: &[String],
    raw: Vec<RawFile>,
) -> anyhow::Result<ReferenceValue> {
    let labels: Vec<&str> = recordings.iter().map(|r| r.label.as_str()).collect();
    let [from, to] = share.window_s;
    Ok(ReferenceValue {
        name: if read.specimen.is_empty() { labels.join(", ") } else { read.specimen.clone() },
        quantity: ReferenceQuantity::RelaxedFraction,
        figure: Figure { value: share.fraction, sd: share.sd, interval_90: None },
        date: day(read.date.as_deref())?,
        source: "ramp and hold".to_owned(),
        specimen: format!("{} ({} held)", labels.join(", "), recordings.len()),
        machine: read.machine.clone(),
        method: format!(
            "share of the force that relaxes between {from:.3} and {to:.0} s after a step, 1 − G({to:.0} s)/G({from:.3} s); mean of {} models that \
             predict alike, the best of them {}; the force itself falls by {:.4} of its peak over the hold of {}; uncertainty: fits, differences \
             of the models, zero, an assumed scatter of specimens of {} %. {}",
            share.models,
            found.law.kind.words(),
            share.measured,
            recordings[share.of].label,
            100.0 * share.assumed_scatter,
            remarks.join("; ")
        ),
        validity: Validity { time_s: Some(share.window_s), ..Validity::default() },
        raw,
    })
}

fn sentence(found: &Choice, recordings: &[Recording], share: Option<&Lost>) -> String {
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
    let Some(share) = share else {
        return format!("no share that relaxes can be told ({}); {how}", found.law.kind.words());
    };
    let [from, to] = share.window_s;
    let fraction = with_sd(share.fraction, share.sd, 100.0, "%");
    format!(
        "{fraction} of the force relaxes between {from:.2} and {to:.0} s after a step ({}); {how}",
        found.law.kind.words()
    )
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
    let named: Vec<(&str, &[Fault])> =
        recordings.iter().zip(faults).map(|(r, f)| (r.label.as_str(), f.as_slice())).collect();
    vec![
        left_out_table(&named, "What the machine itself yields can't be told from one specimen."),
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
        let begin = recording.phase.iter().position(|p| *p != Phase::Rest).unwrap_or(0);
        let start = recording.time_s[begin.saturating_sub(1)];
        let scale = if recording.force_unit == "N" { 1.0 } else { 1e-3 };
        let point = |(t, f): (&f64, f64)| (t - start, scale * f);
        let measured = recording.time_s.iter().zip(recording.force.iter().copied()).map(point);
        curves.push(Curve { name: recording.label.clone(), points: measured.collect(), line: false });
        // On the way back the plate comes free, which is no part of the model.
        let modelled = recording.time_s.iter().zip(found.law.force(recording)).map(point);
        let held = modelled.zip(&recording.phase).filter(|(_, phase)| **phase != Phase::Unloading);
        let name = format!("{}, modelled", recording.label);
        curves.push(Curve { name, points: held.map(|(point, _)| point).collect(), line: true });
    }
    curves
}
