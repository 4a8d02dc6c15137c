//! Does the driver do what it should when single messages are lost, come twice or say something else? Asked over a port of its own,
//! with the reference controller behind it and every message in the hands of the test.

use super::connect::{NativeOptions, connect_through};
use super::stage::NativeStage;
use crate::clock::HostTime;
use crate::clock::steady::steady;
use crate::device::{DeviceError, Motion, Stage, StageReport, StageState};
use crate::driver::DriverError;
use crate::driver::port::BytePort;
use firmware_proto::{
    Activity, AxisLimits, AxisSet, Config, Controller, Decoder, EMERGENCY_STOP, Heard, HomingConfig, Host,
    Identity, Name, Outcome, Patience, Reason, Refusal, Request, ResetCause, Response, State, Switches,
};
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// What becomes of a message on its way: the messages that arrive in its place.
type Way<M> = Box<dyn FnMut(M) -> Vec<M> + Send>;

/// A controller on the other side of the table.
struct Desk {
    controller: Controller,
    began: HostTime,
    requests: Decoder,
    answers: Decoder,
    there: Way<Request>,
    back: Way<Response>,
    /// Emergency patterns that are still to be lost.
    lose_patterns: u32,
    /// The next read fails.
    broken: Arc<AtomicBool>,
    /// Bytes on their way back.
    waiting: Vec<u8>,
}

#[derive(Clone)]
struct Port(Arc<Mutex<Desk>>);

impl Desk {
    fn pass(&mut self) -> u32 {
        let now_us = (HostTime::now().since(self.began).as_micros()) as u32;
        // The low switches are half a millimetre below where the stage stands at first.
        let low = AxisSet::of(self.controller.step_counters().map(|steps| steps <= -800));
        self.controller.advance(now_us, Switches { low, high: AxisSet::NONE });
        now_us
    }

    fn carry_there(&mut self, bytes: &[u8]) {
        let now_us = self.pass();
        if bytes.starts_with(&EMERGENCY_STOP) {
            if self.lose_patterns > 0 {
                self.lose_patterns -= 1;
            } else {
                self.controller.receive(bytes, now_us);
            }
            return;
        }
        for byte in bytes {
            let Some(frame) = self.requests.feed(*byte) else { continue };
            let request = Request::decode(&frame).expect("the driver sends what the table has");
            for arriving in (self.there)(request) {
                self.controller.receive(arriving.encode(frame.stamp).as_bytes(), now_us);
            }
        }
        self.carry_back();
    }

    fn carry_back(&mut self) {
        let mut room = [0; 96];
        loop {
            let count = self.controller.output(&mut room);
            for byte in &room[..count] {
                let Some(frame) = self.answers.feed(*byte) else { continue };
                let answer = Response::decode(&frame).expect("the controller sends what the table has");
                let arriving = (self.back)(answer).into_iter().map(|answer| answer.encode(frame.stamp));
                self.waiting.extend(arriving.flat_map(|frame| frame.as_bytes().to_vec()));
            }
            if count == 0 {
                return;
            }
        }
    }
}

impl Port {
    fn desk<T>(&self, look: impl FnOnce(&mut Desk) -> T) -> T {
        look(&mut self.0.lock().expect("no test panics inside"))
    }
}

impl BytePort for Port {
    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> io::Result<usize> {
        if self.desk(|desk| desk.broken.swap(false, Ordering::AcqRel)) {
            return Err(io::ErrorKind::BrokenPipe.into());
        }
        let until = HostTime::now() + wait;
        loop {
            let count = self.desk(|desk| {
                desk.pass();
                desk.carry_back();
                let count = desk.waiting.len().min(buffer.len());
                buffer[..count].copy_from_slice(&desk.waiting[..count]);
                desk.waiting.drain(..count);
                count
            });
            if count > 0 || until.remaining().is_zero() {
                return Ok(count);
            }
            std::thread::sleep(until.remaining().min(Duration::from_micros(500)));
        }
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.desk(|desk| desk.carry_there(bytes));
        Ok(())
    }

    fn second(&self) -> io::Result<Box<dyn BytePort>> {
        Ok(Box::new(self.clone()))
    }
}

fn port() -> Port {
    let axis = AxisLimits {
        travel_low_um: 0,
        travel_high_um: 50_000,
        max_speed_um_s: 50_000,
        max_acceleration_um_s2: 1_000_000,
        steps: 1600,
        per_mm: 1,
    };
    let config = Config {
        axes: [axis; 2],
        emergency_um_s2: 1_000_000,
        homing: HomingConfig {
            fast_um_s: 10_000,
            slow_um_s: 5000,
            acceleration_um_s2: 500_000,
            back_off_um: 300,
        },
        unhomed_speed_um_s: 1000,
        unhomed_distance_um: 2000,
        name: Name::new("desk"),
        firmware_hash: 9,
        boot_count: 4,
        reset_cause: ResetCause::PowerOn,
    };
    Port(Arc::new(Mutex::new(Desk {
        controller: Controller::new(config, 0).expect("a sound configuration"),
        began: HostTime::now(),
        requests: Decoder::new(),
        answers: Decoder::new(),
        there: Box::new(|request| vec![request]),
        back: Box::new(|answer| vec![answer]),
        lose_patterns: 0,
        broken: Arc::default(),
        waiting: Vec::new(),
    })))
}

