//! `run`: a protocol carried out on a rig, watched, and recorded as a session.

use super::interrupt::Interrupts;
use super::planned::{Planned, PlannedArguments};
use super::run_watch::{Watch, watch};
use super::{Context, Exit, Outcome, UsageError};
use crate::acquire::{
    Cause, CheckedPlan, Conduct, Instruments, Latch, Operator, Ran, Stopped, Watched, conduct,
};
use crate::clock::HostTime;
use crate::dataset::{read_mesh, write_msh};
use crate::device::{ForceFormat, MarkerSource, Stage, StageLimits, StageState};
use crate::rig::{Devices, RigFile};
use crate::session::{
    Event, ForceDocument, HashedText, MarkersDocument, MountingDocument, Outcome as SessionOutcome,
    PhantomDocument, Session, SessionWriter, StageDocument, StartDocument, TipDocument, utc_text,
};
use anyhow::{Context as _, bail};
use clap::Args;
use serde_json::json;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, SystemTime};

/// Carries a protocol out on a rig and records everything that the devices say.
///
/// Checks the whole plan first, then the devices; homes the stage if it has not homed; reads the force sensor with nothing at the tip,
/// and takes that for the zero of its limits. While it runs, the force is watched on every single record: whatever goes wrong stops the
/// stage, is told, and is put down. Space, q or Ctrl-C stop it too. This program is no emergency stop: see the README on safety.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  phantom-rig run rigs/protocols/five-pokes.toml --rig rigs/sim.toml --yes
  phantom-rig run rigs/protocols/five-pokes.toml --rig rigs/sim.toml --out sessions/monday --from 3
  phantom-rig run rigs/protocols/five-pokes.toml --rig rigs/sim.toml --out sessions/monday --resume")]
pub(super) struct RunArguments {
    #[command(flatten)]
    planned: PlannedArguments,
    /// Where the session goes: a folder that does not exist yet; by default sessions/DATE-PROTOCOL
    #[arg(long, value_name = "SESSION")]
    out: Option<PathBuf>,
    /// Go on with an interrupted session at the first poke that it did not finish
    #[arg(long, requires = "out", conflicts_with = "from")]
    resume: bool,
    /// Agree to every question of the protocol beforehand
    #[arg(long)]
    yes: bool,
    /// Clear a fault that the stage has latched: somebody has looked at the bench
    #[arg(long)]
    clear: bool,
    /// Have the force sensor take its reading for zero first, with nothing at the tip; what it read before is gone
    #[arg(long)]
    bias: bool,
    /// Print lines instead of a screen
    #[arg(long)]
    lines: bool,
}

/// What is left over of a disk, whatever a session needs (bytes).
const SPARE: f64 = 200e6;
/// How long a stage may take to say what it is doing.
const ANSWER: Duration = Duration::from_secs(3);

