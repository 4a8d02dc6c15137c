//! `session` and `replay`: what becomes of sessions that say too little, and that an interruption leaves nothing.

use super::{fixture, interrupt, names, phantom_rig, run, utf8};
use phantom_rig::clock::HostTime;
use phantom_rig::dataset::write_msh;
use phantom_rig::device::{Losses, MarkerFrame, MarkerPosition};
use phantom_rig::session::{
    CameraDocument, HashedText, LensDocument, MarkersDocument, Outcome, PhantomDocument, SessionWriter,
    StartDocument, TipDocument,
};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Stdio;

pub(super) fn start(camera: Option<CameraDocument>) -> StartDocument {
    StartDocument {
        format: String::new(),
        name: "look".to_owned(),
        segment: 0,
        first_poke: 1,
        started_utc: "2026-11-26T15:57:03.250000Z".to_owned(),
        started_host_ns: 1_000_000_000,
        boot: String::new(),
        variables: BTreeMap::new(),
        program: "phantom-rig".to_owned(),
        seeds: BTreeMap::new(),
        rig: HashedText::new("a rig"),
        protocol: HashedText::new("a protocol"),
        stage: None,
        force: None,
        markers: Some(MarkersDocument { source: "camera".to_owned(), rate_hz: 30.0, markers: 0 }),
        camera,
        calibration: None,
        mounting: None,
        tip: TipDocument {
            contact: "bonded".to_owned(),
            shape: "pad".to_owned(),
            radius_m: 0.008,
            sphere_radius_m: None,
        },
        phantom: PhantomDocument {
            description: "a slab".to_owned(),
            mesh: Some("mesh.msh".to_owned()),
            mesh_sha256: None,
            poisson_ratio: 0.47,
            density_kg_m3: 1050.0,
            modulus_range_pa: [5e3, 2e4],
        },
    }
}

/// A camera of which nobody knows where it stood, and perhaps not its lens either.
pub(super) fn camera(lens_is_known: bool) -> CameraDocument {
    let lens = LensDocument {
        focal_px: [1620.0; 2],
        principal_px: [319.5, 239.5],
        radial: [0.0; 3],
        tangential: [0.0; 2],
    };
    CameraDocument {
        backend: "stacked".to_owned(),
        source: "a pipe".to_owned(),
        rate_hz: 30.0,
        size_px: [640, 480],
        metres_per_unit: 1e-4,
        lens: lens_is_known.then_some(lens),
        lens_file: None,
        fiducials_m: Vec::new(),
        fiducial_sd_m: 1e-4,
        registration: None,
    }
}

/// A finished session of two seconds with frames of one marker and the phantom's mesh.
fn record(folder: &Path, camera: Option<CameraDocument>) {
    let writer = SessionWriter::create(folder, start(camera)).expect("a new session");
    let mesh = fs::File::create(folder.join("mesh.msh")).expect("writable");
    write_msh(&fixture::slab(), mesh).expect("writable");
    let mut recorder = writer.recorder();
    let at = |number: u64| HostTime::from_nanos(1_000_000_000 + number * 33_333_333);
    for number in 0..60 {
        let markers = vec![MarkerPosition { marker: 1, position_m: [0.01, 0.02, 0.02] }];
        assert!(recorder.markers(MarkerFrame { host: at(number), number: number as u32, markers }));
    }
    drop(recorder);
    writer.finish(Outcome::Success, Losses::default(), at(60)).expect("written");
}

fn registration() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs/sim-camera-registration.toml")
}

#[test]
fn a_session_whose_camera_stood_nobody_knows_where_becomes_no_bundle() {
    let place = tempfile::tempdir().expect("a folder");
    let at = |name: &str| place.path().join(name);
    let (session, bundle, tables) = (at("noreg"), at("bundle"), at("tables"));
    record(&session, Some(camera(true)));
    let (session, bundle, tables) = (utf8(&session), utf8(&bundle), utf8(&tables));
    for more in [&["--csv", tables][..], &[]] {
        let arguments = ["session", "export", session, "--bundle", bundle];
        let (code, text, stderr) = run(&[&arguments[..], more].concat());
        assert_eq!((code, text.as_str()), (1, ""), "{stderr}");
        for words in
            ["where its camera stood is not known", "calibrate registration", "--registration", "--csv"]
        {
            assert!(stderr.contains(words), "{words:?} is not in {stderr}");
        }
        assert_eq!(names(place.path()), ["noreg"], "nothing is written");
    }
    let (code, text, stderr) = run(&["session", "export", session, "--csv", tables]);
    assert!(code == 0 && text.contains("1 tables"), "{text}{stderr}");

    // Told where the camera stood, it is a session like others: this one was recorded without a stage.
    let known = registration();
    let export = |session: &str, file: &str| {
        run(&["session", "export", session, "--bundle", bundle, "--registration", file])
    };
    let (code, _, stderr) = export(session, utf8(&known));
    assert!(code == 1 && stderr.contains("the session lacks how stage and sensor are mounted"), "{stderr}");
    let (code, _, stderr) = export(session, "no-such.toml");
    assert!(code == 1 && stderr.contains("no-such.toml: can't be read"), "{stderr}");
    let (code, _, _) = run(&["session", "export", session, "--csv", tables, "--registration", utf8(&known)]);
    assert_eq!(code, 2, "a registration is for bundles");

    let (blind, without) = (at("blind"), at("without"));
    record(&blind, Some(camera(false)));
    record(&without, None);
    let (code, _, stderr) = export(utf8(&blind), utf8(&known));
    assert!(code == 1 && stderr.contains("the lens of its camera is not known"), "{stderr}");
    let (code, _, stderr) = export(utf8(&without), utf8(&known));
    assert!(code == 1 && stderr.contains("it has no pictures"), "{stderr}");
    assert_eq!(names(place.path()), ["blind", "noreg", "tables", "without"]);
}

