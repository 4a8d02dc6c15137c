//! Homing with Grbl, which says nothing while it lasts: how long it may take, and how it ends otherwise.

use super::*;

/// Homing with so long a rest after each of its eight legs.
fn slow_homing(dialect: GrblDialect, rest_ms: f64) -> GrblSetup {
    let mut setup = bench(dialect);
    setup.settings.insert(26, rest_ms);
    setup
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
