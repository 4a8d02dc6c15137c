//! `plan`: what it draws over, what it says of a camera that nobody has placed, and how much it says will be recorded.

use super::{names, run, utf8};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

fn rigs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs")
}

fn protocol(name: &str) -> PathBuf {
    rigs().join("protocols").join(name)
}

#[test]
fn a_drawing_replaces_a_drawing_and_nothing_else() {
    let place = tempfile::tempdir().expect("a folder");
    let (plan, notes, other) =
        (place.path().join("plan.svg"), place.path().join("notes.md"), place.path().join("logo.svg"));
    let (rig, protocol) = (rigs().join("sim.toml"), protocol("five-pokes.toml"));
    let draw = |file: &Path, more: &[&str]| {
        let arguments = ["plan", utf8(&protocol), "--rig", utf8(&rig), "--draw", utf8(file)];
        run(&[&arguments[..], more].concat())
    };
    let drawn = |file: &Path| fs::read_to_string(file).expect("a file").starts_with("<svg");
    for _ in 0..2 {
        let (code, text, stderr) = draw(&plan, &[]);
        assert!(code == 0 && text.contains("Drawn: ") && drawn(&plan), "{text}{stderr}");
        let drawing = fs::read_to_string(&plan).expect("a file");
        assert!(drawing.contains("Bars mark depths, they are narrower than the tip."), "{drawing}");
    }
    fs::write(&notes, "years").expect("writable");
    fs::write(&other, "<svg xmlns=\"http://www.w3.org/2000/svg\"></svg>\n").expect("writable");
    for file in [&notes, &other] {
        let before = fs::read(file).expect("a file");
        let (code, text, stderr) = draw(file, &[]);
        assert_eq!((code, text.as_str()), (1, ""), "{stderr}");
        assert!(stderr.contains("exists; choose another name or pass --force"), "{stderr}");
        assert_eq!(fs::read(file).expect("a file"), before);
    }
    assert_eq!(draw(&notes, &["--force"]).0, 0);
    assert!(drawn(&notes));
    let (code, _, stderr) = draw(place.path(), &["--force"]);
    assert!(code == 1 && stderr.contains("is a folder"), "{stderr}");
    assert_eq!(run(&["plan", utf8(&protocol), "--rig", utf8(&rig), "--force"]).0, 2);
    assert_eq!(names(place.path()), ["logo.svg", "notes.md", "plan.svg"]);
}

/// A depth that is probably in metres is noted, not refused.
#[test]
fn a_depth_in_metres_is_noted() {
    let (rig, protocol) = (rigs().join("sim.toml"), protocol("five-pokes.toml"));
    let plan = |more: &[&str]| run(&[&["plan", utf8(&protocol), "--rig", utf8(&rig)][..], more].concat());
    let (code, text, stderr) = plan(&["--set", "deep_mm=0.003"]);
    let noted = text.contains("note: step ") && text.contains("it goes 0.0030 mm deep");
    assert!(code == 3 && noted && text.contains("depths are in mm in a protocol"), "{text}{stderr}");
    let (code, text, _) = plan(&[]);
    assert!(code == 0 && !text.contains("note:"), "{text}");
}

#[test]
fn pictures_that_give_no_markers_are_noted() {
    let place = tempfile::tempdir().expect("a folder");
    let text = fs::read_to_string(rigs().join("sim-camera.toml")).expect("the rig file that comes with it");
    let named = "registration = \"sim-camera-registration.toml\"";
    assert!(text.contains(named));
    let rig = place.path().join("rig.toml");
    fs::write(&rig, text.replacen(named, "# nobody knows", 1)).expect("writable");
    let plan = |name: &str, more: &[&str]| {
        run(&[&["plan", utf8(&protocol(name)), "--rig", utf8(&rig)][..], more].concat())
    };
    let (code, text, stderr) = plan("five-pokes.toml", &[]);
    assert!(
        code == 3 && text.contains("note: the rig file does not say where the camera stands"),
        "{text}{stderr}"
    );
    assert!(text.contains("calibrate registration"), "{text}");
    let (code, text, _) = plan("five-pokes.toml", &["--json"]);
    let json: Value = serde_json::from_str(&text).expect("JSON");
    assert!(code == 3 && json["without_markers"].is_string(), "{json}");
    // What is to find it out pokes nothing.
    let (code, text, stderr) = plan("look.toml", &[]);
    assert!(code == 0 && !text.contains("note:"), "{text}{stderr}");
}

