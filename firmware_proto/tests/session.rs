//! Is nothing carried out twice, late, or for another session, whatever arrives in whatever order?

mod stage;

use firmware_proto::*;
use stage::{SESSION, Stage, config};

fn accepted(response: Response) {
    assert!(matches!(response, Response::Accepted { .. }), "{response:?}");
}

fn refusal(response: Response) -> Refusal {
    match response {
        Response::Refused { refusal, .. } => refusal,
        other => panic!("not refused: {other:?}"),
    }
}

fn identity(response: Response) -> Identity {
    match response {
        Response::Identity { identity } => identity,
        other => panic!("no identity: {other:?}"),
    }
}

const fn go(motion: u32, x_nm: i32) -> Request {
    Request::Move { motion, target_nm: [x_nm, 2_000_000], speed_um_s: 20_000, acceleration_um_s2: 200_000 }
}

#[test]
fn a_copy_is_answered_and_not_carried_out() {
    let mut stage = Stage::homed(0);
    let first = go(stage.next_motion(), 10_000_000);
    let bytes = stage.bytes(first);
    let answer = stage.send(&bytes);
    assert_eq!(stage.send(&bytes), answer, "during the motion");
    stage.finish();
    let back = go(stage.next_motion(), 2_000_000);
    accepted(stage.ask(back));
    stage.finish();
    let counters = stage.controller.step_counters();
    let again = stage.send(&bytes);
    let answers =
        |heard: &[(Stamp, Response)]| heard.iter().map(|(_, response)| *response).collect::<Vec<_>>();
    assert!(
        matches!(answers(&again)[..], [Response::Refused { refusal, .. }] if refusal.reason == Reason::StaleSequence)
            || answers(&again) == answers(&answer)
    );
    stage.wait(1_000_000);
    assert_eq!(stage.controller.step_counters(), counters);
}

/// The last 8 answers are kept.
#[test]
fn kept_answers_are_the_last_ones() {
    let mut stage = Stage::homed(0);
    let leases: Vec<Vec<u8>> = (0..ANSWERS_KEPT as u16 + 1)
        .map(|more| stage.bytes(Request::Lease { lease_ms: 100 + more }))
        .collect();
    for bytes in &leases {
        stage.send(bytes);
    }
    let reasons = |heard: Vec<(Stamp, Response)>| match heard[0].1 {
        Response::Refused { refusal, .. } => Some(refusal.reason),
        _ => None,
    };
    assert_eq!(reasons(stage.send(&leases[0])), Some(Reason::StaleSequence));
    for bytes in &leases[1..] {
        assert_eq!(reasons(stage.send(bytes)), None);
    }
}

/// A sequence that was skipped this time round is not answered with what its number got the time before.
#[test]
fn answers_of_the_time_before_are_forgotten() {
    let mut stage = Stage::homed(0);
    stage.sequence = 4;
    accepted(stage.ask(Request::Lease { lease_ms: 50 }));
    for _ in 6..=255 {
        stage.ask(Request::Query {});
    }
    for _ in 0..=4 {
        stage.ask(Request::Query {});
    }
    let skipped = stage.bytes(Request::Lease { lease_ms: 60 });
    assert_eq!(stage.sequence, 5);
    stage.ask(Request::Query {});
    let heard = stage.send(&skipped);
    assert!(
        matches!(heard[..], [(_, Response::Refused { refusal, .. })] if refusal.reason == Reason::StaleSequence)
    );
}

#[test]
fn what_a_device_says_is_not_answered() {
    let mut stage = Stage::greeted(0);
    let own = Stamp { sequence: 9, session: SESSION, tick_us: 0 };
    for layout in Response::TABLE {
        let bytes = layout.fields.iter().map(|field| field.bytes).sum();
        let payload = vec![0; bytes];
        assert_eq!(stage.send(Encoded::of(MAJOR, layout.kind, own, &payload).as_bytes()), []);
    }
}

#[test]
fn a_move_that_arrives_after_the_stop_sent_after_it_does_not_start() {
    let mut stage = Stage::homed(0);
    let late = go(stage.next_motion(), 10_000_000);
    let late = stage.bytes(late);
    accepted(stage.ask(Request::Stop {}));
    let heard = stage.send(&late);
    assert!(
        matches!(heard[0].1, Response::Refused { refusal, .. } if refusal.reason == Reason::StaleSequence)
    );
    assert_eq!(stage.state().activity, Activity::Idle);
}

