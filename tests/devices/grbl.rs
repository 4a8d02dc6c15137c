//! A stage run by Grbl: the driver over a pseudo-terminal against the emulated controller, in both dialects and with each fault.

use crate::steady::steady;
use phantom_rig::clock::HostTime;
use phantom_rig::device::{DeviceError, Motion, Stage, StageReport, StageState};
use phantom_rig::driver::{DriverError, GrblOptions, GrblStage};
use phantom_rig::sim::bytes::{GrblDialect, GrblEmulator, GrblFaults, GrblSetup};
use serialport::{SerialPort, TTYPort};
use std::io::Write;
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use GrblDialect::{Classic, Hal};

const SPEED: f64 = 0.01;
const ACCELERATION: f64 = 0.2;
/// A tip may be seen a little later than the report that it is compared with, and a report is rounded to 1 µm (m).
const ROUNDING: f64 = 2e-6;
/// Longest wait for anything on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// A stage with an emulated controller behind it. Fields are dropped in order.
struct Rig {
    stage: GrblStage,
    tip: Arc<Mutex<[f64; 2]>>,
    faults: GrblFaults,
    _emulator: GrblEmulator,
}

fn options(port: &str) -> GrblOptions {
    GrblOptions {
        banner: Duration::from_millis(400),
        reply: Duration::from_secs(2),
        silence: Duration::from_secs(2),
        moving_rate_hz: 50.0,
        idle_rate_hz: 20.0,
        ..GrblOptions::new(port)
    }
}

/// The bench with an axis of each kind near its switch and fast homing: half a second a homing.
fn bench(dialect: GrblDialect) -> GrblSetup {
    let mut setup = GrblSetup::bench(dialect);
    setup.start_mm = [-3.0, -2.0, -4.0];
    setup.settings.extend([(24, 600.0), (26, 5.0)]);
    setup
}

impl Rig {
    fn with(setup: GrblSetup) -> Self {
        Self::with_options(setup, options)
    }

    fn with_options(setup: GrblSetup, options: impl Fn(&str) -> GrblOptions) -> Self {
        let tip = Arc::new(Mutex::new([f64::NAN; 2]));
        let seen = tip.clone();
        let emulator =
            GrblEmulator::start(setup, move |_, position| *seen.lock().expect("no panic") = position)
                .expect("a pseudo-terminal");
        let stage = GrblStage::connect(&options(emulator.port())).expect("a stage");
        Self { stage, tip, faults: emulator.faults(), _emulator: emulator }
    }

    fn new(dialect: GrblDialect) -> Self {
        Self::with(bench(dialect))
    }

    fn homed(dialect: GrblDialect) -> Self {
        Self::with(bench(dialect)).and_home()
    }

    fn and_home(mut self) -> Self {
        self.home();
        self
    }

    fn home(&mut self) {
        self.stage.home().expect("homing starts");
        let home = self.until(|report| report.homed);
        assert_eq!(home.state, StageState::Idle);
    }

    fn tip(&self) -> [f64; 2] {
        *self.tip.lock().expect("no panic")
    }

    /// The next report.
    fn report(&mut self) -> StageReport {
        self.try_report().expect("a report")
    }

    fn try_report(&mut self) -> Result<StageReport, DeviceError> {
        let until = HostTime::now() + PATIENCE;
        self.stage.report(until).map(|report| report.expect("a report within a minute"))
    }

    fn until(&mut self, mut done: impl FnMut(&StageReport) -> bool) -> StageReport {
        let deadline = HostTime::now() + PATIENCE;
        loop {
            let report = self.report();
            if done(&report) {
                return report;
            }
            assert!(HostTime::now() < deadline, "{report:?} is the last of a minute");
        }
    }

    /// Reports until it fails.
    fn failure(&mut self) -> DeviceError {
        let deadline = HostTime::now() + PATIENCE;
        while HostTime::now() < deadline {
            if let Err(error) = self.try_report() {
                return error;
            }
        }
        panic!("nothing went wrong for a minute")
    }

    fn go(&mut self, x_mm: f64, z_mm: f64) -> Result<(), DeviceError> {
        self.stage.move_to(motion(x_mm, z_mm))
    }

    /// Says something that the controller does not hear.
    fn unheard(&mut self, say: impl FnOnce(&mut GrblStage)) {
        self.faults.deafen(true);
        say(&mut self.stage);
        thread::sleep(LOST);
        self.faults.deafen(false);
    }

