//! Whether the driver of the Net F/T keeps its head when the wire brings what no sensor sends.

use crate::steady::steady;
use phantom_rig::clock::HostTime;
use phantom_rig::device::{ForceRecord, ForceSensor, with_causes};
use phantom_rig::driver::{NetFt, NetFtSettings};
use phantom_rig::sim::bytes::{NetFtEmulator, NetFtSetup};
use std::net::{SocketAddr, TcpListener, UdpSocket};
use std::time::{Duration, Instant};

const DEADLINE: Duration = Duration::from_secs(30);

/// A page from the emulator, a stream from the test.
struct Wire {
    _emulator: NetFtEmulator,
    stream: UdpSocket,
    sensor: NetFt,
    client: SocketAddr,
}

impl Wire {
    /// A stream whose sensor answers so many requests at once, each with a first record.
    fn answering(requests: u32) -> Self {
        let emulator =
            NetFtEmulator::start(NetFtSetup::default(), HostTime::now(), |_| [0.0; 6]).expect("an emulator");
        let stream = UdpSocket::bind("127.0.0.1:0").expect("a socket");
        stream.set_read_timeout(Some(DEADLINE)).expect("a time-out");
        let settings = NetFtSettings {
            http_port: emulator.http_port(),
            rdt_port: stream.local_addr().expect("an address").port(),
            ..NetFtSettings::at("127.0.0.1")
        };
        let mut sensor = NetFt::open(&settings).expect("a sensor");
        let server = stream.try_clone().expect("the same socket");
        let client = std::thread::spawn(move || {
            let mut request = [0; 16];
            let mut client = None;
            for _ in 0..requests {
                let (length, from) = server.recv_from(&mut request).expect("a request");
                assert_eq!(request[..length], [0x12, 0x34, 0, 2, 0, 0, 0, 0]);
                client = Some(from);
            }
            let client = client.expect("a client");
            for answer in 1..=requests {
                server.send_to(&record(1, 100 * answer), client).expect("a record");
            }
            client
        });
        sensor.start().expect("a stream");
        let client = client.join().expect("a client");
        Self { _emulator: emulator, stream, sensor, client }
    }

    fn new() -> Self {
        Self::answering(1)
    }

    fn send(&self, datagram: &[u8]) {
        self.stream.send_to(datagram, self.client).expect("sent");
    }

    /// What is there already: the first record.
    fn receive_at_once(&mut self) -> Vec<ForceRecord> {
        let mut records = Vec::new();
        self.sensor.receive(HostTime::now(), &mut records).expect("no error");
        assert_eq!(records.len(), 1);
        records
    }

    /// What arrived up to the record of that number.
    fn receive_to(&mut self, rdt_sequence: u32) -> Vec<u32> {
        let deadline = HostTime::now() + DEADLINE;
        let mut records = Vec::with_capacity(256);
        while records.last().is_none_or(|r: &ForceRecord| r.rdt_sequence != rdt_sequence) {
            assert!(HostTime::now() < deadline, "{records:?}");
            self.sensor
                .receive(HostTime::now() + Duration::from_millis(100), &mut records)
                .expect("no error");
        }
        records.iter().map(|r| r.rdt_sequence).collect()
    }
}

fn record(rdt_sequence: u32, ft_sequence: u32) -> Vec<u8> {
    [rdt_sequence, ft_sequence, 0, 0, 0, 0, 0, 0, 0].iter().flat_map(|word| word.to_be_bytes()).collect()
}

#[test]
fn datagrams_from_elsewhere_are_ignored_and_counted() {
    steady(|| {
        let mut wire = Wire::new();
        let stranger = UdpSocket::bind("127.0.0.1:0").expect("a socket");
        for n in 0..5 {
            stranger.send_to(&record(1000 + n, 1), wire.client).expect("sent");
        }
        wire.send(&record(2, 101));
        assert_eq!(wire.receive_to(2), [1, 2]);
        assert_eq!(wire.sensor.interference().foreign, 5);
    });
}

#[test]
fn datagrams_that_are_no_records_are_ignored_and_counted() {
    steady(|| {
        let mut wire = Wire::new();
        for length in [0, 1, 8, 35, 37, 71, 1439, 1441, 1476, 9000] {
            wire.send(&vec![0; length]);
        }
        wire.send(&[record(2, 101), record(3, 102), record(4, 103)].concat());
        assert_eq!(wire.receive_to(4), [1, 2, 3, 4]);
        let losses = wire.sensor.losses();
        assert_eq!((losses.malformed, losses.received, losses.lost), (10, 4, 0));
    });
}

