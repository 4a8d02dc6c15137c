//! `calibrate tensile`: Young's modulus of a material from pulled dumb-bells.

use super::instrument::{day, noted, write};
use super::specimen::{
    SpecimenArguments, contradictions, faulty, left_out, left_out_table, raw, read, sources, tables, warmed,
    withheld, written,
};
use crate::calib::coupon::{Fault, Name, Specimen, compliance, wrong_units};
use crate::calib::dumbbell::{Modulus, Pull, Settings, estimate};
use crate::calib::export::Export;
use crate::calib::reference::{Figure, ReferenceQuantity, ReferenceValue, Validity};
use crate::cli::{Context, Exit, Outcome, UsageError};
use crate::report::{Curve, SpecimenTable, specimen_page};
use crate::units::with_sd;
use clap::Args;
use serde_json::{Value, json};

/// Finds Young's modulus from pulled dumb-bells: median over specimens of one material, with an interval.
///
/// Model (linear, neo-Hookean, Yeoh, Ogden) by evidence on specimens, or parts, that a fit did not see. Preload and slack are taken off. Writes
/// tensile.html, tensile.json and tensile.toml, the reference value: put it into calibration/values. A specimen in another unit is left out; there is
/// no reference value where a test slipped, saturated or contradicts itself, or where the specimens are not one material. Exit code 3: something
/// is named that does not belong to the material, or more than a tenth of the strains asked for lies beyond the data.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  phantom-rig calibrate tensile 'calibration/raw/Ecoflex 00-30.csv' --out calibration/ecoflex-30
  phantom-rig calibrate tensile calibration/raw/batch-7 --strain 0,0.3 --specimen 'gel, batch 7' --out calibration/gel-7")]
pub(in crate::cli) struct TensileArguments {
    #[command(flatten)]
    read: SpecimenArguments,
    /// Strains that are fitted: lowest and highest
    #[arg(
        long,
        value_name = "LOW,HIGH",
        value_delimiter = ',',
        default_value = "0,0.5",
        allow_hyphen_values = true
    )]
    strain: Vec<f64>,
}

pub(super) fn run(arguments: &TensileArguments, _: &Context) -> anyhow::Result<Outcome> {
    let [low, high] = arguments.strain[..] else {
        return Err(UsageError("--strain needs two numbers, such as 0,0.5".to_owned()).into());
    };
    if !(low.is_finite() && high.is_finite() && low < high) {
        return Err(UsageError(format!("--strain {low},{high}: the first is less than the second")).into());
    }
    let exports = read(&arguments.read)?;
    let pulls: Vec<Pull> = tables(&exports).into_iter().map(Pull::from_table).collect::<Result<_, _>>()?;
    let settings = Settings { window: [low, high], ..Settings::default() };
    let all = faults(&exports, &pulls, high);
    // What is in another unit is no specimen of the median.
    let is_other = |faults: &[Fault]| faults.iter().any(|f| f.name == Name::WrongUnit);
    let (other, used): (Vec<_>, Vec<_>) =
        pulls.into_iter().zip(all).partition(|(_, faults)| is_other(faults));
    let (pulls, faults): (Vec<Pull>, Vec<Vec<Fault>>) = used.into_iter().unzip();
    let found = estimate(&pulls, &settings)?;
    let mut wrong = Vec::new();
    for (pull, faults) in &other {
        wrong.push(format!("{}: left out of the estimate", pull.label));
        wrong.extend(faulty(&pull.label, faults));
    }
    for (pull, faults) in pulls.iter().zip(&faults) {
        wrong.extend(faulty(&pull.label, faults));
    }
    let contradictions = contradictions(&exports);
    wrong.extend(contradictions.iter().cloned());
    wrong.extend(found.apart());
    let mixed = found.is_mixed();
    let withheld = mixed.clone().map(|why| format!("no reference value is written: {why}"));
    let withheld = withheld.or_else(|| withheld_by(&contradictions, &faults));
    let window = settings.window;
    let degraded = !wrong.is_empty() || withheld.is_some() || found.is_short(window);
    let mut remarks = found.short(window);
    remarks.extend(found.remarks.iter().cloned());
    remarks.extend(wrong.into_iter().chain(warmed(&exports)).chain(withheld.clone()));
    let sentence = sentence(&found, mixed.as_deref());
    let value = value(arguments, &found, &pulls, &remarks, raw(&exports))?;
    let reference = if withheld.is_none() { value.text()? } else { String::new() };
    let json = json(arguments, &found, mixed.as_deref(), &faults, &remarks, &value);
    let names = sources(&exports);
    let page = specimen_page(
        ["Young’s modulus from dumb-bells", &names, &sentence],
        &remarks,
        &page_tables(&found, &faults),
        ["strain", "stress, kPa"],
        false,
        &curves(&found, &pulls),
    )?;
    write(&arguments.read.out, arguments.read.force, "tensile", &page, &json, &reference)?;
    let text = noted(&sentence, &remarks) + &written(&arguments.read.out, "tensile", !reference.is_empty());
    Ok(Outcome { exit: if degraded { Exit::Degraded } else { Exit::Good }, text, json })
}