    /// Well under way to (-50, -1) mm.
    fn under_way(&mut self) {
        self.go(-50.0, -1.0).expect("a motion");
        self.until(|report| report.state == StageState::Moving && report.position_m[0] < -3e-3);
    }
}

/// Homing with so long a rest after each of its eight legs.
fn slow_homing(dialect: GrblDialect, rest_ms: f64) -> GrblSetup {
    let mut setup = bench(dialect);
    setup.settings.insert(26, rest_ms);
    setup
}

/// What was sent has been lost by then.
const LOST: Duration = Duration::from_millis(50);

fn motion(x_mm: f64, z_mm: f64) -> Motion {
    Motion { target_m: [x_mm * 1e-3, z_mm * 1e-3], speed_m_s: SPEED, acceleration_m_s2: ACCELERATION }
}

fn near(a: [f64; 2], b: [f64; 2], within: f64) -> bool {
    (0..2).all(|axis| (a[axis] - b[axis]).abs() <= within)
}

#[test]
fn it_is_known_and_has_not_homed() {
    for (dialect, name) in [(Classic, "Grbl 1.1h"), (Hal, "grblHAL 1.1f")] {
        steady(|| {
            let mut rig = Rig::new(dialect);
            assert_eq!(rig.stage.identity().controller, name);
            let limits = rig.stage.limits();
            // Hard limits are on: the last millimetre belongs to the switch.
            assert_eq!(limits.travel_m, [[-0.1, -0.001], [-0.03, -0.001]]);
            assert!((limits.speed_m_s[0] - 0.025).abs() < 1e-12);
            let report = rig.report();
            assert_eq!((report.state, report.homed), (StageState::Idle, false), "{dialect:?}");
            assert!(matches!(rig.go(-5.0, -5.0), Err(DeviceError::NotHomed { .. })));
        });
    }
}

#[test]
fn it_homes_and_goes_where_it_is_told() {
    for dialect in [Classic, Hal] {
        steady(|| {
            let mut rig = Rig::homed(dialect);
            assert!(near(rig.tip(), [-1e-3; 2], ROUNDING), "{:?}", rig.tip());
            let mut seen = Vec::new();
            rig.go(-5.0, -4.0).expect("a motion");
            let end = rig.until(|report| {
                seen.push(*report);
                report.state == StageState::Idle
            });
            assert!(
                near(end.position_m, [-5e-3, -4e-3], ROUNDING) && near(rig.tip(), [-5e-3, -4e-3], ROUNDING)
            );
            // 5 mm at 10 mm/s takes half a second.
            assert!(seen.len() > 5, "{} reports", seen.len());
            assert!(
                seen.windows(2).all(|w| w[0].host < w[1].host && w[0].position_m[0] >= w[1].position_m[0])
            );
            assert!(seen.iter().all(|report| report.homed));
            // On the straight line from (-1, -1) to (-5, -4).
            let off = |r: &StageReport| (0.75 * (r.position_m[0] + 1e-3) - (r.position_m[1] + 1e-3)).abs();
            assert!(seen.iter().all(|report| off(report) < 5e-6), "it went another way");
        });
    }
}

#[test]
fn motions_beyond_its_limits_are_refused_here() {
    steady(|| {
        let mut rig = Rig::homed(Hal);
        for (x, z, axis) in [(-101.0, -1.0, 0), (0.0, -1.0, 0), (-1.0, -30.1, 1), (f64::NAN, -1.0, 0)] {
            match rig.go(x, z) {
                Err(DeviceError::OutsideTravel { axis: named, .. }) => assert_eq!(named, axis),
                other => panic!("{other:?} for {x} {z}"),
            }
        }
        let base = motion(-5.0, -1.0);
        for wrong in [0.0, -1.0, f64::NAN, 0.026] {
            let refused = rig.stage.move_to(Motion { speed_m_s: wrong, ..base });
            assert!(
                matches!(refused, Err(DeviceError::TooFast { axis: 0, .. })),
                "{refused:?} at {wrong} m/s"
            );
        }
        let refused = rig.stage.move_to(Motion { acceleration_m_s2: 0.21, ..base });
        assert!(matches!(refused, Err(DeviceError::TooFast { axis: 0, .. })), "{refused:?}");
        let refused = rig.stage.move_to(Motion { speed_m_s: 1e-5, ..base });
        assert!(matches!(refused, Err(DeviceError::Refused { .. })), "{refused:?}");
        // √2 of it along the diagonal.
        let along = rig.stage.acceleration_along([-1e-3; 2], [-2e-3; 2]);
        assert!((along - 0.2 * 2.0_f64.sqrt()).abs() < 1e-12);
        assert!(near(rig.report().position_m, [-1e-3; 2], ROUNDING));
    });
}