/// Long leases: a test that runs beside others may have to wait for a processor.
fn options() -> NativeOptions {
    NativeOptions {
        lease: Duration::from_millis(1000),
        reports: Duration::from_millis(10),
        patience: Duration::from_millis(100),
        greeting: Duration::from_millis(400),
        ..NativeOptions::new("a desk")
    }
}

fn connect(port: &Port) -> Result<NativeStage, DriverError> {
    connect_through(Box::new(port.clone()), &options())
        .map(|connection| NativeStage::new(connection, &options()))
}

/// The first report that is as wanted; nothing here takes 20 s.
fn wait(stage: &mut NativeStage, wanted: impl Fn(&StageReport) -> bool) -> StageReport {
    let until = HostTime::now() + Duration::from_secs(20);
    loop {
        let report = stage.report(until).expect("nothing fails").expect("it comes in time");
        if wanted(&report) {
            return report;
        }
    }
}

fn homed(port: &Port) -> NativeStage {
    let mut stage = connect(port).expect("a sound controller");
    stage.home().expect("it may home");
    wait(&mut stage, |report| report.homed && report.state == StageState::Idle);
    stage
}

fn far() -> Motion {
    Motion { target_m: [0.05, 0.05], speed_m_s: 0.02, acceleration_m_s2: 0.5 }
}

fn state(port: &Port) -> State {
    port.desk(|desk| desk.controller.state())
}

/// A controller whose identity is changed on its way, and whose limits become something else.
fn claiming(change: fn(&mut Identity), limits: fn() -> Vec<Response>) -> Port {
    let port = port();
    port.desk(|desk| {
        desk.back = Box::new(move |answer| match answer {
            Response::Identity { mut identity } => {
                change(&mut identity);
                vec![Response::Identity { identity }]
            }
            Response::Axis { .. } => limits(),
            other => vec![other],
        });
    });
    port
}

#[test]
fn a_version_that_cannot_be_talked_to_is_named() {
    steady(|| {
        let other = |identity: &mut Identity| identity.schema_hash = 5;
        let major = || {
            let refusal = Refusal { reason: Reason::MajorMismatch, axis: 255, limit: 2, asked: 1 };
            vec![Response::Refused { request: Request::Describe { axis: 0 }.kind(), refusal }]
        };
        let error = connect(&claiming(other, major)).err().expect("another version");
        assert!(matches!(error, DriverError::NativeMajor { major: 2, ours: 1, .. }), "{error}");
        let error = connect(&claiming(other, Vec::new)).err().expect("another table");
        assert!(matches!(error, DriverError::NativeSchema { firmware: 9, schema: 5, .. }), "{error}");
        let weak = |identity: &mut Identity| identity.capabilities = 0b00111;
        let error = connect(&claiming(weak, Vec::new)).err().expect("no emergency pattern");
        assert!(
            matches!(error, DriverError::NativeCapability { missing: "EmergencyPattern", .. }),
            "{error}"
        );
    });
}

/// An accepted move of which the host never hears has to end, and not because a lease runs out.
#[test]
fn a_motion_without_an_answer_is_called_off() {
    steady(|| {
        let port = port();
        let mut stage = homed(&port);
        port.desk(|desk| {
            desk.back = Box::new(|answer| match answer {
                Response::Accepted { motion: 2, request } if request != (Request::Stop {}).kind() => {
                    Vec::new()
                }
                other => vec![other],
            });
        });
        let error = stage.move_to(far()).expect_err("no answer");
        assert!(matches!(error, DeviceError::Silent { .. }), "{error}");
        wait(&mut stage, |report| report.state == StageState::Idle);
        let state = state(&port);
        assert_eq!((state.activity, state.outcome), (Activity::Idle, Outcome::Stopped));
        assert!(state.position_nm[0] < 50_000_000, "{}", state.position_nm[0]);
    });
}

/// Nobody knows whether a motion runs that was sent over a port that failed before the answer came.
#[test]
fn a_motion_is_called_off_when_the_port_fails() {
    steady(|| {
        let port = port();
        let mut stage = homed(&port);
        port.desk(|desk| {
            let broken = desk.broken.clone();
            desk.there = Box::new(move |request| {
                broken.fetch_or(matches!(request, Request::Move { .. }), Ordering::AcqRel);
                vec![request]
            });
        });
        let error = stage.move_to(far()).expect_err("the port failed");
        assert!(matches!(error, DeviceError::Lost { .. }), "{error}");
        let state = state(&port);
        assert!(matches!(state.activity, Activity::Stopping | Activity::Idle), "{state:?}");
        wait(&mut stage, |report| report.state == StageState::Idle);
    });
}

