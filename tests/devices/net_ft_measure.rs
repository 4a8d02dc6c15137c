//! How many records of a minute at 7000 Hz arrive over loopback, and what that costs. Run by hand:
//! `cargo test --release --test devices -- --ignored --nocapture seven_kilohertz`, for `NET_FT_SECONDS` (60).

use phantom_rig::clock::HostTime;
use phantom_rig::device::ForceSensor;
use phantom_rig::driver::{NetFt, NetFtSettings};
use phantom_rig::sim::bytes::{NetFtEmulator, NetFtSetup};
use std::time::Duration;

/// Processor time of each thread of this process (s), by name.
fn processor_seconds(thread: &str) -> f64 {
    let mut ticks = 0.0;
    for task in std::fs::read_dir("/proc/self/task").expect("threads").flatten() {
        let stat = std::fs::read_to_string(task.path().join("stat")).unwrap_or_default();
        if let Some((head, tail)) = stat.rsplit_once(')')
            && head.ends_with(thread)
        {
            // utime and stime, fields 14 and 15 of proc(5), are 11 and 12 behind the name.
            ticks +=
                tail.split_whitespace().skip(11).take(2).filter_map(|f| f.parse::<f64>().ok()).sum::<f64>();
        }
    }
    ticks / 100.0
}

fn measure(buffered: bool, pause: Duration) {
    let seconds: f64 = std::env::var("NET_FT_SECONDS").map_or(60.0, |s| s.parse().expect("a number"));
    let emulator =
        NetFtEmulator::start(NetFtSetup::default(), HostTime::now(), |t| [0.0, 0.0, t.sin(), 0.0, 0.0, 0.0])
            .expect("one");
    let settings = NetFtSettings {
        http_port: emulator.http_port(),
        rdt_port: emulator.rdt_port(),
        buffered,
        ..NetFtSettings::at("127.0.0.1")
    };
    std::thread::Builder::new()
        .name("net-ft-driver".to_owned())
        .spawn(move || {
            let mut sensor = NetFt::open(&settings).expect("a sensor");
            sensor.start().expect("a stream");
            let mut records = Vec::with_capacity(16_384);
            let (mut waits, mut calls, mut late) = (Vec::new(), 0_u64, 0.0_f64);
            let begun = HostTime::now();
            let end = begun + Duration::from_secs_f64(seconds);
            let mut previous = begun;
            while HostTime::now() < end {
                records.clear();
                sensor.receive(HostTime::now() + Duration::from_millis(100), &mut records).expect("no error");
                calls += 1;
                let now = HostTime::now();
                waits.push(now.since(previous).as_secs_f64());
                previous = now;
                if let Some(last) = records.last() {
                    let felt = f64::from(last.ft_sequence) / 7000.0;
                    late = late.max(last.host.seconds_after(emulator.power_up()) - felt);
                }
                if !pause.is_zero() {
                    std::thread::sleep(pause);
                }
            }
            let took = HostTime::now().seconds_after(begun);
            waits.sort_by(f64::total_cmp);
            println!(
                "buffered {buffered}, pause {pause:?}: {took:.2} s, {:?}, {:?}; {:.1} records/s, {calls} calls, \
                 longest wait {:.1} ms, 99 % below {:.2} ms; latest record {:.1} ms after its time; \
                 processor: driver {:.1} %, emulator {:.1} % of one",
                sensor.losses(),
                sensor.interference(),
                sensor.losses().received as f64 / took,
                waits[waits.len() - 1] * 1e3,
                waits[waits.len() * 99 / 100] * 1e3,
                late * 1e3,
                100.0 * processor_seconds("net-ft-driver") / took,
                100.0 * processor_seconds("net-ft-emulator") / took,
            );
        })
        .expect("a thread")
        .join()
        .expect("no panic");
}

#[test]
#[ignore = "takes minutes; a measurement, not a check"]
fn seven_kilohertz() {
    measure(false, Duration::ZERO);
    measure(true, Duration::ZERO);
}

#[test]
#[ignore = "takes minutes; a measurement, not a check"]
fn a_reader_that_pauses() {
    for pause_ms in [20, 50, 100, 200, 500, 1000] {
        for buffered in [false, true] {
            measure(buffered, Duration::from_millis(pause_ms));
        }
    }
}