#[test]
fn a_second_motion_waits_for_the_first() {
    steady(|| {
        let mut rig = Rig::homed(Classic);
        rig.under_way();
        assert!(matches!(rig.go(-1.0, -1.0), Err(DeviceError::Refused { .. })));
        assert!(matches!(rig.stage.home(), Err(DeviceError::Refused { .. })));
    });
}

#[test]
fn stopping_brakes_and_keeps_the_position() {
    for dialect in [Classic, Hal] {
        steady(|| {
            let mut rig = Rig::homed(dialect);
            rig.under_way();
            rig.stage.stop().expect("a stop");
            let rest = rig.until(|report| report.state != StageState::Moving);
            assert_eq!((rest.state, rest.homed), (StageState::Idle, true), "{dialect:?}");
            assert!(near(rest.position_m, rig.tip(), ROUNDING));
            rig.go(-1.0, -1.0).expect("it moves again");
            rig.until(|report| report.state == StageState::Idle);
            assert!(near(rig.tip(), [-1e-3; 2], ROUNDING));
        });
    }
}

/// The controller takes 50 ms to read a line: a cancellation sent at once would overtake the jog.
#[test]
fn a_stop_right_after_a_motion_does_not_overtake_it() {
    for dialect in [Classic, Hal] {
        steady(|| {
            let mut setup = bench(dialect);
            setup.reading = Duration::from_millis(50);
            let mut rig = Rig::with(setup).and_home();
            rig.go(-90.0, -1.0).expect("a motion");
            rig.stage.stop().expect("a stop");
            let rest = rig.until(|report| report.state != StageState::Moving);
            assert_eq!(rest.state, StageState::Idle);
            assert!(rig.tip()[0] > -0.08, "it went on to {} m", rig.tip()[0]);
        });
    }
}

#[test]
fn a_stopper_stops_from_another_thread_and_latches() {
    for dialect in [Classic, Hal] {
        steady(|| {
            let mut rig = Rig::homed(dialect);
            let stopper = rig.stage.stopper().expect("a stopper");
            rig.under_way();
            let at =
                thread::spawn(move || stopper.stop_now()).join().expect("no panic").expect("a byte sent");
            let rest = rig.until(|report| report.state != StageState::Moving);
            assert!(rest.host > at);
            assert_eq!(rest.state, StageState::Fault { code: 0 }, "{dialect:?}");
            assert!(near(rest.position_m, rig.tip(), ROUNDING));
            assert!(rest.homed);
            let refused = rig.go(-1.0, -1.0);
            assert!(matches!(refused, Err(DeviceError::Fault { code: 0, .. })), "{refused:?}");
            assert!(matches!(rig.stage.home(), Err(DeviceError::Fault { .. })));
            let before = rig.tip();
            rig.stage.clear().expect("cleared");
            let cleared = rig.report();
            assert_eq!(cleared.state, StageState::Idle);
            assert_eq!(rig.tip(), before, "clearing moves nothing");
            // grblHAL takes the reset for one in motion and no longer trusts its position.
            assert_eq!(cleared.homed, dialect == Classic);
            if dialect == Hal {
                rig.home();
            }
            rig.go(-1.0, -1.0).expect("it moves again");
            rig.until(|report| report.state == StageState::Idle);
        });
    }
}

