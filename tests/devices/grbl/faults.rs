//! What goes wrong with a Grbl controller in use: each fault is told by name, and the stage stands.

use super::*;

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
            // What resets it is on its way for as long as a machine that is not held up may take, and then has to be read.
            thread::sleep(3 * LOST);
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
