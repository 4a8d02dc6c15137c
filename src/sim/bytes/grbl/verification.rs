//! The emulated controller against the published interface and closed forms, on a clock advanced by hand.

use super::{GrblDialect, GrblMachine, GrblSetup};
use GrblDialect::{Classic, Hal};
use std::time::Duration;

/// Length of a step on the bench (mm): what a report may be off by.
const STEP_MM: f64 = 1.0 / 400.0;

struct Bench {
    machine: GrblMachine,
}

impl Bench {
    fn with(setup: GrblSetup) -> Self {
        let mut bench = Self { machine: GrblMachine::new(setup) };
        bench.wait(0.2);
        bench
    }

    fn new(dialect: GrblDialect) -> Self {
        Self::with(GrblSetup::bench(dialect))
    }

    fn homed(dialect: GrblDialect) -> Self {
        let mut bench = Self::new(dialect);
        assert!(bench.say("$H\n").iter().all(|line| line.starts_with('<')));
        assert_eq!(bench.wait(20.0).last().map(String::as_str), Some("ok"));
        bench
    }

    fn wait(&mut self, seconds: f64) -> Vec<String> {
        self.machine.advance(Duration::from_secs_f64(seconds));
        self.machine.take_output().lines().filter(|line| !line.is_empty()).map(str::to_owned).collect()
    }

    /// Sends bytes and lets pass the 1 ms that reading a line takes.
    fn say(&mut self, text: &str) -> Vec<String> {
        self.machine.receive(text.as_bytes());
        self.wait(0.001)
    }

    fn byte(&mut self, byte: u8) -> Vec<String> {
        self.machine.receive(&[byte]);
        self.wait(0.0)
    }

    fn report(&mut self) -> String {
        self.byte(b'?').concat()
    }

    /// Machine coordinates of X and Z as reported (mm).
    fn reported(&mut self) -> [f64; 2] {
        let report = self.report();
        let position =
            report.split("MPos:").nth(1).and_then(|rest| rest.split('|').next()).expect("a position");
        let mm: Vec<f64> = position.split(',').map(|x| x.parse().expect("a number")).collect();
        [mm[0], mm[2]]
    }

    fn x_mm(&self) -> f64 {
        self.machine.position_m()[0] * 1e3
    }
}

/// Distance after `t` of a trapezoid (textbook form, independent of the emulator's phases).
fn trapezoid(length: f64, top: f64, a: f64, t: f64) -> f64 {
    let ramp = top / a;
    let total = length / top + ramp;
    if t <= ramp {
        0.5 * a * t * t
    } else if t <= total - ramp {
        top * (t - 0.5 * ramp)
    } else if t < total {
        length - 0.5 * a * (total - t).powi(2)
    } else {
        length
    }
}

#[test]
fn a_jog_is_a_trapezoid() {
    let mut bench = Bench::homed(Classic);
    // From -1 to -21 mm at 10 mm/s and 200 mm/s²: 2.05 s.
    assert_eq!(bench.say("$J=G53G21G90X-21F600\n"), ["ok"]);
    for k in 0..=210 {
        let t = 0.01 * f64::from(k);
        let expected = -1.0 - trapezoid(20.0, 10.0, 200.0, t);
        assert!((bench.x_mm() - expected).abs() < 1e-9, "{} instead of {expected} after {t} s", bench.x_mm());
        assert!((bench.reported()[0] - expected).abs() <= 0.5 * STEP_MM + 0.0005);
        let word = if t < 2.05 - 1e-9 { "<Jog|" } else { "<Idle|" };
        assert!(bench.report().starts_with(word), "{} after {t} s", bench.report());
        bench.wait(0.01);
    }
}

