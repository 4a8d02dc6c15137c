//! Whether the driver of the Net F/T tells each fault of the emulated sensor apart, over loopback.

use crate::steady::steady;
use phantom_rig::clock::HostTime;
use phantom_rig::device::{DeviceError, ForceRecord, ForceSensor, with_causes};
use phantom_rig::driver::{DriverError, NetFt, NetFtSettings, NetFtSilence};
use phantom_rig::sim::bytes::{NetFtEmulator, NetFtFamily, NetFtPageFault, NetFtSetup, PageUnit};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Longer than any machine takes for what a test waits for.
const DEADLINE: Duration = Duration::from_secs(30);

/// Long enough for records that are on their way to have arrived.
const QUIET: Duration = Duration::from_millis(300);

/// Slow enough that a busy machine does not lose records of its own.
fn calm() -> NetFtSetup {
    NetFtSetup { rate_hz: 1000.0, ..NetFtSetup::default() }
}

/// A wrench that tells its time: 1 N along z more every second.
fn ramp(time_s: f64) -> [f64; 6] {
    [0.25, -0.5, time_s % 10.0, 0.01, -0.02, 0.03]
}

fn settings(emulator: &NetFtEmulator) -> NetFtSettings {
    NetFtSettings {
        http_port: emulator.http_port(),
        rdt_port: emulator.rdt_port(),
        ..NetFtSettings::at("127.0.0.1")
    }
}

fn emulate(setup: NetFtSetup) -> NetFtEmulator {
    NetFtEmulator::start(setup, HostTime::now(), ramp).expect("an emulator")
}

fn started(emulator: &NetFtEmulator) -> NetFt {
    let mut sensor = NetFt::open(&settings(emulator)).expect("a sensor");
    sensor.start().expect("a stream");
    sensor
}

/// Receives until what came satisfies `enough`.
fn receive_until(
    sensor: &mut NetFt,
    mut enough: impl FnMut(&NetFt, &[ForceRecord]) -> bool,
) -> Vec<ForceRecord> {
    let deadline = HostTime::now() + DEADLINE;
    let mut records = Vec::with_capacity(100_000);
    while !enough(sensor, &records) {
        assert!(
            HostTime::now() < deadline,
            "not enough after {} records: {:?}",
            records.len(),
            sensor.losses()
        );
        sensor.receive(HostTime::now() + QUIET, &mut records).expect("no error");
    }
    records
}

fn receive(sensor: &mut NetFt, count: usize) -> Vec<ForceRecord> {
    receive_until(sensor, |_, records| records.len() >= count)
}

/// Whether nothing comes any more once what was on its way has arrived.
fn falls_silent(sensor: &mut NetFt) -> bool {
    let deadline = HostTime::now() + DEADLINE;
    let mut records = Vec::with_capacity(4096);
    while HostTime::now() < deadline {
        records.clear();
        sensor.receive(HostTime::now() + QUIET, &mut records).expect("silence is no error");
        if records.is_empty() {
            return true;
        }
    }
    false
}

fn one_after_another(records: &[ForceRecord], ticks: u32) {
    for pair in records.windows(2) {
        assert_eq!(pair[1].rdt_sequence, pair[0].rdt_sequence.wrapping_add(1));
        assert_eq!(pair[1].ft_sequence, pair[0].ft_sequence.wrapping_add(ticks));
        assert!(pair[1].host >= pair[0].host);
    }
}

#[test]
fn a_stream_comes_whole_and_means_what_was_felt() {
    steady(|| {
        for (buffered, family) in
            [(false, NetFtFamily::NetBox), (true, NetFtFamily::NetBox), (false, NetFtFamily::Axia)]
        {
            let emulator = emulate(NetFtSetup {
                family,
                product: String::new(),
                force_unit: PageUnit::new("lbf", 1, 4.448_221_615_260_5),
                torque_unit: PageUnit::new("N-mm", 4, 1e-3),
                counts_per_torque: 1000.0,
                ..calm()
            });
            let mut sensor =
                NetFt::open(&NetFtSettings { buffered, ..settings(&emulator) }).expect("a sensor");
            sensor.start().expect("a stream");
            let records = receive(&mut sensor, 500);
            assert_eq!(records[0].rdt_sequence, 1);
            one_after_another(&records, 7);
            let losses = sensor.losses();
            assert_eq!((losses.received, losses.lost, losses.malformed), (records.len() as u64, 0, 0));
            for record in &records {
                let time_s = f64::from(record.ft_sequence) / sensor.format().tick_hz;
                let (felt, read) = (ramp(time_s), sensor.format().wrench(record.counts));
                for i in 0..6 {
                    // Half a count, and rounding.
                    let half = 0.5000001 * if i < 3 { 4.448_221_615_260_5e-6 } else { 1e-6 };
                    assert!((felt[i] - read[i]).abs() <= half, "component {i}: {} for {}", read[i], felt[i]);
                }
            }
            // Nothing arrives before it was felt.
            let last = records[records.len() - 1];
            let felt_at = emulator.power_up() + Duration::from_secs_f64(f64::from(last.ft_sequence) / 7000.0);
            assert!(last.host >= felt_at);
            sensor.stop().expect("an end");
            assert!(falls_silent(&mut sensor));
        }
    });
}

