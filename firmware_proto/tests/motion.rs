//! Does the stage move as mechanics says: trapezoids, straight lines, stopping distances, homing, switches?
//!
//! Distances in mm, times in s; v speed, a acceleration, L length. One step is 0.625 µm.

mod stage;

use firmware_proto::*;
use proptest::prelude::*;
use stage::{STEP_NM, Stage, config};

/// mm of both axes from zero.
fn mm(stage: &Stage) -> [f64; 2] {
    stage.state().steps.map(|steps| f64::from(steps) * STEP_NM * 1e-6)
}

fn near(a: f64, b: f64, tolerance: f64) -> bool {
    (a - b).abs() <= tolerance
}

/// A step, mm: positions are whole steps, so that the nearest is at most half of this away.
const STEP: f64 = STEP_NM * 1e-6;

fn accepted(response: Response) {
    assert!(matches!(response, Response::Accepted { .. }), "{response:?}");
}

fn refusal(response: Response) -> Refusal {
    match response {
        Response::Refused { refusal, .. } => refusal,
        other => panic!("not refused: {other:?}"),
    }
}

/// A stage at (10, 10) mm with the longest lease.
fn at_ten(now_us: u32) -> Stage {
    let mut stage = Stage::at(now_us, [10_000_000; 2]);
    accepted(stage.ask(Request::Lease { lease_ms: 1000 }));
    stage
}

/// Lets time pass with a word in every lease.
fn run(stage: &mut Stage, mut us: u32) {
    while us > 0 {
        let part = us.min(500_000);
        stage.wait(part);
        stage.ask(Request::Ping { host_tick_us: 0 });
        us -= part;
    }
}

/// L = 40 at v = 10, a = 100: ramps of v/a = 0.1 s over v²/2a = 0.5, duration L/v + v/a = 4.1 s.
#[test]
fn a_long_move_is_a_trapezoid() {
    for (at_us, position, velocity) in [
        (50_000, 0.125, 5.0),
        (100_000, 0.5, 10.0),
        (2_050_000, 20.0, 10.0),
        (4_000_000, 39.5, 10.0),
        (4_050_000, 39.875, 5.0),
        (4_100_000, 40.0, 0.0),
    ] {
        let mut stage = at_ten(0);
        accepted(stage.go([50_000_000, 10_000_000], 10_000, 100_000));
        run(&mut stage, at_us);
        assert!(near(mm(&stage)[0], 10.0 + position, STEP / 2.0), "{at_us} µs: {:?}", mm(&stage));
        let speed = f64::from(stage.state().velocity_nm_s[0]) * 1e-6;
        assert!(near(speed, velocity, 1e-5), "{at_us} µs: {speed}");
        assert_eq!(mm(&stage)[1], 10.0);
    }
    let mut stage = at_ten(0);
    accepted(stage.go([50_000_000, 10_000_000], 10_000, 100_000));
    run(&mut stage, 4_099_999);
    assert_eq!(stage.state().activity, Activity::Moving);
    run(&mut stage, 1);
    assert_eq!((stage.state().activity, stage.state().outcome), (Activity::Idle, Outcome::Reached));
}

/// L = 0.4 at a = 100 never reaches v = 20: top speed √(aL) = 6.3246, duration 2√(L/a) = 0.126491 s.
#[test]
fn a_short_move_is_a_triangle() {
    let mut stage = at_ten(0);
    accepted(stage.go([10_400_000, 10_000_000], 20_000, 100_000));
    run(&mut stage, 63_246);
    assert!(near(f64::from(stage.state().velocity_nm_s[0]) * 1e-6, 40_f64.sqrt(), 1e-3));
    assert!(near(mm(&stage)[0], 10.2, STEP));
    run(&mut stage, 126_491 - 63_246);
    assert_eq!(stage.state().activity, Activity::Moving);
    run(&mut stage, 1);
    assert_eq!((stage.state().activity, stage.state().steps[0]), (Activity::Idle, 16_640));
}

