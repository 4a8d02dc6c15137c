//! A serial line that drops, doubles, corrupts and delays: nothing moves twice, and what was asked is done.

use super::*;

/// Goes back and forth over a line that fails and compares the way that the stage has gone with the sum of the moves.
fn back_and_forth(
    setup: NativeStageSetup,
    moves: usize,
    spoil: impl FnOnce(&mut phantom_rig::sim::bytes::NativeStageFaults),
) {
    let emulator = power(setup);
    let mut stage = homed(&options(&emulator));
    emulator.faults().change(spoil);
    let (start, began) = (emulator.truth(), HostTime::now());
    let mut commanded = [0.0; 2];
    let mut at = rest(&mut stage).position_m;
    let mut done = 0;
    for n in 0..moves {
        // Whole steps, so that ways add up without rounding.
        let target = [if n % 2 == 0 { 4.0 } else { 1.0 }, 1.0 + 0.1 * (n % 10) as f64];
        stage.move_to(go(target[0], target[1])).expect("a bad line delays, it does not refuse");
        let there = rest(&mut stage).position_m;
        commanded = [0, 1].map(|axis| commanded[axis] + (target[axis] * 1e-3 - at[axis]).abs());
        at = there;
        done += 1;
        assert!(far(at, target.map(|mm| mm * 1e-3)) < 1e-9, "{at:?} {target:?}");
    }
    let (end, took) = (emulator.truth(), HostTime::now().since(began));
    println!("{done} moves in {took:?}: {:?}", stage.losses());
    let gone = [0, 1].map(|axis| end.gone_m[axis] - start.gone_m[axis]);
    assert!(far(gone, commanded) < STEP_M / 2.0, "went {gone:?} m for {commanded:?} m");
}

#[test]
fn nothing_moves_twice_when_bytes_are_wrong() {
    steady(|| {
        back_and_forth(NativeStageSetup { seed: 1, ..Default::default() }, 12, |faults| {
            faults.corrupt_share = 0.01
        });
    });
}

#[test]
fn nothing_moves_twice_when_bytes_are_lost_or_doubled() {
    steady(|| {
        back_and_forth(NativeStageSetup { seed: 2, ..Default::default() }, 12, |faults| {
            (faults.drop_share, faults.duplicate_share) = (0.004, 0.004);
        });
    });
}

#[test]
fn nothing_moves_twice_when_frames_are_lost_or_doubled() {
    steady(|| {
        let setup = NativeStageSetup { seed: 3, line_bytes_s: None, ..Default::default() };
        back_and_forth(setup, 12, |faults| {
            (faults.drop_frame_share, faults.duplicate_frame_share) = (0.2, 0.3)
        });
    });
}

/// Late copies of old moves are the ones that could send it back.
#[test]
fn nothing_moves_twice_when_frames_come_late() {
    steady(|| {
        back_and_forth(NativeStageSetup { seed: 7, ..Default::default() }, 16, |faults| {
            (faults.drop_frame_share, faults.late_frame_share) = (0.1, 0.4);
        });
    });
}

#[test]
#[ignore = "a measurement: 100 moves over a line with 0 and 1 % of wrong bytes"]
fn moves_over_a_bad_line() {
    for share in [0.0, 0.01] {
        println!("{} % of bytes wrong", share * 100.0);
        back_and_forth(NativeStageSetup { seed: 4, ..Default::default() }, 100, |faults| {
            faults.corrupt_share = share
        });
    }
}

#[test]
#[ignore = "a measurement: how often the usual lease of 100 ms outlasts 1 % of wrong bytes"]
fn leases_over_a_bad_line() {
    for lease_ms in [100, 250] {
        let emulator = power(NativeStageSetup { seed: 5, ..Default::default() });
        let mut stage = homed(&NativeOptions {
            lease: Duration::from_millis(lease_ms),
            ..NativeOptions::new(emulator.port())
        });
        emulator.faults().change(|faults| faults.corrupt_share = 0.01);
        let (mut expired, mut seconds) = (0, 0.0);
        for n in 0..40 {
            let began = HostTime::now();
            stage.move_to(go(if n % 2 == 0 { 30.0 } else { 1.0 }, 1.0)).expect("it may move");
            let report =
                wait(&mut stage, |report| report.state != StageState::Moving).expect("nothing fails");
            seconds += HostTime::now().since(began).as_secs_f64();
            if report.state != StageState::Idle {
                expired += 1;
                std::thread::sleep(Duration::from_millis(100));
                stage.clear().expect("at rest");
                rest(&mut stage);
            }
        }
        println!(
            "lease {lease_ms} ms: {expired} of 40 motions ended by the lease in {seconds:.0} s; {:?}",
            stage.losses()
        );
        println!("emulator waited {:?} for the processor", emulator.truth().stood_still);
    }
}