#[test]
fn a_stopper_latches_a_standing_stage_and_one_that_is_just_being_told_to_move() {
    steady(|| {
        let mut setup = bench(Classic);
        setup.reading = Duration::from_millis(20);
        let mut rig = Rig::with(setup).and_home();
        let stopper = rig.stage.stopper().expect("a stopper");
        for round in 0..6_u64 {
            // At another moment of the motion's beginning each time.
            thread::scope(|scope| {
                scope.spawn(|| {
                    let until = HostTime::now() + Duration::from_millis(6 * round);
                    while HostTime::now() < until {
                        thread::yield_now();
                    }
                    stopper.stop_now().expect("a byte sent");
                });
                // Refused, unanswered or under way: all may be.
                let _ = rig.go(-90.0, -1.0);
            });
            let rest = rig.until(|report| matches!(report.state, StageState::Fault { .. }));
            assert!(rest.position_m[0] > -0.08, "round {round}: it is at {:?}", rest.position_m);
            let before = rig.tip();
            rig.stage.clear().expect("cleared");
            assert_eq!(rig.report().state, StageState::Idle);
            assert_eq!(rig.tip(), before, "round {round}: nothing was queued");
            if !rig.report().homed {
                rig.home();
            }
        }
    });
}

#[test]
fn a_reset_in_motion_is_noticed() {
    for dialect in [Classic, Hal] {
        steady(|| {
            let mut rig = Rig::homed(dialect);
            rig.under_way();
            rig.faults.reset();
            let error = rig.failure();
            assert!(matches!(error, DeviceError::Reset { .. }), "{error}");
            let after = rig.report();
            assert_eq!((after.state, after.homed), (StageState::Idle, false));
            assert!(matches!(rig.go(-1.0, -1.0), Err(DeviceError::NotHomed { .. })));
            rig.home();
        });
    }
}

#[test]
fn a_pulled_plug_is_noticed() {
    for dialect in [Classic, Hal] {
        steady(|| {
            let mut rig = Rig::homed(dialect);
            let stopper = rig.stage.stopper().expect("a stopper");
            rig.under_way();
            rig.faults.unplug();
            let error = rig.failure();
            assert!(matches!(error, DeviceError::Lost { .. }), "{error}");
            assert!(stopper.stop_now().is_err());
            assert!(matches!(rig.stage.stop(), Err(DeviceError::Lost { .. })));
        });
    }
}

#[test]
fn silence_is_noticed() {
    steady(|| {
        let mut rig = Rig::homed(Hal);
        rig.under_way();
        rig.faults.silence(true);
        let error = rig.failure();
        let DeviceError::Silent { waited, .. } = error else { panic!("{error}") };
        assert!(waited > Duration::from_secs(2) && waited < Duration::from_secs(30), "{waited:?}");
    });
}

#[test]
fn corrupted_reports_are_counted_and_not_believed() {
    for dialect in [Classic, Hal] {
        steady(|| {
            let mut rig = Rig::homed(dialect);
            rig.go(-21.0, -11.0).expect("a motion");
            rig.faults.corrupt(0.005);
            let end = rig.until(|report| {
                let [x, z] = report.position_m;
                let on_path = (-21.02e-3..=-0.98e-3).contains(&x) && (-11.02e-3..=-0.98e-3).contains(&z);
                assert!(on_path, "{report:?} is off the path");
                report.state != StageState::Moving && near(report.position_m, [-21e-3, -11e-3], ROUNDING)
            });
            assert_eq!(end.state, StageState::Idle);
            rig.faults.corrupt(0.0);
            assert!(rig.stage.nonsense() > 0);
            assert_eq!(rig.stage.line_counts(), [("lines_without_sense", rig.stage.nonsense())]);
        });
    }
}

#[test]
fn lost_lines_are_asked_for_again() {
    for dialect in [Classic, Hal] {
        steady(|| {
            let mut rig = Rig::homed(dialect);
            rig.go(-11.0, -1.0).expect("a motion");
            rig.faults.drop_lines(0.2);
            rig.until(|report| report.state == StageState::Idle);
            assert!(near(rig.tip(), [-11e-3, -1e-3], ROUNDING));
        });
    }
}

#[test]
fn a_limit_switch_is_a_fault_until_it_is_cleared_and_homed() {
    for dialect in [Classic, Hal] {
        steady(|| {
            let mut rig = Rig::homed(dialect);
            rig.under_way();
            rig.faults.hit_limit();
            let hit = rig.until(|report| report.state != StageState::Moving);
            assert_eq!((hit.state, hit.homed), (StageState::Fault { code: 1 }, false), "{dialect:?}");
            assert!(matches!(rig.go(-1.0, -1.0), Err(DeviceError::Fault { code: 1, .. })));
            // Silence that is to be expected of Grbl now is none that alarms anybody.
            let quiet = rig.stage.report(HostTime::now() + Duration::from_millis(2500)).expect("no failure");
            assert!(quiet.is_none_or(|report| report.state == StageState::Fault { code: 1 }));
            rig.stage.clear().expect("cleared");
            let cleared = rig.report();
            assert_eq!((cleared.state, cleared.homed), (StageState::Idle, false));
            assert!(matches!(rig.go(-1.0, -1.0), Err(DeviceError::NotHomed { .. })));
            rig.home();
            assert!(near(rig.tip(), [-1e-3; 2], ROUNDING));
        });
    }
}

