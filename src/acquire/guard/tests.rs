//! Each reason to stop, on a sensor that plays a script.

use super::super::latch::tests::Counted;
use super::*;
use crate::device::{ClockComparison, ForceIdentity, Losses};
use std::sync::Arc;
use std::sync::atomic::AtomicU32;

/// Says what it is told to, batch by batch, and then nothing; ends the watch when it is through.
struct Scripted {
    identity: ForceIdentity,
    format: ForceFormat,
    batches: std::vec::IntoIter<Vec<ForceRecord>>,
    /// What happens after the last batch.
    then: Then,
    over: Arc<AtomicBool>,
}

#[derive(Clone, Copy, PartialEq)]
enum Then {
    Over,
    Silence,
    Lost,
}

impl ForceSensor for Scripted {
    fn identity(&self) -> &ForceIdentity {
        &self.identity
    }
    fn format(&self) -> &ForceFormat {
        &self.format
    }
    fn start(&mut self) -> Result<(), DeviceError> {
        Ok(())
    }
    fn clock_at_start(&self) -> Option<ClockComparison> {
        None
    }
    fn stop(&mut self) -> Result<(), DeviceError> {
        Ok(())
    }
    fn bias(&mut self) -> Result<(), DeviceError> {
        Ok(())
    }
    fn clear_latch(&mut self) -> Result<(), DeviceError> {
        Ok(())
    }
    fn receive(&mut self, until: HostTime, records: &mut Vec<ForceRecord>) -> Result<(), DeviceError> {
        match (self.batches.next(), self.then) {
            (Some(mut batch), _) => {
                let now = HostTime::now();
                batch.iter_mut().for_each(|r| r.host = now);
                records.append(&mut batch);
            }
            (None, Then::Over) => self.over.store(true, Ordering::Release),
            (None, Then::Silence) => std::thread::sleep(until.remaining()),
            (None, Then::Lost) => {
                let source = std::io::Error::from(std::io::ErrorKind::ConnectionReset);
                return Err(DeviceError::Lost { device: "sensor".to_owned(), source });
            }
        }
        Ok(())
    }
    fn losses(&self) -> Losses {
        Losses::default()
    }
    fn explain(&self, _: u32) -> Vec<&'static str> {
        Vec::new()
    }
}

const FORMAT: ForceFormat = ForceFormat {
    counts_per_newton: 1e6,
    counts_per_newton_metre: 1e6,
    rate_hz: 7000.0,
    tick_hz: 7000.0,
    range: None,
    stop_mask: 0x8000_0000,
};

const LIMITS: Limits = Limits {
    wrench: [2.0, 2.0, 5.0, 0.1, 0.1, 0.1],
    zero: [1000.0, 0.0, -2_000_000.0, 0.0, 0.0, 0.0],
    silence: Duration::from_millis(30),
    age: Duration::from_millis(40),
    gap: 20,
    frozen: 5,
};

fn record(number: u32, tick: u32, counts: [i32; 6]) -> ForceRecord {
    ForceRecord { host: HostTime::from_nanos(0), rdt_sequence: number, ft_sequence: tick, status: 0, counts }
}

/// What the watch ends with: the cause, records handed on, stops sent, and whether the sensor was lost.
fn watched(batches: Vec<Vec<ForceRecord>>, then: Then) -> (Option<Cause>, usize, u32, bool) {
    let over = Arc::new(AtomicBool::new(false));
    let stops = Arc::new(AtomicU32::new(0));
    let latch = Latch::new(Box::new(Counted(stops.clone())));
    let identity = ForceIdentity {
        product: String::new(),
        calibration: String::new(),
        configuration: String::new(),
        address: String::new(),
    };
    let batches = batches.into_iter();
    let mut sensor = Scripted { identity, format: FORMAT, batches, then, over: over.clone() };
    let live = LiveForce::new([0; 6], 7000.0);
    let mut handed = 0;
    let ended = watch(&mut sensor, LIMITS, &latch, &live, &over, |records| {
        handed += records.len();
        // A silent sensor is watched until it has tripped.
    });
    let lost = ended.is_err();
    (latch.tripped().map(|t| t.cause), handed, stops.load(Ordering::SeqCst), lost)
}

