//! `diagnose`: a bundle → what the model left out, and a folder with a page, `diagnosis.json` and the next poke.

use super::continued::{ContinueArguments, Continued};
use super::{Context, Exit, Kind, Outcome, StagedFolder, UsageError, fit};
use crate::dataset::read_bundle;
use crate::diagnose::{Choice, Progress, Settings, diagnose};
use crate::geometry::Vec3;
use crate::inverse;
use crate::observation::Recording;
use crate::report::{conclusion, diagnosis_json, evidence, is_sure, write_diagnosis};
use crate::rig::RigFile;
use crate::units::counted;
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Says what physics the model leaves out of a recording: whether something is, where, what, how much.
///
/// Writes a folder with diagnosis.html (the page), diagnosis.json and, where another poke would tell more,
/// next-poke.csv. Ends with exit code 3 when the verdict does not stand alone with confidence: nothing in the
/// catalogue explains the recording, several entries do, or the confidence is below 90 %.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  phantom-rig diagnose rigs/demo
  phantom-rig diagnose rigs/demo --out demo-quick-diagnosis --quick
  phantom-rig diagnose rigs/demo --false-alarm 0.001
  phantom-rig diagnose proofs/1/recordings/draw-0004 --continue 'phantom-rig bench proofs/1 draw-0004'
  phantom-rig diagnose monday-bundle --rig rigs/sim.toml --continue 'phantom-rig poke sessions/monday --rig rigs/sim.toml'
  phantom-rig diagnose rigs/demo --print-only --json > demo.json")]
pub(super) struct DiagnoseArguments {
    /// The bundle: a folder with recording.toml, mesh.msh, pokes.csv, force.csv, markers.csv
    #[arg(value_name = "BUNDLE")]
    bundle: PathBuf,
    /// Where to write; by default the bundle's name with "-diagnosis", in the current folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace whatever is at DIR; without it only an earlier diagnosis
    #[arg(long)]
    force: bool,
    /// Stay on the given mesh: faster, less certain
    #[arg(long)]
    quick: bool,
    /// Share of recordings without anything left out in which a mismatch may be called
    #[arg(long, value_name = "SHARE", default_value_t = FALSE_ALARM, allow_negative_numbers = true)]
    false_alarm: f64,
    /// Write no folder; only say what was found
    #[arg(long, conflicts_with_all = ["out", "force"])]
    print_only: bool,
    /// Ask only for pokes that the stage of this rig file can make: leaning in its plane of motion
    #[arg(long, value_name = "FILE")]
    rig: Option<PathBuf>,
    #[command(flatten)]
    further: ContinueArguments,
}

const FALSE_ALARM: f64 = 0.02;

pub(super) fn run(arguments: &DiagnoseArguments, context: &Context) -> anyhow::Result<Outcome> {
    let share = arguments.false_alarm;
    if !(share > 0.0 && share < 1.0) {
        return Err(UsageError(format!("--false-alarm must lie between 0 and 1, got {share}")).into());
    }
    let settings = Settings {
        fit: inverse::Settings { quick: arguments.quick, ..inverse::Settings::default() },
        false_alarm: share,
        enough: arguments.further.confidence,
        choice: arguments.further.random_pokes.map_or(Choice::Telling, Choice::Random),
        plane: arguments.rig.as_deref().map(plane).transpose()?,
    };
    arguments.further.check()?;
    let spinner = context.progress.spinner("reading");
    let (mut recording, suspicions) = read_bundle(&arguments.bundle)?;
    let destination = arguments.out.clone().unwrap_or_else(|| fit::beside(&arguments.bundle, "diagnosis"));
    let folder = match arguments.print_only {
        true => None,
        false => Some(StagedFolder::new(&destination, Kind::Diagnosis, arguments.force)?),
    };
    let further = &arguments.further;
    further.check_folder(&destination, arguments.force)?;
    let made =
        |recording: &Recording| Ok(diagnose(recording, &settings, &mut |stage| spinner.label(&said(stage)))?);
    let mut diagnosis = made(&recording)?;
    let tell = |text: &str| spinner.label(text);
    let continued = further.go_on(&destination, &mut recording, &mut diagnosis, &tell, made)?;
    let failed = continued.as_ref().is_some_and(Continued::failed);
    diagnosis.remarks.extend(suspicions.iter().map(ToString::to_string));
    let made_with = json!({
        "bundle": arguments.bundle.display().to_string(),
        "quick": arguments.quick,
        "false_alarm": share,
    });
    let mut made_with = made_with.as_object().cloned().unwrap_or_default();
    if let Some(continued) = continued {
        made_with.insert("continued".to_owned(), serde_json::to_value(continued)?);
    }
    let mut text = format!("{}.\n{}", conclusion(&diagnosis), evidence(&diagnosis));
    for remark in &diagnosis.remarks {
        text.push_str(&format!("\n- {remark}"));
    }
    if let Some(poke) = &diagnosis.next_poke {
        text.push_str(&format!("\nNext poke: {}", poke.why));
    }
    if let Some(folder) = folder {
        spinner.label("writing");
        write_diagnosis(folder.path(), &diagnosis, &recording, &made_with)?;
        folder.finish()?;
        text.push_str(&format!("\nPage: {}", destination.join("diagnosis.html").display()));
    }
    drop(spinner);
    let good = is_sure(&diagnosis) && !failed;
    Ok(Outcome {
        exit: if good { Exit::Good } else { Exit::Degraded },
        text,
        json: diagnosis_json(&diagnosis, &made_with)?,
    })
}

/// Normal of the plane in which a rig's stage moves the tip.
fn plane(rig: &Path) -> anyhow::Result<Vec3> {
    let mounting = RigFile::read(rig)?.mounting();
    let [first, second] = [[1.0, 0.0], [0.0, 1.0]].map(|motion| mounting.moved_by(motion));
    Ok(first.cross(&second).normalize())
}

fn said(stage: Progress) -> String {
    match stage {
        Progress::Fitting(stage) => fit::said(stage),
        Progress::Screening => "trying every entry of the catalogue".to_owned(),
        Progress::Restraint { readings } => {
            format!("looking for restraint anew under {}", counted(readings, "reading", "readings"))
        }
        Progress::LookingCloser { unknowns } => format!("looking closer: {unknowns} unknowns"),
        Progress::Refitting { acting: 0, entries } => format!("refitting {entries} entries"),
        Progress::Refitting { acting, entries } => format!("refitting {entries} entries beside {acting}"),
    }
}
