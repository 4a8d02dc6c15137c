//! `doctor`: which devices are there, do they answer, and what to do next.

use super::today::today;
use super::{Context, Exit, Outcome};
use crate::acquire::stay_resident;
use crate::calib::set::CalibrationSet;
use crate::clock::HostTime;
use crate::dataset::read_phantom;
use crate::device::{ForceSensor, Losses, MarkerSource, Stage, StageState, with_causes};
use crate::driver::{GrblOptions, GrblStage, NativeOptions, NativeStage, NetFt, NetFtSettings, serial_ports};
use crate::rig::{RigError, RigFile};
use crate::track::{GreyView, Settings, Tracker};
use clap::Args;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Looks for devices and says what they answer.
///
/// Without --rig: asks every serial port who is there, first in this project's own protocol, then in Grbl's (opening a port resets some
/// boards: nothing may be moving), and the force sensor at --force. With --rig: opens the rig's own devices. Nothing is moved.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  phantom-rig doctor
  phantom-rig doctor --force 192.168.1.1
  phantom-rig doctor --rig rigs/sim.toml")]
pub(super) struct DoctorArguments {
    /// Open the devices of this rig
    #[arg(long, value_name = "FILE")]
    rig: Option<PathBuf>,
    /// Address of the force sensor
    #[arg(long, value_name = "ADDRESS", conflicts_with = "rig")]
    force: Option<String>,
    /// Ask only this serial port
    #[arg(long, value_name = "PORT", conflicts_with = "rig")]
    port: Vec<String>,
}

/// How long a force stream is listened to.
const LISTEN: Duration = Duration::from_secs(2);

/// One thing that was looked at.
struct Finding {
    text: String,
    json: Value,
    good: bool,
}

pub(super) fn run(arguments: &DoctorArguments, context: &Context) -> anyhow::Result<Outcome> {
    let spinner = context.progress.spinner("asking");
    let mut findings = Vec::new();
    if let Some(file) = &arguments.rig {
        let rig = RigFile::read(file)?;
        let mut devices = rig.open_each(rig.simulated(&[])?, 0.0)?;
        findings.push(match &mut devices.stage {
            Ok(found) => stage(found.as_mut()),
            Err(error) => missing("stage", error),
        });
        findings.push(match &mut devices.force {
            Ok(found) => force(found.as_mut()),
            Err(error) => missing("force sensor", error),
        });
        match &mut devices.markers {
            Ok(Some(source)) if source.camera().is_some() => findings.push(camera(source.as_mut())),
            Ok(_) => {}
            Err(error) => findings.push(missing("markers", error)),
        }
        findings.extend(rig.mesh().map(|file| mesh(&rig, &file)));
        let serial = devices.force.as_ref().ok().map(|found| found.identity().calibration.clone());
        findings.extend(rig.calibration().map(|set| calibration(set, serial.as_deref())).transpose()?);
    } else {
        let ports = if arguments.port.is_empty() { serial_ports()? } else { arguments.port.clone() };
        if ports.is_empty() {
            findings.push(Finding {
                text: "no serial port: is the stage plugged in and switched on, and may you open it (group dialout)?".to_owned(),
                json: json!({"stage": null}),
                good: false,
            });
        }
        let first = findings.len();
        // A port behind which nobody answers takes ten seconds: all are asked at once.
        spinner.label(&format!("asking {}", ports.join(", ")));
        let asked: Vec<Finding> = std::thread::scope(|scope| {
            let all: Vec<_> = ports.iter().map(|port| scope.spawn(|| who(port))).collect();
            // A thread that panicked has said why on standard error.
            all.into_iter().map(|one| one.join().unwrap_or_else(|e| std::panic::resume_unwind(e))).collect()
        });
        findings.extend(asked);
        // A port with something else behind it is no fault where another one has a stage.
        let found = findings[first..].iter().any(|f| f.good);
        findings[first..].iter_mut().for_each(|f| f.good |= found && f.json.get("native").is_some());
        match &arguments.force {
            Some(address) => {
                spinner.label(&format!("asking {address}"));
                match NetFt::open(&NetFtSettings::at(address.clone())) {
                    Ok(mut sensor) => findings.push(force(&mut sensor)),
                    Err(error) => findings.push(Finding {
                        text: format!("force sensor at {address}: {}", with_causes(&error)),
                        json: json!({"force": address, "error": with_causes(&error)}),
                        good: false,
                    }),
                }
            }
            None => findings.push(Finding {
                text: "force sensor: name its address with --force; as delivered it is 192.168.1.1"
                    .to_owned(),
                json: json!({"force": null}),
                good: true,
            }),
        }
    }
    findings.push(memory());
    drop(spinner);
    let good = findings.iter().all(|f| f.good);
    let mut text: Vec<String> = findings.iter().map(|f| f.text.clone()).collect();
    text.push(match &arguments.rig {
        _ if !good => "next: see to what is said above, then run doctor again".to_owned(),
        Some(rig) => format!("next: phantom-rig plan PROTOCOL --rig {}", rig.display()),
        None => {
            "next: put ports and addresses into a rig file (rigs/bench-ati-*.toml), then phantom-rig plan"
                .to_owned()
        }
    });
    Ok(Outcome {
        exit: if good { Exit::Good } else { Exit::Degraded },
        text: text.join("\n"),
        json: json!({"format": "phantom-doctor/1", "good": good, "findings": findings.into_iter().map(|f| f.json).collect::<Vec<_>>()}),
    })
}