/// 30 and 40 mm are a 3-4-5 triangle: axis 1 gets 4/5 of the speed along the path, its limit is 20 mm/s.
#[test]
fn limits_hold_for_each_axis() {
    let mut stage = at_ten(0);
    let told = refusal(stage.go([40_000_000, 50_000_000], 25_001, 100_000));
    let expected = Refusal { reason: Reason::Speed, axis: 1, limit: 20_000, asked: 20_001 };
    assert_eq!(told, expected);
    let told = refusal(stage.go([40_000_000, 50_000_000], 25_000, 250_001));
    let expected = Refusal { reason: Reason::Acceleration, axis: 1, limit: 200_000, asked: 200_001 };
    assert_eq!(told, expected);
    let told = refusal(stage.go([40_000_000, 60_000_001], 25_000, 250_000));
    assert_eq!(told, Refusal { reason: Reason::Travel, axis: 1, limit: 60_000_000, asked: 60_000_001 });
    let told = refusal(stage.go([499_999, 20_000_000], 25_000, 250_000));
    assert_eq!(told, Refusal { reason: Reason::Travel, axis: 0, limit: 500_000, asked: 499_999 });
    assert_eq!(refusal(stage.go([20_000_000; 2], 0, 1)).limit, 1);
    assert_eq!(refusal(stage.go([20_000_000; 2], 1, 0)).reason, Reason::Acceleration);
    assert_eq!(stage.state().activity, Activity::Idle, "a refusal moves nothing");
    accepted(stage.go([40_000_000, 50_000_000], 25_000, 250_000));
    let told = refusal(stage.go([10_000_000; 2], 1000, 1000));
    assert_eq!((told.reason, told.limit), (Reason::Busy, i64::from(stage.state().motion)));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 150, failure_persistence: None, ..ProptestConfig::default() })]

    /// Duration L/v + v/a or 2√(L/a); on the line within half a step an axis; at the target at the end,
    /// whatever the steps in time and the tick it begins at.
    #[test]
    fn moves_are_straight_and_take_their_time(
        target in [500_000..60_000_000_i32, 500_000..60_000_000_i32],
        speed in 1000..20_000_u32,
        acceleration in 10_000..200_000_u32,
        begin in any::<u32>(),
        steps in proptest::collection::vec(1..400_000_u32, 1..20),
    ) {
        let mut stage = at_ten(begin);
        accepted(stage.go(target, speed, acceleration));
        let from = [10.0, 10.0];
        let to = target.map(|nm| (f64::from(nm) / STEP_NM).round() * STEP);
        let way = [to[0] - from[0], to[1] - from[1]];
        let length = way[0].hypot(way[1]);
        let (v, a) = (f64::from(speed) * 1e-3, f64::from(acceleration) * 1e-3);
        let duration = if length > v * v / a { length / v + v / a } else { 2.0 * (length / a).sqrt() };
        let mut elapsed = 0.0;
        for step in steps {
            run(&mut stage, step);
            elapsed += f64::from(step) * 1e-6;
            let gone = [mm(&stage)[0] - from[0], mm(&stage)[1] - from[1]];
            let along = (gone[0] * way[0] + gone[1] * way[1]) / length;
            for axis in 0..2 {
                prop_assert!(near(gone[axis], along * way[axis] / length, STEP), "off the line at {elapsed}");
            }
            // The nearer of the two ends of the trapezoid gives the distance: a·t²/2 or v·t − v²/2a.
            let t = elapsed.min(duration - elapsed).max(0.0);
            let ramp = (v / a).min(duration / 2.0);
            let half = if t < ramp { a * t * t / 2.0 } else { a * ramp * (t - ramp / 2.0) };
            let expected = if elapsed < duration / 2.0 { half } else { length - half };
            prop_assert!(near(along, expected, STEP), "{along} instead of {expected} at {elapsed}");
            for nm_s in stage.state().velocity_nm_s {
                prop_assert!(f64::from(nm_s).abs() * 1e-6 <= v + 1e-6);
            }
            let idle = stage.state().activity == Activity::Idle;
            prop_assert!(near(elapsed, duration, 2e-6) || idle == (elapsed > duration));
        }
        stage.finish();
        prop_assert_eq!(stage.state().steps, target.map(|nm| (f64::from(nm) / STEP_NM).round() as i32));
        prop_assert_eq!(stage.state().outcome, Outcome::Reached);
    }

    /// Wherever in the motion, a stop takes at most v²/2a and v/a, and stays on the line.
    #[test]
    fn a_stop_takes_at_most_its_braking_distance(at_us in 1..4_100_000_u32) {
        let mut stage = at_ten(0);
        accepted(stage.go([50_000_000, 10_000_000], 10_000, 100_000));
        run(&mut stage, at_us);
        let (before, v) = (mm(&stage)[0], f64::from(stage.state().velocity_nm_s[0]) * 1e-6);
        accepted(stage.ask(Request::Stop {}));
        prop_assert!(v == 0.0 || stage.state().activity == Activity::Stopping);
        // One tick for the part of a tick, one for the rounding of v/a.
        run(&mut stage, (v / 100.0 * 1e6) as u32 + 2);
        prop_assert_eq!(stage.state().activity, Activity::Idle);
        let expected = before + v * v / 200.0;
        prop_assert!(near(mm(&stage)[0], expected, STEP), "{} instead of {expected}", mm(&stage)[0]);
        prop_assert!(matches!(stage.state().outcome, Outcome::Stopped | Outcome::Reached));
        prop_assert_eq!(stage.state().fault, Fault::None);
    }
}