fn quiet(count: u32) -> Vec<ForceRecord> {
    (1..=count).map(|n| record(n, n + 70, [0, 0, -2_000_000, 0, 0, 0])).collect()
}

#[test]
fn a_sound_stream_within_the_limits_trips_nothing_and_is_handed_on_whole() {
    // Just inside on both sides of a zero that is not zero.
    let edge = vec![
        record(101, 171, [2_001_000, 0, 3_000_000, 0, 0, 0]),
        record(102, 172, [-1_999_000, 0, -7_000_000, 0, 0, 0]),
    ];
    assert_eq!(watched(vec![quiet(100), edge], Then::Over), (None, 102, 0, false));
}

#[test]
fn a_force_beyond_its_limit_stops_the_stage_and_the_rest_is_still_recorded() {
    let beyond = record(3, 73, [0, 0, 3_000_001, 0, 0, 0]);
    let after = record(4, 74, [0, 0, -2_000_000, 0, 0, 0]);
    let (cause, handed, stops, _) = watched(vec![quiet(2), vec![beyond, after]], Then::Over);
    match cause {
        Some(Cause::Limit { axis: 2, value, limit: 5.0 }) => assert!((value - 5.000_001).abs() < 1e-12),
        other => panic!("{other:?}"),
    }
    assert_eq!((handed, stops), (4, 1));
}

#[test]
fn every_other_fault_of_the_sensor_is_told_by_name() {
    let next = |n, tick| vec![record(n, tick, [0, 0, -2_000_000, 0, 0, 0])];
    let mut status = next(3, 73);
    status[0].status = 0x8000_0002;
    let frozen = (3..9).map(|n| record(n, 72, [0, 0, -2_000_000, 0, 0, 0])).collect();
    for (batch, expected) in [
        (status, Cause::SensorStatus { status: 0x8000_0002 }),
        (next(24, 94), Cause::SensorGap { records: 21 }),
        (frozen, Cause::SensorFrozen),
        (next(1, 9000), Cause::SensorRestarted),
    ] {
        let (cause, _, stops, _) = watched(vec![quiet(2), batch], Then::Over);
        assert_eq!((cause, stops), (Some(expected), 1));
    }
    // Not yet a reason: as many as allowed.
    assert_eq!(watched(vec![quiet(2), next(23, 93)], Then::Over).0, None);
    let standing = (3..8).map(|n| record(n, 72, [0, 0, -2_000_000, 0, 0, 0])).collect();
    assert_eq!(watched(vec![quiet(2), standing], Then::Over).0, None);
}

#[test]
fn a_lost_sensor_and_a_silent_one_stop_the_stage() {
    let (cause, handed, stops, lost) = watched(vec![quiet(5)], Then::Lost);
    assert_eq!((cause, handed, stops, lost), (Some(Cause::SensorLost), 5, 1, true));

    let over = Arc::new(AtomicBool::new(false));
    let latch = Arc::new(Latch::new(Box::new(Counted(Arc::new(AtomicU32::new(0))))));
    let (end, seen) = (over.clone(), latch.clone());
    let ender = std::thread::spawn(move || {
        let deadline = HostTime::now() + Duration::from_secs(20);
        while seen.tripped().is_none() && HostTime::now() < deadline {
            std::thread::yield_now();
        }
        end.store(true, Ordering::Release);
    });
    let identity = ForceIdentity {
        product: String::new(),
        calibration: String::new(),
        configuration: String::new(),
        address: String::new(),
    };
    let batches = vec![quiet(5)].into_iter();
    let mut sensor = Scripted { identity, format: FORMAT, batches, then: Then::Silence, over: over.clone() };
    watch(&mut sensor, LIMITS, &latch, &LiveForce::new([0; 6], 7000.0), &over, |_| {}).expect("not lost");
    ender.join().expect("ended");
    match latch.tripped().map(|t| t.cause) {
        Some(Cause::SensorSilent { for_ms }) => assert!(for_ms >= 30, "{for_ms}"),
        other => panic!("{other:?}"),
    }
}

