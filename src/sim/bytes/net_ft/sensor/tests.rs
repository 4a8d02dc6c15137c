//! Whether the emulated sensor keeps to the published interface, in ticks instead of seconds.

use super::super::setup::PageUnit;
use super::*;

const CLIENT: &str = "127.0.0.1:5000";
const OTHER: &str = "127.0.0.1:6000";

fn at(address: &str) -> SocketAddr {
    address.parse().expect("an address")
}

fn request(command: u8, count: u8) -> [u8; 8] {
    [0x12, 0x34, 0, command, 0, 0, 0, count]
}

/// What a record says, by the table of the manual.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Seen {
    rdt: u32,
    ft: u32,
    status: u32,
    counts: [i32; 6],
}

struct Bench {
    sensor: Sensor,
    faults: NetFtFaultSwitch,
    tick: u64,
}

impl Bench {
    fn new(setup: NetFtSetup, wrench: impl FnMut(f64) -> [f64; 6] + Send + 'static) -> Self {
        let faults = NetFtFaultSwitch::default();
        Self { sensor: Sensor::new(setup, Box::new(wrench), faults.clone()), faults, tick: 0 }
    }

    fn ask(&mut self, command: u8, count: u8, from: &str) {
        self.sensor.hear(&request(command, count), at(from), self.tick);
    }

    /// Lets so many ticks go by and returns the datagrams as records, with whom they went to.
    fn run(&mut self, ticks: u64) -> Vec<(SocketAddr, Vec<Seen>)> {
        self.tick += ticks;
        let mut sent = Vec::new();
        let mut sink = |to: SocketAddr, bytes: &[u8]| {
            assert_eq!(bytes.len() % 36, 0);
            let seen = bytes.chunks_exact(36).map(|record| {
                let word = |n: usize| {
                    u32::from_be_bytes(record[4 * n..4 * n + 4].try_into().expect("four bytes of a record"))
                };
                Seen {
                    rdt: word(0),
                    ft: word(1),
                    status: word(2),
                    counts: std::array::from_fn(|i| word(3 + i) as i32),
                }
            });
            sent.push((to, seen.collect()));
        };
        while self.sensor.send_due(self.tick, 7, &mut sink) {}
        sent
    }

    fn records(&mut self, ticks: u64) -> Vec<Seen> {
        self.run(ticks).into_iter().flat_map(|(_, records)| records).collect()
    }
}

/// 1 N more a second along z.
fn ramp(time_s: f64) -> [f64; 6] {
    [0.5, -0.5, time_s, 0.01, -0.01, 0.0]
}

#[test]
fn requests_are_numbered_from_one_and_the_clock_runs_on() {
    let mut bench = Bench::new(NetFtSetup { rate_hz: 1000.0, ..NetFtSetup::default() }, ramp);
    assert!(bench.run(1000).is_empty(), "nobody asked");
    bench.ask(2, 0, CLIENT);
    let records = bench.records(7000);
    assert_eq!(records.len(), 1000);
    for (n, record) in records.iter().enumerate() {
        assert_eq!((record.rdt, record.ft), (n as u32 + 1, 1001 + 7 * n as u32));
    }
    bench.ask(2, 0, CLIENT);
    let again = bench.records(7);
    assert_eq!((again[0].rdt, again[0].ft), (1, 8001));
    bench.ask(0, 0, CLIENT);
    assert!(bench.run(7000).is_empty(), "it was stopped");
}

/// Each record's counts are those of its own time, however late it is asked for.
#[test]
fn counts_belong_to_the_records_own_time() {
    let setup = NetFtSetup {
        force_unit: PageUnit::new("kN", 4, 1e3),
        torque_unit: PageUnit::new("N-mm", 4, 1e-3),
        counts_per_force: 1e9,
        counts_per_torque: 500.0,
        ..NetFtSetup::default()
    };
    let mut bench = Bench::new(setup, ramp);
    bench.ask(2, 0, CLIENT);
    for record in bench.records(7000) {
        let time_s = f64::from(record.ft) / 7000.0;
        let expected = [500_000, -500_000, (time_s * 1e6).round() as i32, 5_000, -5_000, 0];
        assert_eq!(record.counts, expected);
    }
}

