//! A stage to test the controller on: switches where a real stage has them, a manual clock, and a host that
//! can be told to misbehave. Also the seeded random numbers of the tests.
#![allow(dead_code, reason = "every test file uses its part")]

use firmware_proto::{
    AxisLimits, AxisSet, Config, Controller, Decoder, HomingConfig, Name, Request, ResetCause, Response,
    SCHEMA_HASH, Stamp, State, Switches,
};

/// 1600 steps/mm (a 2 mm screw, 200 full steps, 16 micro-steps): 625 nm a step.
pub(crate) const STEP_NM: f64 = 625.0;
pub(crate) const SESSION: u32 = 0x5EED_0001;

pub(crate) fn config() -> Config {
    let axis = AxisLimits {
        travel_low_um: 500,
        travel_high_um: 60_000,
        max_speed_um_s: 20_000,
        max_acceleration_um_s2: 200_000,
        steps: 1600,
        per_mm: 1,
    };
    Config {
        axes: [axis; 2],
        emergency_um_s2: 200_000,
        homing: HomingConfig {
            fast_um_s: 5000,
            slow_um_s: 250,
            acceleration_um_s2: 100_000,
            back_off_um: 1000,
        },
        unhomed_speed_um_s: 1000,
        unhomed_distance_um: 2000,
        name: Name::new("bench stage"),
        firmware_hash: 0x1122_3344_5566_7788,
        boot_count: 7,
        reset_cause: ResetCause::PowerOn,
    }
}

pub(crate) struct Stage {
    pub(crate) controller: Controller,
    pub(crate) now_us: u32,
    /// Counters at or below which the low switches are pressed, and at or above which the high ones are.
    pub(crate) low_at: [i32; 2],
    pub(crate) high_at: [i32; 2],
    pub(crate) sequence: u8,
    pub(crate) motion: u32,
    pub(crate) session: u32,
}

impl Stage {
    /// Just booted, 2.5 mm from both low switches, 62 mm from low to high switches.
    pub(crate) fn booted(now_us: u32) -> Self {
        let controller = Controller::new(config(), now_us).expect("a stage that can be driven");
        let (low_at, high_at) = ([-4000; 2], [95_200; 2]);
        Self { controller, now_us, low_at, high_at, sequence: 0, motion: 0, session: SESSION }
    }

    /// With its session open.
    pub(crate) fn greeted(now_us: u32) -> Self {
        let mut stage = Self::booted(now_us);
        stage.ask(Request::Hello { replaces: 0, boot_count: 7, schema_hash: SCHEMA_HASH });
        stage
    }

    /// With both axes homed and the lease at its longest.
    pub(crate) fn homed(now_us: u32) -> Self {
        let mut stage = Self::greeted(now_us);
        let home = Request::Home { motion: stage.next_motion(), axes: AxisSet::ALL };
        assert!(matches!(stage.ask(home), Response::Accepted { .. }));
        stage.finish();
        assert_eq!(stage.state().homed, AxisSet::ALL);
        stage
    }

    /// Homed with few looks at the switches: zero lies up to 10 ms of touch, 4 steps, beyond them.
    pub(crate) fn homed_roughly(now_us: u32) -> Self {
        let mut stage = Self::greeted(now_us);
        let home = Request::Home { motion: stage.next_motion(), axes: AxisSet::ALL };
        stage.ask(home);
        stage.finish_in(10_000);
        assert_eq!(stage.state().homed, AxisSet::ALL);
        stage
    }

    /// Homed, and at the target.
    pub(crate) fn at(now_us: u32, target_nm: [i32; 2]) -> Self {
        let mut stage = Self::homed(now_us);
        let answer = stage.go(target_nm, 10_000, 100_000);
        assert!(matches!(answer, Response::Accepted { .. }), "{answer:?}");
        stage.finish();
        assert_eq!(stage.state().position_nm, target_nm);
        stage
    }