fn withheld_by(contradictions: &[String], faults: &[Vec<Fault>]) -> Option<String> {
    withheld(contradictions, &faults.iter().flatten().collect::<Vec<_>>())
}

/// What was found; of specimens that are not one material, `mixed`, there is no modulus.
fn sentence(found: &Modulus, mixed: Option<&str>) -> String {
    if let Some(why) = mixed {
        return format!("{why}: there is no common modulus");
    }
    let [low, high] = found.interval_90.map(|e| 1e-3 * e);
    // The second digit of the deviation, as in the value.
    let decimals = (1.0 - (1e-3 * found.sd_pa).log10().floor()).clamp(0.0, 9.0) as usize;
    format!(
        "E = {}, 90 % interval {low:.decimals$} to {high:.decimals$} kPa ({}, {})",
        with_sd(found.modulus_pa, found.sd_pa, 1e-3, "kPa"),
        found.model.name(),
        match found.specimens.len() {
            1 => "one specimen".to_owned(),
            n => format!("median of {n} specimens"),
        }
    )
}

fn value(
    arguments: &TensileArguments,
    found: &Modulus,
    pulls: &[Pull],
    remarks: &[String],
    raw: Vec<crate::calib::reference::RawFile>,
) -> anyhow::Result<ReferenceValue> {
    let range = |values: Vec<f64>| {
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        (!values.is_empty()).then_some([least, most])
    };
    let read = &arguments.read;
    let labels: Vec<&str> = pulls.iter().map(|p| p.label.as_str()).collect();
    Ok(ReferenceValue {
        name: if read.specimen.is_empty() { labels.join(", ") } else { read.specimen.clone() },
        quantity: ReferenceQuantity::YoungModulus,
        figure: Figure { value: found.modulus_pa, sd: found.sd_pa, interval_90: Some(found.interval_90) },
        date: day(read.date.as_deref())?,
        source: "tensile test of dumb-bells".to_owned(),
        specimen: format!("{} ({} pulled)", labels.join(", "), pulls.len()),
        machine: read.machine.clone(),
        method: format!(
            "{} model in strains {} to {}, slack taken off; uncertainty: geometry, load cell, start, scatter. {}",
            found.model.name(),
            arguments.strain[0],
            arguments.strain[1],
            remarks.join("; ")
        ),
        validity: Validity {
            strain: Some(found.reached([arguments.strain[0], arguments.strain[1]])),
            rate_per_s: range(pulls.iter().filter_map(|p| p.rate_per_s).collect()),
            temperature_c: range(pulls.iter().filter_map(|p| p.temperature_c).collect()),
            ..Validity::default()
        },
        raw,
    })
}

/// What a neo-Hookean bar from zero strain leaves out of each pull.
fn faults(exports: &[Export], pulls: &[Pull], to: f64) -> Vec<Vec<Fault>> {
    let mut all: Vec<Vec<Fault>> = pulls.iter().map(|p| Specimen::of_dumbbell(p, to).diagnose()).collect();
    for (faults, table) in all.iter_mut().zip(tables(exports)) {
        faults.extend(compliance(table));
    }
    let whole: Vec<Specimen> = pulls.iter().map(|p| Specimen::of_dumbbell(p, f64::INFINITY)).collect();
    for (of, fault) in wrong_units(&whole) {
        all[of].push(fault);
    }
    all
}

