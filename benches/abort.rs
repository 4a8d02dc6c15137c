//! From a step of the force at the sensor to the stop bytes on the stage's pseudo-terminal: how long, and how often?
//!
//! The emulated sensor streams 7000 records a second over loopback, everything is recorded, the stage's driver asks for reports: as in a
//! run. The step comes at a random instant; it counts from the first record that holds it. `cargo bench --bench abort`, for
//! `ABORT_ROUNDS` stops (300, some six minutes).

use phantom_rig::acquire::{
    Bench, Cause, Conduct, Doing, Instruments, Latch, Latency, LoadLimits, Operator, PhantomBox, Plan,
    Protocol, Watched, conduct,
};
use phantom_rig::clock::HostTime;
use phantom_rig::device::{ForceSensor, Mounting, SensorMounting, Stage, StageLimits, StageState};
use phantom_rig::driver::{NativeOptions, NativeStage, NetFt, NetFtSettings};
use phantom_rig::geometry::{Mat3, Vec3};
use phantom_rig::session::{
    ForceDocument, HashedText, Outcome, PhantomDocument, SessionWriter, StageDocument, StartDocument,
    TipDocument, boot, utc_text,
};
use phantom_rig::sim::bytes::{NativeStageEmulator, NativeStageSetup, NetFtEmulator, NetFtSetup};
use rand::{RngExt, SeedableRng};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, SystemTime};

/// What pushes on the tip after the step, and where the run is stopped (N).
const PUSH_N: f64 = 10.0;
const LIMIT_N: f64 = 5.0;

const PROTOCOL: &str =
    "format = \"phantom-protocol/1\"\nname = \"waiting\"\n[[step]]\nkind = \"wait\"\nwait_s = 60\n";

fn bench(limits: StageLimits) -> Bench {
    Bench {
        limits,
        mounting: Mounting::new([0.045, 0.075, 0.085], [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0]], 1e-4)
            .expect("two axes"),
        tip_radius_m: 0.008,
        phantom: PhantomBox { low_m: [0.0; 3], high_m: [0.1, 0.15, 0.025] },
        surface_tolerance_m: 4e-4,
        clearance_m: 4e-3,
        run_up_m: 1e-3,
        travel_speed_m_s: 0.02,
        approach_speed_m_s: 0.008,
        acceleration_m_s2: 0.2,
        stop_deceleration_m_s2: 0.5,
        latency: Latency { sensor_s: 0.0, host_s: 0.005, serial_s: 0.002 },
        load: LoadLimits {
            sensor: SensorMounting {
                to_phantom: Mat3::identity(),
                tip_m: Vec3::new(0.0, 0.0, -0.04),
                reads_reaction: true,
            },
            force_n: [LIMIT_N; 3],
            torque_nm: 0.3,
            range: [30.0, 30.0, 60.0, 0.5, 0.5, 0.5],
        },
        stiffness_n_per_m: [100.0, 300.0],
        least_rest_s: 0.5,
        streams: Vec::new(),
    }
}

fn start(stage: &NativeStage, force: &NetFt) -> StartDocument {
    StartDocument {
        format: String::new(),
        name: "waiting".to_owned(),
        segment: 0,
        first_poke: 1,
        started_utc: utc_text(SystemTime::now()),
        started_host_ns: HostTime::now().nanos(),
        boot: boot(),
        variables: Default::default(),
        program: "bench".to_owned(),
        seeds: Default::default(),
        rig: HashedText::new("rig"),
        protocol: HashedText::new(PROTOCOL),
        stage: Some(StageDocument::new(stage.identity(), stage.limits())),
        force: Some(ForceDocument::new(force.identity(), force.format())),
        markers: None,
        mounting: None,
        tip: TipDocument {
            contact: "bonded".to_owned(),
            shape: "pad".to_owned(),
            radius_m: 0.008,
            sphere_radius_m: None,
        },
        phantom: PhantomDocument {
            description: "none".to_owned(),
            mesh: None,
            mesh_sha256: None,
            poisson_ratio: 0.47,
            density_kg_m3: 1050.0,
            modulus_range_pa: [5e3, 2e4],
        },
    }
}

fn main() {
    let rounds: usize = std::env::var("ABORT_ROUNDS").map_or(300, |r| r.parse().expect("a number"));
    let pushes = Arc::new(AtomicBool::new(false));
    let felt_ns = Arc::new(AtomicU64::new(0));
    let (theirs, mark) = (Arc::clone(&pushes), Arc::clone(&felt_ns));
    let sensor = NetFtEmulator::start(
        NetFtSetup { range: [30.0, 30.0, 60.0, 0.5, 0.5, 0.5], ..NetFtSetup::default() },
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
        NativeStageEmulator::start(NativeStageSetup::default(), |_| {}).expect("a pseudo-terminal");
    let mut stage = NativeStage::connect(&NativeOptions::new(emulator.port())).expect("a stage");
    let settings = NetFtSettings {
        http_port: sensor.http_port(),
        rdt_port: sensor.rdt_port(),
        ..NetFtSettings::at("127.0.0.1")
    };
    let mut force = NetFt::open(&settings).expect("a sensor");
    let bench = bench(*stage.limits());
    let protocol = Protocol::parse("waiting.toml", PROTOCOL, &[]).expect("sound");
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
    let (mut arrived, mut handled, mut all) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..rounds {
        let place = tempfile::tempdir().expect("a folder");
        let writer =
            SessionWriter::create(&place.path().join("session"), start(&stage, &force)).expect("a session");
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
                pushes.store(true, Ordering::Relaxed);
            });
            let instruments = Instruments { stage: &mut stage, force: &mut force, markers: None };
            conduct(instruments, &doing, &writer).expect("a zero")
        });
        let tripped = ran.stopped.expect("a stop").tripped;
        assert!(matches!(tripped.cause, Cause::Limit { axis: 2, .. }), "{}", tripped.cause);
        let felt = HostTime::from_nanos(felt_ns.swap(0, Ordering::Relaxed));
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
    println!("{rounds} stops (ms)            p50     p90     p99     most");
    for (what, mut times) in
        [("sensor to host", arrived), ("host to stop bytes", handled), ("sensor to stop bytes", all)]
    {
        times.sort_unstable();
        let at = |share: f64| times[((times.len() - 1) as f64 * share).round() as usize].as_secs_f64() * 1e3;
        println!("{what:<22} {:>7.3} {:>7.3} {:>7.3} {:>7.3}", at(0.5), at(0.9), at(0.99), at(1.0));
    }
}
