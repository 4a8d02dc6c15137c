//! Does a line that loses, doubles, delays, reorders and damages frames ever make the stage move wrongly?
//!
//! A host that pokes to and fro talks to the controller through such a line, both ways, on a manual clock.
//! Watched all the time, whatever the line does:
//!
//! * the counters change only during a motion;
//! * each motion begins once, with a number above all earlier ones, and was asked by the host with that number;
//! * a motion that ends well ends at the target that was asked with its number;
//! * otherwise it was stopped by a request, or a fault is latched.

mod stage;

use std::collections::BTreeMap;

use firmware_proto::*;
use stage::{Random, Stage};

/// One direction of the line.
struct Line {
    /// By arrival, µs, and order of sending.
    under_way: BTreeMap<(u64, u64), Vec<u8>>,
    sent: u64,
    /// One frame in so many is lost, doubled, delayed by up to 120 ms, damaged. 0 for never.
    evil: [u64; 4],
}

impl Line {
    fn new(evil: [u64; 4]) -> Self {
        Self { under_way: BTreeMap::new(), sent: 0, evil }
    }

    fn send(&mut self, bytes: &[u8], now: u64, random: &mut Random) {
        let [lost, doubled, delayed, damaged] = self.evil.map(|rate| rate > 0 && random.once_in(rate));
        for copy in 0..1 + u64::from(doubled) {
            if lost && copy == 0 {
                continue;
            }
            let mut bytes = bytes.to_vec();
            if damaged {
                match random.below(3) {
                    // Up to three wrong bits, a missing byte, a byte too many.
                    0 => (0..=random.below(3)).for_each(|_| {
                        let bit = random.below(bytes.len() as u64 * 8) as usize;
                        bytes[bit / 8] ^= 1 << (bit % 8);
                    }),
                    1 => drop(bytes.remove(random.below(bytes.len() as u64) as usize)),
                    _ => bytes.insert(random.below(bytes.len() as u64) as usize, random.below(256) as u8),
                }
            }
            let late = if delayed || copy > 0 { random.below(120_000) } else { 0 };
            self.under_way.insert((now + 2000 + late, self.sent), bytes);
            self.sent += 1;
        }
    }

    fn arrived(&mut self, now: u64) -> Vec<u8> {
        let later = self.under_way.split_off(&(now, u64::MAX));
        std::mem::replace(&mut self.under_way, later).into_values().flatten().collect()
    }
}

/// Looks at the controller after every millisecond.
#[derive(Default)]
struct Watch {
    asked: BTreeMap<u32, Option<[i32; 2]>>,
    /// Highest number begun in this session.
    begun: u32,
    counters: [i32; 2],
    was: Option<State>,
    stops: u32,
    reached: u32,
}

impl Watch {
    fn ask(&mut self, request: Request) {
        match request {
            Request::Move { motion, target_nm, .. } => drop(self.asked.insert(motion, Some(target_nm))),
            Request::Home { motion, .. } => drop(self.asked.insert(motion, None)),
            Request::Stop {} => self.stops += 1,
            _ => {}
        }
    }

    fn look(&mut self, stage: &Stage) {
        let (state, counters) = (stage.state(), stage.controller.step_counters());
        let Some(was) = self.was.replace(state) else {
            self.counters = counters;
            return;
        };
        // The motion that homed was another session's; this one begins with none.
        if state.motion != was.motion && !(state.motion == 0 && self.begun == 0) {
            assert!(state.motion > self.begun, "motion {} begins after {}", state.motion, self.begun);
            assert!(self.asked.contains_key(&state.motion), "motion {} was never asked", state.motion);
            self.begun = state.motion;
        } else if was.activity == Activity::Idle {
            assert_eq!(state.activity, Activity::Idle, "motion {} begins again", state.motion);
            assert_eq!(counters, self.counters, "steps without a motion");
        }
        self.counters = counters;
        let rested = was.activity == Activity::Idle && state.motion == was.motion;
        if state.activity != Activity::Idle || rested || self.begun == 0 {
            return;
        }
        // It has just come to rest.
        match state.outcome {
            Outcome::Reached => {
                self.reached += 1;
                if let Some(target_nm) = self.asked[&state.motion] {
                    assert_eq!(state.position_nm, target_nm, "motion {}", state.motion);
                }
            }
            Outcome::Stopped => assert!(self.stops > 0, "stopped, and nobody asked"),
            Outcome::Faulted => assert_ne!(state.fault, Fault::None),
            other => panic!("at rest with {other:?}"),
        }
    }
}