/// 1000 records a second for 300 s, each so much later than it was felt: what matters is how old the latest is, not how many come at once.
#[test]
fn a_stream_that_falls_behind_stops_the_stage_and_one_that_catches_up_does_not() {
    let judged = |late_ms: &dyn Fn(f64) -> f64| {
        let format = ForceFormat { rate_hz: 1000.0, tick_hz: 1000.0, ..FORMAT };
        let mut judge = Judge::new(LIMITS, format);
        (1..=300_000_u32).find_map(|n| {
            let felt_s = f64::from(n) / 1000.0;
            let arrives_ns = (felt_s * 1e9 + late_ms(felt_s) * 1e6) as u64;
            let host = HostTime::from_nanos(1_000_000_000 + arrives_ns);
            let cause =
                judge.cause(&ForceRecord { host, ..record(n, n + 70, [1000, 0, -2_000_000, 0, 0, 0]) });
            cause.map(|cause| (felt_s, cause))
        })
    };
    // A clock that is 0.018 % slow: 54 ms in the end, more than a record may be old.
    assert_eq!(judged(&|t| 0.18 * t), None);
    // A network that varies, and one that holds records up for 28 ms again and again, longer than may be each time but soon over.
    assert_eq!(judged(&|t| 20.0 * (40.0 * t).sin().abs()), None);
    assert_eq!(judged(&|t| if t % 0.1 < 0.028 { 45.0 } else { 0.0 }), None);
    // Half a second of standing still after which all comes at once.
    assert_eq!(judged(&|t| if (1.0..1.5).contains(&t) { 1e3 * (1.5 - t) } else { 0.0 }), None);
    // Records that are 41 ms old for longer than 30 ms.
    match judged(&|t| if t < 1.0 { 3.0 } else { 44.0 }) {
        Some((felt_s, Cause::SensorLate { by_ms: 40 })) => {
            assert!((1.03..1.04).contains(&felt_s), "{felt_s}")
        }
        other => panic!("{other:?}"),
    }
    // A sender that keeps up with only 95 % of them, and one that loses a thousandth.
    for (behind_ms, s) in [(50.0, 0.8..0.95), (1.0, 50.0..51.0)] {
        match judged(&|t| behind_ms * t) {
            Some((felt_s, Cause::SensorLate { .. })) => assert!(s.contains(&felt_s), "{felt_s}"),
            other => panic!("{other:?}"),
        }
    }
}

/// After a stop at 5 N the way out may press as hard as before and a tenth of the limit more; a sensor that lies is no reason to stay.
#[test]
fn on_the_way_out_only_more_force_than_before_stops() {
    let mut judge = Judge::new(LIMITS, FORMAT);
    let at = |n: u32, z: i32| record(n, n + 70, [1000, 0, -2_000_000 + z, 0, 0, 0]);
    assert!(matches!(judge.cause(&at(1, 5_200_000)), Some(Cause::Limit { axis: 2, .. })));
    judge.widen([0, 0, 5_300_000, 0, 0, 0]);
    assert_eq!(judge.cause(&at(2, 5_700_000)), None);
    assert_eq!(judge.cause(&ForceRecord { status: 0x8000_0002, ..at(2, 0) }), None);
    assert!(matches!(judge.cause(&at(3, 5_900_000)), Some(Cause::Limit { axis: 2, .. })));
    assert!(matches!(
        judge.cause(&record(4, 74, [2_300_000, 0, -2_000_000, 0, 0, 0])),
        Some(Cause::Limit { axis: 0, .. })
    ));
}