#[test]
fn buffered_datagrams_are_full_and_a_count_ends_the_stream() {
    let mut bench = Bench::new(NetFtSetup { records_a_datagram: 40, ..NetFtSetup::default() }, ramp);
    bench.ask(3, 90, CLIENT);
    let sizes: Vec<usize> = bench.run(1000).iter().map(|(_, records)| records.len()).collect();
    assert_eq!(sizes, [40, 40, 10]);
    assert_eq!(bench.sensor.due(), None);
}

#[test]
fn the_newest_client_has_the_stream() {
    let mut bench = Bench::new(NetFtSetup::default(), ramp);
    bench.ask(2, 0, CLIENT);
    assert!(bench.run(10).iter().all(|(to, _)| *to == at(CLIENT)));
    bench.ask(2, 0, OTHER);
    let sent = bench.run(10);
    assert!(sent.iter().all(|(to, _)| *to == at(OTHER)));
    assert_eq!(sent[0].1[0].rdt, 1);
    bench.ask(2, 0, CLIENT);
    bench.faults.take_over();
    assert!(bench.run(10).is_empty(), "an unknown client has it");
}

#[test]
fn what_is_no_request_is_ignored() {
    let mut bench = Bench::new(NetFtSetup::default(), ramp);
    for bytes in
        [&[][..], &[0x12, 0x34, 0, 2], &[0x43, 0x21, 0, 2, 0, 0, 0, 0], &[0x12, 0x34, 0, 9, 0, 0, 0, 0]]
    {
        bench.sensor.hear(bytes, at(CLIENT), 0);
    }
    bench.ask(1, 0, CLIENT);
    assert!(bench.run(100).is_empty());
    let mut axia = Bench::new(NetFtSetup { family: NetFtFamily::Axia, ..NetFtSetup::default() }, ramp);
    axia.ask(1, 0, CLIENT);
    assert_eq!(axia.records(100).len(), 100);
}

#[test]
fn the_clock_wraps() {
    let mut bench = Bench::new(NetFtSetup { first_tick: u32::MAX - 1, ..NetFtSetup::default() }, ramp);
    bench.ask(2, 0, CLIENT);
    let clock: Vec<u32> = bench.records(3).iter().map(|r| r.ft).collect();
    assert_eq!(clock, [u32::MAX, 0, 1]);
}

#[test]
fn a_bias_makes_the_present_reading_zero() {
    let mut bench = Bench::new(NetFtSetup::default(), |_| [1.0, -2.0, 3.0, 0.01, 0.02, 0.03]);
    bench.ask(2, 0, CLIENT);
    assert_eq!(bench.records(1)[0].counts, [1_000_000, -2_000_000, 3_000_000, 10_000, 20_000, 30_000]);
    bench.ask(0x42, 0, CLIENT);
    assert_eq!(bench.records(1)[0].counts, [0; 6]);
}

#[test]
fn a_threshold_stays_latched_until_it_is_let_go() {
    let mut bench = Bench::new(
        NetFtSetup { threshold_n: Some(5.0), tick_hz: 100.0, rate_hz: 100.0, ..NetFtSetup::default() },
        |time_s| if time_s < 0.1 { [3.0, 4.001, 0.0, 0.0, 0.0, 0.0] } else { [0.0; 6] },
    );
    bench.ask(2, 0, CLIENT);
    assert!(bench.records(20).iter().all(|r| r.status == 0x8001_0000));
    bench.ask(0x41, 0, CLIENT);
    assert!(bench.records(20).iter().all(|r| r.status == 0));
}

#[test]
fn beyond_its_range_it_saturates_and_says_so() {
    for (family, status) in [(NetFtFamily::NetBox, 0x8002_0000), (NetFtFamily::Axia, 0xc800_0000)] {
        let setup = NetFtSetup { family, ..NetFtSetup::default() };
        let mut bench = Bench::new(setup.clone(), |_| [0.0, 0.0, -20.0, 0.0, 0.0, 0.0]);
        bench.ask(2, 0, CLIENT);
        let record = bench.records(1)[0];
        assert_eq!((record.counts[2], record.status), (-17_000_000, status));

        let mut bench = Bench::new(setup, ramp);
        bench.faults.change(|faults| faults.saturated = true);
        bench.ask(2, 0, CLIENT);
        let record = bench.records(1)[0];
        assert_eq!((record.counts[0], record.counts[1], record.status), (12_000_000, -12_000_000, status));
    }
}

