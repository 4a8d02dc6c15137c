//! `demo`: the main job from end to end on a simulated bench that conceals something: run, export, fit, diagnose, and the answer.

use super::conceal::seal_answer;
use super::interrupt::{Kept, so_far};
use super::look::{late, seen};
use super::planned::{Planned, PlannedArguments};
use super::proof::{Manifest, ProofFolder, Seal, bundle_sum, digest, draw_name, hex, read_sums, replace};
use super::recorded_run::{How, MESH, record, told};
use super::run_watch::Watch;
use super::{Context, Exit, Kind, Outcome, StagedFolder};
use crate::acquire::Cause;
use crate::clock::HostTime;
use crate::dataset::{read_phantom, read_seen_sessions, write_bundle};
use crate::rig::SimulatedBench;
use crate::session::Session;
use crate::sim::World;
use anyhow::{Context as _, anyhow, bail};
use clap::Args;
use serde_json::json;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Shows the main job from end to end on a simulated bench that conceals something.
///
/// Draws what the bench conceals and puts it under seal; runs a short protocol on it through the real drivers; exports the recording;
/// fits it as if nothing were concealed; diagnoses it in a process that is given the recording and nothing else; opens the seal.
/// Markers come from the pictures of the bench's depth camera. Takes some four minutes: the run is real time.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  phantom-rig demo
  phantom-rig demo --seed 77 --out target/demo/77")]