/// The acknowledgement of an emergency stop and the news of its fault come back to back. The stage is braking all the while.
#[test]
fn a_stop_tells_no_moment_twice() {
    steady(|| {
        let port = port();
        let mut stage = homed(&port);
        let stopper = stage.stopper().expect("the port opens twice");
        stage.move_to(far()).expect("it may move");
        wait(&mut stage, |report| report.position_m[0] > 0.003);
        stopper.stop_now().expect("the desk takes it");
        let mut last = wait(&mut stage, |_| true);
        while !matches!(last.state, StageState::Fault { .. }) || state(&port).activity != Activity::Idle {
            let next = wait(&mut stage, |_| true);
            assert_ne!(next.tick_us, last.tick_us, "{next:?}");
            last = next;
        }
    });
}

#[test]
fn the_stop_is_said_again_until_it_is_heard() {
    steady(|| {
        let port = port();
        let mut stage = homed(&port);
        let stopper = stage.stopper().expect("the port opens twice");
        stage.move_to(far()).expect("it may move");
        port.desk(|desk| desk.lose_patterns = 4);
        stopper.stop_now().expect("the desk takes it");
        let report = wait(&mut stage, |report| matches!(report.state, StageState::Fault { .. }));
        assert_eq!(report.state, StageState::Fault { code: 4 });
        wait(&mut stage, |_| state(&port).activity == Activity::Idle);
        stage.clear().expect("at rest");
        stage.move_to(far()).expect("cleared");
    });
}

/// What a person has not cleared stays latched in the host, whatever becomes of the pattern and of the controller.
#[test]
fn after_a_stop_that_nobody_heard_nothing_moves() {
    steady(|| {
        let port = port();
        let mut stage = homed(&port);
        let stopper = stage.stopper().expect("the port opens twice");
        port.desk(|desk| desk.lose_patterns = u32::MAX);
        stopper.stop_now().expect("the desk takes it");
        let error = stage.move_to(far()).expect_err("stopped");
        assert!(matches!(error, DeviceError::Fault { code: 4, .. }), "{error}");
        assert!(matches!(stage.clear(), Err(DeviceError::Silent { .. })), "a stop that is not acknowledged");
        assert_eq!(state(&port).activity, Activity::Idle);
    });
}

#[test]
fn what_comes_twice_is_reported_once() {
    steady(|| {
        let port = port();
        // A board that does not get to run in time skips reports by itself.
        let (twice, sent) = (Arc::new(AtomicBool::new(false)), Arc::new(Mutex::new(Vec::new())));
        port.desk(|desk| {
            let (twice, sent) = (Arc::clone(&twice), Arc::clone(&sent));
            desk.back = Box::new(move |answer| {
                if let Response::Telemetry { counter, .. } = answer {
                    sent.lock().expect("no test panics inside").push(counter);
                }
                vec![answer; 1 + usize::from(twice.load(Ordering::Acquire))]
            });
        });
        let mut stage = homed(&port);
        twice.store(true, Ordering::Release);
        let mut last = None;
        for _ in 0..10 {
            let report = wait(&mut stage, |_| true);
            assert!(last.is_none_or(|last| last != report.tick_us));
            last = Some(report.tick_us);
        }
        stage.ping().expect("one of two answers will do");
        let losses = stage.losses();
        assert!(losses.streamed_late >= 9 && losses.unasked >= 1, "{losses:?}");
        let skipped: u32 =
            sent.lock().expect("no test panics inside").windows(2).map(|n| n[1] - n[0] - 1).sum();
        assert!(losses.streamed_lost <= u64::from(skipped), "{losses:?}, {skipped} skipped");
    });
}

#[test]
fn a_session_that_another_program_opens_is_lost_not_taken_back() {
    steady(|| {
        let port = port();
        let mut stage = homed(&port);
        let mut other = Host::new(0xABCD, Patience::default());
        for _ in 0..2 {
            let hello = other.hello(0);
            port.desk(|desk| {
                let now_us = desk.pass();
                desk.controller.receive(hello.as_bytes(), now_us);
                let mut room = [0; 512];
                let count = desk.controller.output(&mut room);
                let heard = room[..count].iter().filter_map(|byte| other.hear(*byte));
                assert!(heard.filter(|heard| matches!(heard, Heard::Answer { .. })).count() == 1);
            });
        }
        assert!(other.is_open());
        for _ in 0..2 {
            let error = stage.move_to(far()).expect_err("not ours any more");
            let said = format!("{error}: {:?}", std::error::Error::source(&error).map(ToString::to_string));
            assert!(said.contains("another program"), "{said}");
        }
        stage.stop().expect("whoever is there may stop it");
    });
}
