//! `fit`: a bundle → modulus, restraint, and a folder with a page, `fit.json`, tables and VTK files.

use super::session_export::CALIBRATION;
use super::{Context, Exit, Kind, Outcome, StagedFolder, UsageError};
use crate::dataset::read_bundle;
use crate::digest::sha256_hex;
use crate::fem::Order;
use crate::inverse::published::{Variant, fit_recording};
use crate::inverse::{Driven, Fit, Progress, Settings, fit};
use crate::observation::Recording;
use crate::report::{Verdict, finding, to_json, trust, verdict, write_fit};
use anyhow::Context as _;
use clap::{Args, ValueEnum};
use serde_json::json;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// Fits a recording: Young's modulus, the hidden restraint, how surely, and a page to look at.
///
/// Writes a folder with fit.html (the page), fit.json, CSV tables and VTK files. Ends with exit code 3 when the
/// model does not explain the recording down to the noise, the fit has not come to rest, or the modulus lies plainly outside the range that the
/// operator expects: the figures are then not to be trusted.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  phantom-rig fit rigs/demo
  phantom-rig fit rigs/demo --out demo-quick --quick
  phantom-rig fit rigs/demo --element p1 --json > p1.json
  phantom-rig fit rigs/demo --method published --out demo-published")]
pub(super) struct FitArguments {
    /// The bundle: a folder with recording.toml, mesh.msh, pokes.csv, force.csv, markers.csv
    #[arg(value_name = "BUNDLE")]
    bundle: PathBuf,
    /// Where to write; by default the bundle's name with "-fit", in the current folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace whatever is at DIR; without it only an earlier fit
    #[arg(long)]
    force: bool,
    /// How the fit is made
    #[arg(long, value_enum, default_value = "default")]
    method: Method,
    /// Order of the elements: p2 by default, p1 with the published methods, as published; p1 may be tens of per cent
    /// off
    #[arg(long, value_enum)]
    element: Option<Element>,
    /// What drives the model: by default the stage when it was recorded, else the wrench
    #[arg(long, value_enum, default_value = "auto")]
    drive: Drive,
    /// Stay on the given mesh: faster, about 2 % less certain
    #[arg(long)]
    quick: bool,
    /// Radius of the patches through which springs pull
    #[arg(long, value_name = "MM", default_value_t = PATCH_RADIUS_MM, allow_negative_numbers = true)]
    patch_radius_mm: f64,
}

const PATCH_RADIUS_MM: f64 = 5.0;

/// How the fit is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Method {
    /// Modulus and patches jointly from all pokes, weighted by the noise
    Default,
    /// The published two-step method, for comparison: energy regularisation, then l1; poke by poke on the given mesh
    Published,
    /// The same with the unit matrix in step one, as printed
    PublishedUnit,
    /// The same with the unit matrix on unknowns relative to the start
    PublishedUnitScaled,
    /// The same without regularisation in step one
    PublishedUnregularised,
    /// The same with the direct method as step two
    PublishedDirect,
}

impl Method {
    fn variant(self) -> Option<Variant> {
        match self {
            Self::Default => None,
            Self::Published => Some(Variant::Published),
            Self::PublishedUnit => Some(Variant::Unit),
            Self::PublishedUnitScaled => Some(Variant::UnitScaled),
            Self::PublishedUnregularised => Some(Variant::Unregularised),
            Self::PublishedDirect => Some(Variant::Direct),
        }
    }

