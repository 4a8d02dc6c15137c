//! What is saved of a damaged session, is what is lost said, and does any sequence of bytes make a reader panic?

use super::fixtures::{FORCE_HZ, FRAMES_HZ, STAGE_HZ, force_record, frame, record, report, start};
use crate::session::container::{Channels, Layout, Part, closing_checksums_agree, load, survey, walk};
use crate::session::document::StopDocument;
use crate::session::message::{ForceBatch, Message};
use crate::session::recover::salvage;
use crate::session::scribe::Scribe;
use crate::session::tally::Tally;
use crate::session::{Finding, Loss, Outcome, Session, SessionError, Topic, recover};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::fs;
use std::io::Cursor;
use std::path::Path;

/// A small file, as bytes: a chunk for the start document, one for each of three seconds, one for the stop document.
fn small_file() -> Vec<u8> {
    let mut scribe = Scribe::begin(Vec::new(), Path::new("memory")).expect("a file");
    scribe.write(Message::Start(Box::new(start()))).expect("written");
    scribe.flush().expect("written");
    for chunk in 0..3 {
        for number in 0..3 {
            let mut batch = ForceBatch::new();
            let first = chunk * FORCE_HZ + number * 3;
            (first..first + 3).for_each(|n| assert!(batch.push(force_record(n))));
            scribe.write(Message::Force(batch)).expect("written");
        }
        scribe.write(Message::Stage(report(chunk * STAGE_HZ))).expect("written");
        scribe.write(Message::Markers(frame(chunk * FRAMES_HZ))).expect("written");
        scribe.flush().expect("written");
    }
    let stop = StopDocument {
        outcome: Outcome::Success,
        stopped_host_ns: force_record(3 * FORCE_HZ).host.nanos(),
        messages: scribe.counts().messages(),
        force_records: 27,
        dropped: Default::default(),
        sensor: Default::default(),
    };
    scribe.write(Message::Stop(Box::new(stop))).expect("written");
    scribe.finish().expect("written")
}

/// Saves what is readable of a file, and returns it with what was lost.
fn saved(bytes: &[u8]) -> (Vec<u8>, Loss) {
    let mut source = Cursor::new(bytes);
    let layout = survey(&mut source).expect("memory is readable");
    let scribe = Scribe::begin(Vec::new(), Path::new("memory")).expect("a file");
    salvage(&mut source, &layout, None, scribe, 1).expect("memory is readable and writable")
}

fn messages_of(bytes: &[u8]) -> Vec<(u32, Message)> {
    let mut source = Cursor::new(bytes);
    let layout = survey(&mut source).expect("memory is readable");
    let mut messages = Vec::new();
    walk(&mut source, &layout, |part| {
        if let Part::Messages(found) = part {
            let decoded = found.iter().map(|raw| (raw.sequence, Message::decode(raw.topic, raw.payload)));
            messages
                .extend(decoded.map(|(sequence, message)| (sequence, message.expect("follows its schema"))));
        }
        Ok::<_, std::io::Error>(())
    })
    .expect("memory is readable");
    messages
}

/// Cut off after every single byte: what is saved is what was there, from the beginning on, and every byte is accounted for.
#[test]
fn a_file_cut_off_anywhere_keeps_its_beginning() {
    let whole = small_file();
    let all = messages_of(&whole);
    let mut kept_before = 0;
    for length in 0..whole.len() {
        let (file, loss) = saved(&whole[..length]);
        let kept = messages_of(&file);
        assert_eq!(kept, all[..kept.len()], "cut off at {length}");
        assert!(kept.len() >= kept_before, "cut off at {length}");
        assert_eq!(loss.saved.values().sum::<u64>(), kept.len() as u64);
        // Nothing is known to be missing between what is there, and the end is not known.
        assert!(loss.lost.is_empty() && loss.lost_force_records == 0 && !loss.is_none());
        kept_before = kept.len();
    }
    assert_eq!(kept_before, all.len());
    let mut source = Cursor::new(&whole);
    assert_eq!(survey(&mut source).expect("readable").tail, None);
}

/// One bit at a time, at every byte: nothing but what was written is saved, at most one chunk is lost, and that is said.
#[test]
fn a_flipped_bit_costs_one_chunk_at_most_and_is_noticed() {
    let whole = small_file();
    let all = messages_of(&whole);
    let mut random = ChaCha8Rng::seed_from_u64(3);
    for at in 0..whole.len() {
        let mut damaged = whole.clone();
        damaged[at] ^= 1 << random.random_range(0..8);
        let (file, loss) = saved(&damaged);
        let kept = messages_of(&file);
        let mut left = all.iter();
        assert!(
            kept.iter().all(|message| left.any(|other| other == message)),
            "byte {at}: something else was saved"
        );
        assert!(all.len() - kept.len() <= 5, "byte {at}: {} of {} saved", kept.len(), all.len());
        if kept.len() < all.len() {
            assert!(loss.bytes > 0, "byte {at}: {loss:?}");
        }
    }
}