/// A device of a rig file that cannot be opened.
fn missing(device: &'static str, error: &RigError) -> Finding {
    let why = with_causes(error);
    Finding { text: format!("{device}: {why}"), json: json!({"device": device, "error": why}), good: false }
}

/// Whether the phantom's mesh can be read, and is no larger than the phantom is said to be.
fn mesh(rig: &RigFile, file: &Path) -> Finding {
    let name = file.display();
    let (text, error) = match read_phantom(file) {
        Ok(mesh) => match rig.holds(&mesh) {
            Ok(()) => (format!("mesh {name}: {} nodes", mesh.nodes.len()), None),
            Err(error) => (format!("mesh {name}: {error}"), Some(error.to_string())),
        },
        Err(error) if file.exists() => (format!("mesh: {}", with_causes(&error)), Some(with_causes(&error))),
        Err(error) => {
            (format!("mesh {name}: missing; `phantom-rig mesh block` makes one"), Some(with_causes(&error)))
        }
    };
    let good = error.is_none();
    Finding { text, json: json!({"mesh": file, "error": error}), good }
}

/// Whether a run's program stays in memory. One that does not is no fault of the bench.
fn memory() -> Finding {
    let (text, error) = match stay_resident() {
        Ok(()) => ("memory: a run keeps its program there".to_owned(), None),
        Err(error) => (
            format!(
                "memory: a run can't keep its program there ({error}), and may stop later on a computer that is short of it; \
                 raise the limit that `ulimit -l` shows"
            ),
            Some(error.to_string()),
        ),
    };
    Finding { text, json: json!({"resident": error.is_none(), "error": error}), good: true }
}

/// Whether the calibration set holds today, for this sensor.
fn calibration(set: &CalibrationSet, serial: Option<&str>) -> anyhow::Result<Finding> {
    let doubts = set.doubts(today()?, serial);
    let told: Vec<String> = doubts.iter().map(ToString::to_string).collect();
    let [from, until] = set.valid;
    let state = if told.is_empty() { "sound".to_owned() } else { told.join("; ") };
    Ok(Finding {
        text: format!("calibration: {}, {from} to {until}: {state}", set.file.display()),
        json: json!({"calibration": set.name, "doubts": told}),
        good: told.is_empty(),
    })
}

/// Who answers on a port.
fn who(port: &str) -> Finding {
    let native = match NativeStage::connect(&NativeOptions::new(port)) {
        Ok(mut found) => return stage(&mut found),
        Err(error) => with_causes(&error),
    };
    match GrblStage::connect(&GrblOptions::new(port)) {
        Ok(mut found) => stage(&mut found),
        Err(error) => Finding {
            text: format!(
                "{port}: no stage that this program knows\n  own protocol: {native}\n  Grbl: {}",
                with_causes(&error)
            ),
            json: json!({"stage": port, "native": native, "grbl": with_causes(&error)}),
            good: false,
        },
    }
}