/// 1000 requests wrap the sequence nearly four times; then the whole recording arrives once more: to the same
/// session, to a session that replaced it, and to the device after a reboot.
#[test]
fn a_replayed_recording_moves_nothing() {
    let mut stage = Stage::booted(0);
    let mut tape = Vec::new();
    let say = |stage: &mut Stage, tape: &mut Vec<u8>, request: Request| {
        let bytes = stage.bytes(request);
        tape.extend(&bytes);
        stage.send(&bytes)
    };
    say(&mut stage, &mut tape, Request::Hello { replaces: 0, boot_count: 7, schema_hash: SCHEMA_HASH });
    say(&mut stage, &mut tape, Request::Home { motion: 1, axes: AxisSet::ALL });
    stage.finish();
    for motion in 2..202 {
        let x_nm = if motion % 2 == 0 { 2_000_000 } else { 2_500_000 };
        say(&mut stage, &mut tape, go(motion, x_nm));
        while stage.state().activity != Activity::Idle {
            stage.wait(30_000);
            say(&mut stage, &mut tape, Request::Ping { host_tick_us: 0 });
        }
        assert_eq!((stage.state().motion, stage.state().outcome), (motion, Outcome::Reached));
    }
    // A fault and its clearing: neither may come back.
    stage.controller.receive(&EMERGENCY_STOP, stage.now_us);
    say(&mut stage, &mut tape, Request::Clear { fault_ordinal: 1 });
    assert_eq!(stage.state().fault, Fault::None);

    let still = |stage: &mut Stage, tape: &[u8]| {
        let counters = stage.controller.step_counters();
        for chunk in tape.chunks(50) {
            stage.controller.receive(chunk, stage.now_us);
            stage.heard();
            stage.wait(5000);
            assert_eq!(
                (stage.controller.step_counters(), stage.state().activity),
                (counters, Activity::Idle)
            );
        }
    };
    still(&mut stage, &tape);

    stage.session = 77;
    let hello = Request::Hello { replaces: SESSION, boot_count: 7, schema_hash: SCHEMA_HASH };
    assert_eq!(identity(stage.ask(hello)).session, 77);
    still(&mut stage, &tape);

    let rebooted = Config { boot_count: 8, ..config() };
    stage.controller = Controller::new(rebooted, stage.now_us).expect("the same stage");
    still(&mut stage, &tape);
    assert_eq!(stage.state().motion, 0);
}

/// A late Clear does not clear a fault that it was not meant for, though its sequence is new again.
#[test]
fn a_late_clear_clears_no_later_fault() {
    let mut stage = Stage::homed(0);
    stage.send(&EMERGENCY_STOP);
    let clear = stage.bytes(Request::Clear { fault_ordinal: 1 });
    stage.send(&clear);
    assert_eq!(stage.state().fault, Fault::None);
    for _ in 0..200 {
        stage.ask(Request::Query {});
    }
    stage.send(&EMERGENCY_STOP);
    let heard = stage.send(&clear);
    assert!(
        heard.iter().any(|(_, response)| matches!(response, Response::Refused { refusal, .. }
            if refusal.reason == Reason::OtherFault && refusal.limit == 2)),
        "{heard:?}"
    );
    assert_eq!(stage.state().fault, Fault::EmergencyStop);
}

#[test]
fn a_session_opens_only_for_who_knows_the_last_one() {
    let mut stage = Stage::booted(0);
    let hello = |replaces, boot_count| Request::Hello { replaces, boot_count, schema_hash: SCHEMA_HASH };
    assert_eq!(refusal(stage.ask(go(1, 0))).reason, Reason::NoSession);
    assert_eq!(identity(stage.ask(hello(0, 6))).session, 0, "another boot's");
    assert_eq!(identity(stage.ask(hello(5, 7))).session, 0, "another session's");
    assert_eq!(identity(stage.ask(hello(0, 7))).session, SESSION);
    assert_eq!(identity(stage.ask(hello(0, 7))).session, SESSION, "said again: nothing changes");
    stage.session = 9;
    assert_eq!(identity(stage.ask(hello(0, 7))).session, SESSION);
    assert_eq!(identity(stage.ask(hello(SESSION, 7))).session, 9);
    stage.session = 0;
    let told = identity(stage.ask(hello(9, 7)));
    assert_eq!(told.session, 9, "without a session of its own, a host only asks");
    assert_eq!(
        (told.name.as_str(), told.boot_count, told.reset_cause),
        ("bench stage", 7, ResetCause::PowerOn)
    );
    assert_eq!((told.schema_hash, told.firmware_hash), (SCHEMA_HASH, 0x1122_3344_5566_7788));
    assert_eq!(told.capabilities, 0b11111);
}

#[test]
fn a_new_session_ends_the_old_ones_motion() {
    let mut stage = Stage::homed(0);
    accepted(stage.ask(Request::Lease { lease_ms: 1000 }));
    accepted(stage.ask(Request::Telemetry { period_ms: 10 }));
    let long = go(stage.next_motion(), 50_000_000);
    accepted(stage.ask(long));
    stage.wait(50_000);
    stage.session = 77;
    stage.ask(Request::Hello { replaces: SESSION, boot_count: 7, schema_hash: SCHEMA_HASH });
    assert_eq!(stage.state().activity, Activity::Stopping);
    stage.finish();
    assert_eq!(
        (stage.state().motion, stage.state().outcome, stage.state().fault),
        (0, Outcome::None, Fault::None)
    );
    stage.heard();
    accepted(stage.ask(go(1, 50_000_000)));
    stage.wait(99_999);
    assert_eq!((stage.heard(), stage.state().fault), (vec![], Fault::None), "telemetry is off");
    stage.wait(1);
    assert_eq!(stage.state().fault, Fault::Comms, "the lease is 100 ms again");
}