/// At v = 10 and the emergency deceleration 200: v²/2a = 0.25 mm in 50 ms; at the motion's own it were 0.5 mm.
#[test]
fn an_emergency_stop_brakes_hard_and_is_acknowledged_twice() {
    let mut stage = at_ten(0);
    accepted(stage.go([50_000_000, 10_000_000], 10_000, 100_000));
    run(&mut stage, 1_000_000);
    let before = mm(&stage)[0];
    let mut bytes = Request::Query {}.encode(Stamp::default()).as_bytes()[..9].to_vec();
    bytes.extend(EMERGENCY_STOP);
    let stopping = |heard: Vec<(Stamp, Response)>| {
        heard.iter().find_map(|(_, response)| match response {
            Response::EmergencyStop { state, .. } => Some(*state),
            _ => None,
        })
    };
    let first = stopping(stage.send(&bytes)).expect("acknowledged at once, in the middle of a frame");
    assert_eq!((first.activity, first.fault), (Activity::Stopping, Fault::EmergencyStop));
    stage.wait(50_000);
    let second = stopping(stage.heard()).expect("acknowledged at rest");
    assert_eq!((second.activity, second.steps), (Activity::Idle, stage.state().steps));
    assert!(near(mm(&stage)[0], before + 0.25, STEP));
    assert_eq!(stage.state().homed, AxisSet::ALL, "it decelerated: no step was lost");

    assert_eq!(refusal(stage.go([20_000_000; 2], 1000, 1000)).reason, Reason::Faulted);
    let third = stopping(stage.send(&EMERGENCY_STOP)).expect("acknowledged again");
    assert_eq!(third.fault_ordinal, first.fault_ordinal, "it is the same fault");
    let at_rest = stage.controller.step_counters();
    accepted(stage.ask(Request::Clear { fault_ordinal: first.fault_ordinal }));
    stage.wait(10_000_000);
    assert_eq!(stage.controller.step_counters(), at_rest, "clearing starts nothing");
    accepted(stage.go([20_000_000; 2], 1000, 1000));
}

/// Silence from the start: the ramp of v/a = 0.1 s ends with the lease, 0.5 mm on; v²/2a = 0.5 mm more.
#[test]
fn a_lease_that_runs_out_stops_within_the_braking_distance() {
    for steps in [vec![10_000_000], vec![1000; 400], vec![99_999, 1, 100_000, 1]] {
        let mut stage = at_ten(0);
        accepted(stage.ask(Request::Lease { lease_ms: 100 }));
        accepted(stage.go([50_000_000, 10_000_000], 10_000, 100_000));
        for step in steps {
            stage.wait(step);
        }
        let state = stage.state();
        assert_eq!(
            (state.activity, state.fault, state.outcome),
            (Activity::Idle, Fault::Comms, Outcome::Faulted)
        );
        assert!(near(mm(&stage)[0], 11.0, STEP), "{:?}", mm(&stage));
        let wrong = stage.state().fault_ordinal + 1;
        assert_eq!(refusal(stage.ask(Request::Clear { fault_ordinal: wrong })).reason, Reason::OtherFault);
        assert_eq!(refusal(stage.go([20_000_000; 2], 1000, 1000)).reason, Reason::Faulted);
        accepted(stage.ask(Request::Clear { fault_ordinal: wrong - 1 }));
        let told = refusal(stage.ask(Request::Lease { lease_ms: 10 }));
        assert_eq!((told.reason, told.limit, told.asked), (Reason::Lease, 20, 10));
    }
}

