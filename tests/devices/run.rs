//! A whole run on emulated devices, and each fault in the middle of a poke: it stops safely, or goes on with the loss put down.
//!
//! The phantom is a spring here: what a run does with forces does not depend on what makes them.

mod recording;

use crate::run_bench::{bench, mounting, sensor, start_document};
use crate::steady::steady;
use firmware_proto::ResetCause;
use phantom_rig::acquire::{
    AcquireError, Cause, Conduct, Doing, Instruments, Latch, Operator, Phase, Plan, Protocol, Ran, Watched,
    conduct,
};
use phantom_rig::clock::HostTime;
use phantom_rig::device::{ForceSensor, Stage};
use phantom_rig::driver::{NativeOptions, NativeStage, NetFt, NetFtSettings};
use phantom_rig::session::{
    CalibrationDocument, Gap, GapCause, Outcome, Session, SessionWriter, StartDocument, Topic,
};
use phantom_rig::sim::bytes::{
    NativeStageEmulator, NativeStageFaultSwitch, NativeStageSetup, NativeStageTruth, NetFtEmulator,
    NetFtFaultSwitch, NetFtSetup,
};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// What the phantom pushes back with (N/m).
const STIFFNESS: f64 = 250.0;
/// Records a second: a machine that runs other tests besides keeps up with these.
const RATE_HZ: f64 = 1000.0;
/// How long a motion goes on without a word: longer than usual, for a machine that runs other tests besides.
const LEASE: Duration = Duration::from_millis(1000);
/// Longest wait for anything on a busy machine.
const PATIENCE: Duration = Duration::from_secs(120);

const PROTOCOL: &str = "format = \"phantom-protocol/1\"\nname = \"two pokes\"\n[defaults]\nspeed_mm_s = 4\npause_s = 1\nhold_s = 1.5\n\
    [[step]]\nkind = \"poke\"\nsite_mm = [50, 75, 25]\ndepth_mm = 3\n\
    [[step]]\nkind = \"poke\"\nsite_mm = [55, 75, 25]\ndepth_mm = 2\n";

/// What the tip at the stage's position feels, as the sensor reads it.
fn felt(position: [f64; 2]) -> [f64; 6] {
    let depth = (0.025 - mounting().tip_at(position).z).max(0.0);
    let mut wrench = sensor().sensed([0.0, 0.0, -STIFFNESS * depth, 0.0, 0.0, 0.0]);
    // Not at zero when nothing touches: the zero has to be found.
    wrench[2] += 0.7;
    wrench
}

/// The emulated bench with the real drivers on it.
struct Rig {
    stage: NativeStage,
    force: NetFt,
    stage_emulator: NativeStageEmulator,
    force_emulator: NetFtEmulator,
    push: Arc<AtomicU64>,
}

fn rig() -> Rig {
    let push = Arc::new(AtomicU64::new(0));
    let pushes = Arc::clone(&push);
    let place = Arc::new([AtomicU64::new(0), AtomicU64::new(0)]);
    let theirs = Arc::clone(&place);
    let mut setup = NativeStageSetup::default();
    for (axis, own) in setup.firmware.axes.iter_mut().enumerate() {
        let [low, high] = bench(5.0).limits.travel_m[axis];
        own.travel_low_um = (low * 1e6) as i32;
        own.travel_high_um = (high * 1e6) as i32;
        setup.switches_m[axis] = [0.0, high + 1e-3];
        setup.ends_m[axis] = [-2e-3, high + 3e-3];
        setup.start_m[axis] = 2e-3;
    }
    let stage_emulator = NativeStageEmulator::start(setup, move |_, at| {
        theirs.iter().zip(at).for_each(|(cell, x)| cell.store(x.to_bits(), Ordering::Relaxed));
    })
    .expect("a pseudo-terminal");
    let wrench = move |_: f64| {
        let mut wrench = felt(std::array::from_fn(|a| f64::from_bits(place[a].load(Ordering::Relaxed))));
        wrench[2] += f64::from_bits(pushes.load(Ordering::Relaxed));
        wrench
    };
    let setup =
        NetFtSetup { rate_hz: RATE_HZ, range: [30.0, 30.0, 60.0, 0.5, 0.5, 0.5], ..NetFtSetup::default() };
    let force_emulator = NetFtEmulator::start(setup, HostTime::now(), wrench).expect("loopback");
    let stage =
        NativeStage::connect(&NativeOptions { lease: LEASE, ..NativeOptions::new(stage_emulator.port()) })
            .expect("a stage");
    let settings = NetFtSettings {
        http_port: force_emulator.http_port(),
        rdt_port: force_emulator.rdt_port(),
        ..NetFtSettings::at("127.0.0.1")
    };
    let force = NetFt::open(&settings).expect("a sensor");
    Rig { stage, force, stage_emulator, force_emulator, push }
}

