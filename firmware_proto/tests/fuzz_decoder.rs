//! Do any bytes at all make the decoder, the controller or the host panic, wedge, or move the stage wrongly?
//!
//! Random bytes, damaged and cut frames, well-formed frames with random fields, pieces of the emergency pattern,
//! random switches and steps in time. The same inputs for the same seed. Ordinary runs take 200 000; FUZZ_INPUTS
//! asks for another number:
//!
//! `FUZZ_INPUTS=10000000 cargo test --release -p firmware_proto --test fuzz_decoder`

mod stage;

use firmware_proto::*;
use stage::{Random, SESSION, Stage};

/// A request of any kind, more often than not one that could be accepted.
fn request(random: &mut Random, motion: &mut u32, state: &State) -> Request {
    let odd = |random: &mut Random| random.once_in(4).then(|| random.next() as u32);
    if state.fault != Fault::None && random.once_in(2) {
        return Request::Clear { fault_ordinal: state.fault_ordinal };
    }
    *motion = motion.wrapping_add(u32::from(!random.once_in(4)));
    let motion = odd(random).filter(|_| random.once_in(50)).unwrap_or(*motion);
    let speed_um_s = odd(random).unwrap_or(1 + random.below(20_000) as u32);
    let acceleration_um_s2 = odd(random).unwrap_or(1 + random.below(200_000) as u32);
    match random.below(12) {
        0 => {
            let replaces = odd(random).unwrap_or(SESSION);
            Request::Hello {
                replaces,
                boot_count: 7,
                schema_hash: SCHEMA_HASH ^ u64::from(random.once_in(8)),
            }
        }
        1 => Request::Query {},
        2 => Request::Stop {},
        3 => Request::Ping { host_tick_us: random.next() as u32 },
        4 => Request::Describe { axis: random.below(4) as u8 },
        5 => Request::Home { motion, axes: AxisSet::of([random.once_in(2), random.once_in(2)]) },
        6 | 7 => {
            let target = |random: &mut Random| match odd(random) {
                Some(any) => any as i32,
                None => 500_000 + random.below(59_500_000) as i32,
            };
            let target_nm = [target(random), target(random)];
            Request::Move { motion, target_nm, speed_um_s, acceleration_um_s2 }
        }
        8 => {
            let velocity_um_s =
                if random.once_in(2) { speed_um_s as i32 } else { -(random.below(1000) as i32) };
            Request::Jog { motion, axis: random.below(3) as u8, velocity_um_s, acceleration_um_s2 }
        }
        9 => Request::Clear { fault_ordinal: odd(random).unwrap_or(state.fault_ordinal) },
        10 => Request::Telemetry { period_ms: random.below(200) as u16 },
        _ => Request::Lease { lease_ms: odd(random).unwrap_or(20 + random.below(980) as u32) as u16 },
    }
}

fn frame(random: &mut Random, motion: &mut u32, sequence: &mut u8, state: &State) -> Vec<u8> {
    *sequence = sequence.wrapping_add(if random.once_in(100) { random.next() as u8 } else { 1 });
    let session = if random.once_in(50) { random.next() as u32 } else { SESSION };
    let stamp = Stamp { sequence: *sequence, session, tick_us: random.next() as u32 };
    match random.below(12) {
        0 => {
            let count = random.below(MAX_PAYLOAD as u64 + 1);
            let payload = random.bytes(count);
            Encoded::of(random.below(3) as u8, random.next() as u8, stamp, &payload).as_bytes().to_vec()
        }
        1 => Response::Telemetry { counter: random.next() as u32, state: *state }
            .encode(stamp)
            .as_bytes()
            .to_vec(),
        _ => request(random, motion, state).encode(stamp).as_bytes().to_vec(),
    }
}

fn damage(bytes: &mut Vec<u8>, random: &mut Random) {
    for _ in 0..=random.below(3) {
        let place = random.below(bytes.len().max(1) as u64) as usize;
        match random.below(4) {
            0 if !bytes.is_empty() => bytes[place] ^= 1 << random.below(8),
            1 if !bytes.is_empty() => drop(bytes.remove(place)),
            2 => bytes.truncate(place),
            _ => bytes.insert(place.min(bytes.len()), random.below(256) as u8),
        }
    }
}

fn input(random: &mut Random, motion: &mut u32, sequence: &mut u8, state: &State) -> Vec<u8> {
    match random.below(10) {
        0 => {
            let count = random.below(200);
            random.bytes(count)
        }
        1 => {
            // Few values: zeros, count bytes, runs.
            (0..random.below(200)).map(|_| [0, 1, 2, 95, 96, 254, 255][random.below(7) as usize]).collect()
        }
        2 => EMERGENCY_STOP[..if random.once_in(20) { 8 } else { random.below(8) as usize }].to_vec(),
        3 | 4 => {
            let mut bytes = frame(random, motion, sequence, state);
            damage(&mut bytes, random);
            bytes
        }
        _ => frame(random, motion, sequence, state),
    }
}

