//! `conceal`: a seed → recordings of simulated sessions, the hashes of what they conceal, and the answers under seal.

use super::proof::{
    Manifest, ProofError, ProofFolder, Seal, Sums, bundle_sum, digest, draw_name, hex, read_sums, replace,
    write_sums,
};
use super::{Context, Exit, Kind, Outcome, StagedFolder, UsageError};
use crate::dataset::write_bundle;
use crate::observation::Recording;
use crate::sim::{Answer, Phantom, SimError, Strength, World};
use anyhow::Context as _;
use clap::Args;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::collections::VecDeque;
use std::path::PathBuf;

/// Draws simulated sessions that conceal effects, or none, and seals what they conceal.
///
/// Writes recordings to DIR/recordings and a salted SHA-256 hash of each answer to DIR/hashes.csv, in the open; the
/// answers, encrypted, to DIR.sealed, and what opens them to DIR.key. A session that the bench cannot carry through is
/// drawn anew; how often is written in its answer. Equal seeds make equal draws. Goes on where it was stopped; a larger
/// COUNT adds draws.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  phantom-rig conceal --seed 20261 --count 500 --out proofs/20261
  phantom-rig conceal --seed 7 --count 3 --phantoms 1 --out proofs/small")]
pub(super) struct ConcealArguments {
    /// Draw phantoms, effects, strengths, protocols and noise from this seed
    #[arg(long)]
    seed: u64,
    /// Draws in all
    #[arg(long)]
    count: u64,
    /// Phantoms that the draws share; each costs some twenty seconds of processor time
    #[arg(long, default_value_t = 20)]
    phantoms: u64,
    /// Pass over draws that conceal nothing
    #[arg(long)]
    with_effect: bool,
    /// Where to write
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// A draw that the bench refuses so often in a row is given up.
const ATTEMPTS: u64 = 50;

/// From what the world of a draw is made. Sealed with its answer, so that the session can be gone on with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Session {
    seed: u64,
    stock_seed: u64,
    phantoms: u64,
}

/// A draw to be made.
struct Waiting {
    draw: String,
    index: u64,
    /// Seeds before this one that were passed over.
    skipped: u64,
    /// Those of them that the bench could not record.
    refusals: u64,
    world: World,
    /// Why the last was refused.
    refused: Option<SimError>,
}

pub(super) fn run(arguments: &ConcealArguments, context: &Context) -> anyhow::Result<Outcome> {
    for (name, value) in [("count", arguments.count), ("phantoms", arguments.phantoms)] {
        if value == 0 {
            return Err(UsageError(format!("--{name} 0: at least one is needed")).into());
        }
    }
    let folder = ProofFolder::new(&arguments.out);
    let seal = begin(arguments, &folder)?;
    let mut hashes = read_sums(&folder.hashes())?;
    let made = |draw: &str, hashes: &Sums| {
        folder.recording(draw).is_dir() && folder.sealed(draw).is_file() && hashes.contains_key(draw)
    };
    let mut waiting: Vec<Waiting> = (1..=arguments.count)
        .filter(|&index| !made(&draw_name(index), &hashes))
        .map(|index| Waiting::first(arguments, index))
        .collect();
    let (new, mut skipped) = (waiting.len(), 0);
    let bar = context.progress.bar("drawing", new as u64);
    while let Some(plan) = waiting.first().map(|w| w.world.phantom.clone()) {
        let (now, later): (Vec<_>, Vec<_>) = waiting.into_iter().partition(|w| w.world.phantom == plan);
        waiting = later;
        let mut now = VecDeque::from(now);
        bar.label("preparing a phantom");
        let phantom = Phantom::prepare(&plan);
        bar.label("drawing");
        while !now.is_empty() {
            let some: Vec<Waiting> = now.drain(..now.len().min(rayon::current_num_threads())).collect();
            let recorded: Vec<(Waiting, Result<Recorded, SimError>)> = some
                .into_par_iter()
                .map(|w| {
                    let recorded = match &phantom {
                        Ok(phantom) => record(&w.world, phantom),
                        Err(error) => Err(error.clone()),
                    };
                    (w, recorded)
                })
                .collect();
            for (draw, recorded) in recorded {
                match recorded {
                    Ok(recorded) => {
                        write(arguments, &folder, &seal, &draw, recorded, &mut hashes)?;
                        bar.advance();
                    }
                    Err(error) => {
                        skipped += 1;
                        let again = draw.again(arguments, error)?;
                        if phantom.is_ok() && again.world.phantom == plan {
                            now.push_back(again);
                        } else {
                            waiting.push(again);
                        }
                    }
                }
            }
        }
    }
    drop(bar);
    let text = format!(
        "{}: {} draws, {new} of them new; {skipped} seeds were passed over because the bench could not record them\n\
         {}: hashes of the answers\n{}: opens them",
        arguments.out.display(),
        hashes.len(),
        folder.hashes().display(),
        folder.key().display()
    );
    let json = json!({
        "format": "phantom-conceal/1",
        "folder": arguments.out,
        "draws": hashes.len(),
        "new": new,
        "passed_over": skipped,
    });
    Ok(Outcome { exit: Exit::Good, text, json })
}