fn stage(stage: &mut dyn Stage) -> Finding {
    let identity = stage.identity().clone();
    let limits = *stage.limits();
    let answer = stage.report(HostTime::now() + Duration::from_secs(2));
    let (state, good) = match &answer {
        Ok(Some(report)) => match report.state {
            StageState::Fault { code } => {
                let meaning = stage.meaning(code);
                (
                    format!("latched in fault {code} ({meaning}): look at the bench, then run with --clear"),
                    false,
                )
            }
            _ if report.homed => ("ready".to_owned(), true),
            _ => ("not homed: run will home it first".to_owned(), true),
        },
        Ok(None) => ("does not report".to_owned(), false),
        Err(error) => (with_causes(error), false),
    };
    let mm = |x: f64| x * 1e3;
    let axis = |a: usize| {
        format!(
            "{:.1} to {:.1} mm, {:.1} mm/s, {:.0} mm/s²",
            mm(limits.travel_m[a][0]),
            mm(limits.travel_m[a][1]),
            mm(limits.speed_m_s[a]),
            mm(limits.acceleration_m_s2[a])
        )
    };
    Finding {
        text: format!(
            "stage at {}: {} ({}), {state}\n  axis 0: {}\n  axis 1: {}",
            identity.port,
            identity.controller,
            identity.firmware,
            axis(0),
            axis(1)
        ),
        json: json!({
            "stage": identity.port, "controller": identity.controller, "firmware": identity.firmware, "state": state,
            "travel_m": limits.travel_m, "speed_m_s": limits.speed_m_s, "acceleration_m_s2": limits.acceleration_m_s2,
        }),
        good,
    }
}

/// Rate, losses, depth and dots of a camera.
fn camera(source: &mut dyn MarkerSource) -> Finding {
    let name = source.camera().map_or(String::new(), |(identity, _)| identity.source.clone());
    match watch(source) {
        Ok(seen) => {
            let losses = source.losses().unwrap_or_default();
            let bad = losses.malformed + losses.unpaired + losses.dropped + losses.lost;
            let [rate_hz, set_hz] = [seen.frames as f64 / LISTEN.as_secs_f64(), source.rate_hz()];
            let good =
                (rate_hz / set_hz - 1.0).abs() < 0.1 && seen.depth_share > 0.3 && seen.dots >= LEAST_DOTS;
            Finding {
                text: format!(
                    "camera at {name}: {}\n  {rate_hz:.1} frames a second of {set_hz}; {} thrown away as stale, {} dropped, {} unpaired, \
                     {} malformed, {} lost\n  depth in {:.0} % of the pixels; {} dots",
                    if good && bad == 0 { "sound" } else { "look at the figures" },
                    losses.stale,
                    losses.dropped,
                    losses.unpaired,
                    losses.malformed,
                    losses.lost,
                    1e2 * seen.depth_share,
                    seen.dots
                ),
                json: json!({
                    "camera": name, "rate_hz": rate_hz, "set_rate_hz": set_hz, "stale": losses.stale, "dropped": losses.dropped,
                    "unpaired": losses.unpaired, "malformed": losses.malformed, "lost": losses.lost,
                    "depth_share": seen.depth_share, "dots": seen.dots,
                }),
                good,
            }
        }
        Err(error) => Finding {
            text: format!("camera at {name}: {}", with_causes(&error)),
            json: json!({"camera": name, "error": with_causes(&error)}),
            good: false,
        },
    }
}

/// What a camera showed.
struct Seen {
    frames: u32,
    /// Share of the last frame's pixels that have a depth.
    depth_share: f64,
    /// Dots in it.
    dots: usize,
}

/// Fewer dots are no phantom with markers.
const LEAST_DOTS: usize = 10;

