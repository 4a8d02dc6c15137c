//! `bench`: the simulated bench of a concealed draw goes on with its session.

use super::conceal::Session;
use super::proof::{ProofError, ProofFolder, open_answer, open_key, read_sums};
use super::{Context, Exit, Kind, Outcome, StagedFolder};
use crate::dataset::{read_planned_pokes, write_bundle};
use crate::sim::Phantom;
use crate::units::counted;
use clap::Args;
use serde::Deserialize;
use serde_json::json;
use std::path::PathBuf;

/// Goes on with the session of a concealed draw: the pokes of its recording, then more.
///
/// Writes a bundle that repeats the draw's recording up to its last instant, at which the next poke begins: to the last bit
/// where only places are poked that the phantom has, those of the recording among them. Needs the key, because what the draw
/// conceals acts on: whoever asks for the pokes is told nothing but the bundle. Takes some twenty seconds of processor time.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  phantom-rig bench proofs/20261 draw-0004 --pokes next-poke.csv --out recordings/draw-0004-more
  phantom-rig diagnose proofs/20261/recordings/draw-0004 --continue 'phantom-rig bench proofs/20261 draw-0004'")]
pub(super) struct BenchArguments {
    /// The folder that `conceal` made
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// The draw, such as draw-0004
    #[arg(value_name = "DRAW")]
    draw: String,
    /// All pokes to make after those of the draw's recording: a table as `diagnose` writes it
    #[arg(long, value_name = "CSV")]
    pokes: PathBuf,
    /// The bundle to write
    #[arg(long, value_name = "BUNDLE")]
    out: PathBuf,
    /// The key of the answers; by default DIR.key
    #[arg(long, value_name = "FILE")]
    key: Option<PathBuf>,
    /// Replace whatever is at BUNDLE
    #[arg(long)]
    force: bool,
}

/// What of an answer tells how to make its session.
#[derive(Deserialize)]
struct Made {
    session: Session,
}

pub(super) fn run(arguments: &BenchArguments, context: &Context) -> anyhow::Result<Outcome> {
    let (folder, draw) = (ProofFolder::new(&arguments.folder), arguments.draw.as_str());
    folder.made()?;
    let sums = read_sums(&folder.hashes())?;
    if !sums.contains_key(draw) {
        let (place, draw) = (arguments.folder.clone(), draw.to_owned());
        let ends = [sums.keys().next(), sums.keys().next_back()];
        let known = ends.map(|end| end.map_or("none", String::as_str)).join(" to ");
        return Err(ProofError::NoSuchDraw { place, draw, known }.into());
    }
    let planned = read_planned_pokes(&arguments.pokes)?;
    let seal = open_key(&folder, arguments.key.as_deref())?;
    let made: Made = open_answer(&folder, &seal, draw, &sums)?;
    let mut world = made.session.world(draw);
    for poke in &planned {
        world.press(poke)?;
    }
    let bundle = StagedFolder::new(&arguments.out, Kind::Recording, arguments.force)?;
    let spinner = context.progress.spinner("preparing the phantom");
    let phantom = Phantom::prepare(&world.phantom)?;
    spinner.label("poking");
    let recording = world.record(&phantom)?;
    spinner.label("writing");
    write_bundle(&recording, bundle.path())?;
    bundle.finish()?;
    drop(spinner);
    let pokes = recording.pokes.len();
    Ok(Outcome {
        exit: Exit::Good,
        text: format!(
            "{}: {}, {} of them new",
            arguments.out.display(),
            counted(pokes, "poke", "pokes"),
            planned.len()
        ),
        json: json!({
            "format": "phantom-bench/1",
            "bundle": arguments.out,
            "pokes": pokes,
            "new": planned.len(),
        }),
    })
}