/// Makes the folder, or checks that it was made from the same seed.
fn begin(arguments: &ConcealArguments, folder: &ProofFolder) -> anyhow::Result<Seal> {
    let place = || arguments.out.clone();
    let mut manifest = Manifest {
        format: "phantom-conceal/1".to_owned(),
        count: arguments.count,
        phantoms: arguments.phantoms,
        with_effect: arguments.with_effect,
        seed_sha256: hex(&digest("phantom-rig seed", &[&arguments.seed.to_le_bytes()])),
    };
    match folder.manifest()? {
        None => {
            let taken = arguments.out.read_dir().is_ok_and(|mut entries| entries.next().is_some());
            if taken || arguments.out.is_file() {
                return Err(ProofError::Taken { place: place() }.into());
            }
        }
        Some(before) => {
            if before.seed_sha256 != manifest.seed_sha256 {
                return Err(ProofError::OtherSeed { place: place() }.into());
            }
            if before.phantoms != manifest.phantoms {
                let (has, asked) = (before.phantoms, manifest.phantoms);
                return Err(ProofError::OtherPhantoms { place: place(), has, asked }.into());
            }
            if before.with_effect != manifest.with_effect {
                return Err(ProofError::OtherKind { place: place() }.into());
            }
            manifest.count = manifest.count.max(before.count);
        }
    }
    folder.make()?;
    folder.write_manifest(&manifest)?;
    let seal = Seal::of_seed(arguments.seed);
    replace(&folder.key(), seal.text().as_bytes())?;
    Ok(seal)
}

impl Waiting {
    fn first(arguments: &ConcealArguments, index: u64) -> Self {
        let (skipped, world) = wanted(arguments, index, 0);
        Self { draw: draw_name(index), index, skipped, refusals: 0, world, refused: None }
    }

    /// The same draw from the next seed.
    fn again(self, arguments: &ConcealArguments, error: SimError) -> anyhow::Result<Self> {
        let refusals = self.refusals + 1;
        if refusals == ATTEMPTS {
            let what = format!("{}: the bench could record none of {ATTEMPTS} sessions", self.draw);
            return Err(error).context(what);
        }
        let (skipped, world) = wanted(arguments, self.index, self.skipped + 1);
        Ok(Self { skipped, refusals, world, refused: Some(error), ..self })
    }
}

/// The first world of a draw, from the attempt on, that is asked for, with its attempt.
fn wanted(arguments: &ConcealArguments, index: u64, from: u64) -> (u64, World) {
    let mut attempt = from;
    loop {
        let world = session(arguments, index, attempt).world(&draw_name(index));
        if !arguments.with_effect || !Answer::of(&world).physics.is_empty() {
            return (attempt, world);
        }
        attempt += 1;
    }
}