#[test]
fn a_lost_chunk_is_stated_in_bytes_records_and_seconds() {
    let whole = small_file();
    let mut source = Cursor::new(&whole);
    let layout = survey(&mut source).expect("readable");
    let chunk = layout.chunks[2];
    let mut damaged = whole.clone();
    damaged[chunk.offset as usize + 40] ^= 0x10;
    let (_, loss) = saved(&damaged);
    assert_eq!(loss.bytes, chunk.hole_of_chunk().bytes);
    assert_eq!(loss.lost, [("/force", 3), ("/stage", 1), ("/markers", 1)].into());
    assert_eq!(loss.lost_force_records, 9);
    // From the ninth force record of the first second to the first one of the third.
    assert!((loss.lost_s - (2.0 - 8.0 / FORCE_HZ as f64)).abs() < 2e-9, "{} s", loss.lost_s);
}

#[test]
fn a_damaged_session_is_told_and_recovered() {
    let place = tempfile::tempdir().expect("a folder");
    let (folder, into) = (place.path().join("session"), place.path().join("saved"));
    record(&folder, 3);
    let file = folder.join("session.mcap");
    let mut bytes = fs::read(&file).expect("a file");
    let middle = bytes.len() / 2;
    bytes[middle..middle + 1000].fill(0);
    fs::remove_file(&file).expect("removed");
    fs::write(&file, &bytes).expect("written");

    let session = Session::open(&folder).expect("a session that opens");
    assert!(session.force().any(|r| matches!(r, Err(SessionError::Damaged { .. }))));
    let kept = session.force().filter(|r| r.is_ok()).count() as u64;
    let missing = 3 * FORCE_HZ - kept;
    let findings = session.verify().expect("readable");
    assert!(findings.contains(&Finding::MissingForce { segment: 1, records: missing }), "{findings:?}");
    assert!(findings.contains(&Finding::Checksum { segment: 1 }));

    let recovery = recover(&folder, &into).expect("saved");
    let [loss] = &recovery.segments[..] else { panic!("{recovery:?}") };
    assert_eq!((loss.saved_force_records, loss.lost_force_records), (kept, missing));
    assert!(loss.end_is_known && loss.bytes >= 1000);
    // Times go on at 7000 Hz: the hole lasts as long as the missing records, and the step over it.
    let expected_s = (missing + 1) as f64 / FORCE_HZ as f64;
    assert!((loss.lost_s - expected_s).abs() < 0.034, "{} s for {expected_s} s", loss.lost_s);
    let saved = Session::open(&into).expect("a session");
    assert!(saved.force().all(|r| r.is_ok()));
    assert_eq!(saved.force().count() as u64, kept);
    assert_eq!(saved.stop(), session.stop());
    assert!(matches!(recover(&folder, &into), Err(SessionError::Exists { .. })));
}

/// The first chunk holds schemas, channels and the start document; the manifest stands in for it.
#[test]
fn a_session_without_its_beginning_is_read_with_the_manifest() {
    let place = tempfile::tempdir().expect("a folder");
    let folder = place.path().join("session");
    record(&folder, 1);
    let file = folder.join("session.mcap");
    let mut bytes = fs::read(&file).expect("a file");
    bytes[..200].fill(0xFF);
    fs::remove_file(&file).expect("removed");
    fs::write(&file, &bytes).expect("written");
    let session = Session::open(&folder).expect("a session");
    assert_eq!(session.start().name, start().name);
    assert_eq!(session.force().filter(|r| r.is_ok()).count() as u64, FORCE_HZ);
    assert!(session.verify().expect("readable").contains(&Finding::NoStart { segment: 1 }));
    fs::remove_file(folder.join("manifest.json")).expect("removed");
    assert!(matches!(Session::open(&folder), Err(SessionError::NoStart { .. })));
}

/// Only the manifest is left: what the session was meant to be is known, and that nothing of it is there.
#[test]
fn a_session_whose_file_is_empty_is_said_to_hold_nothing() {
    let place = tempfile::tempdir().expect("a folder");
    let (folder, emptied) = (place.path().join("session"), place.path().join("emptied"));
    record(&folder, 1);
    fs::create_dir(&emptied).expect("writable");
    fs::copy(folder.join("manifest.json"), emptied.join("manifest.json")).expect("a copy");
    fs::write(emptied.join("session.mcap"), []).expect("writable");
    let findings = Session::open(&emptied).expect("a session that opens").verify().expect("readable");
    assert_eq!(findings, [Finding::Interrupted, Finding::Empty { segment: 1 }]);
}

