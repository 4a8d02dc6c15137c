//! `draw`: a seed → a recording bundle of the simulated bench, and beside it what it conceals.

use super::{Context, Exit, Kind, Outcome, StagedFile, StagedFolder};
use crate::dataset::write_bundle;
use crate::sim::{Draw, Kinematics, Truth, demo, draw, record};
use anyhow::Context as _;
use clap::Args;
use std::path::{Path, PathBuf};

/// Simulates a session on a phantom whose modulus and restraint are concealed.
///
/// Writes the recording bundle to OUT and the answer to OUT.truth.toml, beside and not inside it. Equal seeds
/// make equal bundles. The simulated bench has elements, meshes and loads of its own: it shares nothing with
/// the fit.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  phantom-rig draw --seed 7 recordings/draw-7
  phantom-rig draw --seed 7 --finite-strain recordings/draw-7-deep")]
pub(super) struct DrawArguments {
    /// Draw phantom, restraint, sites and noise from this seed
    #[arg(long, required_unless_present = "demo", conflicts_with = "demo")]
    seed: Option<u64>,
    /// Make the demonstration recording instead
    #[arg(long)]
    demo: bool,
    /// Deform a neo-Hookean phantom at finite strain, about a minute's work, and poke it twice as deep
    #[arg(long)]
    finite_strain: bool,
    /// Replace OUT and OUT.truth.toml when they exist
    #[arg(long)]
    force: bool,
    /// The bundle to write
    #[arg(value_name = "OUT")]
    out: PathBuf,
}

/// How much deeper the pokes of a session at finite strain are.
const DEEPER: f64 = 2.0;

pub(super) fn run(arguments: &DrawArguments, context: &Context) -> anyhow::Result<Outcome> {
    let session = session(arguments);
    let answer = answer_file(&arguments.out);
    let bundle = StagedFolder::new(&arguments.out, Kind::Recording, arguments.force)?;
    let beside = StagedFile::new(&answer, arguments.force)?;
    let spinner = context.progress.spinner("poking the simulated phantom");
    let recording = record(&session)?;
    spinner.label("writing");
    write_bundle(&recording, bundle.path())?;
    let truth = Truth::of(&session);
    std::fs::write(beside.path(), toml::to_string(&truth)?)
        .with_context(|| format!("can't write {}", answer.display()))?;
    bundle.finish()?;
    beside.finish()?;
    drop(spinner);
    let (pokes, markers) = (recording.pokes.len(), recording.markers.numbers.len());
    let text = format!(
        "{}: {pokes} pokes, {markers} markers, {} frames\n{}: what it conceals",
        arguments.out.display(),
        recording.markers.frame_time_s.len(),
        answer.display()
    );
    let json = serde_json::json!({
        "format": "phantom-draw/1",
        "bundle": arguments.out,
        "truth": answer,
        "pokes": pokes,
        "markers": markers,
    });
    Ok(Outcome { exit: Exit::Good, text, json })
}

fn session(arguments: &DrawArguments) -> Draw {
    let mut session = arguments.seed.map_or_else(demo, draw);
    if arguments.finite_strain {
        session.kinematics = Kinematics::FiniteStrain;
        for poke in &mut session.pokes {
            poke.depth_m *= DEEPER;
        }
    }
    session
}

/// `OUT.truth.toml`.
fn answer_file(out: &Path) -> PathBuf {
    let mut name = out.as_os_str().to_owned();
    name.push(".truth.toml");
    PathBuf::from(name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::Progress;
    use crate::dataset::read_bundle;

    #[test]
    fn the_bundle_reads_back_and_the_answer_lies_beside_it() {
        let place = tempfile::tempdir().expect("a temporary folder");
        let out = place.path().join("demo");
        let arguments =
            DrawArguments { seed: None, demo: true, finite_strain: false, force: false, out: out.clone() };
        let context = Context { progress: Progress::silent(), shows: false };
        run(&arguments, &context).expect("a bundle");
        let (read, suspicions) = read_bundle(&out).expect("a sound bundle");
        assert!(suspicions.is_empty(), "{suspicions:?}");
        assert_eq!(read, record(&demo()).expect("the same recording"));
        let size: u64 = std::fs::read_dir(&out)
            .expect("readable")
            .map(|e| e.expect("readable").metadata().expect("readable").len())
            .sum();
        assert!(size < 1_500_000, "the demonstration takes {size} bytes");
        let answer = std::fs::read_to_string(answer_file(&out)).expect("an answer");
        let answer: toml::Table = answer.parse().expect("TOML");
        assert_eq!(answer["young_modulus_pa"].as_float(), Some(demo().young_modulus_pa));
        assert_eq!(answer["restraint"].as_array().map(Vec::len), Some(2));
        assert!(run(&arguments, &context).is_err(), "an answer is not overwritten without force");
    }
}