/// The feed is the speed along the path, and no axis exceeds its own speed or acceleration (gnea/grbl, planner).
#[test]
fn speed_and_acceleration_are_those_of_the_path() {
    let mut bench = Bench::homed(Hal);
    bench.say("$120=100\n");
    // 3:4:5 triangle: 15 mm along X, 20 mm along Z. X allows 100/0.6 = 167, Z 200/0.8 = 250 mm/s² along the path.
    bench.say("$J=G53X-16Z-21F600\n");
    for k in 0..=30 {
        let t = 0.1 * f64::from(k);
        let path = trapezoid(25.0, 10.0, 100.0 / 0.6, t);
        let [x, z] = bench.machine.position_m().map(|m| m * 1e3);
        assert!(
            (x - (-1.0 - 0.6 * path)).abs() < 1e-9 && (z - (-1.0 - 0.8 * path)).abs() < 1e-9,
            "after {t} s"
        );
        bench.wait(0.1);
    }
    // 25 mm/s an axis: 25/0.8 along the path, whatever the feed.
    bench.say("$J=G53X-1Z-1F9000\n");
    bench.wait(0.5);
    assert!((bench.machine.speed_mm_s() - 25.0 / 0.8).abs() < 1e-9);
}

/// How far the bench goes at 10 mm/s after it was told to brake: the motion prepared, and v²/2a = 100/400 mm.
fn braking_mm(dialect: GrblDialect) -> f64 {
    10.0 * GrblSetup::bench(dialect).prepared.as_secs_f64() + 0.25
}

#[test]
fn cancelling_a_jog_brakes_and_drops_what_is_queued() {
    for (dialect, byte) in [(Classic, 0x85), (Hal, 0x85), (Classic, b'!')] {
        let mut bench = Bench::homed(dialect);
        bench.say("$J=G53X-50F600\n");
        assert_eq!(bench.say("$J=G53X-1F600\n"), ["ok"]);
        bench.wait(1.0);
        let at = bench.x_mm();
        bench.byte(byte);
        bench.wait(2.0);
        let farther = at - bench.x_mm();
        assert!((farther - braking_mm(dialect)).abs() < 1e-9, "{dialect:?}: {farther} mm farther");
        assert!(bench.report().starts_with("<Idle|"));
    }
}

/// The race that users of Grbl report: 0x85 does not cancel a jog that the controller has not read yet. grblHAL drops it.
#[test]
fn a_cancellation_that_overtakes_a_jog_is_lost_on_grbl() {
    let mut setup = GrblSetup::bench(Classic);
    setup.reading = Duration::from_millis(20);
    for (dialect, expected) in [(Classic, -11.0), (Hal, -1.0)] {
        let mut bench = Bench::with(GrblSetup { dialect, ..setup.clone() });
        bench.machine.receive(b"$H\n");
        bench.wait(20.0);
        bench.machine.receive(b"$J=G53X-11F600\n\x85");
        let replies = bench.wait(5.0);
        assert_eq!(replies.len(), usize::from(dialect == Classic));
        assert!((bench.x_mm() - expected).abs() < 1e-9, "{dialect:?}");
    }
}

#[test]
fn homing_ends_a_pull_off_from_the_switches_after_the_time_it_takes() {
    let mut bench = Bench::new(Classic);
    bench.say("$H\n");
    // Axes at 25 and, slowly, at 100/60 mm/s; Z 4 mm and X 12 mm from their switches; 1 mm off, 25 ms of rest after each leg.
    let cycle = |far: f64| far / 25.0 + 2.0 / 25.0 + 60.0 / 100.0 + 4.0 * 0.025;
    let expected = cycle(4.0) + cycle(12.0);
    assert_eq!(bench.wait(expected - 0.01), Vec::<String>::new());
    assert!(bench.byte(b'?').is_empty(), "Grbl does not report while homing");
    let end = bench.wait(0.02);
    assert_eq!(end.len(), 2, "{end:?}");
    assert!(end[0].starts_with("<Home|") && end[1] == "ok");
    assert_eq!(bench.reported(), [-1.0, -1.0]);
    assert!(bench.machine.position_m().iter().all(|x| (x + 1e-3).abs() < 1e-12));
}

