//! Does a replay hand out what was recorded, in step, and does recording it anew give the same bytes?

use super::fixtures::{FORCE_HZ, FRAMES_HZ, STAGE_HZ, at, record, start};
use crate::clock::HostTime;
use crate::device::{ForceSensor, Losses, MarkerSource, Motion, Stage};
use crate::session::{Outcome, Replay, Session, SessionError, SessionWriter, Speed, StartDocument, Topic};
use std::path::Path;
use std::time::Duration;

/// Topic, number and payload of every message, topic by topic.
fn payloads(session: &Session) -> Vec<(Topic, u32, Vec<u8>)> {
    let mut payloads = Vec::new();
    for recorded in session.messages(&[Topic::Force, Topic::Stage, Topic::Markers]) {
        let recorded = recorded.expect("a message");
        let mut bytes = Vec::new();
        recorded.message.encode(&mut bytes).expect("bytes");
        payloads.push((recorded.message.topic(), recorded.sequence, bytes));
    }
    payloads.sort();
    payloads
}

/// Records everything that the devices of a replay hand out.
fn record_replay(session: &Session, speed: Speed, folder: &Path) {
    let replay = Replay::new(session, speed).expect("a replay");
    let mut stage = replay.stage().expect("a stage");
    let mut force = replay.force().expect("a force sensor");
    let mut markers = replay.markers().expect("markers");
    let writer = SessionWriter::create(folder, start()).expect("a new session");
    let mut recorder = writer.recorder();
    force.start().expect("started");
    let mut records = Vec::with_capacity(64);
    while !(stage.is_over() && force.is_over() && markers.is_over()) {
        let until = HostTime::now() + Duration::from_millis(1);
        records.clear();
        force.receive(until, &mut records).expect("records");
        assert!(recorder.force(&records, HostTime::now()));
        let until = HostTime::now();
        stage.report(until).expect("a report").into_iter().for_each(|r| assert!(recorder.stage(r)));
        markers.frame(until).expect("a frame").into_iter().for_each(|f| assert!(recorder.markers(f)));
    }
    assert_eq!(force.losses(), Losses { received: force.losses().received, ..Losses::default() });
    drop(recorder);
    writer.finish(Outcome::Success, force.losses(), at(9, 1)).expect("finished");
}

#[test]
fn recorded_anew_it_is_the_same_to_the_byte() {
    let place = tempfile::tempdir().expect("a folder");
    record(&place.path().join("first"), 2);
    let first = Session::open(place.path().join("first")).expect("a session");
    record_replay(&first, Speed::AsFastAsPossible, &place.path().join("second"));
    let second = Session::open(place.path().join("second")).expect("a session");
    let (expected, found) = (payloads(&first), payloads(&second));
    assert_eq!(
        expected.len() as u64,
        first.messages(&[Topic::Force]).count() as u64 + 2 * (STAGE_HZ + FRAMES_HZ)
    );
    assert!(expected == found);
}

/// At ten times the speed, 1 s takes 0.1 s; and the bytes are the same as well.
#[test]
fn at_a_given_speed_it_takes_its_time() {
    let place = tempfile::tempdir().expect("a folder");
    record(&place.path().join("first"), 1);
    let first = Session::open(place.path().join("first")).expect("a session");
    let began = HostTime::now();
    record_replay(&first, Speed::Times(10.0), &place.path().join("second"));
    assert!(HostTime::now().since(began) >= Duration::from_millis(95));
    let second = Session::open(place.path().join("second")).expect("a session");
    assert!(payloads(&first) == payloads(&second));
}

/// Three threads, each reading as fast as it can: none is ever ahead of what another has still to hand out.
#[test]
fn the_devices_keep_in_step_across_threads() {
    let place = tempfile::tempdir().expect("a folder");
    record(&place.path().join("session"), 2);
    let session = Session::open(place.path().join("session")).expect("a session");
    let replay = Replay::new(&session, Speed::AsFastAsPossible).expect("a replay");
    let (mut stage, mut force, mut markers) = (
        replay.stage().expect("a stage"),
        replay.force().expect("a sensor"),
        replay.markers().expect("markers"),
    );
    force.start().expect("started");
    // Order of taking: a number is drawn by each thread before it takes and after, so that what one took surely before another is known.
    let turn = std::sync::atomic::AtomicU64::new(0);
    let draw = || turn.fetch_add(1, std::sync::atomic::Ordering::SeqCst);
    let taken: Vec<(u64, u64, HostTime)> = std::thread::scope(|scope| {
        let force = scope.spawn(|| {
            let (mut taken, mut records) = (Vec::new(), Vec::new());
            while !force.is_over() {
                let before = draw();
                force.receive(HostTime::now(), &mut records).expect("records");
                taken.extend(records.drain(..).next_back().map(|r| (before, draw(), r.host)));
            }
            taken
        });
        let stage = scope.spawn(|| {
            let mut taken = Vec::new();
            while !stage.is_over() {
                let before = draw();
                taken.extend(
                    stage.report(HostTime::now()).expect("a report").map(|r| (before, draw(), r.host)),
                );
            }
            taken
        });
        let mut taken = Vec::new();
        while !markers.is_over() {
            let before = draw();
            taken.extend(markers.frame(HostTime::now()).expect("a frame").map(|f| (before, draw(), f.host)));
        }
        taken.extend(force.join().expect("no panic"));
        taken.extend(stage.join().expect("no panic"));
        taken
    });
    assert!(taken.len() as u64 > 2 * (STAGE_HZ + FRAMES_HZ + FORCE_HZ / 70));
    for &(_, done, earlier) in &taken {
        let ahead = taken.iter().find(|&&(began, _, time)| began > done && time < earlier);
        assert_eq!(ahead, None, "taken after {earlier:?}");
    }
}

#[test]
fn a_recorded_stage_accepts_commands_and_follows_none() {
    let place = tempfile::tempdir().expect("a folder");
    record(&place.path().join("session"), 1);
    let session = Session::open(place.path().join("session")).expect("a session");
    let replay = Replay::new(&session, Speed::AsFastAsPossible).expect("a replay");
    let mut stage = replay.stage().expect("a stage");
    let document = session.start().stage.as_ref().expect("a stage");
    assert_eq!((stage.identity(), stage.limits()), (&document.identity(), &document.limits()));
    let before = stage.report(HostTime::now()).expect("readable").expect("a report");
    let motion = Motion { target_m: [9.0, 9.0], speed_m_s: 1.0, acceleration_m_s2: 1.0 };
    stage.home().and_then(|()| stage.move_to(motion)).and_then(|()| stage.stop()).expect("accepted");
    stage.stopper().expect("a stopper").stop_now().expect("accepted");
    let after = stage.report(HostTime::now()).expect("readable").expect("a report");
    let recorded: Vec<_> = session.stage().take(2).map(|r| r.expect("a report")).collect();
    assert_eq!([before, after], recorded[..]);
}

#[test]
fn what_was_not_recorded_is_not_replayed() {
    let place = tempfile::tempdir().expect("a folder");
    let folder = place.path().join("session");
    let writer =
        SessionWriter::create(&folder, StartDocument { force: None, ..start() }).expect("a new session");
    writer.finish(Outcome::Success, Losses::default(), at(9, 1)).expect("finished");
    let session = Session::open(&folder).expect("a session");
    assert!(matches!(Replay::new(&session, Speed::Times(0.0)), Err(SessionError::Speed { .. })));
    let replay = Replay::new(&session, Speed::Times(1.0)).expect("a replay");
    assert!(matches!(replay.force().err(), Some(SessionError::NoDevice { device: "force sensor", .. })));
}