fn watch(source: &mut dyn MarkerSource) -> Result<Seen, crate::device::DeviceError> {
    let mut seen = Seen { frames: 0, depth_share: 0.0, dots: 0 };
    // The first one may be long in coming: the camera is started.
    source.frame(HostTime::now() + LISTEN)?;
    let asked = HostTime::now();
    let mut last = None;
    while HostTime::now().since(asked) < LISTEN {
        if source.frame(HostTime::now() + Duration::from_millis(50))?.is_some() {
            seen.frames += 1;
            last = source.pictures();
        }
    }
    if let Some(frame) = last {
        let with = frame.depth.values.iter().filter(|d| **d > 0).count();
        seen.depth_share = with as f64 / frame.depth.values.len().max(1) as f64;
        let (width, height) = (frame.grey.width, frame.grey.height);
        let dots = GreyView::new(width, height, width, &frame.grey.pixels)
            .and_then(|grey| Tracker::reference_dots(&grey, &Settings::default()));
        seen.dots = dots.map_or(0, |dots| dots.len());
    }
    Ok(seen)
}

/// Rate, losses and the unevenness of a force stream.
fn force(sensor: &mut dyn ForceSensor) -> Finding {
    let identity = sensor.identity().clone();
    let format = *sensor.format();
    match listen(sensor) {
        Ok(heard) => {
            let lost = heard.losses.lost + heard.losses.malformed;
            let good =
                lost == 0 && heard.status.is_empty() && (heard.rate_hz / format.rate_hz - 1.0).abs() < 0.02;
            let status = if heard.status.is_empty() { "sound".to_owned() } else { heard.status.join(", ") };
            Finding {
                text: format!(
                    "force sensor at {}: {} {} ({}), {status}\n  {:.1} records a second of {}, {lost} lost of {}; longest pause {:.1} ms; \
                     first record {:.1} ms after the request",
                    identity.address,
                    identity.product,
                    identity.calibration,
                    identity.configuration,
                    heard.rate_hz,
                    format.rate_hz,
                    heard.losses.received,
                    heard.pause_s * 1e3,
                    heard.first_s * 1e3
                ),
                json: json!({
                    "force": identity.address, "product": identity.product, "calibration": identity.calibration,
                    "rate_hz": heard.rate_hz, "set_rate_hz": format.rate_hz, "received": heard.losses.received, "lost": lost,
                    "longest_pause_s": heard.pause_s, "first_record_s": heard.first_s, "status": heard.status,
                }),
                good,
            }
        }
        Err(error) => Finding {
            text: format!("force sensor at {}: {}", identity.address, with_causes(&error)),
            json: json!({"force": identity.address, "error": with_causes(&error)}),
            good: false,
        },
    }
}

/// What a stream was like.
struct Heard {
    rate_hz: f64,
    losses: Losses,
    pause_s: f64,
    first_s: f64,
    status: Vec<&'static str>,
}

fn listen(sensor: &mut dyn ForceSensor) -> Result<Heard, crate::device::DeviceError> {
    let asked = HostTime::now();
    sensor.start()?;
    let (mut records, mut first, mut last, mut pause) =
        (Vec::with_capacity(4096), None, asked, Duration::ZERO);
    let (mut count, mut status) = (0_u32, 0);
    while HostTime::now().since(asked) < LISTEN {
        records.clear();
        sensor.receive(HostTime::now() + Duration::from_millis(50), &mut records)?;
        for record in &records {
            let since = *first.get_or_insert(record.host);
            if since != record.host {
                pause = pause.max(record.host.since(last));
            }
            last = record.host;
            count += 1;
            status |= record.status;
        }
    }
    sensor.stop()?;
    let first = first.unwrap_or(last);
    let span = last.since(first).as_secs_f64();
    Ok(Heard {
        rate_hz: if span > 0.0 { f64::from(count.saturating_sub(1)) / span } else { 0.0 },
        losses: sensor.losses(),
        pause_s: pause.as_secs_f64(),
        first_s: first.since(asked).as_secs_f64(),
        status: if status == 0 { Vec::new() } else { sensor.explain(status) },
    })
}