#[test]
fn a_motion_that_is_not_acknowledged_is_stopped() {
    for dialect in [Classic, Hal] {
        steady(|| {
            let mut rig = Rig::homed(dialect);
            rig.faults.withhold_oks(1);
            let error = rig.go(-90.0, -1.0).expect_err("no acknowledgement");
            assert!(matches!(error, DeviceError::Silent { .. }), "{error}");
            let rest = rig.until(|report| report.state != StageState::Moving);
            assert_eq!(rest.state, StageState::Fault { code: 0 });
            assert!(rig.tip()[0] > -0.08, "it went on to {} m", rig.tip()[0]);
            rig.stage.clear().expect("cleared");
            assert_eq!(rig.report().state, StageState::Idle);
        });
    }
}

#[test]
fn homing_without_an_acknowledgement_is_not_believed() {
    steady(|| {
        let mut rig = Rig::new(Classic);
        rig.faults.withhold_oks(1);
        rig.stage.home().expect("homing starts");
        let error = rig.failure();
        assert!(matches!(error, DeviceError::Silent { during: "homing", .. }), "{error}");
        let after = rig.report();
        assert_eq!((after.state, after.homed), (StageState::Fault { code: 0 }, false));
    });
}

/// Standing, Grbl answers the question that comes with the command before it reads the command; then it says nothing until it has homed.
#[test]
fn homing_may_take_longer_than_a_reply() {
    for dialect in [Classic, Hal] {
        steady(|| {
            let short = |port: &str| GrblOptions { reply: Duration::from_millis(300), ..options(port) };
            let mut rig = Rig::with_options(slow_homing(dialect, 120.0), short).and_home();
            rig.home();
            rig.go(-5.0, -4.0).expect("a motion");
        });
    }
}

/// The settings of this one do not tell how long it really takes.
#[test]
fn homing_that_takes_too_long_is_ended() {
    steady(|| {
        let mut setup = slow_homing(Classic, 2000.0);
        setup.settings.extend([(24, 6000.0), (25, 6000.0), (130, 10.0), (131, 10.0), (132, 10.0)]);
        let mut rig = Rig::with(setup);
        rig.stage.home().expect("homing starts");
        let error = rig.failure();
        assert!(matches!(error, DeviceError::Silent { during: "homing", .. }), "{error}");
        // Reset while homing: so it does not go on.
        let ended = rig.until(|report| report.state == StageState::Fault { code: 6 });
        assert!(!ended.homed);
    });
}

#[test]
fn a_stop_that_got_lost_can_be_repeated() {
    for dialect in [Classic, Hal] {
        steady(|| {
            let mut rig = Rig::homed(dialect);
            rig.under_way();
            rig.unheard(|stage| stage.stop().expect("a stop"));
            rig.stage.stop().expect("a stop");
            let rest = rig.until(|report| report.state != StageState::Moving);
            assert_eq!((rest.state, rest.homed), (StageState::Idle, true), "{dialect:?}");
            assert!(rig.tip()[0] > -0.03, "it went on to {} m", rig.tip()[0]);
        });
    }
}

/// It hears nothing of the first stop, and nothing is heard of it: it may still be moving.
#[test]
fn a_stage_that_is_not_seen_at_rest_is_reset() {
    for dialect in [Classic, Hal] {
        steady(|| {
            let mut rig = Rig::homed(dialect);
            rig.under_way();
            rig.unheard(|stage| stage.stop().expect("a stop"));
            rig.faults.silence(true);
            let _ = rig.stage.report(HostTime::now() + Duration::from_millis(1500));
            let stopped = rig.tip();
            assert!(stopped[0] > -0.04, "it went on to {} m", stopped[0]);
            thread::sleep(LOST);
            assert_eq!(rig.tip(), stopped, "{dialect:?} stands");
            let error = rig.failure();
            assert!(matches!(error, DeviceError::Silent { .. }), "{error}");
            rig.faults.silence(false);
            let rest = rig.until(|report| report.state != StageState::Moving);
            assert!(matches!(rest.state, StageState::Fault { .. }) && !rest.homed, "{rest:?}");
        });
    }
}