pub(super) fn run(arguments: &RunArguments, context: &Context) -> anyhow::Result<Outcome> {
    let mut planned = arguments.planned.read()?;
    let resumed = arguments.resume.then(|| Session::open(arguments.out.as_deref().unwrap_or(Path::new("."))));
    let resumed = resumed.transpose()?;
    if let Some(session) = &resumed {
        planned.go_on_from(first_unfinished(session)?)?;
    }
    let watch_by = Watch::choose(context, arguments.lines);
    if planned.asks() && !arguments.yes && watch_by != Watch::Screen {
        return Err(UsageError(
            "the protocol asks questions and nobody is there to answer; pass --yes".to_owned(),
        )
        .into());
    }
    // Once without devices: what speaks against the plan is known before anything is opened.
    planned.plan([0.0, 0.0]).checked()?;
    let folder = match &arguments.out {
        Some(folder) => folder.clone(),
        None => default_folder(planned.protocol.name()),
    };
    let parent = folder.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if arguments.out.is_none() {
        std::fs::create_dir_all(parent).with_context(|| format!("{}: can't be made", parent.display()))?;
    }
    let spinner = context.progress.spinner("opening the devices");
    let mut devices = planned.rig.open(&planned.pokes())?;
    let position = at_rest(devices.stage.as_mut(), arguments.clear)?;
    let plan = planned.plan(position).checked()?;
    fits(&planned.rig, devices.stage.limits(), devices.force.format())?;
    room(parent, plan.plan().data_bytes())?;
    if arguments.bias {
        devices.force.bias()?;
    }
    devices.force.start()?;
    drop(spinner);

    let mesh = match planned.rig.mesh() {
        Some(file) => read_mesh(&file)?,
        None => devices.simulated_mesh()?,
    };
    let start = start_document(&planned, &devices);
    let writer = match &resumed {
        Some(_) => SessionWriter::continue_session(&folder, start)?,
        None => SessionWriter::create(&folder, start)?,
    };
    if resumed.is_none() {
        let file = folder.join(MESH);
        let mut to = BufWriter::new(
            File::create(&file).with_context(|| format!("{}: can't be written", file.display()))?,
        );
        write_msh(&mesh, &mut to)
            .and_then(|()| to.flush())
            .with_context(|| format!("{}: can't be written", file.display()))?;
    }
    if arguments.bias {
        writer.recorder().event(Event::new(HostTime::now(), "bias"));
    }
    let ran = carry_out(&planned, &plan, devices, &writer, watch_by, arguments.yes)?;
    let outcome = match &ran.stopped {
        None => SessionOutcome::Success,
        Some(stopped) => SessionOutcome::Abort { cause: told(stopped, &ran) },
    };
    let stop = writer.finish(outcome, ran.losses, HostTime::now())?;
    Ok(said(&folder, &plan, &ran, &stop))
}

/// File of the phantom's mesh in a session's folder.
pub(super) const MESH: &str = "mesh.msh";

/// Runs the plan on a thread of its own while this one shows it.
fn carry_out(
    planned: &Planned,
    plan: &CheckedPlan,
    mut devices: Devices,
    writer: &SessionWriter,
    watch_by: Watch,
    yes: bool,
) -> anyhow::Result<Ran> {
    let latch = Arc::new(Latch::new(devices.stage.stopper()?));
    let theirs = Arc::clone(&latch);
    let _interrupts = Interrupts::to(move || theirs.trip(Cause::Asked, HostTime::now()));
    let (watched, operator) = (Watched::default(), Operator::default());
    let (silence, gap, frozen) = planned.rig.patience();
    let doing = Conduct {
        plan,
        bench: &planned.bench,
        silence,
        gap,
        frozen,
        latch: &latch,
        watched: &watched,
        operator: &operator,
    };
    let title = format!("{} · {}", planned.protocol.name(), planned.rig.name());
    let instruments = Instruments {
        stage: &mut *devices.stage,
        force: &mut *devices.force,
        markers: devices.markers.as_mut().map(|source| &mut **source as &mut dyn MarkerSource),
    };
    let ran = std::thread::scope(|scope| {
        let runner = scope.spawn(|| conduct(instruments, &doing, writer));
        let over = || runner.is_finished();
        watch(watch_by, &title, &planned.bench, &watched, &operator, &latch, yes, &over);
        runner.join()
    });
    let ran = ran.map_err(|_| anyhow::anyhow!("the run gave up; the stage was stopped"))??;
    // A stream that nobody reads any more is asked to end; it ends by itself when the sensor hears nobody.
    let _ = devices.force.stop();
    Ok(ran)
}

/// Where the stage is; refuses one that is latched, unless a person has cleared it.
fn at_rest(stage: &mut dyn Stage, clear: bool) -> anyhow::Result<[f64; 2]> {
    let end = HostTime::now() + ANSWER;
    let mut cleared = false;
    while HostTime::now() < end {
        let Some(report) = stage.report(HostTime::now() + Duration::from_millis(100))? else { continue };
        match report.state {
            StageState::Idle => return Ok(report.position_m),
            StageState::Fault { .. } if clear && !cleared => {
                stage.clear()?;
                cleared = true;
            }
            StageState::Fault { .. } if cleared => {}
            StageState::Fault { code } => {
                bail!(
                    "{} has latched fault {code}; look at the bench, then pass --clear",
                    stage.identity().port
                )
            }
            StageState::Moving | StageState::Homing => {}
        }
    }
    bail!("{} does not come to rest within {} s", stage.identity().port, ANSWER.as_secs())
}