/// Every byte of a finished file stands under some checksum.
#[test]
fn no_flipped_bit_escapes_verification() {
    let whole = small_file();
    let is_sound = |bytes: &[u8]| {
        let mut source = Cursor::new(bytes);
        let layout = survey(&mut source).expect("readable");
        let tally = Tally::of(&mut source, &layout, 1).expect("readable");
        let closed = closing_checksums_agree(&mut source, &layout).expect("readable");
        closed && tally.damage.is_empty()
    };
    assert!(is_sound(&whole));
    let mut random = ChaCha8Rng::seed_from_u64(4);
    for at in 0..whole.len() {
        let mut damaged = whole.clone();
        damaged[at] ^= 1 << random.random_range(0..8);
        assert!(!is_sound(&damaged), "byte {at}");
    }
}

/// One damaged file: truncated, bits flipped, parts overwritten, repeated, or nothing but noise.
fn mutated(whole: &[u8], random: &mut ChaCha8Rng) -> Vec<u8> {
    let mut bytes = whole.to_vec();
    if random.random_range(0..20) == 0 {
        bytes = (0..random.random_range(0..4096)).map(|_| random.random()).collect();
    }
    for _ in 0..random.random_range(1..6) {
        let length = bytes.len();
        if length < 2 {
            break;
        }
        let (from, size) = (random.random_range(0..length), random.random_range(1..64));
        let until = (from + size).min(length);
        match random.random_range(0..7) {
            0 => bytes.truncate(from),
            1 => bytes[from] ^= 1 << random.random_range(0..8),
            2 => bytes[from..until].fill(random.random()),
            3 => bytes[from..until].iter_mut().for_each(|b| *b = random.random()),
            4 => bytes.extend_from_within(from..until),
            5 => drop(bytes.drain(from..until)),
            _ => {
                // A length that lies, where lengths are likely to be.
                let lie: u64 = [0, 1, 40, u64::MAX, u64::MAX - 40, length as u64][random.random_range(0..6)];
                let until = (from + 8).min(length);
                bytes[from..until].copy_from_slice(&lie.to_le_bytes()[..until - from]);
            }
        }
    }
    bytes
}

/// So many inputs are tried.
fn inputs() -> u64 {
    std::env::var("FUZZ_INPUTS").ok().and_then(|n| n.parse().ok()).unwrap_or(2000)
}

#[test]
fn no_bytes_make_a_reader_panic_or_invent() {
    let whole = small_file();
    let all = messages_of(&whole);
    for seed in 0..inputs() {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let bytes = mutated(&whole, &mut random);
        let (file, loss) = saved(&bytes);
        let kept = messages_of(&file);
        // A repeated chunk is there twice; nothing is there that was not written.
        assert!(kept.iter().all(|message| all.contains(message)), "seed {seed}");
        assert_eq!(loss.saved.values().sum::<u64>(), kept.len() as u64, "seed {seed}");
        assert!(loss.bytes <= bytes.len() as u64, "seed {seed}");
    }
}

/// Behind a checksum that agrees, too: payloads and records of every kind of wrongness.
#[test]
fn no_payload_makes_a_decoder_panic() {
    let mut payloads = Vec::new();
    for (_, message) in messages_of(&small_file()) {
        let mut bytes = Vec::new();
        message.encode(&mut bytes).expect("bytes");
        assert_eq!(Message::decode(message.topic(), &bytes), Some(message.clone()));
        payloads.push((message.topic(), bytes));
    }
    for seed in 0..inputs() {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let (topic, payload) = &payloads[random.random_range(0..payloads.len())];
        let bytes = mutated(payload, &mut random);
        if let Some(message) = Message::decode(*topic, &bytes) {
            let mut again = Vec::new();
            message.encode(&mut again).expect("bytes");
            assert_eq!(Message::decode(*topic, &again).map(|m| m.topic()), Some(*topic), "seed {seed}");
        }
    }
}

/// Chunks whose records are wrong although a checksum agrees, as another program could write them.
#[test]
fn no_records_make_a_tally_panic() {
    let whole = small_file();
    let mut source = Cursor::new(&whole);
    let layout = survey(&mut source).expect("memory is readable");
    let mut records = Vec::new();
    assert!(load(&mut source, &layout.chunks[1], &mut records).expect("memory is readable"));
    for seed in 0..inputs() {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut tally = Tally::new(1);
        let bytes = mutated(&records, &mut random);
        Channels::default().messages(&bytes).iter().for_each(|raw| tally.message(raw));
        assert!(tally.count(Topic::Force).messages <= bytes.len() as u64);
    }
}

#[test]
fn an_empty_file_has_nothing_in_it() {
    assert_eq!(survey(&mut Cursor::new(&[])).expect("readable"), Layout::default());
}