/// It has said nothing for longer than silence is borne with: so it homes.
#[test]
fn a_stop_after_homing_for_long_is_no_silence() {
    steady(|| {
        let impatient = |port: &str| GrblOptions { silence: Duration::from_millis(500), ..options(port) };
        let mut rig = Rig::with_options(slow_homing(Classic, 1000.0), impatient);
        let stopper = rig.stage.stopper().expect("a stopper");
        rig.stage.home().expect("homing starts");
        let none = rig.stage.report(HostTime::now() + Duration::from_millis(1000)).expect("no failure");
        assert!(none.is_none_or(|report| report.state == StageState::Homing), "{none:?}");
        stopper.stop_now().expect("a byte sent");
        let stopped = rig.until(|report| matches!(report.state, StageState::Fault { .. }));
        assert_eq!((stopped.state, stopped.homed), (StageState::Fault { code: 7 }, false));
    });
}

#[test]
fn homing_whose_stop_got_lost_is_reset() {
    for dialect in [Classic, Hal] {
        steady(|| {
            let mut rig = Rig::with(slow_homing(dialect, 1000.0));
            let stopper = rig.stage.stopper().expect("a stopper");
            rig.stage.home().expect("homing starts");
            rig.unheard(|_| {
                stopper.stop_now().expect("a byte sent");
            });
            let stopped = rig.until(|report| matches!(report.state, StageState::Fault { .. }));
            assert_eq!((stopped.state, stopped.homed), (StageState::Fault { code: 6 }, false), "{dialect:?}");
        });
    }
}

/// Nobody has listened for long after a stop: that it was not seen at rest says nothing.
#[test]
fn a_stage_that_nobody_has_looked_at_is_not_reset() {
    steady(|| {
        let mut rig = Rig::homed(Classic);
        rig.under_way();
        rig.stage.stop().expect("a stop");
        thread::sleep(Duration::from_secs(1));
        let rest = rig.until(|report| report.state != StageState::Moving);
        assert_eq!((rest.state, rest.homed), (StageState::Idle, true));
    });
}

#[test]
fn a_stop_outlives_the_program_that_made_it() {
    for dialect in [Classic, Hal] {
        steady(|| {
            for moving in [false, true] {
                let mut setup = bench(dialect);
                setup.resets_on_open = false;
                let emulator = GrblEmulator::start(setup, |_, _| {}).expect("a pseudo-terminal");
                let mut first = GrblStage::connect(&options(emulator.port())).expect("a stage");
                // The fault of having been stopped is nobody else's.
                first.home().expect("homing starts");
                let deadline = HostTime::now() + PATIENCE;
                while !first.report(deadline).expect("reports").expect("a report").homed {}
                if moving {
                    first.move_to(motion(-50.0, -1.0)).expect("a motion");
                }
                first.stopper().expect("a stopper").stop_now().expect("a byte sent");
                thread::sleep(Duration::from_millis(500));
                drop(first);
                // Connecting alone, as to ask who is there, lets nothing go. A grblHAL that was moving is in alarm from then on.
                if !(dialect == Hal && moving) {
                    drop(GrblStage::connect(&options(emulator.port())).expect("a stage"));
                }
                let mut second = GrblStage::connect(&options(emulator.port())).expect("a stage");
                let refused = second.home();
                assert!(
                    matches!(refused, Err(DeviceError::Fault { .. })),
                    "{dialect:?}, moving {moving}: {refused:?}"
                );
                second.clear().expect("cleared");
                second.home().expect("homing starts");
            }
        });
    }
}

#[test]
fn homing_that_fails_is_a_fault() {
    for dialect in [Classic, Hal] {
        steady(|| {
            let mut rig = Rig::new(dialect);
            rig.faults.break_switches();
            rig.report();
            rig.stage.home().expect("homing starts");
            let failed = rig.until(|report| matches!(report.state, StageState::Fault { .. }));
            assert_eq!((failed.state, failed.homed), (StageState::Fault { code: 9 }, false));
            rig.stage.clear().expect("cleared");
        });
    }
}

