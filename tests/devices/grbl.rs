//! A stage run by Grbl: the driver over a pseudo-terminal against the emulated controller, in both dialects.

mod connect;
mod faults;
mod homing;

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
