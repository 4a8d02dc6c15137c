//! A plan carried out on a rig's devices and recorded: from opening them to the end of the session.

use super::Context;
use super::interrupt::Interrupts;
use super::planned::Planned;
use super::run_picture::LivePicture;
use super::run_view::Title;
use super::run_watch::{Reach, Watch, watch};
use super::today::today;
use crate::acquire::{
    Cause, Conduct, Instruments, Latch, Operator, Ran, Stopped, Watched, conduct, stay_resident,
};
use crate::calib::set::Doubt;
use crate::clock::HostTime;
use crate::dataset::write_msh;
use crate::device::{AXES, ForceFormat, Losses, MarkerSource, Stage, StageLimits, StageState};
use crate::digest::sha256_hex;
use crate::rig::{Devices, RigFile, SimulatedBench};
use crate::session::{
    Event, ForceDocument, HashedText, MarkersDocument, MountingDocument, Outcome as SessionOutcome,
    PhantomDocument, SessionWriter, StageDocument, StartDocument, StopDocument, TipDocument, boot,
    utc_seconds, utc_text,
};
use anyhow::{Context as _, bail};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

/// How a plan is to be carried out.
#[derive(Debug, Clone, Copy)]
pub(super) struct How {
    pub(super) watch: Watch,
    /// Every question was agreed to beforehand.
    pub(super) yes: bool,
    /// A latched stage may be cleared.
    pub(super) clear: bool,
    /// The sensor is to take its reading for zero.
    pub(super) bias: bool,
    /// Seconds that a simulated bench has stood before.
    pub(super) at_rest_s: f64,
    /// What the camera sees goes into a file every second.
    pub(super) live: bool,
}

/// What was recorded.
pub(super) struct RecordedRun {
    pub(super) ran: Ran,
    pub(super) stop: StopDocument,
    /// When it began, and what the clock of a simulated bench showed then (s).
    pub(super) began: (HostTime, Option<f64>),
}

/// What is left over of a disk, whatever a session needs (bytes), and as a share of what it needs: noisy pictures are larger than usual ones.
const SPARE: [f64; 2] = [200e6, 0.4];
/// How long a stage may take to say what it is doing.
const ANSWER: Duration = Duration::from_secs(3);

/// Opens the devices of a rig, carries the plan out, and records it into `folder`: a new session, or one that goes on. Behind simulated
/// devices is `bench`.
pub(super) fn record(
    planned: &Planned,
    bench: Option<SimulatedBench>,
    folder: &Path,
    goes_on: bool,
    how: How,
    context: &Context,
) -> anyhow::Result<RecordedRun> {
    let parent = folder.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mesh = planned.mesh()?;
    let spinner = context.progress.spinner("opening the devices");
    if how.watch == Watch::Lines {
        let simulated =
            if bench.is_some() { "; to prepare a simulated phantom takes some seconds" } else { "" };
        eprintln!("  the devices are opened{simulated}");
    }
    let mut devices = planned.rig.open(bench, how.at_rest_s)?;
    at_rest(devices.stage.as_mut(), how.clear)?;
    if how.clear {
        devices.force.clear_latch()?;
    }
    calibrated(&planned.rig, &devices.force.identity().calibration)?;
    if let Some(note) = planned.unplaced()? {
        eprintln!("  note: {note}");
    }
    fits(&planned.rig, devices.stage.limits(), devices.force.format())?;
    stops(&planned.rig, devices.stage.as_ref())?;
    room(parent, planned.plan([0.0, 0.0]).data_bytes())?;
    let mesh = mesh.map_or_else(|| devices.simulated_mesh(), Ok)?;
    let mut mesh_bytes = Vec::new();
    write_msh(&mesh, &mut mesh_bytes).context("the phantom's mesh")?;
    if how.bias {
        devices.force.bias()?;
    }
    drop(spinner);

    let (start, began) = (start_document(planned, &devices, &mesh_bytes)?, HostTime::now());
    let session_began = HostTime::from_nanos(start.started_host_ns);
    let writer = if goes_on {
        SessionWriter::continue_session(folder, start)?
    } else {
        std::fs::create_dir_all(parent).with_context(|| format!("{}: can't be made", parent.display()))?;
        let writer = SessionWriter::create(folder, start)?;
        let kept = folder.join(MESH);
        std::fs::write(&kept, &mesh_bytes)
            .with_context(|| format!("{}: can't be written", kept.display()))?;
        writer
    };
    if how.bias {
        writer.recorder().event(Event::new(HostTime::now(), "bias"));
    }
    let ran = match carry_out(planned, &mut devices, (folder, session_began), &writer, how) {
        Ok(ran) => ran,
        Err(error) => {
            // Nothing was poked; why is the session's end. That it could not be written either is the lesser evil.
            let cause = format!("{error:#}");
            let _ = writer.finish(SessionOutcome::Fail { cause }, Losses::default(), HostTime::now());
            return Err(error);
        }
    };
    if let Some(failure) = devices.simulation_failure() {
        bail!("the simulated bench gave up in the middle of the run: {failure}");
    }
    let outcome = match &ran.stopped {
        None => SessionOutcome::Success,
        Some(stopped) => SessionOutcome::Abort { cause: told(stopped, &ran) },
    };
    let stop = writer.finish(outcome, ran.losses, HostTime::now()).with_context(|| match &ran.stopped {
        Some(stopped) => format!("{}; {}", told(stopped, &ran), whereabouts(stopped)),
        None => "the plan was carried out; the session did not reach the disk".to_owned(),
    })?;
    Ok(RecordedRun { ran, stop, began: (began, devices.simulated_time_s(began)) })
}

