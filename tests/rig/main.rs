//! A protocol on the simulated bench at the process boundary: planned, run, interrupted, gone on with, looked at, exported, replayed, and
//! added to; and what is refused before anything moves.

#[path = "../support/program.rs"]
mod program;
#[path = "../support/steady.rs"]
mod steady;

use phantom_rig::dataset::read_bundle;
use program::{phantom_rig, run, utf8};
use serde_json::Value;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use steady::steady;

const PROTOCOL: &str = "format = \"phantom-protocol/1\"\nname = \"three\"\n[variables]\npress_s = 1\n[defaults]\nspeed_mm_s = 4\npause_s = 1\nhold_s = \"$press_s\"\n\
    [[step]]\nkind = \"ask\"\ntext = \"Ready?\"\n\
    [[step]]\nkind = \"poke\"\nsite_mm = [50, 75, 25]\ndirection = [0.5, 0.0, -0.866]\ndepth_mm = 2\nrepeats = 2\n\
    [[step]]\nkind = \"poke\"\nsite_mm = [60, 75, 25]\nuntil_force_n = 0.3\ndepth_limit_mm = 4\nspeed_mm_s = 1\n";

/// A rig like that of `rigs/sim.toml`, patient enough for a machine that stands still now and then.
fn rig(place: &Path, change: &[(&str, &str)]) -> PathBuf {
    let sim = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs/sim.toml");
    let mut text = fs::read_to_string(sim).expect("the rig file that comes with the program");
    let patient = [
        ("silence_ms = 1000", "silence_ms = 5000"),
        ("frozen_records = 70", "frozen_records = 7000"),
        ("rate_hz = 7000.0", "rate_hz = 1000.0"),
        ("force_noise_n = [0.07, 0.07, 0.07]", "force_noise_n = [0.02, 0.02, 0.02]"),
    ];
    for (from, to) in patient.iter().chain(change) {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    let file = place.join("rig.toml");
    fs::write(&file, text).expect("writable");
    file
}

fn protocol(place: &Path) -> PathBuf {
    let file = place.join("three.toml");
    fs::write(&file, PROTOCOL).expect("writable");
    file
}

/// Starts a run and interrupts it as Ctrl-C does once a line says `at`; exit code and what was printed.
fn interrupted(arguments: &[&str], at: &str) -> (i32, String) {
    let mut child = phantom_rig()
        .args(arguments)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let stderr = BufReader::new(child.stderr.take().expect("a pipe"));
    let mut told = String::new();
    let mut done = false;
    for line in stderr.lines() {
        let line = line.expect("text");
        if line.contains(at) && !done {
            done = true;
            let pid = child.id().to_string();
            assert!(Command::new("kill").args(["-INT", &pid]).status().expect("kill").success());
        }
        told += &(line + "\n");
    }
    assert!(done, "never {at}: {told}");
    let output = child.wait_with_output().expect("it ends");
    told += &String::from_utf8_lossy(&output.stdout);
    (output.status.code().expect("an exit code"), told)
}

#[test]
fn a_run_that_is_stopped_goes_on_and_becomes_one_recording() {
    steady(stopped_and_gone_on_with);
}

fn stopped_and_gone_on_with() {
    let place = tempfile::tempdir().expect("a folder");
    let at = |name: &str| place.path().join(name);
    // An axis that may not go as fast as approach and travel would.
    let rig = rig(place.path(), &[("most_speed_mm_s = [50.0, 50.0]", "most_speed_mm_s = [50.0, 6.0]")]);
    let (protocol, session) = (protocol(place.path()), at("sessions/monday"));
    let (rig, protocol, session) = (utf8(&rig), utf8(&protocol), utf8(&session));

    let svg = at("plan.svg");
    let (code, text, stderr) = run(&["plan", protocol, "--rig", rig, "--draw", utf8(&svg)]);
    assert_eq!(code, 0, "{text}{stderr}");
    assert!(fs::read_to_string(svg).expect("a drawing").contains("<svg"));

    let (code, told) = interrupted(
        &["run", protocol, "--rig", rig, "--yes", "--lines", "--out", session],
        "poke 2 of 3: press",
    );
    assert_eq!(code, 1, "{told}");
    assert!(told.contains("stopped by hand") && told.contains("the stop was on its way after"), "{told}");
    assert!(told.contains(&format!("--out {session} --resume --clear")), "{told}");
    let (code, text, _) = run(&["session", "info", session]);
    assert!(code == 3 && text.contains("ABORTED: stopped by hand"), "{text}");
    assert!(text.contains("1 poke finished"), "{text}");
    let (code, text, stderr) = run(&["session", "export", session, "--bundle", utf8(&at("half"))]);
    assert!(code == 3 && text.contains("poke 2 was not finished; it is left out"), "{text}{stderr}");
    // Nothing is overwritten, and what goes on is the same protocol with the same values.
    let (code, _, stderr) =
        run(&["run", protocol, "--rig", rig, "--yes", "--out", session, "--resume", "--set", "press_s=2"]);
    assert!(code == 1 && stderr.contains("press_s = 2") && !stderr.contains("devices"), "{stderr}");
    let (code, _, stderr) = run(&["run", protocol, "--rig", rig, "--yes", "--out", session]);
    assert!(code == 1 && stderr.contains("is there already"), "{stderr}");

    let (code, text, stderr) =
        run(&["run", protocol, "--rig", rig, "--yes", "--lines", "--out", session, "--resume"]);
    assert_eq!(code, 0, "{text}{stderr}");
    assert!(stderr.contains("poke 2 of 3") && !stderr.contains("poke 1 of 3"), "{stderr}");
    let (code, text, _) = run(&["session", "info", session]);
    assert!(code == 0 && text.contains("in 2 file(s); finished"), "{text}");
    let (code, text, _) = run(&["session", "verify", session]);
    assert_eq!((code, text.trim_end()), (0, &*format!("{session}: everything is there")));
    let (code, _, stderr) = run(&["run", protocol, "--rig", rig, "--yes", "--out", session, "--resume"]);
    assert!(code == 1 && stderr.contains("came to its end"), "{stderr}");

    let tables = at("tables");
    assert_eq!(run(&["session", "export", session, "--csv", utf8(&tables)]).0, 0);
    let mut events = csv::Reader::from_path(tables.join("events.csv")).expect("a table");
    let columns = events.headers().expect("a header").clone();
    let column = |name: &str| columns.iter().position(|c| c == name).expect("a column");
    let (name, detail) = (column("event"), column("detail"));
    let reached = events.records().map(|row| row.expect("a row")).find(|row| &row[name] == "force-reached");
    let reached: Value =
        serde_json::from_str(&reached.expect("a force ended the third press")[detail]).expect("JSON");
    let force_n = reached["force_n"].as_f64().expect("a force");
    // The mean over 10 ms, looked at every 5 ms, on the way in at some 0.2 N a millimetre.
    assert!((0.3..0.4).contains(&force_n), "{reached}");

    let bundle = at("bundle");
    let (code, text, stderr) = run(&["session", "export", session, "--bundle", utf8(&bundle)]);
    assert!(code == 0 && text.contains("3 pokes") && !text.contains("not finished"), "{text}{stderr}");
    let other = at("other.msh");
    let block =
        ["--size-mm", "40x40x10", "--cells", "4x4x1", "--fixed", "z-", "--search", "x+", "--observed", "z+"];
    let (code, _, stderr) = run(&[&["mesh", "block", utf8(&other)], &block[..]].concat());
    assert_eq!(code, 0, "{stderr}");
    let wrong = at("wrong");
    let (code, _, stderr) =
        run(&["session", "export", session, "--bundle", utf8(&wrong), "--mesh", utf8(&other)]);
    assert!(code == 1 && stderr.contains("no recording that can be read") && !wrong.exists(), "{stderr}");
    for (arguments, words) in [
        (["session", "info", utf8(&bundle)], "a recording bundle, not a session"),
        (["check", session, "--quiet"], "session export"),
        (["fit", session, "--quiet"], "session export"),
    ] {
        let (code, _, stderr) = run(&arguments);
        assert!(code == 1 && stderr.contains(words), "{stderr}");
    }
    let (code, _, stderr) = run(&["session", "export", session, "--bundle", utf8(&bundle)]);
    assert!(code == 1 && stderr.contains("--force"), "a recording is not replaced unasked: {stderr}");
    let (before, _) = read_bundle(&bundle).expect("a bundle");
    assert_eq!(before.pokes.len(), 3);
    // The press that was stopped is in no poke and in no rest: nothing pushes outside of pokes.
    let within = |t: f64| before.pokes.iter().any(|p| t >= p.start_s - 0.05 && t <= p.end_s + 0.05);
    let rows = before.wrench.time_s.iter().zip(&before.wrench.force_n);
    let idle = rows.filter(|(t, _)| !within(**t)).map(|(_, f)| f[2].abs()).fold(0.0, f64::max);
    assert!(idle < 0.04, "{idle} N outside of pokes");

    let torn = at("torn");
    fs::create_dir(&torn).expect("writable");
    fs::copy(Path::new(session).join("manifest.json"), torn.join("manifest.json")).expect("a copy");
    let mut bytes = fs::read(Path::new(session).join("session.mcap")).expect("a file");
    let middle = bytes.len() / 2;
    bytes[middle..middle + 1000].fill(0);
    fs::write(torn.join("session.mcap"), bytes).expect("writable");
    for what in ["verify", "info"] {
        let (code, text, stderr) = run(&["session", what, utf8(&torn)]);
        assert!(code == 3 && text.contains("session recover"), "{what}: {code} {text}{stderr}");
    }
    fs::copy(Path::new(session).join("mesh.msh"), torn.join("mesh.msh")).expect("a copy");
    let (code, _, stderr) = run(&["session", "export", utf8(&torn), "--bundle", utf8(&at("torn-bundle"))]);
    assert!(code == 1 && stderr.contains("are damaged") && stderr.contains("session recover"), "{stderr}");
    fs::write(torn.join("session.mcap"), []).expect("writable");
    let saved = at("saved");
    let (code, text, stderr) = run(&["session", "recover", utf8(&torn), "--out", utf8(&saved)]);
    assert!(code == 3 && text.contains("nothing but the start document"), "{code} {text}{stderr}");

    let again = at("again");
    let (code, text, stderr) = run(&["replay", session, "--out", utf8(&again)]);
    assert!(code == 0 && text.contains(" force records, ") && !text.contains(" 0 "), "{code} {text}{stderr}");
    let replayed = at("replayed");
    run(&["session", "export", utf8(&again), "--bundle", utf8(&replayed)]);
    assert_eq!(read_bundle(&replayed).expect("a bundle").0, before, "a replay is the same recording");

    let table = at("more.csv");
    let header =
        "poke,site_x_m,site_y_m,site_z_m,dir_x,dir_y,dir_z,radius_m,start_s,end_s,depth_m,rate_m_s,hold_s";
    let row = "4,0.05,0.075,0.025,0,0,-1,0.008,0,3,0.0015,0.004,0.5";
    fs::write(&table, format!("{header}\n{row}\n")).expect("writable");
    let longer = at("longer");
    let more = ["poke", session, "--rig", rig, "--pokes", utf8(&table), "--out", utf8(&longer)];
    let (code, text, stderr) = run(&more);
    assert!(code == 0 && text.contains("4 pokes, 1 of them new"), "{text}{stderr}");
    let (after, _) = read_bundle(&longer).expect("a bundle");
    assert_eq!(after.pokes[..3], before.pokes);
    assert!(after.pokes[3].start_s > before.pokes[2].end_s);
    // What was made is not made again.
    let (_, text, stderr) = run(&[&more[..], &["--force"]].concat());
    assert!(text.contains("4 pokes, 0 of them new"), "{text}{stderr}");
    // One of another depth is another one. One too deep, or on another rig, is refused before anything moves.
    let refused = |table: &Path, rig: &str, into: &Path, words: &str| {
        let arguments = ["poke", session, "--rig", rig, "--pokes", utf8(table), "--out", utf8(&longer)];
        let (code, text, stderr) = run(&[&arguments[..], &["--force", "--into", utf8(into)]].concat());
        assert!(code == 1 && stderr.contains(words) && !stderr.contains("homing"), "{code} {text}{stderr}");
    };
    let deep = at("deep.csv");
    fs::write(&deep, format!("{header}\n{}\n", row.replace("0.0015", "0.04"))).expect("writable");
    let (made, elsewhere, other) = (at("sessions/monday-pokes"), at("elsewhere"), at("other"));
    refused(&deep, rig, &made, "name another place with --into");
    refused(
        &deep,
        rig,
        &elsewhere,
        "deep.csv, 1 poke still to be made: the bench can't do this; nothing was moved",
    );
    fs::create_dir(&other).expect("a folder");
    let other = self::rig(&other, &[("clearance_mm = 5.0", "clearance_mm = 6.0")]);
    refused(&table, utf8(&other), &elsewhere, "is not the rig file");
    assert!(!elsewhere.exists(), "a refusal leaves nothing behind");
}

#[test]
fn a_demonstration_that_is_interrupted_says_what_it_leaves() {
    let place = tempfile::tempdir().expect("a folder");
    let out = place.path().join("demo");
    let (code, told) = interrupted(&["demo", "--seed", "7", "--out", utf8(&out)], "A bench is drawn");
    // 1 where the bench had begun to run already, and was stopped.
    assert!(out.is_dir() && (code == 130 || code == 1), "{code} {told}");
    assert!(told.contains(&format!("what there is so far is in {}", out.display())), "{told}");
}

#[test]
fn what_cannot_be_run_is_refused_before_anything_moves() {
    let place = tempfile::tempdir().expect("a folder");
    let three = protocol(place.path());
    let session = place.path().join("session");
    for (change, words) in [
        (("limit_n = [3.0, 3.0, 5.0]", "limit_n = [3.0, 3.0, 500.0]"), "measures up to 60 N"),
        (("travel_mm = [[0.5, 145.0], [0.5, 35.0]]", "travel_mm = [[0.5, 60.0], [0.5, 35.0]]"), "travel"),
        (("port = \"simulated\"", "port = \"/dev/no-such-port\""), "/dev/no-such-port"),
        (("clearance_mm = 5.0", "clearence_mm = 5.0"), "clearance_mm"),
        (
            ("source = \"simulated\"", "source = \"/dev/video0\""),
            "markers.source is /dev/video0; expected \"camera\"",
        ),
        (("source = \"simulated\"", "source = \"camera\""), "a section [camera] beside it"),
        (("latency_ms = 2.0", "latency_ms = 0.5"), "stage.latency_ms"),
        (("latency_ms = 28.0", "latency_ms = 28000.0"), "force.latency_ms"),
        (("radius_mm = 8.0", "radius_mm = 0.008"), "tip.radius_mm is 0.008; expected millimetres"),
        (
            ("[1.0, 0.0, 0.0],\n    [0.0, 0.0, -1.0]", "[2.0, 0.0, 0.0],\n    [0.0, 0.0, -1.0]"),
            "vectors of length 1",
        ),
    ] {
        let rig = rig(place.path(), &[change]);
        let arguments = ["run", utf8(&three), "--rig", utf8(&rig), "--yes", "--out", utf8(&session)];
        let (code, stdout, stderr) = run(&arguments);
        assert!(code == 1 && stderr.contains(words), "{words}: {stdout}{stderr}");
        assert!(!session.exists(), "{words}");
    }
    let without = rig(place.path(), &[("mesh = \"simulated\"", "mesh = \"gel.msh\"")]);
    let (code, text, stderr) = run(&["plan", utf8(&three), "--rig", utf8(&without)]);
    assert!(code == 1 && text.contains("mesh is missing") && text.contains("gel.msh"), "{text}{stderr}");
    let (code, _, stderr) =
        run(&["run", utf8(&three), "--rig", utf8(&without), "--yes", "--out", utf8(&session)]);
    assert!(code == 1 && stderr.contains("mesh block") && !stderr.contains("devices"), "{stderr}");
    let (code, text, stderr) = run(&["doctor", "--rig", utf8(&without)]);
    assert!(
        code == 3 && text.contains("gel.msh: missing") && text.contains("records a second"),
        "{text}{stderr}"
    );
    let rig = rig(place.path(), &[]);
    let (code, _, stderr) = run(&["run", utf8(&three), "--rig", utf8(&rig), "--out", utf8(&session)]);
    assert!(code == 2 && stderr.contains("--yes"), "{stderr}");
}

/// Nothing but the meshes of phantoms that only their owners have is missing.
#[test]
fn the_protocols_that_come_with_the_program_can_be_run_on_its_benches() {
    let rigs = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs");
    for (rig, expected) in
        [("sim.toml", 0), ("sim-camera.toml", 0), ("bench-ati-native.toml", 1), ("bench-ati-grbl.toml", 1)]
    {
        for protocol in ["five-pokes.toml", "demo.toml"] {
            let (rig, protocol) = (rigs.join(rig), rigs.join("protocols").join(protocol));
            let (code, text, stderr) = run(&["plan", utf8(&protocol), "--rig", utf8(&rig)]);
            assert!(
                code == expected && !text.contains("It can't be run"),
                "{rig:?} {protocol:?}: {text}{stderr}"
            );
            assert_eq!(text.contains("mesh is missing"), expected == 1, "{text}");
        }
    }
}

#[test]
fn doctor_finds_the_devices_of_a_rig_and_says_what_is_behind_a_port() {
    let place = tempfile::tempdir().expect("a folder");
    let rig = rig(place.path(), &[]);
    let (code, text, stderr) = run(&["doctor", "--rig", utf8(&rig)]);
    assert_eq!(code, 0, "{text}{stderr}");
    assert!(
        text.contains("emulated stage") && text.contains("records") && text.contains("memory:"),
        "{text}"
    );
    let (code, text, stderr) = run(&["doctor", "--port", "/dev/no-such-port"]);
    assert!(code != 0 && text.contains("/dev/no-such-port"), "{text}{stderr}");
}