    fn name(self) -> &'static str {
        self.variant().map_or("default", Variant::name)
    }
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
    let variant = arguments.method.variant();
    if variant.is_some() {
        only_published(arguments)?;
    }
    let spinner = context.progress.spinner("reading");
    let (recording, suspicions) = read_bundle(&arguments.bundle)?;
    let destination = arguments.out.clone().unwrap_or_else(|| beside(&arguments.bundle, "fit"));
    let folder = StagedFolder::new(&destination, Kind::Fit, arguments.force)?;
    let mut fitted = match variant {
        None => fit(&recording, &settings, &mut |stage| spinner.label(&said(stage)))?,
        Some(variant) => {
            drop(spinner);
            published(&recording, variant, settings.element, context)?
        }
    };
    let spinner = context.progress.spinner("writing");
    fitted.remarks.extend(suspicions.iter().map(ToString::to_string));
    let mut made_with = made_with(arguments, &settings);
    // A bundle of a session carries the set that its numbers were put right by.
    let set = arguments.bundle.join(CALIBRATION);
    match std::fs::read(&set) {
        Ok(set) => {
            made_with.insert("calibration_sha256".to_owned(), json!(sha256_hex(&set)));
        }
        Err(error) if error.kind() == ErrorKind::NotFound => {}
        Err(error) => return Err(error).with_context(|| format!("{}: can't be read", set.display())),
    }
    write_fit(folder.path(), &fitted, &recording, &made_with)?;
    folder.finish()?;
    drop(spinner);

    let page = destination.join("fit.html");
    let good = matches!(verdict(&fitted), Verdict::Explained | Verdict::NoiseOverstated(_));
    let mut text = format!("{}\n{}\n", finding(&fitted), trust(&fitted));
    for remark in &fitted.remarks {
        text.push_str(&format!("- {remark}\n"));
    }
    text.push_str(&format!("Page: {}", page.display()));
    Ok(Outcome {
        exit: if good { Exit::Good } else { Exit::Degraded },
        text,
        json: to_json(&fitted, &made_with)?,
    })
}

/// Refuses what the published methods have no use for.
fn only_published(arguments: &FitArguments) -> anyhow::Result<()> {
    let method = arguments.method.name();
    let refused = [
        ("--quick", arguments.quick, "it stays on the given mesh anyway"),
        ("--drive stage", matches!(arguments.drive, Drive::Stage), "the wrench drives its model"),
        (
            "--patch-radius-mm",
            arguments.patch_radius_mm != PATCH_RADIUS_MM,
            "its springs stand on single nodes",
        ),
    ];
    match refused.iter().find(|r| r.1) {
        Some((option, _, why)) => {
            Err(UsageError(format!("{option} does nothing with --method {method}: {why}")).into())
        }
        None => Ok(()),
    }
}

fn published(
    recording: &Recording,
    variant: Variant,
    element: Order,
    context: &Context,
) -> anyhow::Result<Fit> {
    let bar = context.progress.bar("pokes", recording.pokes.len() as u64);
    Ok(fit_recording(recording, variant, element, &|| bar.advance())?)
}

fn settings(arguments: &FitArguments) -> anyhow::Result<Settings> {
    let radius_mm = arguments.patch_radius_mm;
    if !(radius_mm > 0.0 && radius_mm.is_finite()) {
        return Err(UsageError(format!("--patch-radius-mm must be more than 0, got {radius_mm}")).into());
    }
    Ok(Settings {
        element: match (arguments.element, arguments.method) {
            (Some(Element::P1), _) => Order::P1,
            (Some(Element::P2), _) | (None, Method::Default) => Order::P2,
            (None, _) => Order::P1,
        },
        quick: arguments.quick,
        driven: match arguments.drive {
            Drive::Auto => None,
            Drive::Stage => Some(Driven::ByStage),
            Drive::Wrench => Some(Driven::ByWrench),
        },
        patch_radius_m: radius_mm * 1e-3,
        unrested: false,
    })
}

/// The settings as the page and `fit.json` show them.
fn made_with(arguments: &FitArguments, settings: &Settings) -> serde_json::Map<String, serde_json::Value> {
    let name = |value: &str| serde_json::Value::from(value.to_lowercase());
    let mut made = vec![
        ("bundle", json!(arguments.bundle.display().to_string())),
        ("method", json!(arguments.method.name())),
        ("element", name(&format!("{:?}", settings.element))),
    ];
    if arguments.method == Method::Default {
        made.extend([
            ("drive", name(&format!("{:?}", arguments.drive))),
            ("quick", json!(arguments.quick)),
            ("patch_radius_mm", json!(arguments.patch_radius_mm)),
        ]);
    }
    made.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
}

/// `<bundle>-<what>` in the current folder.
pub(super) fn beside(bundle: &Path, what: &str) -> PathBuf {
    let name =
        bundle.canonicalize().ok().and_then(|p| p.file_name().map(|n| n.to_string_lossy().into_owned()));
    PathBuf::from(format!("{}-{what}", name.unwrap_or_else(|| "recording".to_owned())))
}

pub(super) fn said(stage: Progress) -> String {
    match stage {
        Progress::Building { unknowns: 0 } => "cutting the mesh and factoring".to_owned(),
        Progress::Building { unknowns } => format!("solving for every marker ({unknowns} unknowns)"),
        Progress::Searching { patches, misfit } => {
            format!("looking for restraint: {patches} patches, misfit {misfit:.2}")
        }
    }
}