#[test]
fn homing_that_finds_no_switch_is_alarm_9() {
    let mut bench = Bench::new(Classic);
    bench.machine.break_switches();
    bench.say("$H\n");
    let said = bench.wait(60.0);
    assert_eq!(said[0], "ALARM:9");
    assert!(said[1].starts_with("Grbl 1.1h") && said[2].contains("to unlock"));
}

/// Facts seen on both: an unhomed grblHAL jogs out of its travel.
#[test]
fn soft_limits_before_homing_differ_by_dialect() {
    let jog = "$J=G91X-150F600\n";
    for (dialect, first) in [(Classic, "error:15"), (Hal, "ok")] {
        let mut setup = GrblSetup::bench(dialect);
        assert_eq!(Bench::with(setup.clone()).say(jog), ["error:8"], "locked");
        // Neither insists on homing.
        setup.settings.insert(22, 1.0);
        let mut bench = Bench::with(setup);
        bench.say("$X\n");
        assert_eq!(bench.say(jog), [first]);
        let mut homed = Bench::homed(dialect);
        assert_eq!(homed.say(jog), ["error:15"]);
    }
}

/// Seen on grblHAL with $22=5: it insists on homing at each start, and nothing else unlocks it.
#[test]
fn grblhal_insists_on_homing() {
    let mut bench = Bench { machine: GrblMachine::new(GrblSetup::bench(Hal)) };
    let said = bench.wait(0.2);
    assert!(said[0].starts_with("GrblHAL") && said[1] == "ALARM:11", "{said:?}");
    assert_eq!(bench.say("$X\n"), ["error:46"]);
    assert!(bench.report().starts_with("<Alarm|") && bench.byte(0x87).concat().starts_with("<Alarm:11|"));
    assert!(!bench.byte(0x18).contains(&"ALARM:11".to_owned()), "said already");
    bench.say("$H\n");
    assert_eq!(bench.wait(20.0).last().map(String::as_str), Some("ok"));
    assert!(bench.report().starts_with("<Idle|"));
}

#[test]
fn a_limit_switch_stops_it_until_it_is_reset() {
    for dialect in [Classic, Hal] {
        let mut setup = GrblSetup::bench(dialect);
        setup.settings.extend([(20, 0.0), (22, 1.0)]);
        let mut bench = Bench::with(setup);
        bench.say("$X\n");
        // 12 mm from the switch.
        bench.say("$J=G91X30F600\n");
        let said = bench.wait(5.0);
        assert_eq!(said[0], "ALARM:1");
        assert!(bench.x_mm() > 0.0 && bench.x_mm() < 0.1, "{} mm", bench.x_mm());
        assert_eq!(bench.report().is_empty(), dialect == Classic);
        let unlock = bench.say("$X\n");
        assert_eq!(unlock, if dialect == Hal { vec!["error:79"] } else { vec![] });
        let banner = bench.byte(0x18);
        assert!(banner.iter().any(|line| line.starts_with("Grbl")), "{banner:?}");
        assert_eq!(bench.say("$X\n").last().map(String::as_str), Some("ok"));
        // 10 mm/s for 2 ms after the pulses ended, where its own zero is 12 mm below the switch.
        let believed = bench.reported()[0] - 12.0;
        assert!((bench.x_mm() - believed - 0.02).abs() < STEP_MM, "{believed} and {}", bench.x_mm());
    }
}

#[test]
fn a_reset_in_motion_loses_the_position_and_one_at_rest_keeps_it() {
    let mut bench = Bench::homed(Classic);
    let still = bench.byte(0x18);
    assert!(!still.iter().any(|line| line.starts_with("ALARM")));
    assert_eq!(bench.reported(), [-1.0, -1.0]);
    bench.say("$J=G53X-50F1500\n");
    bench.wait(1.0);
    let said = bench.byte(0x18);
    assert_eq!(said[0], "ALARM:3");
    assert!(said[1].starts_with("Grbl"));
    assert!(bench.report().starts_with("<Alarm|"));
    // 25 mm/s for 2 ms.
    assert!((bench.reported()[0] - bench.x_mm() - 0.05).abs() < STEP_MM);
}