    pub(crate) fn next_motion(&mut self) -> u32 {
        self.motion += 1;
        self.motion
    }

    pub(crate) fn state(&self) -> State {
        self.controller.state()
    }

    pub(crate) fn switches(&self) -> Switches {
        let counters = self.controller.step_counters();
        Switches {
            low: AxisSet::of([0, 1].map(|axis| counters[axis] <= self.low_at[axis])),
            high: AxisSet::of([0, 1].map(|axis| counters[axis] >= self.high_at[axis])),
        }
    }

    /// Lets time pass in one call, with the switches as they are after it.
    pub(crate) fn wait(&mut self, step_us: u32) {
        self.now_us = self.now_us.wrapping_add(step_us);
        let now = self.switches();
        self.controller.advance(self.now_us, now);
        // What the step changed is seen in the same tick, as a switch is.
        let after = self.switches();
        self.controller.advance(self.now_us, after);
    }

    /// Lets time pass in steps of 1 ms until the stage rests.
    pub(crate) fn finish(&mut self) {
        self.finish_in(1000);
    }

    /// Lets time pass, with a word every 20 ms at most, until the stage rests.
    fn finish_in(&mut self, step_us: u32) {
        for step in 0..600_000 {
            if self.state().activity == firmware_proto::Activity::Idle {
                return;
            }
            self.wait(step_us);
            if step % (20_000 / step_us) == 0 {
                self.ask(Request::Ping { host_tick_us: 0 });
            }
        }
        panic!("the stage does not come to rest");
    }

    /// Bytes of the next request.
    pub(crate) fn bytes(&mut self, request: Request) -> Vec<u8> {
        self.sequence = self.sequence.wrapping_add(1);
        let stamp = Stamp { sequence: self.sequence, session: self.session, tick_us: self.now_us };
        request.encode(stamp).as_bytes().to_vec()
    }

    /// Everything that the device has to say after these bytes.
    pub(crate) fn send(&mut self, bytes: &[u8]) -> Vec<(Stamp, Response)> {
        self.controller.receive(bytes, self.now_us);
        self.heard()
    }

    pub(crate) fn heard(&mut self) -> Vec<(Stamp, Response)> {
        let mut decoder = Decoder::new();
        let mut heard = Vec::new();
        // A prime, so that frames are torn at every place.
        let mut line = [0; 7];
        loop {
            let count = self.controller.output(&mut line);
            for byte in &line[..count] {
                if let Some(frame) = decoder.feed(*byte) {
                    heard.push((frame.stamp, Response::decode(&frame).expect("the device speaks its table")));
                }
            }
            if count < line.len() {
                return heard;
            }
        }
    }

    /// The answer to a request with the next sequence.
    pub(crate) fn ask(&mut self, request: Request) -> Response {
        let bytes = self.bytes(request);
        let sequence = self.sequence;
        let heard = self.send(&bytes);
        let answer =
            heard.iter().find(|(stamp, _)| stamp.sequence == sequence && stamp.session == self.session);
        answer.unwrap_or_else(|| panic!("no answer to {request:?} in {heard:?}")).1
    }

    pub(crate) fn go(&mut self, target_nm: [i32; 2], speed_um_s: u32, acceleration_um_s2: u32) -> Response {
        let motion = self.next_motion();
        self.ask(Request::Move { motion, target_nm, speed_um_s, acceleration_um_s2 })
    }
}

/// xorshift64* (Vigna 2016): the same numbers for the same seed, everywhere.
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    pub(crate) fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D)
    }

    /// Below a bound.
    pub(crate) fn below(&mut self, bound: u64) -> u64 {
        (self.next() >> 16) % bound
    }

    /// True once in so many.
    pub(crate) fn once_in(&mut self, bound: u64) -> bool {
        self.below(bound) == 0
    }

    pub(crate) fn bytes(&mut self, count: u64) -> Vec<u8> {
        (0..count).map(|_| self.below(256) as u8).collect()
    }
}
