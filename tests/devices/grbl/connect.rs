//! What a Grbl controller may be like when it is met, and what is refused.

use super::*;

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
