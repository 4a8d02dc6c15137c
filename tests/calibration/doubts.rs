//! Tables in another unit than their headings say: doubted with the unit, kept with exit code 3, and refused by a calibration set.

use super::bench::{Dice, ForceBench, StageBench, press, press_csv, stage_csv, weights_csv};
use super::{names, run, utf8};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

fn weights() -> String {
    let mut dice = Dice::new(21);
    let bench = ForceBench::new(&mut dice);
    weights_csv(&bench.table(&mut dice))
}

/// Runs of a stage whose targets and readings are multiplied by these.
fn runs(targets_by: f64, readings_by: f64) -> String {
    let mut text = "run,direction,target_mm,reading_mm\n".to_owned();
    for (target, reading, up, run) in sound_rows() {
        let direction = if up { "up" } else { "down" };
        let (target, reading) = (1e3 * targets_by * target, 1e3 * readings_by * reading);
        text += &format!("{run},{direction},{target:.9},{reading:.9}\n");
    }
    text
}

/// `calibrate force` or `stage` of a table with this text: exit code, text, and where the results are.
fn calibrated(place: &Path, what: &str, name: &str, text: &str) -> (i32, String, PathBuf) {
    let (file, out) = (place.join(format!("{name}.csv")), place.join(name));
    fs::write(&file, text).expect("writable");
    let (code, text, stderr) = run(&["calibrate", what, utf8(&file), "--out", utf8(&out)]);
    (code, text + &stderr, out)
}

/// `calibrate set` of one file.
fn set_of(option: &str, file: &Path, out: &Path) -> (i32, String, String) {
    let fixed = ["calibrate", "set", "--name", "bench", "--until", "9999-12-31"];
    run(&[&fixed[..], &[option, utf8(file), "--out", utf8(out)]].concat())
}

#[test]
fn a_wrong_unit_is_doubted_with_its_name_and_no_set_takes_it() {
    let place = tempfile::tempdir().expect("a folder");
    let (set, weights) = (place.path().join("set.toml"), weights());
    let kilograms = |text: &str| -> String {
        // Under mass_g as it stands, the second cell of a row.
        let row = |line: &str| {
            let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
            if let Ok(grams) = cells[1].parse::<f64>() {
                cells[1] = format!("{:.6}", 1e-3 * grams);
            }
            cells.join(",") + "\n"
        };
        text.lines().map(row).collect()
    };
    let cases = [
        ("force", "kilograms", kilograms(&weights), "kilograms under mass_g"),
        ("force", "grams", weights.replacen("mass_g", "mass_kg", 1), "grams under mass_kg"),
        ("force", "levers", levers(&weights), "levers are probably metres"),
        ("stage", "metres", runs(1.0, 1e-3), "readings are probably metres under a heading in mm"),
        ("stage", "inches", runs(1.0, 1.0 / 25.4), "readings are probably inches"),
        ("stage", "both", runs(1e-3, 1e-3), "targets and readings are probably metres"),
        ("stage", "millimetres", under_metres(&runs(1.0, 1.0)), "probably mm under headings in m"),
        (
            "stage",
            "mixed",
            runs(1.0, 1.0).replace("reading_mm", "reading_m"),
            "readings are probably mm under",
        ),
    ];
    for (what, name, text, words) in cases {
        let (code, said, out) = calibrated(place.path(), what, name, &text);
        assert!(code == 3 && said.contains(words), "{name}: {code} {said}");
        assert!(!said.contains("Next:"), "{name}: {said}");
        let json = fs::read_to_string(out.join(format!("{what}.json"))).expect("written");
        let json: Value = serde_json::from_str(&json).expect("JSON");
        assert!(json["doubts"][0].as_str().expect("a doubt").contains(words), "{name}: {json:#}");
        let file = out.join(format!("{what}.toml"));
        assert!(fs::read_to_string(&file).expect("written").contains(words), "{name}");
        let (code, _, stderr) = set_of(&format!("--{what}"), &file, &set);
        let named = stderr.contains(&format!("{what}.toml")) && stderr.contains(words);
        assert!(code == 1 && named && !set.exists(), "{name}: {code} {stderr}");
    }
    // A file that says nothing of it, of an earlier program, is refused by its numbers.
    let file = place.path().join("kilograms/force.toml");
    let text = fs::read_to_string(&file).expect("written");
    let silent: String =
        text.lines().filter(|line| !line.starts_with("doubts")).map(|line| format!("{line}\n")).collect();
    assert_ne!(silent, text);
    fs::write(&file, silent).expect("writable");
    let (code, _, stderr) = set_of("--force", &file, &set);
    assert!(code == 1 && stderr.contains("kilograms under mass_g"), "{code} {stderr}");
    // The right units are not doubted.
    let metres = under_metres(&runs(1e-3, 1e-3));
    for (what, text) in [("force", weights), ("stage", runs(1.0, 1.0)), ("stage", metres)] {
        let (code, said, _) = calibrated(place.path(), what, "sound", &text);
        assert!(code == 0 && said.contains("Next:"), "{what}: {code} {said}");
    }
}

