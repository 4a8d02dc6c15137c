//! `fit`: a bundle → modulus, restraint, and a folder with a page, `fit.json`, tables and VTK files.

use super::{Context, Exit, Outcome, StagedFolder, UsageError};
use crate::dataset::read_bundle;
use crate::fem::Order;
use crate::inverse::{Driven, Progress, Settings, fit};
use crate::report::{finding, to_json, trust, write_fit};
use clap::{Args, ValueEnum};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Fits a recording: Young's modulus, the hidden restraint, how surely, and a page to look at.
///
/// Writes a folder with fit.html (the page), fit.json, CSV tables and VTK files. Ends with exit code 3 when the
/// model does not explain the recording down to the noise: the figures are then not to be trusted.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  phantom-rig fit recordings/practice-01
  phantom-rig fit recordings/practice-01 --out results/01 --quick
  phantom-rig fit recordings/practice-01 --element p1 --json > p1.json")]
pub(super) struct FitArguments {
    /// The bundle: a folder with recording.toml, mesh.msh, pokes.csv, force.csv, markers.csv
    #[arg(value_name = "BUNDLE")]
    bundle: PathBuf,
    /// Where to write; by default the bundle's name with "-fit", in the current folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace DIR even if this program did not make it
    #[arg(long)]
    force: bool,
    /// Order of the elements; p1 is offered for comparison only and may be tens of per cent off
    #[arg(long, value_enum, default_value = "p2")]
    element: Element,
    /// What drives the model: by default the stage when it was recorded, else the wrench
    #[arg(long, value_enum, default_value = "auto")]
    drive: Drive,
    /// Stay on the given mesh: faster, about 2 % less certain
    #[arg(long)]
    quick: bool,
    /// Radius of the patches through which springs pull
    #[arg(long, value_name = "MM", default_value_t = 5.0)]
    patch_radius_mm: f64,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Element {
    /// First order
    P1,
    /// Second order
    P2,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Drive {
    /// The stage if there is one
    Auto,
    /// The stage's displacement; force and markers are explained
    Stage,
    /// The wrench; markers are explained
    Wrench,
}

pub(super) fn run(arguments: &FitArguments, context: &Context) -> anyhow::Result<Outcome> {
    let settings = settings(arguments)?;
    let spinner = context.progress.spinner("reading");
    let (recording, suspicions) = read_bundle(&arguments.bundle)?;
    let destination = arguments.out.clone().unwrap_or_else(|| beside(&arguments.bundle));
    let folder = StagedFolder::new(&destination, arguments.force)?;
    let mut fitted = fit(&recording, &settings, &mut |stage| spinner.label(&said(stage)))?;
    fitted.remarks.extend(suspicions.iter().map(ToString::to_string));
    spinner.label("writing");
    let made_with = made_with(arguments);
    write_fit(folder.path(), &fitted, &recording, &made_with)?;
    folder.finish()?;
    drop(spinner);

    let page = destination.join("fit.html");
    let explained = fitted.residual.chi2_per_dof <= fitted.residual.chi2_per_dof_limit;
    let mut text = format!("{}\n{}\n", finding(&fitted), trust(&fitted));
    for remark in &fitted.remarks {
        text.push_str(&format!("- {remark}\n"));
    }
    text.push_str(&format!("Page: {}", page.display()));
    Ok(Outcome {
        exit: if explained { Exit::Good } else { Exit::Degraded },
        text,
        json: to_json(&fitted, &made_with)?,
    })
}

fn settings(arguments: &FitArguments) -> anyhow::Result<Settings> {
    let radius_mm = arguments.patch_radius_mm;
    if !(radius_mm > 0.0 && radius_mm.is_finite()) {
        return Err(UsageError(format!("--patch-radius-mm must be more than 0, got {radius_mm}")).into());
    }
    Ok(Settings {
        element: match arguments.element {
            Element::P1 => Order::P1,
            Element::P2 => Order::P2,
        },
        quick: arguments.quick,
        driven: match arguments.drive {
            Drive::Auto => None,
            Drive::Stage => Some(Driven::ByStage),
            Drive::Wrench => Some(Driven::ByWrench),
        },
        patch_radius_m: radius_mm * 1e-3,
    })
}

/// The settings as the page and `fit.json` show them.
fn made_with(arguments: &FitArguments) -> serde_json::Map<String, serde_json::Value> {
    let name = |value: &str| serde_json::Value::from(value.to_lowercase());
    [
        ("bundle", json!(arguments.bundle.display().to_string())),
        ("method", json!("default")),
        ("element", name(&format!("{:?}", arguments.element))),
        ("drive", name(&format!("{:?}", arguments.drive))),
        ("quick", json!(arguments.quick)),
        ("patch_radius_mm", json!(arguments.patch_radius_mm)),
    ]
    .map(|(key, value)| (key.to_owned(), value))
    .into_iter()
    .collect()
}

/// `<bundle>-fit` in the current folder.
fn beside(bundle: &Path) -> PathBuf {
    let name =
        bundle.canonicalize().ok().and_then(|p| p.file_name().map(|n| n.to_string_lossy().into_owned()));
    PathBuf::from(format!("{}-fit", name.unwrap_or_else(|| "recording".to_owned())))
}

fn said(stage: Progress) -> String {
    match stage {
        Progress::Building { unknowns: 0 } => "cutting the mesh and factoring".to_owned(),
        Progress::Building { unknowns } => format!("solving for every marker ({unknowns} unknowns)"),
        Progress::Searching { patches, misfit } => {
            format!("looking for restraint: {patches} patches, misfit {misfit:.2}")
        }
    }
}
