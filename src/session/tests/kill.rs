//! How much is lost when the process is killed at any instant?

use super::fixtures::{FORCE_HZ, force_record, frame, report, start};
use crate::clock::HostTime;
use crate::clock::steady::steady;
use crate::session::{Session, SessionWriter};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::cell::Cell;
use std::io::{Read, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

/// Names the folder to record into; set for the process that is to be killed.
const FOLDER: &str = "PHANTOM_RIG_TEST_RECORD_UNTIL_KILLED";

/// What may be lost (records): 0.2 s.
const BUDGET: u64 = FORCE_HZ / 5;

/// The process that is to be killed: records in real time, and reports on its standard error how many force records it has handed over,
/// eight bytes each time. Without the variable it does nothing.
#[test]
fn records_until_killed() {
    let Some(folder) = std::env::var_os(FOLDER) else { return };
    let writer = SessionWriter::create(Path::new(&folder), start()).expect("a new session");
    let mut recorder = writer.recorder();
    let (began, mut handed, mut others) = (HostTime::now(), 0_u64, 0_u64);
    let mut records = Vec::with_capacity(2 * BUDGET as usize);
    // Ends by itself should nobody kill it.
    while handed < 60 * FORCE_HZ {
        std::thread::sleep(Duration::from_millis(1));
        let passed = HostTime::now().since(began);
        let due = passed.as_nanos() as u64 * FORCE_HZ / 1_000_000_000;
        records.clear();
        records.extend((handed..due).map(force_record));
        let Some(last) = records.last() else { continue };
        assert!(recorder.force(&records, last.host));
        handed = due;
        std::io::stderr().write_all(&handed.to_le_bytes()).expect("a parent");
        while others < passed.as_millis() as u64 / 30 {
            assert!(recorder.stage(report(others)) && recorder.markers(frame(others)));
            others += 1;
        }
    }
}

/// Has a process record, kills it once it has handed over `instant` records, and returns how many records it had handed over that are not
/// in the session.
fn lost_when_killed(folder: &Path, instant: u64) -> u64 {
    let this_module = module_path!().split_once("::").expect("a crate").1;
    let mut child = Command::new(std::env::current_exe().expect("this program"))
        .args([&format!("{this_module}::records_until_killed"), "--exact", "--nocapture", "--test-threads=1"])
        .env(FOLDER, folder)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("a process");
    let mut pipe = child.stderr.take().expect("a pipe");
    let (mut handed, mut bytes) = (0, [0; 8]);
    let mut is_killed = false;
    while pipe.read_exact(&mut bytes).is_ok() {
        handed = u64::from_le_bytes(bytes);
        if handed >= instant && !is_killed {
            child.kill().expect("a process that is there");
            is_killed = true;
        }
    }
    child.wait().expect("a process that has ended");
    assert!(is_killed, "it ended by itself after {handed} records");

    let session = Session::open(folder).expect("a session that opens");
    assert_eq!(session.stop(), None);
    let mut kept = 0;
    for record in session.force() {
        assert_eq!(record.expect("no damage in the middle"), force_record(kept));
        kept += 1;
    }
    // What was handed over between the last report and the kill may be there as well.
    handed.saturating_sub(kept)
}

/// What is lost by kills at random instants, in order. One while the machine itself was held up is made again: a thread that gets no
/// processor writes nothing.
fn distribution(instants: usize, seed: u64) -> Vec<u64> {
    let place = tempfile::tempdir().expect("a folder");
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let attempts = Cell::new(0);
    let mut all = Vec::with_capacity(instants);
    for _ in 0..instants {
        let instant = random.random_range(100..2 * FORCE_HZ);
        let found = Cell::new(0);
        steady(|| {
            attempts.set(attempts.get() + 1);
            let lost = lost_when_killed(&place.path().join(attempts.get().to_string()), instant);
            assert!(lost <= BUDGET, "{lost} records");
            found.set(lost);
        });
        all.push(found.get());
    }
    println!(
        "{} kills, {} of them repeated because the machine was held up",
        attempts.get(),
        attempts.get() - instants
    );
    all.sort_unstable();
    all
}

#[test]
fn a_kill_loses_no_more_than_a_fifth_of_a_second() {
    distribution(5, 1);
}

/// Run by `cargo test --release -- --ignored --nocapture a_hundred_kills`.
#[test]
#[ignore = "takes minutes"]
fn a_hundred_kills() {
    let lost = distribution(100, 2);
    let ms = |records: u64| records as f64 * 1e3 / FORCE_HZ as f64;
    println!(
        "lost at 100 kills: least {:.0} ms, median {:.0} ms, 90 % {:.0} ms, most {:.0} ms",
        ms(lost[0]),
        ms(lost[50]),
        ms(lost[90]),
        ms(lost[99])
    );
}
