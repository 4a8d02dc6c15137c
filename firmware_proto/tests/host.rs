//! Does the host ask again at the right time, take only its own answers, and notice what was lost?

mod stage;

use firmware_proto::*;
use stage::{Stage, config};

/// The frame's bytes to the host; what they completed.
fn hear(host: &mut Host, bytes: &[u8]) -> Vec<Heard> {
    bytes.iter().filter_map(|byte| host.hear(*byte)).collect()
}

/// Host → controller → host, without loss.
fn talk(host: &mut Host, stage: &mut Stage, bytes: &Encoded) -> Vec<Heard> {
    stage.controller.receive(bytes.as_bytes(), stage.now_us);
    let mut line = [0; 400];
    let count = stage.controller.output(&mut line);
    hear(host, &line[..count])
}

fn opened(stage: &mut Stage) -> Host {
    let mut host = Host::new(0xCAFE, Patience::default());
    let hello = host.hello(stage.now_us);
    talk(&mut host, stage, &hello);
    assert!(!host.is_open() && host.identity().is_some(), "the first greeting only learns");
    let hello = host.hello(stage.now_us);
    talk(&mut host, stage, &hello);
    assert!(host.is_open() && host.may_move());
    host
}

fn answer(heard: &[Heard]) -> Response {
    match heard {
        [Heard::Answer { response, .. }] => *response,
        other => panic!("no single answer: {other:?}"),
    }
}

/// Four tries 20 ms apart, the same bytes each time, over a wrap of the clock; then it is given up.
#[test]
fn silence_is_answered_by_four_tries() {
    let mut host = Host::new(1, Patience::default());
    let begin = u32::MAX - 30_000;
    let first = host.send(Request::Query {}, begin).expect("nothing waits");
    assert_eq!(
        host.send(Request::Stop {}, begin),
        Err(StillWaiting { request: Request::Query {}, tries: 1 })
    );
    for retry in 1..4_u32 {
        let due = begin.wrapping_add(retry * 20_000);
        assert_eq!(host.due(due.wrapping_sub(1)), Due::Nothing);
        assert_eq!(host.silent_us(due), Some(20_000));
        assert_eq!(host.due(due), Due::Resend(first));
    }
    assert_eq!(host.due(begin.wrapping_add(80_000)), Due::GaveUp(Request::Query {}));
    assert!(!host.is_waiting());
    assert_eq!(host.due(begin.wrapping_add(100_000)), Due::Nothing);
}

/// Right in kind, but of another sequence, another session, or the same once more.
#[test]
fn only_the_answer_that_waits_is_taken() {
    let mut stage = Stage::booted(0);
    let mut host = opened(&mut stage);
    host.send(Request::Telemetry { period_ms: 100 }, 0).expect("nothing waits");
    let sequence = 3;
    let accepted = Response::Accepted { request: 0x14, motion: 0 };
    let unasked = |response: Response| [Heard::Unasked { kind: response.kind() }];
    let stamp = Stamp { sequence, session: 0xCAFE, tick_us: 9 };
    for (wrong, response) in [
        (Stamp { sequence: 2, ..stamp }, accepted),
        (Stamp { session: 0xBEEF, ..stamp }, accepted),
        (stamp, Response::Accepted { request: 0x15, motion: 0 }),
        (stamp, Response::Pong { host_tick_us: 0, received_us: 0, session: 0xCAFE }),
    ] {
        assert_eq!(hear(&mut host, response.encode(wrong).as_bytes()), unasked(response));
        assert!(host.is_waiting());
    }
    let bytes = accepted.encode(stamp);
    let request = Request::Telemetry { period_ms: 100 };
    assert_eq!(
        hear(&mut host, bytes.as_bytes()),
        [Heard::Answer { request, response: accepted, tick_us: 9 }]
    );
    assert_eq!(hear(&mut host, bytes.as_bytes()), unasked(accepted), "an answer that came twice");
}

#[test]
fn a_stop_waits_for_nobody() {
    let mut stage = Stage::booted(0);
    let mut host = opened(&mut stage);
    let home = Request::Home { motion: host.next_motion(), axes: AxisSet::ALL };
    let late = host.send(home, 0).expect("nothing waits");
    let stop = host.stop(0);
    assert!(matches!(answer(&talk(&mut host, &mut stage, &stop)), Response::Accepted { request: 3, .. }));
    let heard = talk(&mut host, &mut stage, &late);
    assert_eq!(heard, [Heard::Unasked { kind: 0x86 }]);
    assert_eq!(stage.state().activity, Activity::Idle);
}

/// Telemetry every 10 ms, of which the line loses three in a row.
#[test]
fn lost_telemetry_is_counted() {
    let mut stage = Stage::booted(0);
    let mut host = opened(&mut stage);
    let on = host.send(Request::Telemetry { period_ms: 10 }, 0).expect("nothing waits");
    talk(&mut host, &mut stage, &on);
    let mut lost = Vec::new();
    for number in 0..10 {
        stage.wait(10_000);
        let mut line = [0; 100];
        let count = stage.controller.output(&mut line);
        if (4..7).contains(&number) {
            continue;
        }
        for heard in hear(&mut host, &line[..count]) {
            if let Heard::Streamed { lost: frames, response: Response::Telemetry { .. }, tick_us } = heard {
                assert_eq!(tick_us, stage.now_us);
                lost.push(frames);
            }
        }
    }
    assert_eq!(lost, [0, 0, 0, 0, 3, 0, 0]);
}

