//! From a step of the force at the sensor to the stop bytes on the stage's pseudo-terminal: how long, and how often?
//!
//! The emulated sensor streams 7000 records a second over loopback, everything is recorded, the stage's driver asks for reports: as in a
//! run. The step comes at a random instant; it counts from the first record that holds it. A thread that
//! only sleeps shows how late the machine itself wakes anybody. `cargo bench --bench abort`, for
//! `ABORT_ROUNDS` stops (300, some six minutes); with `ABORT_PAGED=1` the program is not kept in memory, as `run` keeps it where it may.

use phantom_rig::acquire::{
    Bench, Cause, Conduct, Doing, Instruments, Latch, Operator, Plan, Protocol, Watched, conduct,
    stay_resident,
};
use phantom_rig::clock::HostTime;
use phantom_rig::device::{ForceSensor, Stage, StageState};
use phantom_rig::driver::{NativeOptions, NativeStage, NetFt, NetFtSettings};
use phantom_rig::session::{Outcome, SessionWriter};
use phantom_rig::sim::bytes::{NativeStageEmulator, NativeStageSetup, NetFtEmulator, NetFtSetup};
use rand::{RngExt, SeedableRng};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

#[path = "../tests/support/run_bench.rs"]
mod run_bench;

/// What pushes on the tip after the step, and where the run is stopped (N).
const PUSH_N: f64 = 10.0;
const LIMIT_N: f64 = 5.0;

const PROTOCOL: &str =
    "format = \"phantom-protocol/1\"\nname = \"waiting\"\n[[step]]\nkind = \"wait\"\nwait_s = 60\n";

/// How late a thread is woken that sleeps meanwhile: what the machine itself can do.
fn lateness(over: &AtomicBool) -> Vec<Duration> {
    const NAP: Duration = Duration::from_millis(2);
    let mut late = Vec::new();
    while !over.load(Ordering::Relaxed) {
        let before = HostTime::now();
        std::thread::sleep(NAP);
        late.push(HostTime::now().since(before).saturating_sub(NAP));
    }
    late
}

fn main() {
    let rounds: usize = std::env::var("ABORT_ROUNDS").map_or(300, |r| r.parse().expect("a number"));
    let pushes = Arc::new(AtomicBool::new(false));
    let felt_ns = Arc::new(AtomicU64::new(0));
    let (theirs, mark) = (Arc::clone(&pushes), Arc::clone(&felt_ns));
    let sensor = NetFtEmulator::start(
        NetFtSetup { range: [30.0, 30.0, 60.0, 0.5, 0.5, 0.5], ..NetFtSetup::default() },
        HostTime::now(),
        move |_| {
            if !theirs.load(Ordering::Relaxed) {
                return [0.0; 6];
            }
            let _ = mark.compare_exchange(0, HostTime::now().nanos(), Ordering::Relaxed, Ordering::Relaxed);
            [0.0, 0.0, PUSH_N, 0.0, 0.0, 0.0]
        },
    )
    .expect("loopback");
    let emulator =
        NativeStageEmulator::start(NativeStageSetup::default(), |_, _| {}).expect("a pseudo-terminal");
    let mut stage = NativeStage::connect(&NativeOptions::new(emulator.port())).expect("a stage");
    let settings = NetFtSettings {
        http_port: sensor.http_port(),
        rdt_port: sensor.rdt_port(),
        ..NetFtSettings::at("127.0.0.1")
    };
    let mut force = NetFt::open(&settings).expect("a sensor");
    let bench = Bench { limits: *stage.limits(), ..run_bench::bench(LIMIT_N) };
    let protocol = Protocol::parse("waiting.toml", PROTOCOL, &[]).expect("sound");
    if std::env::var_os("ABORT_PAGED").is_none() {
        stay_resident().expect("a limit that lets the program stay in memory (ulimit -l)");
    }
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
    let over = Arc::new(AtomicBool::new(false));
    let theirs = Arc::clone(&over);
    let control = std::thread::spawn(move || lateness(&theirs));
    let (mut arrived, mut handled, mut all) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..rounds {
        let place = tempfile::tempdir().expect("a folder");
        let writer = SessionWriter::create(
            &place.path().join("session"),
            run_bench::start_document("waiting", PROTOCOL, &stage, &force),
        )
        .expect("a session");
        let latch = Latch::new(stage.stopper().expect("a second way"));
        let (watched, operator) = (Watched::default(), Operator::default());
        let plan = |at: [f64; 2]| Plan::new(protocol.name(), &protocol.expand(), &bench, at).checked();
        let doing = Conduct {
            plan: &plan,
            bench: &bench,
            silence: Duration::from_secs(5),
            gap: 35_000,
            frozen: 35_000,
            latch: &latch,
            watched: &watched,
            operator: &operator,
        };
        let wait = Duration::from_micros(random.random_range(50_000..150_000));
        force.start().expect("a stream");
        let ran = std::thread::scope(|scope| {
            scope.spawn(|| {
                while !matches!(watched.now().doing, Doing::Leg(_)) {
                    std::thread::sleep(Duration::from_millis(1));
                }
                std::thread::sleep(wait);
                felt_ns.store(0, Ordering::SeqCst);
                pushes.store(true, Ordering::SeqCst);
            });
            let instruments = Instruments { stage: &mut stage, force: &mut force, markers: None };
            conduct(instruments, &doing, &writer).expect("a zero")
        });
        let tripped = ran.stopped.expect("a stop").tripped;
        assert!(matches!(tripped.cause, Cause::Limit { axis: 2, .. }), "{}", tripped.cause);
        let felt = HostTime::from_nanos(felt_ns.load(Ordering::SeqCst));
        let sent = tripped.sent.expect("the port takes them");
        arrived.push(tripped.seen.since(felt));
        handled.push(sent.since(tripped.seen));
        all.push(sent.since(felt));
        pushes.store(false, Ordering::Relaxed);
        let cause = tripped.cause.to_string();
        writer.finish(Outcome::Abort { cause }, ran.losses, HostTime::now()).expect("a disk");
        force.stop().expect("it ends");
        stage.clear().expect("nothing is wrong");
        while !stage
            .report(HostTime::now() + Duration::from_millis(100))
            .expect("it answers")
            .is_some_and(|report| report.state == StageState::Idle)
        {}
    }
    over.store(true, Ordering::Relaxed);
    let late = control.join().expect("it only sleeps");
    println!("{rounds} stops (ms)            p50     p90     p99     most");
    for (what, mut times) in [
        ("sensor to host", arrived),
        ("host to stop bytes", handled),
        ("sensor to stop bytes", all),
        ("a sleeper woken late", late),
    ] {
        times.sort_unstable();
        let at = |share: f64| times[((times.len() - 1) as f64 * share).round() as usize].as_secs_f64() * 1e3;
        println!("{what:<22} {:>7.3} {:>7.3} {:>7.3} {:>7.3}", at(0.5), at(0.9), at(0.99), at(1.0));
    }
}
