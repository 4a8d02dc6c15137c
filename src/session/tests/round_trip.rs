//! Does what was handed over come back, and does the session say so?

use super::fixtures::{
    FORCE_HZ, FRAMES_HZ, STAGE_HZ, at, event, force_record, frame, hand_over, probe, record, report, start,
};
use crate::device::Losses;
use crate::session::{
    Event, FORMAT, Finding, HashedText, Message, Outcome, Rates, Session, SessionError, SessionWriter,
    StartDocument, Topic, bytes_per_second,
};
use std::fs;

#[test]
fn everything_comes_back_in_its_order() {
    let place = tempfile::tempdir().expect("a folder");
    let folder = place.path().join("session");
    let stop = record(&folder, 2);
    let session = Session::open(&folder).expect("a session");

    let expected = StartDocument { format: FORMAT.to_owned(), segment: 1, ..start() };
    assert_eq!(session.start(), &expected);
    assert_eq!(session.stop(), Some(&stop));
    assert_eq!(stop.force_records, 2 * FORCE_HZ);
    assert_eq!((stop.outcome, stop.sensor.received), (Outcome::Success, 2 * FORCE_HZ));

    let force: Vec<_> = session.force().map(|r| r.expect("a record")).collect();
    assert!(force.iter().copied().eq((0..2 * FORCE_HZ).map(force_record)));
    assert!(session.stage().map(|r| r.expect("a report")).eq((0..2 * STAGE_HZ).map(report)));
    assert!(session.markers().map(|r| r.expect("a frame")).eq((0..2 * FRAMES_HZ).map(frame)));
    assert!(session.events().map(|r| r.expect("an event")).eq((0..2).map(event)));
    assert!(session.clock_probes().map(|r| r.expect("a probe")).eq((0..2).map(probe)));
    assert_eq!(session.gaps().count(), 0);

    let all: Vec<_> = session.messages(&Topic::ALL).map(|r| r.expect("a message").message).collect();
    assert!(matches!(all.first(), Some(Message::Start(_))));
    assert!(matches!(all.last(), Some(Message::Stop(_))));
    assert!(all.windows(2).all(|pair| pair[0].host() <= pair[1].host()));

    assert_eq!(session.verify().expect("readable"), []);
    let info = session.info().expect("readable");
    assert_eq!((info.topics[&Topic::Force].records, info.force.received), (2 * FORCE_HZ, 2 * FORCE_HZ));
    // Recorded times are rounded to whole nanoseconds.
    let rate = info.topics[&Topic::Force].rate_hz.expect("a rate");
    assert!((rate / FORCE_HZ as f64 - 1.0).abs() < 1e-6, "{rate}");
}

#[test]
fn a_finished_session_is_read_only_and_neither_overwritten_nor_continued() {
    let place = tempfile::tempdir().expect("a folder");
    let folder = place.path().join("session");
    record(&folder, 1);
    let entries = fs::read_dir(&folder).expect("a folder").map(|e| e.expect("an entry").path());
    for path in entries.chain([folder.clone()]) {
        let permissions = fs::metadata(&path).expect("there").permissions();
        assert!(permissions.readonly(), "{}", path.display());
    }
    assert!(matches!(SessionWriter::create(&folder, start()), Err(SessionError::Exists { .. })));
    assert!(matches!(SessionWriter::continue_session(&folder, start()), Err(SessionError::Finished { .. })));
}