/// What a fault may reach.
struct Reach<'a> {
    stage: &'a NativeStageFaultSwitch,
    force: &'a NetFtFaultSwitch,
    latch: &'a Latch,
    /// Something else that pushes on the tip (N), as bits.
    push: &'a AtomicU64,
}

/// Its name, what is done, and the causes that it may be taken for.
type Fault = (&'static str, fn(Reach<'_>), fn(Cause) -> bool);

/// Two faults at a time, each on a rig of its own: they mostly wait.
fn beside_each_other(faults: &[Fault], test: impl Fn(&'static str, fn(Reach<'_>), fn(Cause) -> bool) + Sync) {
    for two in faults.chunks(2) {
        std::thread::scope(|scope| {
            for &(name, fault, expected) in two {
                let test = &test;
                scope.spawn(move || test(name, fault, expected));
            }
        });
    }
}

/// What is known after a run.
struct After {
    ran: Ran,
    truth: NativeStageTruth,
    /// Where the stage is some time later: it must not have moved.
    later: NativeStageTruth,
    session: Session,
    _folder: tempfile::TempDir,
}

/// Runs the protocol; `fault` happens once, in the first hold or, where `pressing`, on the way in.
fn run(limit_n: f64, pressing: bool, fault: impl FnOnce(Reach<'_>) + Send) -> After {
    let folder = tempfile::tempdir().expect("a folder");
    let session = folder.path().join("session");
    let (ran, truth, later) = run_into(&session, limit_n, None, pressing, fault);
    let session = Session::open(&session).expect("a session");
    After { ran, truth, later, session, _folder: folder }
}

fn run_into(
    session: &Path,
    limit_n: f64,
    calibration: Option<CalibrationDocument>,
    pressing: bool,
    fault: impl FnOnce(Reach<'_>) + Send,
) -> (Ran, NativeStageTruth, NativeStageTruth) {
    let mut rig = rig();
    let wanted = if pressing { Phase::Press } else { Phase::Hold };
    let (ran, writer) = conducted(&mut rig, session, limit_n, calibration, |reach, watched| {
        let end = HostTime::now() + PATIENCE;
        loop {
            let now = watched.now();
            let deep = now.depth_m.is_some_and(|d| d > 5e-4);
            if now.doing == Doing::Leg(wanted) && deep {
                assert!(now.losses.received > 0 && !now.trace.is_empty(), "{now:?}");
                return fault(reach);
            }
            if now.doing == Doing::Done || HostTime::now() > end {
                return;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
    });
    let ran = ran.expect("a zero");
    let outcome = match &ran.stopped {
        None => Outcome::Success,
        Some(stopped) => Outcome::Abort { cause: stopped.tripped.cause.to_string() },
    };
    // A disk that failed says so here again.
    let _ = writer.finish(outcome, ran.losses, HostTime::now());
    // A stage that hears nothing any more stops when its lease runs out.
    std::thread::sleep(2 * LEASE);
    let truth = rig.stage_emulator.truth();
    std::thread::sleep(Duration::from_millis(300));
    (ran, truth, rig.stage_emulator.truth())
}

/// Runs the protocol, while `meanwhile` happens on a thread of its own.
fn conducted(
    rig: &mut Rig,
    session: &Path,
    limit_n: f64,
    calibration: Option<CalibrationDocument>,
    meanwhile: impl FnOnce(Reach<'_>, &Watched) + Send,
) -> (Result<Ran, AcquireError>, SessionWriter) {
    let bench = bench(limit_n);
    let protocol = Protocol::parse("two.toml", PROTOCOL, &[]).expect("sound");
    let plan = |at: [f64; 2]| Plan::new(protocol.name(), &protocol.expand(), &bench, at).checked();
    let latch = Latch::new(rig.stage.stopper().expect("a second way"));
    let (watched, operator) = (Watched::default(), Operator::default());
    let start = start_document("two pokes", PROTOCOL, &rig.stage, &rig.force);
    let writer = SessionWriter::create(session, StartDocument { calibration, ..start }).expect("a session");
    let doing = Conduct {
        plan: &plan,
        bench: &bench,
        silence: LEASE,
        gap: (RATE_HZ * LEASE.as_secs_f64()) as u32,
        frozen: 50,
        latch: &latch,
        watched: &watched,
        operator: &operator,
    };
    rig.force.start().expect("a stream");
    let reach = Reach {
        stage: rig.stage_emulator.faults(),
        force: rig.force_emulator.faults(),
        latch: &latch,
        push: &rig.push,
    };
    let ran = std::thread::scope(|scope| {
        let watched = &watched;
        scope.spawn(move || meanwhile(reach, watched));
        let instruments = Instruments { stage: &mut rig.stage, force: &mut rig.force, markers: None };
        conduct(instruments, &doing, &writer)
    });
    (ran, writer)
}

impl After {
    /// Why it stopped, once it is sure that it did and that everything about it was put down.
    fn stopped(&self) -> Cause {
        let stopped = self.ran.stopped.as_ref().expect("a stop");
        assert_eq!(self.truth.position_m, self.later.position_m, "it moves on after the stop");
        let end = self.session.stop().map(|stop| stop.outcome.clone());
        assert_eq!(end, Some(Outcome::Abort { cause: stopped.tripped.cause.to_string() }));
        let told = self.session.events().any(|e| e.expect("readable").name == "stopped");
        assert!(told, "the stop is not in the session");
        stopped.tripped.cause
    }

    /// How high the tip is above the phantom (m).
    fn height_m(&self) -> f64 {
        mounting().tip_at(self.later.position_m).z - 0.025
    }
}

#[test]
fn a_run_without_faults_is_carried_out_and_recorded_whole() {
    steady(|| {
        let after = run(3.0, false, |_| {});
        assert!(after.ran.stopped.is_none(), "{:?}", after.ran);
        assert_eq!((after.ran.steps, after.ran.losses.lost), (2, 0));
        let zero = after.ran.zero.expect("a zero");
        assert!((zero.mean[2] - 0.7e6).abs() < 1e3, "{zero:?}");
        assert_eq!(after.session.stop().expect("an end").outcome, Outcome::Success);
        let info = after.session.info().expect("readable");
        assert_eq!(info.force.lost, 0);
        assert_eq!(info.topics[&Topic::Force].records, after.ran.losses.received);
        // The deepest reading is the deepest poke's: 3 mm of 250 N/m, less 1 % for the last of the way.
        let deepest = after.session.force().map(|r| r.expect("readable").counts[2]).max().expect("records");
        let newtons = f64::from(deepest) / 1e6 - 0.7;
        assert!((newtons - 0.75).abs() < 0.01, "{newtons} N");
    });
}

#[test]
fn too_much_force_stops_the_stage_within_the_overshoot_and_takes_the_tip_out() {
    steady(|| {
        let after = run(3.0, true, |reach| reach.push.store(4.0_f64.to_bits(), Ordering::Relaxed));
        match after.stopped() {
            Cause::Limit { axis: 2, value, limit } => {
                assert!(value > limit && limit == 3.0, "{value} {limit}")
            }
            other => panic!("{other:?}"),
        }
        let stopped = after.ran.stopped.expect("a stop");
        assert!(stopped.stands && stopped.retracted, "{stopped:?}");
        assert!(after.height_m() > 3e-3, "{} m", after.height_m());
        let sent = stopped.tripped.sent.expect("sent").since(stopped.tripped.seen);
        assert!(sent < Duration::from_millis(200), "{sent:?}");
        // 4 mm/s and 1 m/s²: 8 µm, and 4 µm for each millisecond of latency.
        assert!(stopped.overshoot_m < 1e-3, "{} m", stopped.overshoot_m);
    });
}

/// A hand on the tip that comes and goes while the zero is taken: it is tried again, and nothing moves.
#[test]
fn no_zero_is_taken_while_something_touches_the_tip() {
    steady(|| {
        let folder = tempfile::tempdir().expect("a folder");
        let mut rig = rig();
        let start = rig.stage_emulator.truth().position_m;
        let (ran, _) = conducted(&mut rig, &folder.path().join("session"), 3.0, None, |reach, _| {
            for force_n in [0.2_f64, 0.0].repeat(20) {
                reach.push.store(force_n.to_bits(), Ordering::Relaxed);
                std::thread::sleep(Duration::from_millis(70));
            }
        });
        assert!(matches!(ran, Err(AcquireError::NotAtRest { axis: 2, moved }) if moved > 0.1), "{ran:?}");
        assert_eq!(rig.stage_emulator.truth().position_m, start);
    });
}

#[test]
fn a_person_stops_it_and_the_tip_stays() {
    steady(|| {
        let after = run(3.0, true, |reach| reach.latch.trip(Cause::Asked, HostTime::now()));
        assert_eq!(after.stopped(), Cause::Asked);
        let stopped = after.ran.stopped.expect("a stop");
        assert!(stopped.stands && !stopped.retracted);
        assert!(after.height_m() < 0.0, "{} m", after.height_m());
    });
}

#[test]
fn every_fault_of_the_sensor_stops_the_stage_and_the_tip_is_taken_out() {
    let faults: [Fault; 6] = [
        ("silent", |r| r.force.change(|f| f.stalled = true), |c| matches!(c, Cause::SensorSilent { .. })),
        ("frozen", |r| r.force.change(|f| f.frozen = true), |c| c == Cause::SensorFrozen),
        ("clock jumps", |r| r.force.change(|f| f.clock_ahead = 7000), |c| c == Cause::SensorRestarted),
        (
            "saturated",
            |r| r.force.change(|f| f.saturated = true),
            |c| matches!(c, Cause::SensorStatus { .. } | Cause::Limit { .. }),
        ),
        (
            "broken",
            |r| r.force.change(|f| f.status_bits = 1 << 30),
            |c| matches!(c, Cause::SensorStatus { .. }),
        ),
        (
            "taken over",
            |r| r.force.take_over(),
            |c| matches!(c, Cause::SensorSilent { .. } | Cause::SensorRestarted),
        ),
    ];
    beside_each_other(&faults, |name, fault, expected| {
        steady(|| {
            let after = run(3.0, false, fault);
            let cause = after.stopped();
            assert!(expected(cause), "{name}: {cause:?}");
            assert!(after.ran.stopped.is_some_and(|s| s.stands && s.retracted), "{name}: {:?}", after.ran);
            assert!(after.height_m() > 3e-3, "{name}: {} m", after.height_m());
            // The sensor's web page is there: only its stream is missing.
            let why = after.ran.why.as_deref().unwrap_or_default();
            let silent = matches!(cause, Cause::SensorSilent { .. });
            assert_eq!(why.contains("web page answers"), silent, "{name}: {why:?}");
            let status = matches!(cause, Cause::SensorStatus { .. });
            assert_eq!(!why.is_empty(), silent || status, "{name}: {why:?}");
        });
    });
}

#[test]
fn every_fault_of_the_stage_stops_it_where_it_is() {
    let faults: [Fault; 4] = [
        ("unplugged", |r| r.stage.unplug(), |c| c == Cause::StageSilent),
        ("reset", |r| r.stage.reset(ResetCause::BrownOut), |c| c == Cause::StageReset),
        ("mute", |r| r.stage.change(|f| f.mute = true), |c| c == Cause::StageSilent),
        (
            "switch",
            |r| r.stage.change(|f| f.stuck[0][1] = Some(true)),
            |c| c == Cause::StageFault { code: 3 },
        ),
    ];
    beside_each_other(&faults, |name, fault, expected| {
        steady(|| {
            let after = run(3.0, true, fault);
            let cause = after.stopped();
            assert!(expected(cause), "{name}: {cause:?} {:?}", after.ran.failure);
            assert!(after.ran.stopped.is_some_and(|s| !s.retracted), "{name}");
            let why = after.ran.why.unwrap_or_default();
            assert_eq!(why.contains("limit switch"), name == "switch", "{name}: {why:?}");
        });
    });
}

#[test]
fn bad_lines_and_lost_datagrams_are_got_through_with_the_loss_put_down() {
    steady(|| {
        let after = run(3.0, false, |r| {
            r.stage.change(|f| {
                (f.corrupt_share, f.drop_frame_share, f.duplicate_frame_share) = (2e-4, 0.01, 0.01)
            });
            r.force.change(|f| (f.drop_share, f.duplicate_share, f.reorder_share) = (0.05, 0.01, 0.01));
        });
        assert!(after.ran.stopped.is_none(), "{:?}", after.ran);
        let losses = after.ran.losses;
        assert!(losses.lost > 20 && losses.duplicated > 0 && losses.reordered > 0, "{losses:?}");
        let info = after.session.info().expect("readable");
        assert_eq!((info.force.lost, info.force.duplicated), (losses.lost, losses.duplicated));
        assert_eq!(after.session.stop().expect("an end").sensor.lost, losses.lost);
        let events: Vec<_> = after.session.events().map(|e| e.expect("readable")).collect();
        let count = |device: &str, name: &str| {
            let line = events.iter().find(|e| e.name == "line" && e.detail["device"] == device);
            line.expect("counts").detail["counts"][name].as_u64().expect("a count")
        };
        assert!(count("stage", "reports_lost") > 0 && count("stage", "requests_resent") > 0, "{events:?}");
        assert_eq!((count("force", "records_frozen"), count("force", "streams_restarted")), (0, 0));
    });
}

/// A disk that can stand still, as one does that is worn out or far away. Gone when it is dropped.
struct SlowDisk(tempfile::TempDir);

impl SlowDisk {
    /// None where nothing can be mounted.
    fn mount(image: &Path) -> Option<Self> {
        let place = tempfile::tempdir().expect("a folder");
        std::fs::File::create(image).and_then(|file| file.set_len(64 << 20)).expect("a file");
        let made = did("mkfs.ext4", &["-q", path(image)]);
        (made && did("mount", &["-o", "loop", path(image), path(place.path())])).then_some(Self(place))
    }

    fn stand_still(&self) {
        assert!(did("fsfreeze", &["-f", path(self.0.path())]));
    }

    fn go_on(&self) -> bool {
        did("fsfreeze", &["-u", path(self.0.path())])
    }
}

impl Drop for SlowDisk {
    fn drop(&mut self) {
        self.go_on();
        did("umount", &[path(self.0.path())]);
    }
}

fn path(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

fn did(program: &str, arguments: &[&str]) -> bool {
    let command = Command::new(program).args(arguments).stderr(Stdio::null()).status();
    command.is_ok_and(|status| status.success())
}

/// What waits for the disk has room for some seconds. The run goes on, and says how much never got there.
#[test]
fn what_a_disk_that_stands_still_does_not_take_is_put_down() {
    steady(|| {
        let folder = tempfile::tempdir().expect("a folder");
        let Some(disk) = SlowDisk::mount(&folder.path().join("image")) else {
            eprintln!("skipped: no disk can be mounted here");
            return;
        };
        let session = disk.0.path().join("session");
        let (ran, ..) = run_into(&session, 3.0, None, false, |_| {
            disk.stand_still();
            std::thread::sleep(Duration::from_secs(12));
            assert!(disk.go_on());
        });
        assert!(ran.stopped.is_none(), "{ran:?}");
        let session = Session::open(&session).expect("a session");
        let info = session.info().expect("readable");
        let left_out = |gap: &&Gap| gap.topic == Topic::Force && gap.cause == GapCause::QueueFull;
        let missing: u64 = info.gaps.iter().filter(left_out).map(|gap| gap.records).sum();
        assert!(missing > 0, "{info:?}");
        assert_eq!(info.topics[&Topic::Force].records + missing, ran.losses.received);
    });
}

/// A disk of 1 MB, which is full after some seconds.
#[test]
fn a_full_disk_stops_the_stage() {
    steady(|| {
        let folder = tempfile::tempdir().expect("a folder");
        if !did("mount", &["-t", "tmpfs", "-o", "size=600k", "tmpfs", path(folder.path())]) {
            eprintln!("skipped: no small disk can be mounted here");
            return;
        }
        let (ran, truth, later) = run_into(&folder.path().join("session"), 3.0, None, false, |_| {});
        assert!(did("umount", &[path(folder.path())]));
        let stopped = ran.stopped.expect("a stop");
        assert_eq!(stopped.tripped.cause, Cause::Recorder);
        assert!(stopped.stands);
        assert_eq!(truth.position_m, later.position_m);
    });
}
