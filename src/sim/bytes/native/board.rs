//! What a stage's board, motors and limit switches do: elapsed time and bytes in, bytes out. No port, no clock, no thread.
//!
//! The stage is where its motors have carried it, not where the controller believes it to be: steps into an end are lost, steps can
//! slip, and a reset forgets the count but not the place.

use super::faults::{Events, NativeStageFaults};
use super::line::Line;
use super::setup::NativeStageSetup;
use crate::device::AXES;
use firmware_proto::{
    Activity, AxisSet, ConfigError, Controller, Decoder, EmergencyWatch, Fault, Identity, ResetCause,
    Response, Switches,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::time::Duration;

/// Longest time between two looks at the switches (µs): 10 µm at 20 mm/s.
const LOOK_US: u32 = 500;
/// Longest frame (bytes).
const ROOM: usize = firmware_proto::MAX_FRAME;

#[derive(Debug)]
pub(super) struct Board {
    setup: NativeStageSetup,
    controller: Controller,
    boot_count: u32,
    /// Until the controller listens (µs).
    booting_us: u32,
    /// Controller's clock (µs).
    tick_us: u32,
    /// The controller's step counters when they were last followed.
    counters: [i32; AXES],
    /// True place of the stage (steps).
    steps: [i64; AXES],
    /// Steps that the stage has gone, both ways.
    gone: [u64; AXES],
    watch: EmergencyWatch,
    patterns: u64,
    to_board: Line,
    from_board: Line,
    frames: Decoder,
}

impl Board {
    /// A board whose power has just come.
    ///
    /// # Errors
    /// When the firmware cannot drive what it is set up for.
    pub(super) fn new(setup: NativeStageSetup) -> Result<Self, ConfigError> {
        let lines = [0, 1].map(|stream| {
            let mut rng = ChaCha8Rng::seed_from_u64(setup.seed);
            rng.set_stream(stream);
            Line::new(rng, setup.line_bytes_s)
        });
        let [to_board, from_board] = lines;
        let mut board = Self {
            controller: Controller::new(setup.firmware, setup.first_tick_us)?,
            boot_count: setup.firmware.boot_count,
            booting_us: u32::try_from(setup.boot.as_micros()).unwrap_or(u32::MAX),
            tick_us: setup.first_tick_us,
            counters: [0; AXES],
            steps: [0; AXES],
            gone: [0; AXES],
            watch: EmergencyWatch::new(),
            patterns: 0,
            to_board,
            from_board,
            frames: Decoder::new(),
            setup,
        };
        board.steps = std::array::from_fn(|axis| board.steps_at(axis, board.setup.start_m[axis]));
        Ok(board)
    }

    /// Lets time pass, then hears what was sent to the board meanwhile and appends what it has to say. `passing` is told of each part
    /// of the time (µs since the beginning of the step) where the stage was at its end (m).
    pub(super) fn step(
        &mut self,
        elapsed_us: u32,
        sent: &[u8],
        faults: &NativeStageFaults,
        events: &Events,
        said: &mut Vec<u8>,
        mut passing: impl FnMut(u32, [f64; AXES]),
    ) {
        if let Some(cause) = events.reset {
            self.reset(cause);
        }
        self.carry(events.slip);
        let mut left_us = elapsed_us;
        while left_us > 0 {
            let part_us = left_us.min(LOOK_US);
            left_us -= part_us;
            self.pass(part_us, faults);
            self.hear(part_us);
            self.say(part_us, faults, said);
            passing(elapsed_us - left_us, self.position_m());
        }
        if !faults.deaf {
            self.to_board.send(sent, faults);
        }
        self.hear(0);
        self.say(0, faults, said);
    }

    /// Where the stage is (m).
    pub(super) fn position_m(&self) -> [f64; AXES] {
        std::array::from_fn(|axis| self.steps[axis] as f64 * self.step_m(axis))
    }

    /// What each axis has gone, both ways (m).
    pub(super) fn gone_m(&self) -> [f64; AXES] {
        std::array::from_fn(|axis| self.gone[axis] as f64 * self.step_m(axis))
    }

    /// Emergency patterns that were seen.
    pub(super) fn patterns(&self) -> u64 {
        self.patterns
    }

    /// Ordinal of the emergency stop that is latched, if one is.
    pub(super) fn emergency(&self) -> Option<u32> {
        let state = self.controller.state();
        (state.fault == Fault::EmergencyStop).then_some(state.fault_ordinal)
    }

    pub(super) fn tick_us(&self) -> u32 {
        self.tick_us
    }

    /// How long a motion goes on without a word from the host.
    pub(super) fn lease(&self) -> Duration {
        Duration::from_micros(self.controller.lease_us().into())
    }

    /// Whether time matters: something moves, or bytes are under way.
    pub(super) fn is_busy(&self) -> bool {
        let moving = self.controller.state().activity != Activity::Idle;
        moving || !self.to_board.is_idle() || !self.from_board.is_idle()
    }

    fn reset(&mut self, cause: ResetCause) {
        self.boot_count = self.boot_count.wrapping_add(1);
        let config =
            firmware_proto::Config { boot_count: self.boot_count, reset_cause: cause, ..self.setup.firmware };
        // The configuration was driven before; only how it came to boot is new.
        if let Ok(controller) = Controller::new(config, self.setup.first_tick_us) {
            self.controller = controller;
        }
        self.booting_us = u32::try_from(self.setup.boot.as_micros()).unwrap_or(u32::MAX);
        (self.tick_us, self.counters) = (self.setup.first_tick_us, [0; AXES]);
        self.watch = EmergencyWatch::new();
    }

    fn pass(&mut self, elapsed_us: u32, faults: &NativeStageFaults) {
        let booting_us = self.booting_us.min(elapsed_us);
        self.booting_us -= booting_us;
        self.tick_us = self.tick_us.wrapping_add(elapsed_us - booting_us);
        self.controller.advance(self.tick_us, self.switches(faults));
        self.follow();
    }

    fn hear(&mut self, elapsed_us: u32) {
        let mut heard = Vec::new();
        self.to_board.arrived(elapsed_us, &mut heard);
        if self.booting_us > 0 {
            return;
        }
        self.patterns += heard.iter().map(|byte| u64::from(self.watch.feed(*byte))).sum::<u64>();
        self.controller.receive(&heard, self.tick_us);
        self.follow();
    }

    fn say(&mut self, elapsed_us: u32, faults: &NativeStageFaults, said: &mut Vec<u8>) {
        self.from_board.arrived(elapsed_us, said);
        let mut room = [0; ROOM];
        // The controller makes a frame when the line is free for it, so that telemetry is as fresh as it can be.
        while self.from_board.is_idle() && self.booting_us == 0 {
            let count = self.controller.output(&mut room);
            if count == 0 {
                break;
            }
            if !faults.mute {
                let bytes = self.claiming(&room[..count]);
                self.from_board.send(&bytes, faults);
            }
            self.from_board.arrived(0, said);
        }
    }

    /// The frames, with the number of another table in what the firmware says of itself if the setup wants that.
    fn claiming(&mut self, bytes: &[u8]) -> Vec<u8> {
        let Some(schema_hash) = self.setup.other_schema else { return bytes.to_vec() };
        let mut out = Vec::new();
        for byte in bytes {
            let Some(frame) = self.frames.feed(*byte) else { continue };
            let frame = match Response::decode(&frame) {
                Ok(Response::Identity { identity }) => {
                    Response::Identity { identity: Identity { schema_hash, ..identity } }.encode(frame.stamp)
                }
                Ok(other) => other.encode(frame.stamp),
                Err(_) => continue,
            };
            out.extend_from_slice(frame.as_bytes());
        }
        out
    }

    /// Lets the motors follow the controller's counters.
    fn follow(&mut self) {
        let counters = self.controller.step_counters();
        let steps = std::array::from_fn(|axis| counters[axis].wrapping_sub(self.counters[axis]));
        self.counters = counters;
        let carried = self.carry(steps);
        self.gone = std::array::from_fn(|axis| self.gone[axis] + carried[axis]);
    }

    /// Moves the stage by so many steps, no further than its ends; gives how far it went.
    fn carry(&mut self, steps: [i32; AXES]) -> [u64; AXES] {
        let before = self.steps;
        self.steps = std::array::from_fn(|axis| {
            let [low, high] = self.setup.ends_m[axis].map(|end| self.steps_at(axis, end));
            (before[axis] + i64::from(steps[axis])).max(low).min(high)
        });
        std::array::from_fn(|axis| self.steps[axis].abs_diff(before[axis]))
    }

    fn switches(&self, faults: &NativeStageFaults) -> Switches {
        let position = self.position_m();
        let shown = |axis: usize, end: usize| {
            let trips = self.setup.switches_m[axis][end];
            let pressed = if end == 0 { position[axis] <= trips } else { position[axis] >= trips };
            faults.stuck[axis][end].unwrap_or(pressed)
        };
        let [low, high] = [0, 1].map(|end| AxisSet::of([shown(0, end), shown(1, end)]));
        Switches { low, high }
    }

    fn step_m(&self, axis: usize) -> f64 {
        let limits = &self.setup.firmware.axes[axis];
        f64::from(limits.per_mm) * 1e-3 / f64::from(limits.steps)
    }

    fn steps_at(&self, axis: usize, position_m: f64) -> i64 {
        (position_m / self.step_m(axis)).round() as i64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use firmware_proto::{Heard, Host, Patience, Request, State};

    /// Time of one step (µs). Unlike a thread's, always the same.
    const STEP_US: u32 = 500;

    /// A host and a board on a clock that the test moves.
    struct Bench {
        board: Board,
        host: Host,
        faults: NativeStageFaults,
        now_us: u32,
        said: Vec<u8>,
    }

    impl Bench {
        fn new(setup: NativeStageSetup) -> Self {
            let board = Board::new(setup).expect("a sound setup");
            let host = Host::new(77, Patience::default());
            Self { board, host, faults: NativeStageFaults::default(), now_us: 0, said: Vec::new() }
        }

        fn step(&mut self, sent: &[u8], events: Events) -> Option<Response> {
            let mut said = Vec::new();
            self.board.step(STEP_US, sent, &self.faults, &events, &mut said, |_, _| {});
            self.now_us += STEP_US;
            self.said.extend_from_slice(&said);
            let heard = said.iter().filter_map(|byte| self.host.hear(*byte));
            heard
                .filter_map(
                    |heard| if let Heard::Answer { response, .. } = heard { Some(response) } else { None },
                )
                .last()
        }

        fn say(&mut self, frame: firmware_proto::Encoded) -> Response {
            let mut answer = self.step(frame.as_bytes(), Events::default());
            for _ in 0..100 {
                if let Some(answer) = answer {
                    return answer;
                }
                answer = self.step(&[], Events::default());
            }
            panic!("no answer within 50 ms");
        }

        fn ask(&mut self, request: Request) -> Response {
            let frame = self.host.send(request, self.now_us).expect("nothing waits");
            self.say(frame)
        }

        fn greet(&mut self) {
            for _ in 0..2 {
                let hello = self.host.hello(self.now_us);
                self.say(hello);
            }
            assert!(self.host.is_open());
        }

        fn state(&mut self) -> State {
            match self.ask(Request::Query {}) {
                Response::State { state } => state,
                other => panic!("{other:?}"),
            }
        }

        /// Until it stands, asking often enough for the lease.
        fn finish(&mut self) -> State {
            loop {
                let state = self.state();
                if state.activity == Activity::Idle {
                    return state;
                }
                self.step(&[], Events::default());
            }
        }

        fn home(&mut self) -> State {
            let motion = self.host.next_motion();
            let answer = self.ask(Request::Home { motion, axes: AxisSet::ALL });
            assert!(matches!(answer, Response::Accepted { .. }), "{answer:?}");
            self.finish()
        }

        fn move_to(&mut self, target_nm: [i32; AXES]) -> Response {
            let motion = self.host.next_motion();
            self.ask(Request::Move { motion, target_nm, speed_um_s: 20_000, acceleration_um_s2: 500_000 })
        }
    }

    /// The switch trips where it is looked at, every 0.5 ms at 1 mm/s, and the stage stands on a step.
    const ZERO_M: f64 = 0.5e-3 * 1e-3 + 0.625e-6;

    #[test]
    fn homing_makes_the_place_of_the_switch_zero() {
        let mut bench = Bench::new(NativeStageSetup::default());
        bench.greet();
        let state = bench.home();
        assert_eq!((state.homed, state.fault), (AxisSet::ALL, Fault::None));
        for axis in 0..AXES {
            let believed_m = f64::from(state.position_nm[axis]) * 1e-9;
            assert!((bench.board.position_m()[axis] - believed_m).abs() <= ZERO_M);
        }
    }

    #[test]
    fn a_move_goes_its_way_and_no_further() {
        let mut bench = Bench::new(NativeStageSetup::default());
        bench.greet();
        let before = bench.home();
        let gone = bench.board.gone_m();
        assert!(matches!(bench.move_to([30_000_000, 10_000_000]), Response::Accepted { .. }));
        let after = bench.finish();
        assert_eq!(after.position_nm, [30_000_000, 10_000_000]);
        let gone = [0, 1].map(|axis| bench.board.gone_m()[axis] - gone[axis]);
        let way = [0, 1].map(|axis| f64::from(after.position_nm[axis] - before.position_nm[axis]) * 1e-9);
        assert!((gone[0] - way[0]).abs() < 1e-12 && (gone[1] - way[1]).abs() < 1e-12, "{gone:?} {way:?}");
    }

    /// A switch that does not trip lets the axis run into its end, where steps are lost.
    #[test]
    fn nothing_goes_through_an_end() {
        let mut bench = Bench::new(NativeStageSetup::default());
        bench.greet();
        bench.faults.stuck[0][0] = Some(false);
        let state = bench.home();
        // The last axis homes first, and has.
        assert_eq!((state.fault, state.homed), (Fault::Homing, AxisSet::of([false, true])));
        assert_eq!(bench.board.position_m()[0], -0.001);
    }

    #[test]
    fn a_switch_that_trips_in_a_move_ends_it_at_once() {
        let mut bench = Bench::new(NativeStageSetup::default());
        bench.greet();
        bench.home();
        bench.move_to([30_000_000, 10_000_000]);
        bench.faults.stuck[1][1] = Some(true);
        bench.step(&[], Events::default());
        let stopped = bench.board.position_m();
        let state = bench.finish();
        assert_eq!((state.fault, state.homed), (Fault::LimitSwitch, AxisSet::NONE));
        assert_eq!(bench.board.position_m(), stopped);
    }

    #[test]
    fn steps_that_slip_are_unknown_until_it_homes() {
        let mut bench = Bench::new(NativeStageSetup::default());
        bench.greet();
        let before = bench.home();
        let at = bench.board.position_m();
        bench.step(&[], Events { slip: [160, 0], ..Events::default() });
        assert!((bench.board.position_m()[0] - at[0] - 1e-4).abs() < 1e-12);
        assert_eq!(bench.state().position_nm, before.position_nm);
        bench.home();
        assert!((bench.board.position_m()[0] - at[0]).abs() <= 2.0 * ZERO_M);
    }

    #[test]
    fn a_reset_forgets_everything_but_the_place() {
        let setup = NativeStageSetup { boot: Duration::from_millis(20), ..Default::default() };
        let mut bench = Bench::new(setup);
        for _ in 0..40 {
            bench.step(&[], Events::default());
        }
        bench.greet();
        bench.home();
        bench.move_to([30_000_000, 10_000_000]);
        for _ in 0..100 {
            bench.step(&[], Events::default());
        }
        let at = bench.board.position_m();
        bench.step(&[], Events { reset: Some(ResetCause::Watchdog), ..Events::default() });
        bench.host = Host::new(78, Patience::default());
        for _ in 0..40 {
            bench.step(&[], Events::default());
        }
        bench.greet();
        let identity = bench.host.identity().expect("it was greeted");
        assert_eq!((identity.boot_count, identity.reset_cause), (2, ResetCause::Watchdog));
        assert_eq!((bench.state().homed, bench.board.position_m()), (AxisSet::NONE, at));
    }

    #[test]
    fn one_seed_gives_the_same_bytes() {
        let talk = |seed| {
            let mut bench = Bench::new(NativeStageSetup { seed, ..Default::default() });
            bench.greet();
            bench.ask(Request::Telemetry { period_ms: 10 });
            bench.faults.corrupt_share = 0.01;
            for _ in 0..1000 {
                bench.step(&[], Events::default());
            }
            bench.said
        };
        assert!(talk(1) == talk(1) && talk(1) != talk(2));
    }

    #[test]
    fn another_table_is_claimed_by_its_number() {
        let mut bench = Bench::new(NativeStageSetup { other_schema: Some(5), ..Default::default() });
        let hello = bench.host.hello(0);
        bench.say(hello);
        assert_eq!(bench.host.identity().map(|identity| identity.schema_hash), Some(5));
    }
}