/// The same numbers under headings in metres.
fn under_metres(table: &str) -> String {
    table.replace("_mm", "_m")
}

/// Levers in metres under headings in millimetres.
fn levers(weights: &str) -> String {
    let row = |line: &str| {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        for cell in &mut cells[5..8] {
            if let Ok(mm) = cell.parse::<f64>() {
                *cell = format!("{:.6}", 1e-3 * mm);
            }
        }
        cells.join(",") + "\n"
    };
    weights.lines().map(row).collect()
}

/// Rows that the others contradict are in the result; a set says so and ends with 3.
#[test]
fn a_set_says_what_its_calibrations_say_against_themselves() {
    let place = tempfile::tempdir().expect("a folder");
    let mut lines: Vec<String> = weights().lines().map(str::to_owned).collect();
    assert!(lines[16].contains(",200.000000,"), "{}", lines[16]);
    lines[16] = lines[16].replacen(",200.000000,", ",400.000000,", 1);
    let (code, said, out) = calibrated(place.path(), "force", "slip", &lines.join("\n"));
    assert_eq!(code, 3, "{said}");
    let set = place.path().join("set.toml");
    let (code, text, stderr) = set_of("--force", &out.join("force.toml"), &set);
    let words = "the other rows contradict line 17 of slip.csv";
    assert!(code == 3 && text.contains(words) && set.is_file(), "{code} {text}{stderr}");
    assert!(
        text.contains("Next: in a rig file beside it") && text.contains("calibration = \"set.toml\""),
        "{text}"
    );
    // A second set of that name needs --replace; a set of nothing is none.
    let (code, _, stderr) = set_of("--force", &out.join("force.toml"), &set);
    assert!(code == 1 && stderr.contains("--replace") && !stderr.contains("--force"), "{code} {stderr}");
    let none = place.path().join("none.toml");
    let (code, _, stderr) =
        run(&["calibrate", "set", "--name", "bench", "--until", "9999-12-31", "--out", utf8(&none)]);
    assert!(code == 2 && stderr.contains("a set of nothing") && !none.exists(), "{code} {stderr}");
}

/// A press that begins in contact is refused by name; one in another unit than its heading is doubted.
#[test]
fn a_press_begins_before_contact_and_in_millimetres() {
    let place = tempfile::tempdir().expect("a folder");
    let (gauge, block, out) =
        (place.path().join("gauge.csv"), place.path().join("block.csv"), place.path().join("out"));
    fs::write(&gauge, stage_csv(&sound_rows())).expect("writable");
    let rows = press(92e-6, 30_000.0, 0.03, &mut Dice::new(2));
    let pressed = |table: &str| {
        fs::write(&block, table).expect("writable");
        run(&["calibrate", "stage", utf8(&gauge), "--block", utf8(&block), "--out", utf8(&out)])
    };
    let stage = |rows: &[(f64, f64)]| pressed(&press_csv(rows));
    let touching: Vec<(f64, f64)> = rows.iter().copied().filter(|row| row.0 > 110e-6).collect();
    let (code, text, stderr) = stage(&touching);
    let said = stderr.contains("block.csv: the press begins in contact");
    assert!(code == 1 && said && !names(place.path()).contains(&"out".to_owned()), "{code} {text}{stderr}");
    let metres: Vec<(f64, f64)> = rows.iter().map(|(z, force)| (1e-3 * z, *force)).collect();
    let (code, text, stderr) = stage(&metres);
    let said = text.contains("positions are probably metres");
    assert!(code == 3 && said, "{code} {text}{stderr}");
    let (code, text, stderr) = pressed(&under_metres(&press_csv(&rows)));
    assert!(code == 3 && text.contains("probably mm under a heading in m"), "{code} {text}{stderr}");
    assert_eq!(stage(&rows).0, 0);
}

fn sound_rows() -> Vec<(f64, f64, bool, u32)> {
    let bench = StageBench::usual();
    bench.table(5, &[1e-3, 7.3e-3, 12.1e-3, 19.8e-3, 24.6e-3, 31.7e-3], &mut Dice::new(8))
}
