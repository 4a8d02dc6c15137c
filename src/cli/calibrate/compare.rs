//! `calibrate compare`: a fit beside what is known without the rig.

use super::instrument::write;
use crate::calib::reference::{Comparison, Figure, Fitted, ReferenceQuantity, ReferenceValue, compare};
use crate::cli::{Context, Exit, Outcome, UsageError};
use crate::report::comparison_page;
use anyhow::{Context as _, bail};
use clap::Args;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Formats that can be compared.
const FIT: &str = "phantom-fit/1";
const DIAGNOSIS: &str = "phantom-diagnosis/1";

/// Compares a fit with reference values: difference, both uncertainties, and whether it is significant.
///
/// Young's modulus is compared with that of the fit; stiffness with the total of its patches. Several references of stiffness are bands side by
/// side: their sum counts. The share that relaxes is compared with that of a diagnosis, which may be given in place of a fit: between the times
/// that the reference was measured for. Exit code 3: they disagree at 95 %.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  phantom-rig calibrate compare sessions/first-fit --reference calibration/values/gel.toml
  phantom-rig calibrate compare fit.json --reference gel.toml --reference band-left.toml --reference band-right.toml --out compared")]
pub(in crate::cli) struct CompareArguments {
    /// fit.json or diagnosis.json, or the folder of a fit or a diagnosis
    #[arg(value_name = "FIT")]
    fit: PathBuf,
    /// A reference value (calibration/values)
    #[arg(long, value_name = "FILE", required = true, num_args = 1..)]
    reference: Vec<PathBuf>,
    /// Write a page and JSON into this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace whatever is there
    #[arg(long)]
    force: bool,
}

pub(super) fn run(arguments: &CompareArguments, _: &Context) -> anyhow::Result<Outcome> {
    let file = document(&arguments.fit);
    let name = file.display().to_string();
    let text = std::fs::read_to_string(&file).with_context(|| format!("{name}: can't be read"))?;
    let fit: Value = serde_json::from_str(&text).with_context(|| format!("{name}: no JSON"))?;
    let diagnosed = fit["format"] == DIAGNOSIS;
    if !diagnosed && fit["format"] != FIT {
        bail!("{name}: format is {}; expected {FIT:?} or {DIAGNOSIS:?}", fit["format"]);
    }
    let references: Vec<ReferenceValue> =
        arguments.reference.iter().map(|file| ReferenceValue::read(file)).collect::<Result<_, _>>()?;
    let mut comparisons: Vec<Comparison> = Vec::new();
    for reference in &references {
        let found = match reference.quantity {
            ReferenceQuantity::YoungModulus if diagnosed => {
                fitted(&fit["extended"]["young_modulus_pa"], "extended.young_modulus_pa", &name)?
            }
            ReferenceQuantity::YoungModulus => fitted(&fit["young_modulus_pa"], "young_modulus_pa", &name)?,
            ReferenceQuantity::RelaxedFraction if diagnosed => {
                relaxed(&fit, reference.validity.time_s, &name)?
            }
            // Together, below.
            ReferenceQuantity::Stiffness if !diagnosed => continue,
            other => {
                let (what, of) = (other.name(), if diagnosed { "diagnosis" } else { "fit" });
                return Err(UsageError(format!(
                    "{}: a {of} gives no {what} with its deviation; a fit gives modulus and stiffness, a diagnosis modulus and relaxed fraction",
                    reference.name
                ))
                .into());
            }
        };
        comparisons.push(compare(found, reference));
    }
    let bands: Vec<&ReferenceValue> =
        references.iter().filter(|r| r.quantity == ReferenceQuantity::Stiffness).collect();
    if let Some(together) = side_by_side(&bands) {
        let total = fitted(&fit["restraint"]["total_n_per_m"], "restraint.total_n_per_m", &name)?;
        comparisons.push(compare(total, &together));
    }
    let agree = comparisons.iter().all(|c| c.agree);
    let words: Vec<String> = comparisons.iter().map(Comparison::words).collect();
    let json = json!({
        "format": "phantom-comparison/1",
        "fit": file,
        "agree": agree,
        "comparisons": comparisons.iter().map(|c| json!({
            "name": c.name, "quantity": c.quantity.key(), "fit": c.fitted, "reference": c.reference, "difference": c.difference,
            "sd": c.sd, "z": c.z, "p": c.p, "agree": c.agree, "share": c.share(), "detectable": c.detectable(),
        })).collect::<Vec<_>>(),
    });
    if let Some(out) = &arguments.out {
        let sentence =
            if agree { "Fit and reference agree at 95 %" } else { "Fit and reference disagree at 95 %" };
        let page = comparison_page(&comparisons, &name, sentence)?;
        write(out, arguments.force, "comparison", &page, &json, "")?;
    }
    Ok(Outcome { exit: if agree { Exit::Good } else { Exit::Degraded }, text: words.join("\n"), json })
}

/// The file, or that of a folder.
fn document(given: &Path) -> PathBuf {
    if !given.is_dir() {
        return given.to_owned();
    }
    let found = ["fit.json", "diagnosis.json"].map(|name| given.join(name));
    found.iter().find(|f| f.is_file()).unwrap_or(&found[0]).clone()
}