#[test]
fn the_sensors_clock_may_wrap() {
    steady(|| {
        // Three seconds after power-up: opening takes a fraction of one.
        let emulator = emulate(NetFtSetup { first_tick: u32::MAX - 3 * 7000, ..calm() });
        let mut sensor = started(&emulator);
        let records = receive_until(&mut sensor, |_, records| {
            records.last().is_some_and(|last| last.ft_sequence < records[0].ft_sequence)
        });
        one_after_another(&records, 7);
        assert_eq!(sensor.losses().lost, 0);
    });
}

#[test]
fn lost_doubled_and_late_records_are_counted() {
    steady(|| {
        let emulator = emulate(NetFtSetup { seed: 7, ..calm() });
        let mut sensor = started(&emulator);
        emulator.faults().change(|faults| faults.drop_share = 0.1);
        let records = receive_until(&mut sensor, |sensor, _| sensor.losses().lost > 20);
        let losses = sensor.losses();
        let span = records[records.len() - 1].rdt_sequence - records[0].rdt_sequence + 1;
        assert_eq!(losses.received + losses.lost, u64::from(span));
        assert_eq!(losses.received, records.len() as u64);

        emulator.faults().change(|faults| (faults.drop_share, faults.duplicate_share) = (0.0, 0.2));
        let before = sensor.losses();
        let records = receive_until(&mut sensor, |sensor, _| sensor.losses().duplicated > 20);
        let doubled =
            records.windows(2).filter(|pair| pair[0].rdt_sequence == pair[1].rdt_sequence).count() as u64;
        assert!(doubled >= 20 && sensor.losses().duplicated == doubled, "{doubled} of {:?}", sensor.losses());
        assert!(sensor.losses().lost <= before.lost + 1);

        emulator.faults().change(|faults| (faults.duplicate_share, faults.reorder_share) = (0.0, 0.2));
        receive_until(&mut sensor, |sensor, _| sensor.losses().reordered > 20);
        assert_eq!(sensor.interference().restarted, 0);
    });
}

#[test]
fn a_stall_is_silence_and_then_a_gap() {
    steady(|| {
        let emulator = emulate(calm());
        let mut sensor = started(&emulator);
        receive(&mut sensor, 10);
        emulator.faults().change(|faults| faults.stalled = true);
        assert!(falls_silent(&mut sensor));
        let before = sensor.losses();
        emulator.faults().change(|faults| faults.stalled = false);
        receive(&mut sensor, 10);
        // Nothing came for the QUIET that was waited out.
        assert!(sensor.losses().lost >= before.lost + 250, "{:?}", sensor.losses());
    });
}

#[test]
fn a_frozen_sensor_is_seen_to_be() {
    steady(|| {
        let emulator = emulate(calm());
        let mut sensor = started(&emulator);
        receive(&mut sensor, 10);
        assert_eq!(sensor.interference().frozen, 0);
        emulator.faults().change(|faults| faults.frozen = true);
        let records = receive_until(&mut sensor, |sensor, _| sensor.interference().frozen >= 50);
        let [first, last] = [records[records.len() - 20], records[records.len() - 1]];
        assert_eq!((first.ft_sequence, first.counts), (last.ft_sequence, last.counts));
        assert_eq!(last.rdt_sequence, first.rdt_sequence + 19);
        emulator.faults().change(|faults| faults.frozen = false);
        let frozen = sensor.interference().frozen;
        let records = receive(&mut sensor, 200);
        one_after_another(&records[100..], 7);
        assert!(sensor.interference().frozen < frozen + 100);
    });
}