/// Ten seconds of talk; gives the motions that reached their end, and whether the host ever gave up.
fn talk(seed: u64, evil: [u64; 4]) -> (u32, u32) {
    let mut random = Random::new(seed);
    let begin = random.next() as u32;
    let mut stage = Stage::homed(begin);
    let begin = stage.now_us;
    let mut host = Host::new(random.next() as u32 | 1, Patience::default());
    let (mut there, mut back) = (Line::new(evil), Line::new(evil));
    let mut watch = Watch::default();
    let mut known: Option<State> = None;
    let mut given_up = 0;
    for now in (0..10_000_000_u64).step_by(1000) {
        let now_us = begin.wrapping_add(now as u32);
        stage.wait(now_us.wrapping_sub(stage.now_us));
        let arrived = there.arrived(now);
        stage.controller.receive(&arrived, now_us);
        watch.look(&stage);
        let mut line = [0; 400];
        let count = stage.controller.output(&mut line);
        for frame in line[..count].split_inclusive(|byte| *byte == 0) {
            back.send(frame, now, &mut random);
        }

        for byte in back.arrived(now) {
            match host.hear(byte) {
                Some(Heard::Answer { response: Response::State { state }, .. }) => known = Some(state),
                Some(Heard::Answer { request: Request::Move { motion, .. }, response, .. }) => {
                    if let Response::Accepted { motion: told, .. } = response {
                        assert_eq!(told, motion);
                        assert!(stage.state().motion >= motion, "accepted, and not begun");
                    }
                    known = None;
                }
                Some(Heard::SessionLost { .. }) => panic!("nothing took the session"),
                _ => {}
            }
        }
        let ask = match host.due(now_us) {
            Due::Resend(bytes) => Some(bytes),
            Due::GaveUp(_) => {
                given_up += 1;
                None
            }
            Due::Nothing => None,
        };
        let ask = ask.or_else(|| {
            if host.is_waiting() {
                return random.once_in(2000).then(|| {
                    watch.ask(Request::Stop {});
                    host.stop(now_us)
                });
            }
            if !host.may_move() {
                return Some(host.hello(now_us));
            }
            let request = match known.take() {
                None => Request::Query {},
                Some(state) if state.activity != Activity::Idle => Request::Ping { host_tick_us: now_us },
                Some(State { fault, fault_ordinal, .. }) if fault != Fault::None => {
                    Request::Clear { fault_ordinal }
                }
                Some(state) if state.homed != AxisSet::ALL || random.once_in(30) => {
                    Request::Home { motion: host.next_motion(), axes: AxisSet::ALL }
                }
                Some(_) => {
                    let target_nm = [0, 1].map(|_| (1000 + random.below(2000) as i32) * 625);
                    let motion = host.next_motion();
                    Request::Move { motion, target_nm, speed_um_s: 10_000, acceleration_um_s2: 100_000 }
                }
            };
            watch.ask(request);
            host.send(request, now_us).ok()
        });
        if let Some(bytes) = ask {
            there.send(bytes.as_bytes(), now, &mut random);
        }
        if random.once_in(5000) {
            there.send(&EMERGENCY_STOP, now, &mut random);
        }
    }
    // Silence: whatever moves, the lease ends it; what is still under way arrives and begins at most one more.
    for _ in 0..10 {
        stage.wait(300_000);
        let arrived = there.arrived(u64::MAX - 1);
        stage.controller.receive(&arrived, stage.now_us);
        watch.look(&stage);
    }
    assert_eq!(stage.state().activity, Activity::Idle);
    (watch.reached, given_up)
}

/// On a good line nothing is given up.
#[test]
fn a_good_line_carries_everything() {
    for seed in 0..10 {
        let (reached, given_up) = talk(seed, [0; 4]);
        assert!(given_up == 0 && reached >= 1, "seed {seed}: {reached} motions, gave up {given_up} times");
    }
}

/// One frame in 10 lost, one in 10 doubled, one in 5 delayed past others, one in 10 damaged.
#[test]
fn a_bad_line_moves_nothing_wrongly() {
    let reached: u32 = (100..200).map(|seed| talk(seed, [10, 10, 5, 10]).0).sum();
    assert!(reached >= 100, "only {reached} motions: the line is too bad to show anything");
}

/// Every second frame suffers from something.
#[test]
fn a_dreadful_line_moves_nothing_wrongly() {
    for seed in 300..360 {
        talk(seed, [4, 3, 2, 4]);
    }
}