/// The share that a diagnosis finds to relax between the reference's times after a step: 1 − G(t₂)/G(t₁), G(t) = 1 − Σ r_i (1 − exp(−t/τ_i)) over
/// its terms; without times all that relaxes. Deviations by derivatives, terms taken as independent.
fn relaxed(diagnosis: &Value, between_s: Option<[f64; 2]>, name: &str) -> anyhow::Result<Fitted> {
    let all = |what: &str| -> anyhow::Result<Vec<Fitted>> {
        let given = &diagnosis["parameters"]["viscoelastic-relaxation"][what];
        let values = given.as_array().map_or_else(|| vec![given], |list| list.iter().collect());
        let key = format!("parameters.viscoelastic-relaxation.{what}");
        values.into_iter().map(|v| fitted(v, &key, name)).collect()
    };
    let shares = all("relaxed_fraction")?;
    let Some(between_s) = between_s else {
        let sd = shares.iter().map(|f| f.sd.powi(2)).sum::<f64>().sqrt();
        return Ok(Fitted { value: shares.iter().map(|f| f.value).sum(), sd });
    };
    let times = all("time_constant_s")?;
    if times.len() != shares.len() {
        bail!("{name}: {} shares relax with {} time constants; expected one each", shares.len(), times.len());
    }
    let gone = |t: f64, tau: f64| -(-t / tau).exp_m1();
    let terms = || shares.iter().zip(&times);
    let [early, late] =
        between_s.map(|t| 1.0 - terms().map(|(r, tau)| r.value * gone(t, tau.value)).sum::<f64>());
    // Derivatives of late/early by a share and by a time constant.
    let variance: f64 = terms()
        .map(|(r, tau)| {
            let by_share = between_s.map(|t| -gone(t, tau.value));
            let by_time = between_s.map(|t| r.value * t / tau.value.powi(2) * (-t / tau.value).exp());
            let of = |[a, b]: [f64; 2]| (b - a * late / early) / early;
            (of(by_share) * r.sd).powi(2) + (of(by_time) * tau.sd).powi(2)
        })
        .sum();
    Ok(Fitted { value: 1.0 - late / early, sd: variance.sqrt() })
}

fn fitted(value: &Value, key: &str, name: &str) -> anyhow::Result<Fitted> {
    match (value["value"].as_f64(), value["sd"].as_f64()) {
        (Some(value), Some(sd)) if sd >= 0.0 => Ok(Fitted { value, sd }),
        (Some(found), _) => bail!(
            "{name}: {key} is {found} with the standard deviation {}; only what has one, 0 or more, can be compared: leave this reference out",
            value["sd"]
        ),
        (None, _) if value.is_null() => {
            bail!(
                "{name}: {key} is not there, or null: nothing was found that could be compared; leave this reference out"
            )
        }
        (None, _) => bail!(
            "{name}: {key} was not determined: its value is {}, expected a number; the remarks in this file say why. Leave this reference \
             out, or record pokes that tell it",
            value["value"]
        ),
    }
}

/// Bands side by side pull together: stiffnesses add, and so do their variances.
fn side_by_side(bands: &[&ReferenceValue]) -> Option<ReferenceValue> {
    let first = bands.first()?;
    if bands.len() == 1 {
        return Some((*first).clone());
    }
    let value = bands.iter().map(|b| b.figure.value).sum();
    let sd = bands.iter().map(|b| b.figure.sd.powi(2)).sum::<f64>().sqrt();
    let name = bands.iter().map(|b| b.name.as_str()).collect::<Vec<_>>().join(" + ");
    Some(ReferenceValue { name, figure: Figure { value, sd, interval_90: None }, ..(*first).clone() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_not_determined_is_told_by_its_key_and_what_to_do() {
        let document = json!({
            "modulus": {"value": null, "sd": null}, "total": {"value": 3.0, "sd": null}, "none": null, "good": {"value": 3.0, "sd": 0.1}
        });
        let said = |key: &str| fitted(&document[key], key, "fit.json").map_err(|error| error.to_string());
        assert_eq!(said("good"), Ok(Fitted { value: 3.0, sd: 0.1 }));
        for (key, words) in [
            ("modulus", "fit.json: modulus was not determined: its value is null, expected a number"),
            ("total", "fit.json: total is 3 with the standard deviation null"),
            ("none", "fit.json: none is not there, or null"),
            ("other", "fit.json: other is not there, or null"),
        ] {
            let told = said(key).expect_err(key);
            assert!(
                told.starts_with(words) && told.to_lowercase().contains("leave this reference out"),
                "{told}"
            );
        }
    }

    /// One term of 0.4 with 10 s, between 5 and 50 s: G = 0.6 + 0.4 e^{−t/10}.
    #[test]
    fn a_diagnosis_is_held_against_the_times_of_the_reference() {
        let number = |value: f64, sd: f64| json!({"value": value, "sd": sd});
        let of = |share: f64, time: f64| {
            let terms =
                json!({"relaxed_fraction": [number(share, 0.02)], "time_constant_s": [number(time, 1.0)]});
            relaxed(&json!({"parameters": {"viscoelastic-relaxation": terms}}), Some([5.0, 50.0]), "made")
                .expect("a share")
        };
        let after = |share: f64, time: f64, t: f64| 1.0 - share + share * (-t / time).exp();
        let by_hand = |share: f64, time: f64| 1.0 - after(share, time, 50.0) / after(share, time, 5.0);
        let found = of(0.4, 10.0);
        assert!((found.value - by_hand(0.4, 10.0)).abs() < 1e-12);
        let slope = |a: f64, b: f64, step: f64| (a - b) / step;
        let by_share = slope(by_hand(0.401, 10.0), by_hand(0.399, 10.0), 0.002);
        let by_time = slope(by_hand(0.4, 10.01), by_hand(0.4, 9.99), 0.02);
        assert!((found.sd - (by_share * 0.02).hypot(by_time)).abs() < 1e-6, "{found:?}");
        // What is over before the first time does not count.
        assert!(of(0.4, 0.01).value.abs() < 1e-12);
    }
}