#[test]
fn trouble_stops_and_what_does_not_concern_the_readings_does_not() {
    steady(|| {
        for family in [NetFtFamily::NetBox, NetFtFamily::Axia] {
            let product = if family == NetFtFamily::Axia { "Ethernet Axia" } else { "Net Box" };
            let emulator = emulate(NetFtSetup { family, product: product.to_owned(), ..calm() });
            let mut sensor = started(&emulator);
            emulator.faults().change(|faults| faults.saturated = true);
            let records = receive_until(&mut sensor, |_, r| r.last().is_some_and(|r| r.status != 0));
            let last = records[records.len() - 1];
            assert_ne!(last.status & sensor.format().stop_mask, 0);
            assert!(sensor.explain(last.status).iter().any(|said| said.contains("range")));
            assert_eq!(sensor.format().wrench(last.counts)[2].abs(), 17.0);
        }
        let emulator = emulate(calm());
        let mut sensor = started(&emulator);
        emulator.faults().change(|faults| faults.status_bits = 1 << 18);
        let records = receive_until(&mut sensor, |_, r| r.last().is_some_and(|r| r.status != 0));
        let status = records[records.len() - 1].status;
        assert_eq!((status, status & sensor.format().stop_mask), (0x8004_0000, 0));
        assert!(sensor.explain(status)[0].contains("DeviceNet"));
    });
}

#[test]
fn a_latched_threshold_stops_until_it_is_let_go() {
    steady(|| {
        let pressed = Arc::new(AtomicBool::new(true));
        let pressing = pressed.clone();
        let wrench =
            move |_| [0.0, 0.0, if pressing.load(Ordering::Relaxed) { 2.0 } else { 0.0 }, 0.0, 0.0, 0.0];
        let emulator =
            NetFtEmulator::start(NetFtSetup { threshold_n: Some(1.0), ..calm() }, HostTime::now(), wrench)
                .expect("an emulator");
        let mut sensor = started(&emulator);
        pressed.store(false, Ordering::Relaxed);
        let records = receive_until(&mut sensor, |_, r| r.last().is_some_and(|r| r.counts[2] == 0));
        let status = records[records.len() - 1].status;
        assert_eq!(status, 0x8001_0000);
        assert_ne!(status & sensor.format().stop_mask, 0);
        sensor.clear_latch().expect("a request");
        receive_until(&mut sensor, |_, r| r.last().is_some_and(|r| r.status == 0));
    });
}

#[test]
fn a_bias_takes_the_reading_for_zero() {
    steady(|| {
        let emulator = NetFtEmulator::start(calm(), HostTime::now(), |_| [1.0, 2.0, 3.0, 0.01, 0.02, 0.03])
            .expect("an emulator");
        let mut sensor = started(&emulator);
        assert_eq!(
            receive(&mut sensor, 1)[0].counts,
            [1_000_000, 2_000_000, 3_000_000, 10_000, 20_000, 30_000]
        );
        sensor.bias().expect("a request");
        receive_until(&mut sensor, |_, r| r.last().is_some_and(|r| r.counts == [0; 6]));
    });
}

#[test]
fn a_second_client_takes_the_stream_and_asking_again_takes_it_back() {
    steady(|| {
        let emulator = emulate(calm());
        let mut first = started(&emulator);
        receive(&mut first, 10);
        let mut second = started(&emulator);
        receive(&mut second, 10);
        assert!(falls_silent(&mut first));
        let why = first.why_silent();
        assert!(matches!(why, NetFtSilence::StreamElsewhere { status: Some(0) }), "{why}");
        assert!(why.to_string().contains("another client"));

        first.start().expect("the stream back");
        assert_eq!(receive(&mut first, 10)[0].rdt_sequence, 1);
        assert!(falls_silent(&mut second));

        emulator.faults().take_over();
        assert!(falls_silent(&mut first));
        assert!(matches!(first.why_silent(), NetFtSilence::StreamElsewhere { .. }));
    });
}

#[test]
fn stopping_leaves_a_stream_alone_that_somebody_else_has_taken() {
    steady(|| {
        let emulator = emulate(calm());
        let mut first = started(&emulator);
        receive(&mut first, 10);
        let mut second = started(&emulator);
        first.stop().expect("nothing comes here any more");
        // More than can have waited for somebody to fetch it.
        receive(&mut second, 2000);
        second.stop().expect("its own stream");
        assert!(falls_silent(&mut second));
    });
}

