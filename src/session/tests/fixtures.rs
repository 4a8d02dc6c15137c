//! What do the tests record: a session whose every record follows from its number.

use crate::clock::HostTime;
use crate::device::{ForceRecord, Losses, MarkerFrame, MarkerPosition, StageReport, StageState};
use crate::session::{
    ClockProbe, Event, ForceDocument, HashedText, MarkersDocument, MountingDocument, Outcome,
    PhantomDocument, Recorder, SessionWriter, StageDocument, StartDocument, StopDocument, TipDocument,
};
use std::fs;
use std::path::Path;
use std::time::Duration;

/// Where the recorded times begin (ns): a machine that has been up for four months, beyond what a float holds to the nanosecond.
pub(super) const ORIGIN_NS: u64 = 10_512_000_123_456_789;
pub(super) const FORCE_HZ: u64 = 7000;
pub(super) const STAGE_HZ: u64 = 50;
pub(super) const FRAMES_HZ: u64 = 30;

pub(super) fn at(number: u64, rate_hz: u64) -> HostTime {
    HostTime::from_nanos(ORIGIN_NS + number * 1_000_000_000 / rate_hz)
}

/// Numbers that look like noise and follow from `number` (SplitMix64, Steele et al. 2014).
pub(super) fn scrambled(number: u64) -> u64 {
    let mut z = number.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

pub(super) fn force_record(number: u64) -> ForceRecord {
    ForceRecord {
        host: at(number, FORCE_HZ),
        rdt_sequence: number as u32 + 1,
        // Wraps after 1000 records.
        ft_sequence: (u32::MAX - 999).wrapping_add(number as u32),
        status: scrambled(number).is_multiple_of(50).into(),
        counts: std::array::from_fn(|i| scrambled(7 * number + i as u64) as i32),
    }
}

pub(super) fn report(number: u64) -> StageReport {
    let noise = scrambled(number);
    StageReport {
        host: at(number, STAGE_HZ),
        tick_us: (!number.is_multiple_of(3)).then_some(noise as u32),
        position_m: [noise as f64 * 1e-20, -(number as f64) / 3.0],
        state: match number % 4 {
            0 => StageState::Idle,
            1 => StageState::Moving,
            2 => StageState::Homing,
            _ => StageState::Fault { code: noise as u8 },
        },
        homed: number.is_multiple_of(2),
    }
}

pub(super) fn frame(number: u64) -> MarkerFrame {
    let seen = (0..20).filter(|marker| !(number + marker).is_multiple_of(7));
    MarkerFrame {
        host: at(number, FRAMES_HZ),
        number: number as u32,
        markers: seen
            .map(|marker| MarkerPosition {
                marker: marker as u32,
                position_m: std::array::from_fn(|i| {
                    scrambled(number * 60 + marker * 3 + i as u64) as f64 * 1e-21
                }),
            })
            .collect(),
    }
}

pub(super) fn event(second: u64) -> Event {
    let mut event = Event::new(at(second, 1), "poke-began");
    event.poke = Some(second as u32);
    event.detail.insert("depth_m".to_owned(), 0.1.into());
    event
}

pub(super) fn probe(second: u64) -> ClockProbe {
    ClockProbe {
        device: "stage µ".to_owned(),
        sent: at(second, 1),
        received: at(second * 10 + 1, 10),
        device_ticks: scrambled(second),
        tick_hz: 1e6,
    }
}

/// What a session of the bench begins with.
pub(crate) fn start() -> StartDocument {
    StartDocument {
        format: String::new(),
        name: "soft block, first try".to_owned(),
        segment: 0,
        first_poke: 0,
        started_utc: "2026-11-22T15:57:03.250000Z".to_owned(),
        started_host_ns: ORIGIN_NS,
        boot: String::new(),
        variables: Default::default(),
        program: "phantom-rig 0.1.0".to_owned(),
        seeds: [("protocol".to_owned(), u64::MAX)].into(),
        rig: HashedText::new("[stage]\nport = \"/dev/ttyACM0\"\n"),
        protocol: HashedText::new("[[poke]]\ndepth_mm = 3.0\n"),
        stage: Some(StageDocument {
            controller: "Grbl 1.1h".to_owned(),
            firmware: "1.1h.20190825".to_owned(),
            port: "/dev/ttyACM0".to_owned(),
            travel_m: [[0.0, 0.2], [-0.03, 0.0]],
            speed_m_s: [0.05; 2],
            acceleration_m_s2: [0.5; 2],
            step_m: [1.0 / 320_000.0; 2],
        }),
        force: Some(ForceDocument {
            product: "Net F/T".to_owned(),
            calibration: "FT12345".to_owned(),
            configuration: "Nano17".to_owned(),
            address: "192.168.1.1:49152".to_owned(),
            counts_per_newton: 1e6,
            counts_per_newton_metre: 1e9 / 3.0,
            rate_hz: FORCE_HZ as f64,
            tick_hz: FORCE_HZ as f64,
            range: Some([12.0, 12.0, 17.0, 0.12, 0.12, 0.12]),
            stop_mask: 0x8002_0000,
        }),
        markers: Some(MarkersDocument {
            source: "simulated".to_owned(),
            rate_hz: FRAMES_HZ as f64,
            markers: 20,
        }),
        camera: None,
        calibration: None,
        mounting: Some(MountingDocument {
            origin_m: [0.01, 0.05, 0.03],
            axes: [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0]],
            tolerance_m: 1e-4,
            sensor_to_phantom: [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
            sensor_to_tip_m: [0.0, 0.0, 0.04],
            reads_reaction: true,
        }),
        tip: TipDocument {
            contact: "bonded".to_owned(),
            shape: "pad".to_owned(),
            radius_m: 0.004,
            sphere_radius_m: None,
        },
        phantom: PhantomDocument {
            description: "silicone, 10 kPa nominal".to_owned(),
            mesh: Some("mesh.msh".to_owned()),
            mesh_sha256: Some("0a1b2c".to_owned()),
            poisson_ratio: 0.47,
            density_kg_m3: 1050.0,
            modulus_range_pa: [5e3, 2e4],
        },
    }
}

/// Hands over `seconds` of everything from second `from` on, in the order of time. A few seconds fit into the queue as a whole.
pub(super) fn hand_over(recorder: &mut Recorder, from: u64, seconds: u64) {
    for second in from..from + seconds {
        assert!(recorder.event(event(second)) && recorder.clock_probe(probe(second)));
        for tick in 0..100 {
            let part = |rate_hz: u64| {
                second * rate_hz + tick * rate_hz / 100..second * rate_hz + (tick + 1) * rate_hz / 100
            };
            let records: Vec<ForceRecord> = part(FORCE_HZ).map(force_record).collect();
            assert!(recorder.force(&records, records[records.len() - 1].host));
            assert!(part(STAGE_HZ).all(|n| recorder.stage(report(n))));
            assert!(part(FRAMES_HZ).all(|n| recorder.markers(frame(n))));
        }
    }
}

/// Records a finished session, each second of it in chunks of its own.
pub(super) fn record(folder: &Path, seconds: u64) -> StopDocument {
    let writer = SessionWriter::create(folder, start()).expect("a new session");
    let mut recorder = writer.recorder();
    let size = || fs::metadata(folder.join("session.mcap")).expect("a file").len();
    for second in 0..seconds {
        let before = size();
        hand_over(&mut recorder, second, 1);
        let began = HostTime::now();
        while size() == before {
            assert!(HostTime::now().since(began) < Duration::from_secs(20), "nothing is written out");
            std::thread::yield_now();
        }
    }
    drop(recorder);
    let sensor = Losses { received: seconds * FORCE_HZ, ..Losses::default() };
    writer.finish(Outcome::Success, sensor, at(seconds, 1)).expect("finished")
}