#[test]
fn a_request_does_not_make_a_faulted_motion_a_stopped_one() {
    let mut stage = at_ten(0);
    accepted(stage.ask(Request::Lease { lease_ms: 100 }));
    accepted(stage.go([50_000_000, 10_000_000], 10_000, 100_000));
    stage.wait(150_000);
    accepted(stage.ask(Request::Stop {}));
    stage.wait(100_000);
    assert_eq!((stage.state().activity, stage.state().outcome), (Activity::Idle, Outcome::Faulted));
}

/// A graver fault replaces a lighter one, never the reverse; none is cleared before rest.
#[test]
fn the_gravest_fault_stays() {
    let mut stage = at_ten(0);
    accepted(stage.ask(Request::Lease { lease_ms: 100 }));
    accepted(stage.go([50_000_000, 10_000_000], 10_000, 100_000));
    stage.wait(150_000);
    let comms = stage.state();
    assert_eq!((comms.activity, comms.fault, comms.fault_ordinal), (Activity::Stopping, Fault::Comms, 1));
    let told = refusal(stage.ask(Request::Clear { fault_ordinal: 1 }));
    assert_eq!(told.reason, Reason::Busy);
    stage.send(&EMERGENCY_STOP);
    assert_eq!((stage.state().fault, stage.state().fault_ordinal), (Fault::EmergencyStop, 2));
    stage.high_at[0] = stage.controller.step_counters()[0];
    stage.wait(0);
    let last = stage.state();
    assert_eq!((last.activity, last.fault, last.fault_ordinal), (Activity::Idle, Fault::EmergencyStop, 2));
    assert_eq!(last.homed, AxisSet::NONE, "the switch counts all the same");
    assert_eq!(last.outcome, Outcome::Faulted);
    assert_eq!(refusal(stage.ask(Request::Clear { fault_ordinal: 1 })).reason, Reason::OtherFault);
    accepted(stage.ask(Request::Clear { fault_ordinal: 2 }));
    assert_eq!(refusal(stage.go([20_000_000; 2], 1000, 1000)).reason, Reason::NotHomed);
}

#[test]
fn any_word_of_the_session_renews_the_lease_and_no_other_does() {
    let mut stage = at_ten(0);
    accepted(stage.ask(Request::Lease { lease_ms: 100 }));
    accepted(stage.go([50_000_000, 10_000_000], 10_000, 100_000));
    for request in [Request::Query {}, Request::Describe { axis: 0 }, Request::Telemetry { period_ms: 0 }] {
        stage.wait(99_999);
        stage.ask(request);
        assert_eq!(stage.state().fault, Fault::None);
    }
    // A kind that it does not know, and a payload of the wrong length: refused, but words of the session.
    for (kind, payload) in [(0x7F, &[][..]), (Request::Query {}.kind(), &[1])] {
        stage.wait(99_999);
        let stamp = Stamp { sequence: 0, session: stage.session, tick_us: 0 };
        stage.send(Encoded::of(MAJOR, kind, stamp, payload).as_bytes());
        assert_eq!(stage.state().fault, Fault::None, "{kind}");
    }
    let stranger = Stamp { sequence: 1, session: 99, tick_us: 0 };
    for _ in 0..10 {
        stage.wait(10_000);
        stage.send(Request::Query {}.encode(stranger).as_bytes());
        // Nor does what the device itself sends, should it come back.
        let own = Stamp { session: stage.session, ..stranger };
        stage.send(Response::Accepted { request: 1, motion: 1 }.encode(own).as_bytes());
    }
    assert_eq!(stage.state().fault, Fault::Comms);
}