#[test]
fn the_safety_door_latches_standing_and_moving() {
    for dialect in [Classic, Hal] {
        let mut bench = Bench::homed(dialect);
        bench.byte(0x84);
        assert!(bench.report().starts_with("<Door:0|"));
        assert!(bench.say("$J=G53X-5F600\n").is_empty(), "suspended: not read");
        bench.byte(0x18);
        assert!(bench.wait(1.0).is_empty() && (bench.x_mm() + 1.0).abs() < 1e-9, "dropped by the reset");
        bench.say("$J=G53X-50F600\n");
        bench.wait(1.0);
        let at = bench.x_mm();
        bench.byte(0x84);
        bench.wait(1.0);
        assert!((at - bench.x_mm() - braking_mm(dialect)).abs() < 1e-9, "braked");
        bench.say("$J=G53X-5F600\n");
        bench.wait(1.0);
        assert!((at - bench.x_mm() - braking_mm(dialect)).abs() < 1e-9, "stays");
        let alarm = bench.byte(0x18).iter().any(|line| line == "ALARM:3");
        assert_eq!(alarm, dialect == Hal);
    }
}

#[test]
fn occasional_fields_come_as_often_as_published() {
    let mut bench = Bench::new(Classic);
    let reports: Vec<String> = (0..22).map(|_| bench.report()).collect();
    let with = |field: &str| -> Vec<usize> {
        reports.iter().enumerate().filter(|(_, r)| r.contains(field)).map(|(i, _)| i).collect()
    };
    assert_eq!(with("WCO:"), [0, 10, 20]);
    assert_eq!(with("Ov:"), [1, 11, 21]);
    let mut setup = GrblSetup::bench(Hal);
    setup.settings.insert(10, 510.0);
    setup.work_offset_mm = [-2.0, 0.0, -3.0];
    let mut hal = Bench::with(setup);
    assert!(hal.report().contains("|Ov:") && hal.report().contains("|WCO:-2.000,0.000,-3.000"));
    assert!(hal.byte(0x87).concat().contains("|H:0"));
    assert!(hal.report().contains("|WPos:2.000,0.000,3.000|Bf:100,1023"));
}

#[test]
fn buffers_have_the_published_sizes() {
    let mut bench = Bench::homed(Classic);
    for n in 0..15 {
        assert_eq!(bench.say("$J=G91X-1F600\n"), ["ok"], "jog {n}");
    }
    assert!(bench.say("$J=G91X-1F600\n").is_empty(), "no room to plan a 16th");
    assert_eq!(bench.wait(0.3), ["ok"], "until one of them has ended");
    // 127 bytes and no more.
    let mut full = Bench::new(Classic);
    full.machine.receive(&[b'X'; 300]);
    assert_eq!(full.say("\n"), ["error:11"]);
    assert_eq!(full.machine.free_bytes(), 127);
}

#[test]
fn what_it_says_about_itself_is_whole() {
    let mut bench = Bench::new(Hal);
    let said = bench.say("$I\n");
    assert!(said.contains(&"[AXS:3:XYZ]".to_owned()) && said.last().is_some_and(|line| line == "ok"));
    let settings = bench.say("$$\n");
    assert!(settings.contains(&"$130=100.000".to_owned()) && settings.contains(&"$13=0".to_owned()));
    assert_eq!(bench.say("$133=5\n"), ["error:3"]);
    assert_eq!(bench.say("G1X5F100\n"), ["error:9"]);
    assert_eq!(bench.say("\n"), ["ok"]);
}