/// A second copy of the newest frame, an old one, and the next: none is lost. Over a wrap of the counter.
#[test]
fn frames_that_come_twice_or_late_are_not_counted_as_lost() {
    let mut stage = Stage::booted(0);
    let mut host = opened(&mut stage);
    let own = Stamp { sequence: 0, session: 0xCAFE, tick_us: 0 };
    let state = stage.state();
    let mut outcome = |counter: u32| match &hear(
        &mut host,
        Response::Telemetry { counter, state }.encode(own).as_bytes(),
    )[..]
    {
        [Heard::Streamed { lost, .. }] => Some(*lost),
        [Heard::Late { kind: 0xC0 }] => None,
        other => panic!("{other:?}"),
    };
    assert_eq!(outcome(u32::MAX - 1), Some(0));
    assert_eq!((outcome(u32::MAX), outcome(u32::MAX)), (Some(0), None));
    assert_eq!((outcome(u32::MAX - 1), outcome(0)), (None, Some(0)));
    assert_eq!((outcome(u32::MAX), outcome(4), outcome(2)), (None, Some(3), None));
    assert_eq!(outcome(5), Some(0));
}

/// A device that boots while it is greeted counts from the beginning: that is no step back.
#[test]
fn a_device_that_has_booted_counts_anew() {
    let mut stage = Stage::booted(0);
    let mut host = Host::new(0xCAFE, Patience::default());
    let telemetry = |counter| {
        let own = Stamp { sequence: 0, session: 0xCAFE, tick_us: 0 };
        Response::Telemetry { counter, state: Stage::booted(0).state() }.encode(own)
    };
    assert!(matches!(hear(&mut host, telemetry(500).as_bytes())[..], [Heard::Streamed { lost: 0, .. }]));
    for _ in 0..2 {
        let hello = host.hello(0);
        talk(&mut host, &mut stage, &hello);
    }
    assert!(host.is_open());
    assert!(matches!(hear(&mut host, telemetry(1).as_bytes())[..], [Heard::Streamed { lost: 0, .. }]));
}

/// The same host after a reboot: its session is gone, whichever way it learns, and is never opened again.
#[test]
fn a_reboot_ends_the_session() {
    for request in [Request::Ping { host_tick_us: 0 }, Request::Lease { lease_ms: 50 }] {
        let mut stage = Stage::booted(0);
        let mut host = opened(&mut stage);
        stage.controller = Controller::new(Config { boot_count: 8, ..config() }, 0).expect("the same stage");
        let bytes = host.send(request, 0).expect("nothing waits");
        assert_eq!(talk(&mut host, &mut stage, &bytes), [Heard::SessionLost { session: 0 }]);
        for _ in 0..3 {
            let hello = host.hello(0);
            talk(&mut host, &mut stage, &hello);
            assert!(!host.is_open() && !host.may_move());
        }
        let mut next = Host::new(0xF00D, Patience::default());
        for _ in 0..2 {
            let hello = next.hello(0);
            talk(&mut next, &mut stage, &hello);
        }
        assert!(next.may_move());
    }
}

#[test]
fn another_host_that_takes_the_stage_is_noticed() {
    let mut stage = Stage::booted(0);
    let mut first = opened(&mut stage);
    let mut second = Host::new(0xF00D, Patience::default());
    for _ in 0..2 {
        let hello = second.hello(0);
        talk(&mut second, &mut stage, &hello);
    }
    assert!(second.is_open());
    let own = Stamp { sequence: 0, session: 0xF00D, tick_us: 0 };
    let streamed = Response::Telemetry { counter: 1, state: stage.state() }.encode(own);
    assert_eq!(hear(&mut first, streamed.as_bytes()), [Heard::SessionLost { session: 0xF00D }]);
}

/// A damaged sequence cannot happen under the checksum, a host that is behind can: it catches up.
#[test]
fn a_host_that_is_behind_catches_up() {
    let mut stage = Stage::booted(0);
    let mut host = opened(&mut stage);
    let ahead = Stamp { sequence: 90, session: 0xCAFE, tick_us: 0 };
    stage.send(Request::Query {}.encode(ahead).as_bytes());
    let lease = host.send(Request::Lease { lease_ms: 50 }, 0).expect("nothing waits");
    let told = answer(&talk(&mut host, &mut stage, &lease));
    assert!(
        matches!(told, Response::Refused { refusal, .. } if refusal.reason == Reason::StaleSequence),
        "{told:?}"
    );
    let lease = host.send(Request::Lease { lease_ms: 50 }, 0).expect("nothing waits");
    assert!(matches!(answer(&talk(&mut host, &mut stage, &lease)), Response::Accepted { .. }));
}

#[test]
fn another_schema_is_seen_before_anything_moves() {
    let mut host = Host::new(0xCAFE, Patience::default());
    host.hello(0);
    let identity = Identity {
        name: Name::new("an older one"),
        firmware_hash: 0,
        schema_hash: SCHEMA_HASH ^ 1,
        capabilities: 0,
        boot_count: 3,
        reset_cause: ResetCause::Unknown,
        session: 0xCAFE,
    };
    let stamp = Stamp { sequence: 1, session: 0xCAFE, tick_us: 0 };
    hear(&mut host, Response::Identity { identity }.encode(stamp).as_bytes());
    assert!(host.is_open() && !host.may_move());
}