/// A switch in the way: no step after it, position unknown, jogs only away from it.
#[test]
fn a_limit_switch_ends_all_steps_at_once() {
    let mut stage = at_ten(0);
    accepted(stage.go([50_000_000, 10_000_000], 10_000, 100_000));
    run(&mut stage, 1_000_000);
    stage.high_at[0] = stage.controller.step_counters()[0];
    stage.wait(0);
    let at = stage.controller.step_counters();
    let state = stage.state();
    assert_eq!((state.activity, state.velocity_nm_s), (Activity::Idle, [0; 2]));
    assert_eq!((state.fault, state.homed), (Fault::LimitSwitch, AxisSet::NONE));
    stage.wait(1_000_000);
    assert_eq!(stage.controller.step_counters(), at);

    accepted(stage.ask(Request::Clear { fault_ordinal: state.fault_ordinal }));
    assert_eq!(refusal(stage.go([20_000_000; 2], 1000, 1000)).reason, Reason::NotHomed);
    let jog = |stage: &mut Stage, velocity_um_s| {
        let motion = stage.next_motion();
        stage.ask(Request::Jog { motion, axis: 0, velocity_um_s, acceleration_um_s2: 100_000 })
    };
    assert_eq!(refusal(jog(&mut stage, 500)).reason, Reason::SwitchPressed);
    accepted(jog(&mut stage, -500));
    run(&mut stage, 1_000_000);
    assert_eq!(stage.state().fault, Fault::None);
    assert!(stage.controller.step_counters()[0] < at[0] - 700, "500 µm/s for a second are 800 steps");
}

/// Also one that the motion leads away from, or of the axis at rest: something is not where it should be.
#[test]
fn any_limit_switch_that_closes_ends_the_motion() {
    for (low, high) in [([true, false], [false; 2]), ([false; 2], [false, true])] {
        let mut stage = at_ten(0);
        accepted(stage.go([50_000_000, 10_000_000], 10_000, 100_000));
        run(&mut stage, 1_000_000);
        stage.controller.advance(stage.now_us, Switches { low: AxisSet::of(low), high: AxisSet::of(high) });
        assert_eq!((stage.state().activity, stage.state().fault), (Activity::Idle, Fault::LimitSwitch));
    }
}

/// Jogs before homing: slow, and 2 mm (3200 steps) around where the device booted, all together.
#[test]
fn jogs_before_homing_stay_near() {
    let mut stage = Stage::greeted(0);
    let jog = |stage: &mut Stage, velocity_um_s| {
        let motion = stage.next_motion();
        stage.ask(Request::Jog { motion, axis: 1, velocity_um_s, acceleration_um_s2: 100_000 })
    };
    assert_eq!(refusal(stage.go([20_000_000; 2], 1000, 1000)).reason, Reason::NotHomed);
    assert_eq!(refusal(jog(&mut stage, 1001)).limit, 1000);
    assert_eq!(refusal(jog(&mut stage, 0)).reason, Reason::Speed);
    accepted(jog(&mut stage, 1000));
    stage.wait(50_000);
    accepted(stage.ask(Request::Stop {}));
    stage.finish();
    accepted(jog(&mut stage, 1000));
    stage.finish();
    assert_eq!(stage.controller.step_counters(), [0, 3200]);
    assert_eq!(refusal(jog(&mut stage, 1000)).reason, Reason::Travel);
    accepted(jog(&mut stage, -1000));
    stage.finish();
    assert_eq!(stage.controller.step_counters(), [0, -3200]);
    assert_eq!(stage.state().homed, AxisSet::NONE);
}

#[test]
fn a_jog_after_homing_ends_with_the_travel() {
    let mut stage = at_ten(0);
    let motion = stage.next_motion();
    accepted(stage.ask(Request::Jog {
        motion,
        axis: 0,
        velocity_um_s: -20_000,
        acceleration_um_s2: 200_000,
    }));
    assert_eq!(stage.state().activity, Activity::Jogging);
    stage.finish();
    assert_eq!(stage.state().position_nm, [500_000, 10_000_000]);
}

/// Zero lies where the low switch trips, within what the touch covers between two looks (250 µm/s for 1 ms are
/// 0.4 steps); the stage then rests clear of it by the way back, 1 mm.
#[test]
fn homing_finds_the_low_switches() {
    for low_at in [[-32_000, -5], [-1, -40_000], [0, 0], [37, 400]] {
        let mut stage = Stage::greeted(0);
        stage.low_at = low_at;
        stage.wait(0);
        let motion = stage.next_motion();
        accepted(stage.ask(Request::Home { motion, axes: AxisSet::ALL }));
        assert_eq!(stage.state().activity, Activity::Homing);
        stage.finish();
        assert_eq!(stage.state().homed, AxisSet::ALL);
        assert_eq!((stage.state().outcome, stage.state().fault), (Outcome::Reached, Fault::None));
        for axis in 0..2 {
            let zero = stage.controller.step_counters()[axis] - stage.state().steps[axis];
            assert!(
                (low_at[axis] - 1..=low_at[axis]).contains(&zero),
                "zero at {zero}, switch at {low_at:?}"
            );
            assert_eq!(stage.state().position_nm[axis], 1_000_000);
        }
    }
}