fn json(
    arguments: &TensileArguments,
    found: &Modulus,
    mixed: Option<&str>,
    faults: &[Vec<Fault>],
    remarks: &[String],
    value: &ReferenceValue,
) -> Value {
    let b = &found.budget;
    let modulus = json!({"value": found.modulus_pa, "sd": found.sd_pa, "interval_90": found.interval_90});
    json!({
        "format": "phantom-tensile/1",
        "out": arguments.read.out,
        "young_modulus_pa": mixed.is_none().then_some(modulus),
        "not_one_material": mixed,
        "model": found.model.name(),
        "evidence": found.scores.iter().map(|s| json!({"model": s.model.name(), "missed_pa": s.missed_pa})).collect::<Vec<_>>(),
        "relative_uncertainty": {
            "width": b.width, "thickness": b.thickness, "gauge_length": b.gauge_length, "load_cell": b.load_cell,
            "start": b.start, "fit": b.fit, "scatter": b.scatter, "total": b.total,
        },
        "specimens": found.specimens.iter().zip(faults).map(|(s, faults)| json!({
            "label": s.label, "young_modulus_pa": s.modulus_pa, "sd_pa": s.sd_pa, "slack": s.slack,
            "young_modulus_with_tare_pa": s.modulus_with_tare_pa, "rows": s.rows.len(), "left_pa": s.left_pa,
            "left_out": left_out(faults),
        })).collect::<Vec<_>>(),
        "raw": value.raw.iter().map(|r| json!({"file": r.file, "sha256": r.sha256})).collect::<Vec<_>>(),
        "remarks": remarks,
    })
}

fn page_tables(found: &Modulus, faults: &[Vec<Fault>]) -> Vec<SpecimenTable> {
    let named: Vec<(&str, &[Fault])> =
        found.specimens.iter().zip(faults).map(|(s, f)| (s.label.as_str(), f.as_slice())).collect();
    // Four digits that count.
    let kpa = |pa: f64| {
        let decimals = (3.0 - (1e-3 * pa).abs().max(1e-9).log10().floor()).clamp(0.0, 9.0) as usize;
        format!("{:.decimals$}", 1e-3 * pa)
    };
    let per_cent = |share: f64| format!("{:.2}", 100.0 * share);
    let b = &found.budget;
    let parts = [
        ("Width", b.width),
        ("Thickness", b.thickness),
        ("Gauge length", b.gauge_length),
        ("Load cell", b.load_cell),
        ("Slack or tare", b.start),
        ("Fit", b.fit),
        ("Specimens", b.scatter),
        ("All", b.total),
    ];
    vec![
        SpecimenTable {
            title: "Specimens",
            head: vec![
                "Specimen",
                "E, kPa",
                "sd of the fit, kPa",
                "slack, strain",
                "E with a tare instead, kPa",
                "left, kPa",
            ],
            rows: found
                .specimens
                .iter()
                .map(|s| {
                    let tare = s.modulus_with_tare_pa.map_or("–".to_owned(), kpa);
                    let slack = format!("{:.4}", s.slack);
                    vec![s.label.clone(), kpa(s.modulus_pa), kpa(s.sd_pa), slack, tare, kpa(s.left_pa)]
                })
                .collect(),
            note: "",
        },
        left_out_table(
            &named,
            "Against a neo-Hookean bar from zero strain, inside the window. What grips and machine yield takes an extensometer beside the crosshead.",
        ),
        SpecimenTable {
            title: "Evidence",
            head: vec!["Model", "missed in unseen data, kPa"],
            rows: found
                .scores
                .iter()
                .map(|s| vec![s.model.name().to_owned(), s.missed_pa.map_or("no minimum".to_owned(), kpa)])
                .collect(),
            note: "A model with more parameters must be better by a tenth.",
        },
        SpecimenTable {
            title: "Uncertainty",
            head: vec!["Part", "share of E, % (1 sd)"],
            rows: parts.iter().map(|(name, share)| vec![(*name).to_owned(), per_cent(*share)]).collect(),
            note: "",
        },
    ]
}

fn curves(found: &Modulus, pulls: &[Pull]) -> Vec<Curve> {
    let mut curves = Vec::new();
    for (one, pull) in found.specimens.iter().zip(pulls) {
        let point = |r: &usize| (pull.strain[*r], 1e-3 * pull.stress[*r]);
        curves.push(Curve {
            name: one.label.clone(),
            points: one.rows.iter().map(point).collect(),
            line: false,
        });
        let model = |r: &usize| {
            let stretch = (1.0 + pull.strain[*r]) / (1.0 + one.slack);
            (pull.strain[*r], 1e-3 * found.model.at(&one.parameters, stretch))
        };
        let name = format!("{}, {}", one.label, found.model.name());
        curves.push(Curve { name, points: one.rows.iter().map(model).collect(), line: true });
    }
    curves
}