#[test]
fn lost_requests_are_repeated() {
    steady(|| {
        let emulator = emulate(calm());
        emulator.faults().change(|faults| faults.lose_starts = 3);
        let mut sensor = started(&emulator);
        let records = receive(&mut sensor, 100);
        one_after_another(&records, 7);
        assert_eq!((sensor.losses().lost, sensor.interference().restarted), (0, 0));

        emulator.faults().change(|faults| faults.lose_stops = 3);
        sensor.stop().expect("an end");
        let deadline = HostTime::now() + Duration::from_secs(10);
        while emulator.faults().now().lose_stops > 0 {
            assert!(HostTime::now() < deadline, "requests to stop are repeated");
            std::thread::sleep(Duration::from_millis(1));
        }
        assert!(falls_silent(&mut sensor));
    });
}

#[test]
fn requests_that_nobody_hears_end_in_a_clear_word() {
    steady(|| {
        let emulator = emulate(calm());
        emulator.faults().change(|faults| faults.lose_starts = u32::MAX);
        let mut sensor = NetFt::open(&settings(&emulator)).expect("a sensor");
        let error = sensor.start().expect_err("nobody hears");
        assert!(matches!(error, DeviceError::Silent { .. }), "{error}");
        assert!(error.to_string().contains("web page answers"), "{error}");

        emulator.faults().change(|faults| (faults.lose_starts, faults.lose_stops) = (0, u32::MAX));
        sensor.start().expect("a stream");
        let error = sensor.stop().expect_err("nobody hears");
        assert!(matches!(error, DeviceError::Refused { .. }), "{error}");
        emulator.faults().change(|faults| faults.lose_stops = 0);
        sensor.start().expect("a stream begun anew");
        assert_eq!(receive(&mut sensor, 1)[0].rdt_sequence, 1);
    });
}

/// On loopback a port that nobody holds answers with ICMP; a bench that is switched off does not answer at all.
#[test]
fn a_sensor_that_goes_away_is_silence() {
    steady(|| {
        let emulator = emulate(calm());
        let mut sensor = started(&emulator);
        receive(&mut sensor, 10);
        drop(emulator);
        assert!(falls_silent(&mut sensor));
        let silence = sensor.why_silent();
        assert!(matches!(silence, NetFtSilence::SensorGone(DriverError::ForcePage { .. })), "{silence}");
        // The cause once, with what the network says of it.
        let told = silence.to_string();
        assert!(
            told.matches("cannot be read: ").count() == 1 && told.matches("refused").count() == 1,
            "{told}"
        );
        sensor.bias().expect("nobody acknowledges a request anyway");
        sensor.stop().expect("silent it is");
        let error = sensor.start().expect_err("nobody there");
        assert!(matches!(error, DeviceError::Silent { .. }), "{error}");
        assert!(error.to_string().contains("does not answer either"), "{error}");
    });
}

#[test]
fn pages_that_readings_cannot_be_built_upon_are_refused() {
    steady(|| {
        let emulator = emulate(calm());
        for (page, said) in [
            (NetFtPageFault::UnitsContradict, "<scfgfu>"),
            (NetFtPageFault::CalibrationPage, "netftcalibration"),
            (NetFtPageFault::Unavailable, "500"),
        ] {
            emulator.faults().change(|faults| faults.page = page);
            let error = with_causes(&NetFt::open(&settings(&emulator)).expect_err("a page to refuse"));
            assert!(error.contains(said), "{error}");
        }
        emulator.faults().change(|faults| faults.page = NetFtPageFault::None);
        let open = |rate| NetFt::open(&NetFtSettings { expected_rate_hz: Some(rate), ..settings(&emulator) });
        let sensor = open(1000.0).expect("the rate that it has");
        assert_eq!((sensor.format().rate_hz, sensor.format().ticks_a_record()), (1000.0, 7));
        assert_eq!(sensor.format().range, Some([12.0, 12.0, 17.0, 0.12, 0.12, 0.12]));
        assert_eq!(sensor.identity().product, "Net F/T");
        let error = open(7000.0).expect_err("another rate").to_string();
        assert!(error.contains("comrdtrate") && error.contains("1000") && error.contains("7000"), "{error}");
    });
}