/// A switch that is never found: at most 1.5 times the high end of travel (60 mm) and the way back (1 mm) are run.
#[test]
fn homing_without_a_switch_latches_a_fault() {
    let mut stage = Stage::greeted(0);
    stage.low_at = [i32::MIN; 2];
    let motion = stage.next_motion();
    accepted(stage.ask(Request::Home { motion, axes: AxisSet::ALL }));
    stage.finish();
    let state = stage.state();
    assert_eq!((state.fault, state.outcome, state.homed), (Fault::Homing, Outcome::Faulted, AxisSet::NONE));
    assert_eq!(stage.controller.step_counters(), [0, -145_600], "the last axis first");
}

/// From the high switch, where an earlier accident may have left it.
#[test]
fn homing_may_begin_on_the_high_switch() {
    let mut stage = Stage::greeted(0);
    stage.high_at = [0; 2];
    stage.wait(0);
    let motion = stage.next_motion();
    accepted(stage.ask(Request::Home { motion, axes: AxisSet::ALL }));
    stage.finish();
    assert_eq!((stage.state().homed, stage.state().fault), (AxisSet::ALL, Fault::None));
}

/// Beyond travel's end there is room for the switch: 62 mm between the switches, where travel ends at 60, and 70 mm.
#[test]
fn homing_reaches_from_the_high_switch_to_the_low_one() {
    for low_at in [-62 * 1600, -70 * 1600] {
        let mut stage = Stage::greeted(0);
        (stage.low_at, stage.high_at) = ([low_at; 2], [0; 2]);
        stage.wait(0);
        let motion = stage.next_motion();
        accepted(stage.ask(Request::Home { motion, axes: AxisSet::ALL }));
        stage.finish();
        assert_eq!((stage.state().homed, stage.state().fault), (AxisSet::ALL, Fault::None), "{low_at}");
    }
}

/// A switch that opens for good after the approach is looked for over twice the way back, 2 mm: the overrun of
/// v²/2a = 0.125 mm lies between, so that the stage ends 1 mm behind where the overrun ended.
#[test]
fn a_touch_that_finds_nothing_ends_soon() {
    let mut stage = Stage::greeted(0);
    accepted(stage.ask(Request::Home { motion: 1, axes: AxisSet::of([true, false]) }));
    while stage.switches().low == AxisSet::NONE {
        stage.wait(1000);
        stage.ask(Request::Ping { host_tick_us: 0 });
    }
    stage.low_at[0] = i32::MIN;
    stage.finish();
    assert_eq!(stage.state().fault, Fault::Homing);
    // 5 mm/s for a millisecond between two looks are 8 steps.
    let behind = f64::from(-4000 - stage.controller.step_counters()[0]) * STEP;
    assert!((1.125..=1.125 + 9.0 * STEP).contains(&behind), "{behind} mm");
}

/// A switch that stays pressed, and one wired to the wrong end.
#[test]
fn homing_does_not_trust_a_stuck_or_exchanged_switch() {
    let mut stuck = Stage::greeted(0);
    stuck.low_at = [i32::MAX; 2];
    stuck.wait(0);
    let motion = stuck.next_motion();
    accepted(stuck.ask(Request::Home { motion, axes: AxisSet::ALL }));
    stuck.finish();
    assert_eq!((stuck.state().fault, stuck.controller.step_counters()), (Fault::Homing, [0, 1600]));

    let mut sticking = Stage::greeted(0);
    let motion = sticking.next_motion();
    accepted(sticking.ask(Request::Home { motion, axes: AxisSet::ALL }));
    while sticking.state().steps == sticking.controller.step_counters() {
        sticking.wait(1000);
        sticking.ask(Request::Ping { host_tick_us: 0 });
    }
    sticking.low_at[1] = i32::MAX;
    sticking.finish();
    assert_eq!((sticking.state().fault, sticking.state().homed), (Fault::Homing, AxisSet::NONE));

    let mut exchanged = Stage::greeted(0);
    accepted(exchanged.ask(Request::Home { motion: 1, axes: AxisSet::ALL }));
    exchanged.wait(50_000);
    exchanged.high_at[1] = exchanged.controller.step_counters()[1];
    exchanged.wait(0);
    assert_eq!((exchanged.state().fault, exchanged.state().activity), (Fault::Homing, Activity::Idle));
}