/// What holds whatever was received.
fn check(stage: &Stage, was: State, counters: [i32; 2], passed: bool) {
    let state = stage.state();
    let now = stage.controller.step_counters();
    if passed && was.activity == Activity::Idle {
        assert_eq!((now, state.activity), (counters, Activity::Idle), "time alone begins no motion");
    }
    if !passed {
        assert_eq!(now, counters, "bytes alone make no step");
    }
    if state.fault != Fault::None {
        assert!(matches!(state.activity, Activity::Idle | Activity::Stopping), "a fault, and it goes on");
    }
    if state.activity == Activity::Idle {
        assert_eq!(state.velocity_nm_s, [0; 2]);
    }
    for axis in 0..AXES {
        // Each axis at most at its limit of 20 mm/s.
        assert!(state.velocity_nm_s[axis].unsigned_abs() <= 20_000_000);
        let homed = state.homed.contains(axis) && was.homed.contains(axis);
        if homed && state.activity != Activity::Homing {
            assert!((0..=60_000_000).contains(&state.position_nm[axis]), "beyond the travel: {state:?}");
        }
    }
}

#[test]
fn any_input_is_survived() {
    let inputs: u64 =
        std::env::var("FUZZ_INPUTS").map_or(200_000, |text| text.parse().expect("a number of inputs"));
    let mut random = Random::new(20_260_101);
    let mut decoder = Decoder::new();
    let mut host = Host::new(SESSION, Patience::default());
    let mut stage = Stage::greeted(0);
    let (mut motion, mut sequence, mut accepted, mut moved) = (0_u32, 1, 0_u64, 0_u64);
    for number in 0..inputs {
        if number % 1000 == 0 {
            stage = if random.once_in(2) {
                Stage::homed(random.next() as u32)
            } else {
                Stage::greeted(number as u32)
            };
            (motion, sequence) = (stage.motion, stage.sequence);
        }
        let bytes = input(&mut random, &mut motion, &mut sequence, &stage.state());

        // The decoder: whatever came before, after a delimiter the next frame is whole.
        for byte in &bytes {
            let _ = decoder.feed(*byte).map(|frame| (Request::decode(&frame), Response::decode(&frame)));
            let _ = host.hear(*byte);
        }
        decoder.feed(0);
        let stamp = Stamp { sequence: number as u8, session: number as u32, tick_us: 0 };
        let query = Request::Query {}.encode(stamp);
        let whole = query.as_bytes().iter().find_map(|byte| decoder.feed(*byte).map(|frame| frame.stamp));
        assert_eq!(whole, Some(stamp), "input {number} wedged the decoder");

        // The controller: in whatever pieces, with whatever switches, at whatever tick.
        let (was, counters) = (stage.state(), stage.controller.step_counters());
        let cut = random.below(bytes.len() as u64 + 1) as usize;
        stage.controller.receive(&bytes[..cut], stage.now_us);
        stage.controller.receive(&bytes[cut..], stage.now_us);
        check(&stage, was, counters, false);
        if stage.state().motion != was.motion && stage.state().motion != 0 {
            accepted += 1;
        }
        let mut line = [0; 512];
        let room = random.below(513) as usize;
        let count = stage.controller.output(&mut line[..room]);
        assert!(count <= room);
        for byte in &line[..count] {
            let _ = host.hear(*byte);
        }

        let (was, counters) = (stage.state(), stage.controller.step_counters());
        let step = match random.below(50) {
            0 => random.next() as u32 % (u32::MAX - 1_000_000),
            1 => 0,
            _ => random.below(50_000) as u32,
        };
        stage.now_us = stage.now_us.wrapping_add(step);
        let odd = Switches {
            low: AxisSet::of([random.once_in(3), random.once_in(3)]),
            high: AxisSet::of([random.once_in(9), random.once_in(9)]),
        };
        let switches = if random.once_in(300) { odd } else { stage.switches() };
        stage.controller.advance(stage.now_us, switches);
        check(&stage, was, counters, true);
        moved += u64::from(stage.controller.step_counters() != counters);
    }
    assert!(accepted * 100 > inputs && moved * 100 > inputs, "{accepted} motions, {moved} steps: too tame");
    println!("{inputs} inputs, {accepted} motions accepted, {moved} steps in time moved the stage");
}
