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
/// side: their sum counts. The share that relaxes is compared with that of a diagnosis, which may be given in place of a fit. Exit code 3: they
/// disagree at 95 %.
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
            ReferenceQuantity::RelaxedFraction if diagnosed => relaxed(&fit, &name)?,
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

/// All shares that a diagnosis found to relax, together.
fn relaxed(diagnosis: &Value, name: &str) -> anyhow::Result<Fitted> {
    const KEY: &str = "parameters.viscoelastic-relaxation.relaxed_fraction";
    let given = &diagnosis["parameters"]["viscoelastic-relaxation"]["relaxed_fraction"];
    let shares = given.as_array().map_or_else(|| vec![given], |list| list.iter().collect());
    let all: Vec<Fitted> = shares.into_iter().map(|v| fitted(v, KEY, name)).collect::<Result<_, _>>()?;
    let sd = all.iter().map(|f| f.sd.powi(2)).sum::<f64>().sqrt();
    Ok(Fitted { value: all.iter().map(|f| f.value).sum(), sd })
}

fn fitted(value: &Value, key: &str, name: &str) -> anyhow::Result<Fitted> {
    match (value["value"].as_f64(), value["sd"].as_f64()) {
        (Some(value), Some(sd)) if sd >= 0.0 => Ok(Fitted { value, sd }),
        _ => bail!(
            "{name}: {key} holds {value}; expected value and sd: what the fit did not determine cannot be compared"
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