/// What became of the stage and the tip after a stop.
pub(super) fn whereabouts(stopped: &Stopped) -> String {
    let stands = if stopped.stands { "the stage stands" } else { "THE STAGE WAS NOT SEEN TO STAND" };
    let tip =
        if stopped.retracted { "the tip was taken out of the phantom" } else { "the tip stays where it is" };
    format!(
        "{stands}, {:.3} mm on; largest force after it {:.3} N; {tip}",
        stopped.overshoot_m * 1e3,
        stopped.peak_n
    )
}

/// Time since a session began (s).
pub(super) fn passed_s(first: &StartDocument) -> f64 {
    let began = HostTime::from_nanos(first.started_host_ns);
    if !first.boot.is_empty() && first.boot == boot() {
        return HostTime::now().seconds_after(began);
    }
    let wall = utc_seconds(&utc_text(SystemTime::now())).zip(utc_seconds(&first.started_utc));
    wall.map_or(0.0, |(now, then)| (now - then).max(0.0))
}

/// File of the phantom's mesh in a session's folder.
pub(super) const MESH: &str = "mesh.msh";

/// Runs the plan on a thread of its own while this one shows it; the session is in `folder` and began then.
fn carry_out(
    planned: &Planned,
    devices: &mut Devices,
    (folder, began): (&Path, HostTime),
    writer: &SessionWriter,
    how: How,
) -> anyhow::Result<Ran> {
    let latch = Arc::new(Latch::new(devices.stage.stopper()?));
    let theirs = Arc::clone(&latch);
    let _interrupts = Interrupts::to(move || theirs.trip(Cause::Asked, HostTime::now()));
    let (watched, operator) = (Watched::default(), Operator::default());
    let (silence, gap, frozen) = planned.rig.patience();
    let plan = |position_m: [f64; AXES]| planned.plan(position_m).checked();
    let doing = Conduct {
        plan: &plan,
        bench: &planned.bench,
        silence,
        gap,
        frozen,
        latch: &latch,
        watched: &watched,
        operator: &operator,
    };
    // Where the system does not allow it, `doctor` says so.
    let _ = stay_resident();
    devices.force.start()?;
    let limit_n = planned.bench.load.force_n.into_iter().fold(f64::INFINITY, f64::min);
    let title = Title {
        text: format!("{} · {}", planned.protocol.name(), planned.rig.name()),
        limit_n,
        pictures: planned.rig.pictures().is_some(),
        note: String::new(),
    };
    let picture = LivePicture::beside(folder, began, how.live && title.pictures);
    let instruments = Instruments {
        stage: &mut *devices.stage,
        force: &mut *devices.force,
        markers: devices.markers.as_mut().map(|source| &mut **source as &mut dyn MarkerSource),
    };
    let ran = std::thread::scope(|scope| {
        let runner = scope.spawn(|| conduct(instruments, &doing, writer));
        let over = || runner.is_finished();
        let reach = Reach { operator: &operator, latch: &latch, watched: &watched };
        watch(how.watch, title, picture, &reach, how.yes, &over);
        runner.join()
    });
    let ran = ran.map_err(|_| anyhow::anyhow!("the run gave up; the stage was stopped"))??;
    // A stream that nobody reads any more is asked to end; it ends by itself when the sensor hears nobody.
    let _ = devices.force.stop();
    Ok(ran)
}