#[test]
fn homing_can_be_stopped() {
    for dialect in [Classic, Hal] {
        steady(|| {
            let mut rig = Rig::new(dialect);
            rig.report();
            rig.stage.home().expect("homing starts");
            rig.stage.stop().expect("a stop");
            let stopped = rig.until(|report| matches!(report.state, StageState::Fault { .. }));
            assert_eq!(stopped.state, StageState::Fault { code: 6 });
            rig.stage.clear().expect("cleared");
            let stopper = rig.stage.stopper().expect("a stopper");
            rig.stage.home().expect("homing starts");
            stopper.stop_now().expect("a byte sent");
            let stopped = rig.until(|report| matches!(report.state, StageState::Fault { .. }));
            assert_eq!((stopped.state, stopped.homed), (StageState::Fault { code: 7 }, false));
        });
    }
}

#[test]
fn work_offsets_do_not_matter() {
    steady(|| {
        let mut setup = bench(Classic);
        setup.settings.insert(10, 0.0);
        setup.work_offset_mm = [-20.0, 3.0, -7.0];
        let mut rig = Rig::with(setup).and_home();
        rig.go(-6.0, -2.0).expect("a motion");
        let end = rig.until(|report| report.state == StageState::Idle);
        assert!(near(end.position_m, [-6e-3, -2e-3], ROUNDING) && near(rig.tip(), [-6e-3, -2e-3], ROUNDING));
    });
}

#[test]
fn a_controller_that_waits_for_a_reset_is_found() {
    steady(|| {
        let mut setup = bench(Classic);
        setup.resets_on_open = false;
        setup.settings.insert(22, 0.0);
        setup.settings.insert(20, 0.0);
        let emulator = GrblEmulator::start(setup, |_, _| {}).expect("a pseudo-terminal");
        let mut first = GrblStage::connect(&options(emulator.port())).expect("a stage");
        emulator.faults().hit_limit();
        let until = HostTime::now() + PATIENCE;
        while let Some(report) = first.report(until).expect("reports") {
            if report.state == (StageState::Fault { code: 1 }) {
                break;
            }
        }
        drop(first);
        let second = GrblStage::connect(&options(emulator.port())).expect("a stage");
        assert_eq!(second.identity().controller, "Grbl 1.1h");
    });
}

#[test]
fn settings_that_do_not_serve_are_named() {
    steady(|| {
        let mut setup = bench(Hal);
        setup.settings.insert(13, 1.0);
        let emulator = GrblEmulator::start(setup, |_, _| {}).expect("a pseudo-terminal");
        let error = GrblStage::connect(&options(emulator.port())).err().expect("reports in inches");
        assert!(error.to_string().contains("$13=1"), "{error}");
        let mut setup = bench(Classic);
        setup.settings.insert(1, 25.0);
        let emulator = GrblEmulator::start(setup, |_, _| {}).expect("a pseudo-terminal");
        let error = GrblStage::connect(&options(emulator.port())).err().expect("motors go limp");
        assert!(error.to_string().contains("$1=25; expected 255"), "{error}");
        let emulator = GrblEmulator::start(bench(Classic), |_, _| {}).expect("a pseudo-terminal");
        let asked = GrblOptions { axes: ['X', 'A'], ..options(emulator.port()) };
        let error = GrblStage::connect(&asked).err().expect("no axis A");
        assert!(matches!(error, DriverError::GrblAxes { .. }), "{error}");
    });
}

#[test]
fn what_is_no_grbl_is_named_for_what_it_says() {
    steady(|| {
        let (mut device, port) = TTYPort::pair().expect("a pseudo-terminal");
        let path = port.name().expect("a path");
        device.write_all(b"start\necho:Marlin 2.1.2\n").expect("written");
        let error = GrblStage::connect(&options(&path)).err().expect("no Grbl");
        assert!(error.to_string().contains("Marlin"), "{error}");
        let missing = GrblStage::connect(&options("/dev/there-is-no-such-port")).err().expect("no port");
        assert!(matches!(missing, DriverError::Open { .. }), "{missing}");
    });
}

#[test]
fn a_port_where_nobody_answers_is_silent() {
    steady(|| {
        let (_device, port) = TTYPort::pair().expect("a pseudo-terminal");
        let error = GrblStage::connect(&options(&port.name().expect("a path"))).err().expect("nobody");
        assert!(matches!(error, DriverError::Device(DeviceError::Silent { .. })), "{error}");
    });
}