/// Refuses devices that can do less than the rig file says.
fn fits(rig: &RigFile, limits: &StageLimits, format: &ForceFormat) -> anyhow::Result<()> {
    let stated = rig.limits();
    for axis in 0..2 {
        let ([low, high], [least, most]) = (stated.travel_m[axis], limits.travel_m[axis]);
        if low < least - 1e-9 || high > most + 1e-9 {
            bail!(
                "stage.travel_mm of axis {axis} goes from {:.3} to {:.3} mm; the controller allows {:.3} to {:.3} mm",
                low * 1e3,
                high * 1e3,
                least * 1e3,
                most * 1e3
            );
        }
        if stated.speed_m_s[axis] > limits.speed_m_s[axis] * (1.0 + 1e-9) {
            bail!(
                "stage.most_speed_mm_s of axis {axis} is {:.3} mm/s; the controller allows {:.3} mm/s",
                stated.speed_m_s[axis] * 1e3,
                limits.speed_m_s[axis] * 1e3
            );
        }
        if stated.acceleration_m_s2[axis] > limits.acceleration_m_s2[axis] * (1.0 + 1e-9) {
            bail!(
                "stage.most_acceleration_mm_s2 of axis {axis} is {:.1} mm/s²; the controller allows {:.1} mm/s²",
                stated.acceleration_m_s2[axis] * 1e3,
                limits.acceleration_m_s2[axis] * 1e3
            );
        }
    }
    if let Some(range) = format.range {
        for (channel, (stated, says)) in rig.force_range().into_iter().zip(range).enumerate() {
            if stated > says * (1.0 + 1e-6) {
                let (key, unit) =
                    if channel < 3 { ("force.range_n", "N") } else { ("force.range_nm", "N·m") };
                bail!("{key}: {stated} {unit} is stated, the sensor is calibrated for {says} {unit}");
            }
        }
    }
    if (format.rate_hz / rig.force_rate_hz() - 1.0).abs() > 0.01 {
        bail!(
            "force.rate_hz is {}; the sensor is set to {} records a second",
            rig.force_rate_hz(),
            format.rate_hz
        );
    }
    Ok(())
}

/// Refuses a disk that is too full.
fn room(folder: &Path, bytes: f64) -> anyhow::Result<()> {
    let disk =
        rustix::fs::statvfs(folder).with_context(|| format!("{}: can't be looked at", folder.display()))?;
    let free = disk.f_bavail as f64 * disk.f_frsize as f64;
    if free < bytes + SPARE {
        bail!(
            "{}: {:.0} MB are free; the session needs about {:.0} MB and {:.0} MB to spare",
            folder.display(),
            free / 1e6,
            bytes / 1e6,
            SPARE / 1e6
        );
    }
    Ok(())
}

/// The first poke that an interrupted session did not finish.
fn first_unfinished(session: &Session) -> anyhow::Result<u32> {
    let mut finished = 0;
    for event in session.events() {
        let event = event?;
        if event.name == "stroke-end" {
            finished = finished.max(event.poke.unwrap_or(0));
        }
    }
    Ok(finished + 1)
}

fn default_folder(protocol: &str) -> PathBuf {
    let word: String = protocol.chars().map(|c| if c.is_alphanumeric() { c } else { '-' }).collect();
    let stamp = utc_text(SystemTime::now()).replace(':', "");
    Path::new("sessions")
        .join(format!("{}-{word}", stamp.split('.').next().unwrap_or(&stamp).trim_end_matches('Z')))
}