#[test]
fn frozen_it_counts_its_records_only() {
    let mut bench = Bench::new(NetFtSetup::default(), ramp);
    bench.ask(2, 0, CLIENT);
    let last = *bench.records(10).last().expect("records");
    bench.faults.change(|faults| faults.frozen = true);
    let frozen = bench.records(5);
    for (n, record) in frozen.iter().enumerate() {
        assert_eq!(*record, Seen { rdt: last.rdt + 1 + n as u32, ..last });
    }
    bench.faults.change(|faults| faults.frozen = false);
    assert_eq!(bench.records(1)[0].ft, 16);
}

#[test]
fn stalled_it_sends_nothing_and_counts_on() {
    let mut bench = Bench::new(NetFtSetup::default(), ramp);
    bench.ask(2, 0, CLIENT);
    bench.faults.change(|faults| faults.stalled = true);
    assert!(bench.run(100).is_empty());
    bench.faults.change(|faults| faults.stalled = false);
    assert_eq!(bench.records(1)[0].rdt, 101);
}

#[test]
fn status_bits_are_set_with_the_summary() {
    let mut bench = Bench::new(NetFtSetup::default(), ramp);
    bench.faults.change(|faults| faults.status_bits = 1 << 2);
    bench.ask(2, 0, CLIENT);
    assert_eq!(bench.records(1)[0].status, 0x8000_0004);
    assert_eq!(bench.sensor.status(), 0x8000_0004);
}

/// Shares of many independent draws lie within five standard deviations of what was asked for; the seed decides which.
#[test]
fn the_network_loses_doubles_and_swaps_by_its_shares() {
    let run = |seed| {
        let mut bench = Bench::new(NetFtSetup { seed, ..NetFtSetup::default() }, ramp);
        bench.faults.change(|faults| (faults.drop_share, faults.duplicate_share) = (0.1, 0.05));
        bench.ask(2, 0, CLIENT);
        bench.records(50_000).iter().map(|r| r.rdt).collect::<Vec<u32>>()
    };
    let numbers = run(1);
    let mut distinct = numbers.clone();
    distinct.dedup();
    let share = |count: usize, of: f64| count as f64 / of;
    let within =
        |found: f64, share: f64, of: f64| (found - share).abs() < 5.0 * (share * (1.0 - share) / of).sqrt();
    assert!(
        within(share(50_000 - distinct.len(), 50_000.0), 0.1, 50_000.0),
        "{} lost",
        50_000 - distinct.len()
    );
    let arrived = distinct.len() as f64;
    assert!(within(share(numbers.len() - distinct.len(), arrived), 0.05, arrived));
    assert_eq!(numbers, run(1));
    assert_ne!(numbers, run(2));
}

#[test]
fn swapped_datagrams_are_all_there() {
    let mut bench = Bench::new(NetFtSetup::default(), ramp);
    bench.faults.change(|faults| faults.reorder_share = 0.2);
    bench.ask(2, 0, CLIENT);
    let mut numbers: Vec<u32> = bench.records(10_000).iter().map(|r| r.rdt).collect();
    let swapped = numbers.windows(2).filter(|pair| pair[1] < pair[0]).count();
    assert!(swapped > 1000, "{swapped}");
    numbers.sort_unstable();
    // The last one may still be held.
    assert!(numbers.windows(2).all(|pair| pair[1] == pair[0] + 1) && numbers.len() >= 9_999);
}

#[test]
fn requests_may_be_lost() {
    let mut bench = Bench::new(NetFtSetup::default(), ramp);
    bench.faults.change(|faults| (faults.lose_starts, faults.lose_stops) = (2, 1));
    for _ in 0..2 {
        bench.ask(2, 0, CLIENT);
        assert!(bench.run(10).is_empty());
    }
    bench.ask(2, 0, CLIENT);
    assert_eq!(bench.records(10).len(), 10);
    bench.ask(0, 0, CLIENT);
    assert_eq!(bench.records(10).len(), 10);
    bench.ask(0, 0, CLIENT);
    assert!(bench.run(10).is_empty());
}