/// What can be known at once is not told after a minute's work: nothing else that speaks against it is found first.
#[test]
fn a_place_that_is_taken_is_told_first() {
    let place = tempfile::tempdir().expect("a folder");
    let at = |name: &str| place.path().join(name);
    let (session, taken, known) = (at("session"), at("taken"), at("known.toml"));
    record(&session, Some(camera(true)));
    fs::create_dir(&taken).expect("writable");
    for file in [&taken.join("years"), &known] {
        fs::write(file, "years").expect("writable");
    }
    for option in ["--bundle", "--csv"] {
        let (code, _, stderr) = run(&["session", "export", utf8(&session), option, utf8(&taken)]);
        assert!(code == 1 && stderr.contains("taken exists"), "{stderr}");
    }
    let same = ["--bundle", utf8(&taken), "--csv", utf8(&taken), "--force"];
    let (code, _, stderr) = run(&[&["session", "export", utf8(&session)][..], &same].concat());
    assert!(code == 2 && stderr.contains("name the same folder"), "{stderr}");
    // Its rig file lists no fiducials: that would be told next.
    let find = ["calibrate", "registration", utf8(&session), "--out", utf8(&known)];
    let (code, _, stderr) = run(&find);
    assert!(code == 1 && stderr.contains("known.toml exists"), "{stderr}");
    assert_eq!(names(place.path()), ["known.toml", "session", "taken"]);
}

#[test]
fn what_is_made_of_a_session_that_was_cut_off_says_so() {
    let place = tempfile::tempdir().expect("a folder");
    let at = |name: &str| place.path().join(name);
    let (session, torn) = (at("session"), at("torn"));
    record(&session, None);
    fs::create_dir(&torn).expect("writable");
    fs::copy(session.join("manifest.json"), torn.join("manifest.json")).expect("a copy");
    let bytes = fs::read(session.join("session.mcap")).expect("a file");
    fs::write(torn.join("session.mcap"), &bytes[..bytes.len() - 40]).expect("writable");
    let export =
        |session: &Path, to: &str| run(&["session", "export", utf8(session), "--csv", utf8(&at(to))]);
    let (code, text, stderr) = export(&torn, "torn-tables");
    let said = text.contains("torn: ") && text.contains("can't be read") && text.contains("missing here");
    assert!(code == 3 && said, "{code} {text}{stderr}");
    let (code, text, _) = export(&session, "tables");
    assert!(code == 0 && !text.contains("note:"), "{code} {text}");
}

#[test]
fn an_empty_session_is_said_to_be_empty() {
    let place = tempfile::tempdir().expect("a folder");
    let (session, emptied) = (place.path().join("session"), place.path().join("emptied"));
    record(&session, None);
    fs::create_dir(&emptied).expect("writable");
    fs::copy(session.join("manifest.json"), emptied.join("manifest.json")).expect("a copy");
    fs::write(emptied.join("session.mcap"), []).expect("writable");
    let (code, text, stderr) = run(&["session", "verify", utf8(&emptied)]);
    assert!(code == 3 && text.contains("segment 1: nothing is in it"), "{code} {text}{stderr}");
    assert!(!text.contains("session recover"), "{text}");
    assert_eq!(run(&["session", "verify", utf8(&session)]).0, 0);
}

#[test]
fn a_session_is_recovered_and_replayed_into_a_new_place_only() {
    let place = tempfile::tempdir().expect("a folder");
    let at = |name: &str| place.path().join(name);
    record(&at("old"), None);
    let (old, saved, again) = (at("old"), at("saved"), at("again"));
    let recover = ["session", "recover", utf8(&old), "--out", utf8(&saved)];
    let replay = ["replay", utf8(&old), "--out", utf8(&again)];
    for (arguments, made) in [(&recover[..], &saved), (&replay, &again)] {
        let (code, text, stderr) = run(arguments);
        assert!(code == 0 && text.starts_with(utf8(made)), "{code} {text}{stderr}");
        assert_eq!(run(&["session", "verify", utf8(made)]).0, 0);
        assert!(made.join("mesh.msh").is_file());
        let (code, _, stderr) = run(arguments);
        assert!(code == 1 && stderr.contains("exists already") && !stderr.contains("--force"), "{stderr}");
    }
    assert_eq!(names(place.path()), ["again", "old", "saved"]);
}

/// At a hundredth of its speed, two seconds take long enough to be interrupted.
#[cfg(unix)]
#[test]
fn a_replay_that_is_interrupted_leaves_nothing() {
    let place = tempfile::tempdir().expect("a folder");
    let (old, again) = (place.path().join("old"), place.path().join("again"));
    record(&old, None);
    let mut child = phantom_rig()
        .args(["replay", utf8(&old), "--speed", "0.01", "--out", utf8(&again)])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts");
    let is_recorded = |name: &String| {
        name.starts_with(".again.partial-") && place.path().join(name).join("mesh.msh").exists()
    };
    while !names(place.path()).iter().any(is_recorded) {
        assert!(child.try_wait().expect("a child").is_none(), "it ended before it had begun to write");
    }
    interrupt(child.id());
    assert_eq!(child.wait().expect("it ends").code(), Some(130));
    assert_eq!(names(place.path()), ["old"]);
    let (code, text, stderr) = run(&["replay", utf8(&old), "--out", utf8(&again), "--json"]);
    let json: Value = serde_json::from_str(&text).unwrap_or_else(|e| panic!("{e}: {text}{stderr}"));
    assert_eq!((code, &json["session"]), (0, &Value::from(utf8(&again))));
}