/// A rig file without [markers], as those for real benches begin: nothing is said to be recorded of them, and why not.
#[test]
fn a_bench_without_markers_promises_none() {
    let place = tempfile::tempdir().expect("a folder");
    let text = fs::read_to_string(rigs().join("sim.toml")).expect("the rig file that comes with it");
    let section = "[markers]                          # where marker positions come from; may be left out\nsource = \"simulated\"\n";
    assert!(text.contains(section));
    let rig = place.path().join("rig.toml");
    let plan = |text: &str, name: &str| {
        fs::write(&rig, text).expect("writable");
        run(&["plan", utf8(&protocol(name)), "--rig", utf8(&rig)])
    };
    let (code, said, stderr) = plan(&text, "five-pokes.toml");
    assert!(code == 0 && said.contains("markers 30/s"), "{said}{stderr}");
    let blind = text.replacen(section, "", 1);
    let (code, said, stderr) = plan(&blind, "five-pokes.toml");
    assert!(code == 3 && said.contains("note: the rig file has no section [markers]"), "{said}{stderr}");
    assert!(said.contains("stage 50/s; about"), "{said}");
    let (code, said, stderr) = plan(&blind, "look.toml");
    assert!(code == 0 && !said.contains("note:") && !said.contains("markers"), "{said}{stderr}");
}

/// Ways clear of the phantom follow from the box of the rig file: a mesh that is higher than that is refused.
#[test]
fn a_mesh_beyond_the_box_is_refused() {
    let place = tempfile::tempdir().expect("a folder");
    let rig = place.path().join("rig.toml");
    fs::copy(rigs().join("bench-ati-native.toml"), &rig).expect("the rig file that comes with it");
    let mesh = place.path().join("phantom.msh");
    let plan = |size: &str| {
        let block =
            ["mesh", "block", "--size-mm", size, "--cells", "4x6x12", "--fixed", "z-,x<50mm", "--search"];
        let more = ["z-,x>50mm", "--observed", "z+", "--force", utf8(&mesh)];
        assert_eq!(run(&[&block[..], &more].concat()).0, 0);
        run(&["plan", utf8(&protocol("look.toml")), "--rig", utf8(&rig)])
    };
    let (code, said, stderr) = plan("100x150x25");
    assert!(code == 0 && !said.contains("mesh"), "{said}{stderr}");
    let (code, said, stderr) = plan("100x150x30");
    assert!(code == 1 && said.contains("the mesh reaches to z = 30.00 mm"), "{said}{stderr}");
    assert!(said.contains("from 0.00 to 25.00 mm there"), "{said}");
    let unusable = |mesh_text: &str, why: &str| {
        fs::write(&mesh, mesh_text).expect("writable");
        let (code, said, stderr) = run(&["plan", utf8(&protocol("look.toml")), "--rig", utf8(&rig)]);
        let refused = said.contains("The phantom's mesh can't be used") && said.contains(why);
        assert!(code == 1 && refused, "{said}{stderr}");
    };
    // What no fit could use is told before the pokes, not after.
    let whole = fs::read_to_string(&mesh).expect("written just now");
    unusable(&whole.replace("\"search\"", "\"serach\""), "no physical surface \"search\"");
    unusable("no mesh", "");
}

/// The camera's section of the rig files for real benches, taken out of comments, is one: only places and lens are not known yet.
#[test]
fn the_camera_of_a_bench_can_be_taken_out_of_comments() {
    let place = tempfile::tempdir().expect("a folder");
    for name in ["bench-ati-native.toml", "bench-ati-grbl.toml"] {
        let text = fs::read_to_string(rigs().join(name)).expect("the rig file that comes with it");
        let (before, after) = text.split_once("# [markers]\n").expect("in comments");
        let (section, after) = after.split_once("\n[tip]").expect("then the tip");
        let lines = section.lines().map(|line| line.trim_start_matches('#').trim_start());
        let section: Vec<&str> = lines.collect();
        let rig = place.path().join("rig.toml");
        let text = format!("{before}[markers]\n{}\n[tip]{after}", section.join("\n"));
        fs::write(&rig, &text).expect("writable");
        let (code, said, stderr) = run(&["plan", utf8(&protocol("five-pokes.toml")), "--rig", utf8(&rig)]);
        assert!(code == 1 && said.contains("mesh is missing"), "{name}: {said}{stderr}");
        assert!(said.contains("the rig file says nothing of the camera's lens"), "{said}");
    }
}

/// Against what runs of these protocols left on the disk: 122.0 and 652.0 MB.
#[test]
fn what_will_be_recorded_is_about_what_was() {
    let rig = rigs().join("sim-camera.toml");
    for (name, recorded_mb) in [("look.toml", 122.0), ("five-pokes.toml", 652.0)] {
        let protocol = protocol(name);
        let arguments = ["plan", utf8(&protocol), "--rig", utf8(&rig)];
        let (code, text, stderr) = run(&arguments);
        assert!(code == 0 && text.contains("stage 50/s") && text.contains("; about "), "{text}{stderr}");
        let (_, text, _) = run(&[&arguments[..], &["--json"]].concat());
        let json: Value = serde_json::from_str(&text).expect("JSON");
        let stated_mb = 1e-6 * json["data_bytes"].as_f64().expect("a number");
        assert!((0.85..1.15).contains(&(stated_mb / recorded_mb)), "{name}: {stated_mb} MB");
    }
}