#[test]
fn a_stopped_homing_is_no_homing() {
    let mut stage = Stage::homed(0);
    let motion = stage.next_motion();
    accepted(stage.ask(Request::Home { motion, axes: AxisSet::of([false, true]) }));
    stage.wait(90_000);
    accepted(stage.ask(Request::Stop {}));
    stage.finish();
    assert_eq!(stage.state().homed, AxisSet::of([true, false]));
    assert_eq!((stage.state().outcome, stage.state().fault), (Outcome::Stopped, Fault::None));
    let told = refusal(stage.go([20_000_000; 2], 1000, 1000));
    assert_eq!((told.reason, told.axis), (Reason::NotHomed, 1));
}

/// The same conversation at three beginnings of the clock: no wrap, one during the move, one at the boot.
#[test]
fn the_tick_may_wrap_at_any_time() {
    let two_seconds_into_the_move = 0_u32.wrapping_sub(at_ten(0).now_us + 2_000_000);
    let states = [0, two_seconds_into_the_move, u32::MAX].map(|begin| {
        let mut stage = at_ten(begin);
        accepted(stage.ask(Request::Telemetry { period_ms: 10 }));
        accepted(stage.go([50_000_000, 30_000_000], 10_000, 100_000));
        let mut states = Vec::new();
        for _ in 0..50 {
            run(&mut stage, 100_000);
            states.push(stage.state());
        }
        states
    });
    assert_eq!(states[0], states[1]);
    assert_eq!(states[0], states[2]);
    assert_eq!(states[0][49].outcome, Outcome::Reached);
}

#[test]
fn time_never_runs_backwards() {
    let mut stage = at_ten(1_000_000_000);
    accepted(stage.go([50_000_000, 10_000_000], 10_000, 100_000));
    run(&mut stage, 500_000);
    let before = stage.state();
    stage.controller.advance(stage.now_us.wrapping_sub(1000), Switches::default());
    assert_eq!(stage.state(), before);
    // A clock set back further is a long step forward, after which the host was silent too long.
    stage.controller.advance(stage.now_us.wrapping_sub(2_000_000), Switches::default());
    assert_eq!((stage.state().activity, stage.state().fault), (Activity::Idle, Fault::Comms));
}

#[test]
fn stages_that_cannot_be_driven_are_refused() {
    let mut short = config();
    // v²/2a = 25/0.2 = 125 µm: the way back must be longer.
    short.homing.back_off_um = 125;
    let told = Controller::new(short, 0).expect_err("refused");
    assert_eq!((told.setting, told.value), ("back_off_um", 125));
    let mut turned = config();
    turned.axes[1].travel_high_um = turned.axes[1].travel_low_um;
    assert_eq!(Controller::new(turned, 0).expect_err("refused").axis, Some(1));
    let mut hard = config();
    hard.axes[1].max_acceleration_um_s2 = 199_999;
    let told = Controller::new(hard, 0).expect_err("an emergency stop would lose steps");
    assert_eq!((told.setting, told.axis, told.bounds[1]), ("emergency_um_s2", Some(1), 199_999));
    let mut none = config();
    none.axes[0].steps = 0;
    assert_eq!(
        Controller::new(none, 0).expect_err("refused").to_string(),
        "steps is 0, allowed 1 to 16777216 (axis 0)"
    );
}

/// 200 steps × 256 in a turn of 3/8 inch (9.525 mm): 51 200 × 40 steps in 381 mm.
#[test]
fn positions_convert_without_drift() {
    let limits = AxisLimits { steps: 2_048_000, per_mm: 381, ..config().axes[0] };
    assert_eq!(limits.nm(2_048_000), 381_000_000);
    assert_eq!(limits.steps_at(381_000_000), 2_048_000);
    for steps in (-10_000_000..10_000_000).step_by(99_991) {
        let exact = f64::from(steps) * 381e6 / 2_048_000.0;
        assert!((f64::from(limits.nm(steps)) - exact).abs() <= 0.5);
        assert_eq!(limits.steps_at(i64::from(limits.nm(steps))), steps);
    }
}
