//! What happens when the disk is full or does not keep up?

use super::fixtures::{at, force_record, frame, report, start};
use crate::clock::HostTime;
use crate::device::{Losses, MarkerFrame};
use crate::session::{
    CAPACITY, Event, Finding, GapCause, Outcome, Session, SessionError, SessionWriter, Topic, recover,
};
use std::path::Path;
use std::process::Command;
use std::sync::mpsc::{channel, sync_channel};
use std::time::Duration;

/// Longer than anything here takes.
const PATIENCE: Duration = Duration::from_secs(20);

/// A small file system of its own, as far as the tests may make one.
struct SmallDisk<'a>(&'a Path);

impl<'a> SmallDisk<'a> {
    fn mount(place: &'a Path, size: &str) -> Option<Self> {
        let options = format!("size={size}");
        let mut mount = Command::new("mount");
        mount.args(["-t", "tmpfs", "-o", &options, "tmpfs"]).arg(place);
        mount.output().ok().filter(|output| output.status.success()).map(|_| Self(place))
    }
}

impl Drop for SmallDisk<'_> {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(self.0).status();
    }
}

#[test]
fn a_full_disk_is_known_at_once_and_what_was_written_stays() {
    let place = tempfile::tempdir().expect("a folder");
    let Some(_disk) = SmallDisk::mount(place.path(), "4m") else {
        println!("skipped: a small file system can be mounted by root only");
        return;
    };
    let folder = place.path().join("session");
    let writer = SessionWriter::create(&folder, start()).expect("a new session");
    let health = writer.health();
    let mut recorder = writer.recorder();
    let wide = MarkerFrame { markers: frame(1).markers.repeat(100), ..frame(1) };
    let (began, mut taken) = (HostTime::now(), 0);
    while health.failure().is_none() {
        assert!(HostTime::now().since(began) < PATIENCE, "nobody noticed");
        taken += u64::from(recorder.stage(report(taken)) && recorder.markers(wide.clone()));
        std::thread::yield_now();
    }
    let failure = health.failure().cloned().expect("a failure");
    let SessionError::Write { source, .. } = failure else { panic!("{failure}") };
    assert_eq!(source.kind(), std::io::ErrorKind::StorageFull);
    // The thread that writes has left, or will have in a moment: handing over goes on without harm.
    while recorder.event(Event::new(HostTime::now(), "too late")) {
        assert!(HostTime::now().since(began) < PATIENCE, "still taken");
    }
    assert!(health.dropped(Topic::Event) > 0);
    drop(recorder);
    assert!(matches!(
        writer.finish(Outcome::Success, Losses::default(), at(9, 1)),
        Err(SessionError::Write { .. })
    ));

    let session = Session::open(&folder).expect("a session that opens");
    assert_eq!(session.stop(), None);
    let kept = session.stage().map(|r| r.expect("a report")).zip(0..).all(|(kept, n)| kept == report(n));
    assert!(kept && session.stage().count() > 10, "{} of {taken}", session.stage().count());
    assert!(session.verify().expect("readable").contains(&Finding::Interrupted));

    let elsewhere = tempfile::tempdir().expect("a folder");
    let recovery = recover(&folder, &elsewhere.path().join("saved")).expect("saved");
    assert!(!recovery.segments[0].end_is_known);
}

/// Half as much again as fits, while the writing thread is held up: some is dropped, all of it is accounted for, and the gap lies where it was.
#[test]
fn what_does_not_fit_is_counted_and_put_down() {
    let place = tempfile::tempdir().expect("a folder");
    let folder = place.path().join("session");
    let (gate, behind_gate) = channel();
    let (held_up, is_held_up) = sync_channel(1);
    let writer =
        SessionWriter::create_held_up(&folder, start(), held_up, behind_gate).expect("a new session");
    // Dropped before the writer, which waits for its thread, should anything below fail.
    let closed = gate;
    let health = writer.health();
    let mut recorder = writer.recorder();
    // Records 14 ms apart: each is a batch of its own.
    let mut hand = |n: u64| recorder.force(&[force_record(n * 100)], force_record(n * 100 + 99).host);
    assert!(hand(0));
    is_held_up.recv_timeout(PATIENCE).expect("the thread writes out what it has");
    let many = CAPACITY as u64 * 3 / 2;
    assert_eq!((1..many).filter(|&n| hand(n)).count(), CAPACITY);
    // What is dropped last has nothing behind it that could carry the gap; it is put down all the same.
    let mut other = writer.recorder();
    assert!(!other.stage(report(0)));
    drop(other);
    drop(closed);
    // Room again: whoever still hands over gets in, with the gap in front.
    let began = HostTime::now();
    let mut number = many;
    while !hand(number) {
        assert!(HostTime::now().since(began) < PATIENCE, "no room");
        std::thread::yield_now();
        number += 1;
    }
    drop(recorder);
    let dropped = health.dropped(Topic::Force);
    let stop = writer.finish(Outcome::Success, Losses::default(), at(9, 1)).expect("finished");

    let session = Session::open(&folder).expect("a session");
    assert_eq!(stop.dropped.get("/force"), Some(&dropped));
    assert_eq!(stop.force_records + dropped, number + 1, "every record is either there or counted");
    let all = session.gaps().map(|g| g.expect("a gap"));
    let (gaps, others): (Vec<_>, Vec<_>) = all.partition(|g| g.topic == Topic::Force);
    assert_eq!(others.iter().map(|g| (g.topic, g.records)).collect::<Vec<_>>(), [(Topic::Stage, 1)]);
    assert_eq!(gaps.iter().map(|g| g.records).sum::<u64>(), dropped);
    assert!(gaps.iter().all(|g| g.cause == GapCause::QueueFull), "{gaps:?}");
    // Nothing that is there lies inside a gap.
    for record in session.force() {
        let host = record.expect("a record").host;
        assert!(gaps.iter().all(|g| host < g.first || host > g.last));
    }
    let findings = session.verify().expect("readable");
    assert!(findings.contains(&Finding::Dropped { segment: 1, topic: Topic::Force, records: dropped }));
}