/// From what the world of a draw is made: seeds follow from the seed by a hash, so that none tells another.
fn session(arguments: &ConcealArguments, index: u64, attempt: u64) -> Session {
    let number = |purpose: &str, of: &[u64]| {
        let parts: Vec<[u8; 8]> = of.iter().map(|n| n.to_le_bytes()).collect();
        let parts: Vec<&[u8]> = parts.iter().map(<[u8; 8]>::as_slice).collect();
        let mut bytes = [0; 8];
        bytes.copy_from_slice(&digest(purpose, &parts)[..8]);
        u64::from_le_bytes(bytes)
    };
    Session {
        seed: number("phantom-rig draw", &[arguments.seed, index, attempt]),
        stock_seed: number("phantom-rig stock", &[arguments.seed]),
        phantoms: arguments.phantoms,
    }
}

impl Session {
    /// The world that is recorded under this name: the one that the world gives itself tells its seed.
    pub(super) fn world(self, name: &str) -> World {
        let mut world = World::draw(self.seed, self.stock_seed, self.phantoms);
        world.name = name.to_owned();
        world
    }
}

/// A recording with the strength of what it conceals.
struct Recorded {
    recording: Recording,
    strength: Option<Strength>,
}

fn record(world: &World, phantom: &Phantom) -> Result<Recorded, SimError> {
    let recording = world.record(phantom)?;
    let strength = world.strength(phantom, &recording)?;
    Ok(Recorded { recording, strength })
}

/// Writes a draw: answer under seal, hash, and last the recording, by which it counts as made.
fn write(
    arguments: &ConcealArguments,
    folder: &ProofFolder,
    seal: &Seal,
    waiting: &Waiting,
    recorded: Recorded,
    hashes: &mut Sums,
) -> anyhow::Result<()> {
    let draw = &waiting.draw;
    let bundle = StagedFolder::new(&folder.recording(draw), Kind::Recording, true)?;
    write_bundle(&recorded.recording, bundle.path())?;
    let more = json!({
        "session": session(arguments, waiting.index, waiting.skipped),
        "passed_over": waiting.skipped,
        "passed_over_because": waiting.refused.as_ref().map(ToString::to_string),
        "strength": recorded.strength.as_ref().map(|s| s.net),
        "own_strength": recorded.strength.as_ref().map(|s| &s.own),
        "signal": recorded.strength.as_ref().map(|s| s.signal),
        "bundle_sha256": bundle_sum(bundle.path())?,
    });
    seal_answer(folder, seal, draw, &waiting.world, &more, hashes)?;
    Ok(bundle.finish()?)
}

/// Puts what a world conceals under seal, with `more` beside it, and its hash in the open.
pub(super) fn seal_answer(
    folder: &ProofFolder,
    seal: &Seal,
    draw: &str,
    world: &World,
    more: &serde_json::Value,
    hashes: &mut Sums,
) -> anyhow::Result<()> {
    let mut answer = serde_json::to_value(Answer::of(world))?;
    if let Some(keys) = answer.as_object_mut() {
        // Derived from the seed: who does not know it cannot try answers against the hash.
        let salt = digest("phantom-rig salt", &[seal.text().as_bytes(), draw.as_bytes()]);
        keys.insert("format".to_owned(), "phantom-answer/1".into());
        keys.insert("salt".to_owned(), hex(&salt).into());
        keys.extend(more.as_object().cloned().unwrap_or_default());
    }
    let text = serde_json::to_vec_pretty(&answer)?;
    replace(&folder.sealed(draw), &seal.close(draw, &text)?)?;
    hashes.insert(draw.to_owned(), hex(&digest("phantom-rig answer", &[&text])));
    Ok(write_sums(&folder.hashes(), hashes)?)
}