pub(super) struct DemoArguments {
    /// Draw what is concealed from this seed; by default another one each time
    #[arg(long)]
    seed: Option<u64>,
    /// Where everything goes: a folder that does not exist yet; by default demo-SEED
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// A rig file of the same simulated bench, and what it names beside it.
struct Rig {
    text: &'static str,
    beside: &'static [(&'static str, &'static str)],
}

/// Markers are found in pictures.
const SEEN: Rig = Rig {
    text: include_str!("../../rigs/sim-camera.toml"),
    beside: &[("sim-camera-registration.toml", include_str!("../../rigs/sim-camera-registration.toml"))],
};
/// The bench tells where they are.
const TOLD: Rig = Rig { text: include_str!("../../rigs/sim.toml"), beside: &[] };

/// Runs that are begun, where the computer stands still for so long that the guard stops them: the last without pictures, which take a
/// processor to make. A program without OpenCV takes none.
const TRIES: [Rig; 3] = if cfg!(feature = "opencv") { [SEEN, SEEN, TOLD] } else { [TOLD, TOLD, TOLD] };

const PROTOCOL: &str = include_str!("../../rigs/protocols/demo.toml");

pub(super) fn run(arguments: &DemoArguments, context: &Context) -> anyhow::Result<Outcome> {
    let seed = arguments.seed.unwrap_or_else(|| rand::random_range(0..u64::from(u32::MAX)));
    let out = arguments.out.clone().unwrap_or_else(|| PathBuf::from(format!("demo-{seed}")));
    if out.exists() {
        bail!("{}: is there already; name another place with --out", out.display());
    }
    let tell = |text: &str| {
        if context.shows {
            eprintln!("{text}");
        }
    };
    let proof = ProofFolder::new(&out);
    proof.make()?;
    let _kept = Kept::so_far(&out);
    carry_out(seed, &out, &proof, &tell, context).map_err(|error| anyhow!("{error:#}; {}", so_far(&out)))
}

/// Everything, in a folder that was made for it.
fn carry_out(
    seed: u64,
    out: &Path,
    proof: &ProofFolder,
    tell: &dyn Fn(&str),
    context: &Context,
) -> anyhow::Result<Outcome> {
    tell(&format!("Seed {seed}. A bench is drawn, with an effect that it does not tell."));
    let planned = plan_on(&TRIES[0], out)?;
    let world =
        planned.rig.simulated(&planned.pokes())?.context("the demonstration's rig is simulated")?.world;
    let world = World { name: draw_name(1), ..world.concealing(seed, cfg!(feature = "opencv")) };

    tell("A protocol is run on it: the drivers are those of a real bench.");
    let session = out.join("session");
    let how = How {
        watch: Watch::choose(context, false),
        yes: true,
        clear: false,
        bias: false,
        at_rest_s: 0.0,
        live: false,
    };
    let mut tries = 0;
    let recorded = loop {
        let planned = plan_on(&TRIES[tries], out)?;
        let bench = SimulatedBench { world: world.clone() };
        let recorded = record(&planned, Some(bench), &session, false, how, context)?;
        let Some(stopped) = &recorded.ran.stopped else { break recorded };
        let why = told(stopped, &recorded.ran);
        tries += 1;
        if recorded.ran.asked || !stood_still(stopped.tripped.cause) || tries == TRIES.len() {
            bail!("{}: stopped: {why}", session.display());
        }
        let aside = out.join(format!("stopped-{tries}"));
        fs::rename(&session, &aside).with_context(|| format!("{}: can't be moved", session.display()))?;
        tell(&format!(
            "The run was stopped: {why}. Nothing is wrong with a simulated bench: this computer stood still. What there is of \
             the session is in {}. Once more{}.",
            aside.display(),
            if cfg!(feature = "opencv") && tries + 1 == TRIES.len() { ", without a camera" } else { "" }
        ));
    };
    tell("The recording is exported, and the answer put under seal.");
    let (bundle, zero) = export(&session, proof, tell, context)?;
    // The answer is what was true when the recording began, not when the bench was switched on.
    let (began, time_s) = recorded.began;
    let later_s = time_s.context("the demonstration's rig is simulated")? + zero.seconds_after(began);
    conclude(proof, seed, &world.later(later_s), &bundle)?;

    tell("The recording is fitted as if nothing were concealed.");
    let fit = out.join("fit");
    if !child(context, &["fit".as_ref(), bundle.as_os_str(), "--out".as_ref(), fit.as_os_str()])? {
        tell("A plain fit has no answer, see above; a diagnosis may.");
    }
    tell("It is diagnosed; then the sealed answer is opened.");
    let prove = ["prove".as_ref(), out.as_os_str(), "--pages".as_ref()];
    if !child(context, &prove)? {
        bail!("the recording could not be diagnosed: see above");
    }
    let page = proof.page(&draw_name(1));
    let fit = fit.is_dir().then_some(fit);
    let places = [
        ("Session", Some(session.clone())),
        ("Fit", fit.as_ref().map(|fit| fit.join("fit.html"))),
        ("Diagnosis", Some(page.clone())),
    ];
    let told = places.into_iter().filter_map(|(name, place)| Some(format!("{name}: {}", place?.display())));
    Ok(Outcome {
        exit: Exit::Good,
        text: told.collect::<Vec<_>>().join("\n"),
        json: json!({
            "format": "phantom-demo/1",
            "seed": seed,
            "session": session,
            "recording": bundle,
            "fit": fit,
            "diagnosis": page,
            "force_records": recorded.stop.force_records,
            "lost": recorded.ran.losses.lost,
        }),
    })
}

/// The protocol on a rig, whose files are written into a folder first.
fn plan_on(rig: &Rig, folder: &Path) -> anyhow::Result<Planned> {
    let (file, protocol) = (folder.join("rig.toml"), folder.join("protocol.toml"));
    let beside = rig.beside.iter().map(|(name, text)| (folder.join(name), *text));
    for (file, text) in [(file.clone(), rig.text), (protocol.clone(), PROTOCOL)].into_iter().chain(beside) {
        fs::write(&file, text).with_context(|| format!("{}: can't be written", file.display()))?;
    }
    PlannedArguments::of_files(&protocol, &file).read()
}

/// Whether a run on a bench without faults may be stopped so because the computer stood still.
fn stood_still(cause: Cause) -> bool {
    use Cause::{CameraLost, SensorGap, SensorLate, SensorSilent, StageAstray, StageFault, StageSilent};
    matches!(
        cause,
        CameraLost
            | SensorSilent { .. }
            | SensorLate { .. }
            | SensorGap { .. }
            | StageSilent
            | StageFault { .. }
            | StageAstray
    )
}

/// The session as a recording, in the place where `prove` looks for it, and when its time is zero.
fn export(
    session: &Path,
    proof: &ProofFolder,
    tell: &dyn Fn(&str),
    context: &Context,
) -> anyhow::Result<(PathBuf, HostTime)> {
    let (recorded, mesh) = (Session::open(session)?, read_phantom(&session.join(MESH))?);
    let from = read_seen_sessions(&seen(&[recorded], &mesh, None, context)?, mesh)?;
    for lag in from.camera_lags.iter().flatten() {
        tell(&format!("Note: {}.", late(lag)));
    }
    for remark in &from.remarks {
        tell(&format!("Note: {remark}."));
    }
    let place = proof.recording(&draw_name(1));
    let bundle = StagedFolder::new(&place, Kind::Recording, false)?;
    write_bundle(&from.recording, bundle.path())?;
    bundle.finish()?;
    Ok((place, from.zero))
}

/// The answer under seal, its hash in the open.
fn conclude(proof: &ProofFolder, seed: u64, world: &World, bundle: &Path) -> anyhow::Result<()> {
    proof.write_manifest(&Manifest {
        format: "phantom-conceal/1".to_owned(),
        count: 1,
        phantoms: 1,
        with_effect: true,
        seed_sha256: hex(&digest("phantom-rig seed", &[&seed.to_le_bytes()])),
    })?;
    let seal = Seal::of_seed(seed);
    replace(&proof.key(), seal.text().as_bytes())?;
    let mut hashes = read_sums(&proof.hashes())?;
    let more = json!({"bundle_sha256": bundle_sum(bundle)?});
    seal_answer(proof, &seal, &draw_name(1), world, &more, &mut hashes)
}

/// Another command of this program, whose output is shown: whether it had an answer. A model that does not explain the recording is one.
fn child(context: &Context, arguments: &[&std::ffi::OsStr]) -> anyhow::Result<bool> {
    let program = std::env::current_exe().context("can't find this program")?;
    let mut command = Command::new(program);
    command.args(arguments);
    if !context.shows {
        command.arg("--quiet").stdout(Stdio::null());
    }
    let status = command.status().context("can't start this program again")?;
    match status.code() {
        Some(0 | 3) => Ok(true),
        Some(1) => Ok(false),
        _ => bail!("phantom-rig {} ended with {status}", arguments[0].to_string_lossy()),
    }
}