#[test]
fn another_schema_or_major_may_ask_and_stop_but_not_move() {
    let mut stage = Stage::booted(0);
    let other = Request::Hello { replaces: 0, boot_count: 7, schema_hash: SCHEMA_HASH ^ 1 };
    assert_eq!(identity(stage.ask(other)).session, SESSION);
    assert_eq!(
        refusal(stage.ask(Request::Home { motion: 1, axes: AxisSet::ALL })).reason,
        Reason::SchemaMismatch
    );
    assert!(matches!(stage.ask(Request::Query {}), Response::State { .. }));
    accepted(stage.ask(Request::Stop {}));

    let stamp = |sequence| Stamp { sequence, session: SESSION, tick_us: 0 };
    let mut answer =
        |kind, payload: &[u8]| stage.send(Encoded::of(MAJOR + 1, kind, stamp(1), payload).as_bytes())[0].1;
    assert!(matches!(answer(0x01, &[0; 16]), Response::Identity { .. }));
    assert!(matches!(answer(0x02, &[]), Response::State { .. }));
    assert!(matches!(answer(0x03, &[]), Response::Accepted { request: 3, .. }));
    let told = refusal(answer(0x10, &[1, 0, 0, 0, 3]));
    assert_eq!((told.reason, told.limit, told.asked), (Reason::MajorMismatch, 1, 2));
}

#[test]
fn what_the_table_does_not_hold_is_refused() {
    let mut stage = Stage::greeted(0);
    let stamp = Stamp { sequence: 9, session: SESSION, tick_us: 0 };
    let mut answer =
        |kind, payload: &[u8]| refusal(stage.send(Encoded::of(MAJOR, kind, stamp, payload).as_bytes())[0].1);
    let told = answer(0x7F, &[]);
    assert_eq!((told.reason, told.asked), (Reason::UnknownKind, 0x7F));
    let told = answer(0x10, &[1, 0, 0, 0]);
    assert_eq!((told.reason, told.asked), (Reason::BadPayload, 4));
    assert_eq!(answer(0x10, &[1, 0, 0, 0, 4]).reason, Reason::BadPayload, "no third axis");
    assert_eq!(answer(0x05, &[2]).reason, Reason::NoSuchAxis);
}

#[test]
fn an_axis_tells_its_limits() {
    let mut stage = Stage::greeted(0);
    let expected = Response::Axis {
        axis: 1,
        limits: config().axes[1],
        emergency_um_s2: 200_000,
        unhomed_speed_um_s: 1000,
        unhomed_distance_um: 2000,
    };
    assert_eq!(stage.ask(Request::Describe { axis: 1 }), expected);
}

/// Arrival and departure differ by the time that the answer waited for the line.
#[test]
fn a_pong_tells_both_ticks() {
    let mut stage = Stage::greeted(5_000_000);
    let ping = stage.bytes(Request::Ping { host_tick_us: 123 });
    stage.controller.receive(&ping, stage.now_us);
    stage.wait(700);
    let (stamp, response) = stage.heard()[0];
    assert_eq!(response, Response::Pong { host_tick_us: 123, received_us: 5_000_000, session: SESSION });
    assert_eq!(stamp.tick_us, 5_000_700);
}

/// 10 ms for a second are 100 frames; where the line was not served, the counter shows the gap.
#[test]
fn telemetry_counts_what_it_loses() {
    let mut stage = Stage::greeted(0);
    accepted(stage.ask(Request::Telemetry { period_ms: 10 }));
    let counters = |stage: &mut Stage| -> Vec<u32> {
        let heard = stage.heard();
        let counter = |response: &Response| match response {
            Response::Telemetry { counter, .. } => Some(*counter),
            _ => None,
        };
        heard.iter().filter_map(|(_, response)| counter(response)).collect()
    };
    let mut seen = Vec::new();
    for _ in 0..1000 {
        stage.wait(1000);
        seen.extend(counters(&mut stage));
    }
    assert_eq!(seen, (1..=100).collect::<Vec<u32>>());
    for _ in 0..5 {
        stage.wait(11_000);
    }
    assert_eq!(counters(&mut stage), [105], "five were due, the newest leaves");
    stage.wait(5000);
    assert_eq!(counters(&mut stage), [106], "and the period keeps its beat");
    assert_eq!(refusal(stage.ask(Request::Telemetry { period_ms: 1 })).limit, 6);
    stage.wait(10_000);
    assert_eq!(counters(&mut stage), [107], "a refusal changes nothing");
    accepted(stage.ask(Request::Telemetry { period_ms: 0 }));
    stage.wait(1_000_000);
    assert_eq!(counters(&mut stage), []);
}

/// More answers wait than the device can hold: the host asks again, and what moved is not moved twice.
#[test]
fn answers_that_find_no_room_are_counted() {
    let mut stage = Stage::greeted(0);
    for _ in 0..10 {
        let query = stage.bytes(Request::Query {});
        stage.controller.receive(&query, 0);
    }
    assert_eq!(stage.heard().len(), 4);
    assert_eq!(stage.controller.answers_dropped(), 6);
}