/// Waits until the stage stands; refuses one that is latched, unless a person has cleared it.
fn at_rest(stage: &mut dyn Stage, clear: bool) -> anyhow::Result<()> {
    let end = HostTime::now() + ANSWER;
    let mut cleared = false;
    while HostTime::now() < end {
        let Some(report) = stage.report(HostTime::now() + Duration::from_millis(100))? else { continue };
        match report.state {
            StageState::Idle => return Ok(()),
            StageState::Fault { .. } if clear && !cleared => {
                stage.clear()?;
                cleared = true;
            }
            StageState::Fault { .. } if cleared => {}
            StageState::Fault { code } => {
                let (port, meaning) = (&stage.identity().port, stage.meaning(code));
                bail!("{port} has latched fault {code} ({meaning}); look at the bench, then pass --clear")
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

/// Refuses a controller that comes to rest later than the plan reckons with.
fn stops(rig: &RigFile, stage: &dyn Stage) -> anyhow::Result<()> {
    let Some(stopping) = stage.stopping() else { return Ok(()) };
    let [_, stated_s] = rig.latencies_s();
    if stated_s < stopping.delay.as_secs_f64() * (1.0 - 1e-9) {
        bail!(
            "stage.latency_ms is {}; this controller brakes up to {} ms after it was told to",
            stated_s * 1e3,
            stopping.delay.as_secs_f64() * 1e3
        );
    }
    let [.., stated_m_s2] = rig.speeds();
    if stated_m_s2 > stopping.deceleration_m_s2 * (1.0 + 1e-9) {
        bail!(
            "stage.stop_deceleration_mm_s2 is {}; this controller brakes with {} mm/s²",
            stated_m_s2 * 1e3,
            stopping.deceleration_m_s2 * 1e3
        );
    }
    Ok(())
}

/// Refuses a disk that is too full. Folders on the way to the session may still have to be made.
fn room(folder: &Path, bytes: f64) -> anyhow::Result<()> {
    let folder = folder.ancestors().find(|place| place.is_dir()).unwrap_or(Path::new("."));
    let disk =
        rustix::fs::statvfs(folder).with_context(|| format!("{}: can't be looked at", folder.display()))?;
    let free = disk.f_bavail as f64 * disk.f_frsize as f64;
    let spare = SPARE[0] + SPARE[1] * bytes;
    if free < bytes + spare {
        bail!(
            "{}: {:.0} MB are free; the session needs about {:.0} MB and {:.0} MB to spare",
            folder.display(),
            free / 1e6,
            bytes / 1e6,
            spare / 1e6
        );
    }
    Ok(())
}

/// Refuses a calibration set of another sensor; one that has expired is only said: what is recorded are the raw readings.
fn calibrated(rig: &RigFile, serial: &str) -> anyhow::Result<()> {
    let Some(set) = rig.calibration() else { return Ok(()) };
    for doubt in set.doubts(today()?, Some(serial)) {
        match doubt {
            Doubt::OtherSensor { .. } => bail!("{}: {doubt}", set.file.display()),
            Doubt::NotYet { .. } | Doubt::Expired { .. } => eprintln!("  note: {doubt}"),
        }
    }
    Ok(())
}

fn start_document(planned: &Planned, devices: &Devices, mesh: &[u8]) -> anyhow::Result<StartDocument> {
    let rig = &planned.rig;
    let camera = match devices.markers.as_ref().and_then(|source| source.camera()) {
        Some((identity, format)) => rig.camera(identity, format)?,
        None => None,
    };
    let (origin_m, axes) = rig.axes();
    let sensor = rig.sensor();
    let (radius_m, shape, contact) = rig.tip();
    let (poisson_ratio, density_kg_m3, modulus_range_pa) = rig.phantom();
    let now = HostTime::now();
    Ok(StartDocument {
        format: String::new(),
        name: planned.protocol.name().to_owned(),
        segment: 0,
        first_poke: planned.first_poke,
        started_utc: utc_text(SystemTime::now()),
        started_host_ns: now.nanos(),
        boot: boot(),
        variables: planned.overridden(),
        program: concat!("phantom-rig ", env!("CARGO_PKG_VERSION")).to_owned(),
        seeds: BTreeMap::new(),
        rig: planned.rig_text(),
        protocol: HashedText::new(planned.protocol_text.clone()),
        stage: Some(StageDocument::new(devices.stage.identity(), devices.stage.limits())),
        force: Some(ForceDocument::new(devices.force.identity(), devices.force.format())),
        markers: devices.markers.as_ref().map(|source| MarkersDocument {
            source: if camera.is_some() { "camera, followed live" } else { "simulated positions" }.to_owned(),
            rate_hz: source.rate_hz(),
            markers: 0,
        }),
        camera,
        calibration: rig.calibration_document(),
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
            mesh_sha256: Some(sha256_hex(mesh)),
            poisson_ratio,
            density_kg_m3,
            modulus_range_pa,
        },
    })
}

/// What a stop is called.
pub(super) fn told(stopped: &Stopped, ran: &Ran) -> String {
    let cause = &stopped.tripped.cause;
    match (&ran.failure, &ran.why) {
        (Some(failure), _) => format!("{cause}: {failure}"),
        (None, Some(why)) => format!("{cause}: {why}"),
        (None, None) => cause.to_string(),
    }
}
