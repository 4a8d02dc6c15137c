//! Do the bytes on the wire stay what the written protocol says? The expected bytes were worked out from
//! `protocol.md` by a separate program with a bitwise CRC and its own COBS, not by this crate.

use firmware_proto::{
    Activity, AxisSet, Decoder, Fault, Identity, Name, Outcome, Reason, Refusal, Request, ResetCause,
    Response, Stamp, State, Switches,
};

fn bytes(hex: &str) -> Vec<u8> {
    hex.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).expect("hex")).collect()
}

fn stamp(sequence: u8, session: u32, tick_us: u32) -> Stamp {
    Stamp { sequence, session, tick_us }
}

const SESSION: u32 = 0x5EED_0001;

#[test]
fn requests_are_these_bytes() {
    let cases = [
        (
            Request::Hello { replaces: 0, boot_count: 7, schema_hash: 0x0123_4567_89AB_CDEF },
            stamp(1, SESSION, 1000),
            "05 01 01 01 01 05 ed 5e e8 03 01 01 01 01 01 02 07 01 01 0d ef cd ab 89 67 45 23 01 43 5c 74 b5 00",
        ),
        (Request::Query {}, stamp(2, SESSION, 0), "05 01 02 02 01 03 ed 5e 01 01 01 05 01 b8 05 4d 00"),
        (
            Request::Stop {},
            stamp(255, SESSION, u32::MAX),
            "05 01 03 ff 01 0b ed 5e ff ff ff ff 77 19 ff 4b 00",
        ),
        (
            Request::Ping { host_tick_us: 0xDEAD_BEEF },
            stamp(3, 0, 0),
            "04 01 04 03 01 01 01 01 01 01 01 09 ef be ad de 43 5f 9e 39 00",
        ),
        (
            Request::Home { motion: 1, axes: AxisSet::ALL },
            stamp(4, SESSION, 2000),
            "05 01 10 04 01 05 ed 5e d0 07 01 02 01 01 01 06 03 31 7f af 66 00",
        ),
        (
            Request::Move {
                motion: 2,
                target_nm: [2_000_000, -500_000],
                speed_um_s: 10_000,
                acceleration_um_s2: 100_000,
            },
            stamp(5, SESSION, 3000),
            "05 01 11 05 01 05 ed 5e b8 0b 01 02 02 01 01 04 80 84 1e 07 e0 5e f8 ff 10 27 01 04 a0 86 01 05 \
             eb 48 c5 de 00",
        ),
        (
            Request::Jog { motion: 3, axis: 1, velocity_um_s: -500, acceleration_um_s2: 20_000 },
            stamp(6, SESSION, 4000),
            "05 01 12 06 01 05 ed 5e a0 0f 01 02 03 01 01 08 01 0c fe ff ff 20 4e 01 05 c1 af 82 40 00",
        ),
    ];
    for (request, stamp, hex) in cases {
        let expected = bytes(hex);
        assert_eq!(request.encode(stamp).as_bytes(), expected, "{request:?}");
        let mut decoder = Decoder::new();
        let (last, before) = expected.split_last().expect("bytes");
        assert!(before.iter().all(|byte| decoder.feed(*byte).is_none()));
        let frame = decoder.feed(*last).expect("a whole frame");
        assert_eq!((frame.stamp, Request::decode(&frame)), (stamp, Ok(request)));
    }
}

#[test]
fn responses_are_these_bytes() {
    let identity = Identity {
        name: Name::new("bench stage"),
        firmware_hash: 0x1122_3344_5566_7788,
        schema_hash: 0x0123_4567_89AB_CDEF,
        capabilities: 0b11111,
        boot_count: 7,
        reset_cause: ResetCause::Watchdog,
        session: SESSION,
    };
    let state = State {
        steps: [3200, -800],
        position_nm: [2_000_000, -500_000],
        velocity_nm_s: [10_000_000, 0],
        activity: Activity::Moving,
        homed: AxisSet::ALL,
        switches: Switches { low: AxisSet::of([false, true]), high: AxisSet::of([true, false]) },
        fault: Fault::None,
        fault_ordinal: 2,
        motion: 5,
        outcome: Outcome::Running,
    };
    let refusal = Refusal { reason: Reason::Travel, axis: 0, limit: 50_000_000, asked: 60_000_000 };
    let cases = [
        (
            Response::Accepted { request: 0x11, motion: 2 },
            stamp(5, SESSION, 3100),
            "05 01 83 05 01 05 ed 5e 1c 0c 01 03 11 02 01 01 05 36 5f c2 7f 00",
        ),
        (
            Response::Refused { request: 0x11, refusal },
            stamp(5, SESSION, 3100),
            "05 01 86 05 01 05 ed 5e 1c 0c 01 03 11 09 05 80 f0 fa 02 01 01 01 01 04 87 93 03 01 01 01 05 94 \
             94 73 99 00",
        ),
        (
            Response::Identity { identity },
            stamp(1, SESSION, 77),
            "05 01 81 01 01 04 ed 5e 4d 01 01 0c 62 65 6e 63 68 20 73 74 61 67 65 01 01 01 01 01 01 01 01 01 \
             01 01 01 12 88 77 66 55 44 33 22 11 ef cd ab 89 67 45 23 01 1f 01 01 02 07 01 01 03 03 01 07 ed \
             5e 2f d1 ac 71 00",
        ),
        (
            Response::Telemetry { counter: 42, state },
            stamp(0, SESSION, 0x8000_0000),
            "03 01 c0 02 01 03 ed 5e 01 01 03 80 2a 01 01 03 80 0c 01 08 e0 fc ff ff 80 84 1e 08 e0 5e f8 ff \
             80 96 98 01 01 01 01 04 01 03 06 02 02 01 01 02 05 01 01 06 01 0d c6 e2 cd 00",
        ),
    ];
    for (response, stamp, hex) in cases {
        assert_eq!(response.encode(stamp).as_bytes(), bytes(hex), "{response:?}");
    }
}