#[test]
fn an_interrupted_session_goes_on_in_a_second_file() {
    let place = tempfile::tempdir().expect("a folder");
    let folder = place.path().join("session");
    let writer = SessionWriter::create(&folder, start()).expect("a new session");
    let mut recorder = writer.recorder();
    hand_over(&mut recorder, 0, 1);
    drop(recorder);
    let meanwhile = SessionWriter::continue_session(&folder, start());
    assert!(matches!(meanwhile, Err(SessionError::InUse { .. })), "{meanwhile:?}");
    drop(writer);

    let session = Session::open(&folder).expect("a session");
    assert_eq!(session.stop(), None);
    assert_eq!(session.verify().expect("readable"), [Finding::Interrupted]);
    let other = StartDocument { protocol: HashedText::new("[[poke]]\ndepth_mm = 4.0\n"), ..start() };
    let other = SessionWriter::continue_session(&folder, other);
    assert!(matches!(other, Err(SessionError::Different { what: "protocol", .. })), "{other:?}");
    let mut other = start();
    other.phantom.mesh_sha256 = Some("another".to_owned());
    let other = SessionWriter::continue_session(&folder, other);
    assert!(matches!(other, Err(SessionError::Different { what: "phantom's mesh", .. })), "{other:?}");

    let writer = SessionWriter::continue_session(&folder, StartDocument { first_poke: 1, ..start() });
    let writer = writer.expect("an interrupted session");
    let mut recorder = writer.recorder();
    hand_over(&mut recorder, 1, 1);
    drop(recorder);
    let cause = "a person stopped it".to_owned();
    writer.finish(Outcome::Abort { cause: cause.clone() }, Losses::default(), at(9, 1)).expect("finished");

    let session = Session::open(&folder).expect("a session");
    assert_eq!(session.segments(), 2);
    assert!(session.force().map(|r| r.expect("a record")).eq((0..2 * FORCE_HZ).map(force_record)));
    assert_eq!(session.stop().map(|stop| &stop.outcome), Some(&Outcome::Abort { cause }));
    assert_eq!(session.verify().expect("readable"), []);
    let parts: Vec<_> = session.parts().iter().map(|part| part.force().count()).collect();
    assert_eq!(parts, [FORCE_HZ as usize; 2]);
}

#[test]
fn a_session_that_was_stopped_goes_on_beside_files_that_stay_read_only() {
    let place = tempfile::tempdir().expect("a folder");
    let folder = place.path().join("session");
    let stopped = SessionWriter::create(&folder, start()).expect("a new session");
    let cause = "a limit".to_owned();
    stopped.finish(Outcome::Abort { cause }, Losses::default(), at(9, 1)).expect("finished");
    let before = fs::read(folder.join("session.mcap")).expect("a file");

    let start = StartDocument { first_poke: 1, ..start() };
    let writer = SessionWriter::continue_session(&folder, start).expect("a session that was stopped");
    assert!(fs::metadata(folder.join("session.mcap")).expect("a file").permissions().readonly());
    writer.finish(Outcome::Success, Losses::default(), at(19, 1)).expect("finished");
    assert!(fs::metadata(&folder).expect("a folder").permissions().readonly());
    assert_eq!(fs::read(folder.join("session.mcap")).expect("a file"), before);
    let session = Session::open(&folder).expect("a session");
    let ends: Vec<_> =
        session.parts().iter().map(|p| p.stop().map(|s| s.outcome == Outcome::Success)).collect();
    assert_eq!(ends, [Some(false), Some(true)]);
}

/// The manifest with another protocol and the old hash: both are told.
#[test]
fn a_changed_protocol_is_noticed() {
    let place = tempfile::tempdir().expect("a folder");
    let folder = place.path().join("session");
    let protocol = HashedText { text: "changed".to_owned(), ..start().protocol };
    let writer =
        SessionWriter::create(&folder, StartDocument { protocol, ..start() }).expect("a new session");
    writer.finish(Outcome::Success, Losses::default(), at(9, 1)).expect("finished");
    fs::remove_file(folder.join("manifest.json")).expect("root may, and so may an owner who insists");
    let findings = Session::open(&folder).expect("a session").verify().expect("readable");
    assert_eq!(findings, [Finding::Manifest, Finding::Hash { segment: 1, what: "protocol" }]);
}

#[test]
fn a_document_that_would_not_read_the_same_is_refused() {
    let place = tempfile::tempdir().expect("a folder");
    let mut bad = start();
    bad.tip.radius_m = f64::NAN;
    let folder = place.path().join("session");
    assert!(matches!(SessionWriter::create(&folder, bad), Err(SessionError::Unwritable { .. })));
    assert!(!folder.exists());
}