fn start_document(planned: &Planned, devices: &Devices) -> StartDocument {
    let rig = &planned.rig;
    let (origin_m, axes) = rig.axes();
    let sensor = rig.sensor();
    let (radius_m, shape, contact) = rig.tip();
    let (poisson_ratio, density_kg_m3, modulus_range_pa) = rig.phantom();
    let now = HostTime::now();
    StartDocument {
        format: String::new(),
        name: planned.protocol.name().to_owned(),
        segment: 0,
        first_poke: planned.first_poke,
        started_utc: utc_text(SystemTime::now()),
        started_host_ns: now.nanos(),
        program: concat!("phantom-rig ", env!("CARGO_PKG_VERSION")).to_owned(),
        seeds: BTreeMap::new(),
        rig: HashedText::new(rig.public_text()),
        protocol: HashedText::new(planned.protocol_text.clone()),
        stage: Some(StageDocument::new(devices.stage.identity(), devices.stage.limits())),
        force: Some(ForceDocument::new(devices.force.identity(), devices.force.format())),
        markers: devices.markers.as_ref().map(|source| MarkersDocument {
            source: "simulated positions".to_owned(),
            rate_hz: source.rate_hz(),
            markers: 0,
        }),
        mounting: Some(MountingDocument {
            origin_m,
            axes,
            tolerance_m: rig.beside_m(),
            sensor_to_phantom: std::array::from_fn(|i| std::array::from_fn(|j| sensor.to_phantom[(i, j)])),
            sensor_to_tip_m: sensor.tip_m.into(),
            reads_reaction: sensor.reads_reaction,
        }),
        tip: TipDocument {
            contact: contact.to_owned(),
            shape: shape.to_owned(),
            radius_m,
            sphere_radius_m: None,
        },
        phantom: PhantomDocument {
            description: rig.name().to_owned(),
            mesh: Some(MESH.to_owned()),
            mesh_sha256: None,
            poisson_ratio,
            density_kg_m3,
            modulus_range_pa,
        },
    }
}

/// What a stop is called.
fn told(stopped: &Stopped, ran: &Ran) -> String {
    match &ran.failure {
        Some(failure) => format!("{}: {failure}", stopped.tripped.cause),
        None => stopped.tripped.cause.to_string(),
    }
}

fn said(folder: &Path, plan: &CheckedPlan, ran: &Ran, stop: &crate::session::StopDocument) -> Outcome {
    let plan = plan.plan();
    let lost = ran.losses.lost + ran.losses.malformed + stop.dropped.values().sum::<u64>();
    let records = format!(
        "{} force records, {} lost, {} not recorded",
        stop.force_records,
        ran.losses.lost + ran.losses.malformed,
        stop.dropped.values().sum::<u64>()
    );
    let (exit, first) = match &ran.stopped {
        Some(stopped) => {
            let tip = if stopped.retracted {
                "the tip was taken out of the phantom"
            } else {
                "the tip stays where it is"
            };
            let stands = if stopped.stands { "it stands" } else { "IT WAS NOT SEEN TO STAND" };
            let sent = stopped.tripped.sent.map(|s| s.since(stopped.tripped.seen).as_secs_f64() * 1e3);
            let sent = sent.map_or("stop bytes could not be sent".to_owned(), |ms| {
                format!("stop bytes after {ms:.2} ms")
            });
            let text = format!(
                "stopped after {} of {} steps: {}\n{sent}; {stands}, {:.3} mm on; largest force after it {:.3} N; {tip}\n\
                 the stage stays latched: look at the bench, then run with --clear",
                ran.steps,
                plan.steps.len(),
                told(stopped, ran),
                stopped.overshoot_m * 1e3,
                stopped.peak_n
            );
            (Exit::Failed, text)
        }
        None if lost > 0 => (Exit::Degraded, format!("{} pokes; something was lost", plan.pokes())),
        None => (Exit::Good, format!("{} pokes", plan.pokes())),
    };
    let name = folder.display();
    Outcome {
        exit,
        text: format!(
            "{first}\n{records}\nSession: {name}\nNext: phantom-rig session export {name} --bundle {name}-bundle"
        ),
        json: json!({
            "format": "phantom-run/1",
            "session": folder,
            "pokes": plan.pokes(),
            "steps_done": ran.steps,
            "stopped": ran.stopped.as_ref().map(|stopped| json!({
                "cause": told(stopped, ran),
                "stop_bytes_after_s": stopped.tripped.sent.map(|s| s.since(stopped.tripped.seen).as_secs_f64()),
                "overshoot_m": stopped.overshoot_m,
                "peak_n": stopped.peak_n,
                "stands": stopped.stands,
                "retracted": stopped.retracted,
            })),
            "force_records": stop.force_records,
            "lost": ran.losses.lost,
            "duplicated": ran.losses.duplicated,
            "reordered": ran.losses.reordered,
            "malformed": ran.losses.malformed,
            "dropped": stop.dropped,
        }),
    }
}