/// An answer that takes longer than the driver waits: each request begins the stream anew, and only the last one counts.
#[test]
fn late_answers_to_repeated_requests_are_one_stream() {
    steady(|| {
        let mut wire = Wire::answering(3);
        wire.send(&record(2, 301));
        wire.send(&record(3, 302));
        assert_eq!(wire.receive_to(3), [1, 2, 3]);
        assert_eq!((wire.sensor.interference().restarted, wire.sensor.losses().received), (0, 3));
    });
}

/// A stop from a client that has lost the stream would end somebody else's.
#[test]
fn only_a_stream_that_still_comes_is_ended_when_its_sensor_is_dropped() {
    for comes in [true, false] {
        steady(|| {
            let wire = Wire::new();
            if comes {
                wire.send(&record(2, 101));
            }
            let Wire { stream, sensor, .. } = wire;
            drop(sensor);
            stream.set_read_timeout(Some(Duration::from_millis(200))).expect("a time-out");
            let mut request = [0; 16];
            let heard = stream.recv_from(&mut request).map(|(length, _)| request[..length].to_vec());
            assert_eq!(heard.ok(), comes.then(|| vec![0x12, 0x34, 0, 0, 0, 0, 0, 0]));
        });
    }
}

#[test]
fn a_stream_that_begins_anew_unasked_is_counted() {
    steady(|| {
        let mut wire = Wire::new();
        wire.send(&record(2, 101));
        wire.send(&record(1, 50_000));
        wire.send(&record(2, 50_001));
        wire.send(&record(3, 50_002));
        assert_eq!(wire.receive_to(3), [1, 2, 1, 2, 3]);
        assert_eq!((wire.sensor.interference().restarted, wire.sensor.losses().lost), (1, 0));
    });
}

/// The buffer of whoever asks does not move while it has room, however much has piled up, and no record is left behind.
#[test]
fn nothing_is_allocated_while_there_is_room() {
    steady(|| {
        let mut wire = Wire::new();
        let mut records = wire.receive_at_once();
        for n in 0..100 {
            wire.send(&record(2 + n, 101 + n));
        }
        records.reserve_exact(100 - records.len());
        records.resize(records.capacity() - 64, records[0]);
        let (place, room, kept) = (records.as_ptr(), records.capacity(), records.len());
        let mut numbers = vec![1];
        let deadline = HostTime::now() + DEADLINE;
        while numbers.len() < 101 {
            assert!(HostTime::now() < deadline, "{} records", numbers.len());
            records.truncate(kept);
            wire.sensor
                .receive(HostTime::now() + Duration::from_millis(100), &mut records)
                .expect("no error");
            assert_eq!((records.as_ptr(), records.capacity()), (place, room));
            numbers.extend(records[kept..].iter().map(|r| r.rdt_sequence));
        }
        assert!(numbers.iter().zip(1..).all(|(number, expected)| *number == expected), "{numbers:?}");
    });
}

#[test]
fn a_sensor_that_is_not_there_is_reported_soon_and_by_its_address() {
    steady(|| {
        let silent = TcpListener::bind("127.0.0.1:0").expect("a listener that never answers");
        let port = silent.local_addr().expect("an address").port();
        let begun = Instant::now();
        let settings = NetFtSettings { http_port: port, ..NetFtSettings::at("127.0.0.1") };
        let error = with_causes(&NetFt::open(&settings).expect_err("no answer"));
        assert!(begun.elapsed() < Duration::from_secs(10), "{:?}", begun.elapsed());
        assert!(
            error.contains(&format!("http://127.0.0.1:{port}/netftapi2.xml")) && error.contains("timeout"),
            "{error}"
        );

        drop(silent);
        let error = with_causes(&NetFt::open(&settings).expect_err("nobody there"));
        assert!(error.contains("refused"), "{error}");
        let error = with_causes(&NetFt::open(&NetFtSettings::at("no such name")).expect_err("no address"));
        assert!(error.contains("no such name"), "{error}");
    });
}

#[test]
fn a_dropped_emulator_leaves_its_ports() {
    steady(|| {
        let emulator =
            NetFtEmulator::start(NetFtSetup::default(), HostTime::now(), |_| [0.0; 6]).expect("an emulator");
        let (rdt, http) = (emulator.rdt_port(), emulator.http_port());
        assert!(UdpSocket::bind(("127.0.0.1", rdt)).is_err());
        drop(emulator);
        UdpSocket::bind(("127.0.0.1", rdt)).expect("a free port");
        std::net::TcpStream::connect(("127.0.0.1", http)).expect_err("nobody listens");
    });
}