#[test]
fn tables_are_exact_and_the_same_every_time() {
    let place = tempfile::tempdir().expect("a folder");
    let folder = place.path().join("session");
    record(&folder, 1);
    let session = Session::open(&folder).expect("a session");
    let [first, second] = ["a", "b"].map(|name| {
        let folder = place.path().join(name);
        fs::create_dir(&folder).expect("a folder");
        let files = session.export_csv(&folder).expect("tables");
        files.iter().map(|file| fs::read_to_string(file).expect("a table")).collect::<Vec<_>>()
    });
    assert_eq!(first, second);
    let again = session.export_csv(&place.path().join("a"));
    assert!(matches!(again, Err(SessionError::Exists { .. })), "{again:?}");

    let mut force = first[0].lines();
    assert_eq!(
        force.next(),
        Some(
            "segment,host_time,rdt_sequence,ft_sequence,status,fx,fy,fz,tx,ty,tz,\
             fx_counts,fy_counts,fz_counts,tx_counts,ty_counts,tz_counts"
        )
    );
    assert_eq!(force.next(), Some("1,ns,1,1,1,N,N,N,N m,N m,N m,1,1,1,1,1,1"));
    let format = session.start().force.as_ref().expect("a sensor").format();
    let mut rows = 0;
    for (row, number) in force.zip(0..) {
        let record = force_record(number);
        let cells: Vec<&str> = row.split(',').collect();
        assert_eq!(cells[1].parse(), Ok(record.host.nanos()));
        for (i, value) in format.wrench(record.counts).into_iter().enumerate() {
            assert_eq!(cells[5 + i].parse::<f64>().map(f64::to_bits), Ok(value.to_bits()));
            assert_eq!(cells[11 + i].parse(), Ok(record.counts[i]));
        }
        rows += 1;
    }
    assert_eq!(rows, FORCE_HZ);
}

/// What is stated as the need for room is enough, and not much too much.
#[test]
fn the_room_that_is_asked_for_is_the_room_that_is_used() {
    let place = tempfile::tempdir().expect("a folder");
    let [one, three] = [1, 3].map(|seconds| {
        let folder = place.path().join(seconds.to_string());
        record(&folder, seconds);
        fs::metadata(folder.join("session.mcap")).expect("a file").len() as f64
    });
    let rates = Rates { force_hz: 7000.0, stage_hz: 50.0, frames_hz: 30.0, markers: 20 };
    let (used, stated) = ((three - one) / 2.0, bytes_per_second(rates));
    assert!(stated > used && stated < 1.1 * used, "{stated} B/s stated, {used} B/s used");
}

/// Every key that a document writes stands in its schema, and the other way round.
#[test]
fn documents_follow_their_schemas() {
    let place = tempfile::tempdir().expect("a folder");
    let folder = place.path().join("session");
    let stop = record(&folder, 1);
    let stop = crate::session::StopDocument { outcome: Outcome::Fail { cause: "x".to_owned() }, ..stop };
    let documents = [
        (Topic::Start, serde_json::to_value(start()).expect("JSON")),
        (Topic::Event, serde_json::to_value(event(0)).expect("JSON")),
        (Topic::Stop, serde_json::to_value(stop).expect("JSON")),
    ];
    for (topic, document) in documents {
        let schema: serde_json::Value = serde_json::from_str(topic.schema().text).expect("JSON");
        let keys = |value: &serde_json::Value| -> Vec<String> {
            value.as_object().map(|o| o.keys().cloned().collect()).unwrap_or_default()
        };
        let (mut stated, mut written) = (keys(&schema["properties"]), keys(&document));
        stated.sort();
        written.sort();
        assert_eq!(stated, written, "{topic}");
    }
}

/// A batch lasts less than 10 ms, so that slow streams are not held back, and its cut depends on the records alone.
#[test]
fn batches_are_short_in_time() {
    let place = tempfile::tempdir().expect("a folder");
    let folder = place.path().join("session");
    let writer = SessionWriter::create(&folder, start()).expect("a new session");
    let mut recorder = writer.recorder();
    // 1000 records a second: ten to a batch, whatever the calls.
    for (part, calls) in [(0, 1), (1, 3), (2, 25)] {
        let records: Vec<_> = (100 * part..100 * (part + 1)).map(|n| force_record(7 * n)).collect();
        records.chunks(calls).for_each(|part| assert!(recorder.force(part, part[part.len() - 1].host)));
    }
    assert!(recorder.event(Event::new(force_record(0).host, "end")));
    drop(recorder);
    writer.finish(Outcome::Success, Losses::default(), at(9, 1)).expect("finished");
    let session = Session::open(&folder).expect("a session");
    let mut sizes = Vec::new();
    for recorded in session.messages(&[Topic::Force]) {
        match recorded.expect("a message").message {
            Message::Force(batch) => sizes.push(batch.records().len()),
            other => panic!("{other:?}"),
        }
    }
    assert_eq!(sizes.iter().sum::<usize>(), 300);
    assert!(sizes.iter().all(|&size| size == 10), "{sizes:?}");
}
