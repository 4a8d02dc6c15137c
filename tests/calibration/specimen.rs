//! `calibrate tensile` and `bands`: a value with its file where a test is sound, a refusal with its place and no file where it is not.

use super::{names, run, utf8};
use std::fs;

/// A neo-Hookean pull of E = 60 kPa: strains in steps of half a per cent.
fn rows() -> Vec<(f64, f64, f64)> {
    let stretch = |k: u32| 1.0 + 0.005 * f64::from(k);
    let kpa = |l: f64| 20.0 * (l - 1.0 / (l * l));
    (0..110).map(|k| (0.1 * f64::from(k), stretch(k) - 1.0, kpa(stretch(k)))).collect()
}

/// Specimens in other units and of other materials make no reference value: what is left out or withheld is said, with exit code 3.
#[test]
fn what_is_no_specimen_of_the_material_makes_no_value() {
    let place = tempfile::tempdir().expect("a folder");
    let run_of = |name: &str, gains: &[f64]| {
        let (folder, out) = (place.path().join(name), place.path().join(format!("{name}-out")));
        fs::create_dir(&folder).expect("writable");
        for (k, gain) in gains.iter().enumerate() {
            let scaled: Vec<(f64, f64, f64)> = rows().iter().map(|(t, e, p)| (*t, *e, gain * p)).collect();
            fs::write(folder.join(format!("{k}.csv")), table(&scaled)).expect("writable");
        }
        let (code, text, _) = run(&["calibrate", "tensile", utf8(&folder), "--out", utf8(&out)]);
        (code, text, phantom_rig::calib::reference::ReferenceValue::read(&out.join("tensile.toml")).ok())
    };
    let (code, text, value) = run_of("one-in-pounds", &[1.0, 1.02, 0.98 * 4.448_222, 0.99]);
    let value = value.expect("a value");
    assert!(code == 3 && text.contains("left out of the estimate"), "{code} {text}");
    assert!(
        (value.figure.value / 60e3 - 1.0).abs() < 0.03 && value.method.contains("wrong unit"),
        "{value:?}"
    );
    let (code, text, value) = run_of("two-materials", &[1.0, 1.02, 2.5, 2.6]);
    assert!(code == 3 && text.contains("not one material") && value.is_none(), "{code} {text} {value:?}");
    let (code, _, value) = run_of("sound", &[1.0, 1.02, 0.98, 0.99]);
    assert!(code == 0 && value.is_some(), "{code}");
}

fn table(rows: &[(f64, f64, f64)]) -> String {
    let line = |(t, e, p): &(f64, f64, f64)| format!("{t:.1},{e:.4},{p:.4}\n");
    "Time (s),Strain (mm/mm),Stress (kPa)\n".to_owned() + &rows.iter().map(line).collect::<String>()
}

#[test]
fn a_pull_becomes_a_reference_value() {
    let place = tempfile::tempdir().expect("a folder");
    let (file, out) = (place.path().join("gel.csv"), place.path().join("out"));
    fs::write(&file, table(&rows())).expect("writable");
    let (code, text, stderr) = run(&["calibrate", "tensile", utf8(&file), "--out", utf8(&out)]);
    assert_eq!(code, 0, "{text}{stderr}");
    for name in ["tensile.html", "tensile.json", "tensile.toml"] {
        assert!(out.join(name).is_file(), "{name}");
    }
    let value =
        phantom_rig::calib::reference::ReferenceValue::read(&out.join("tensile.toml")).expect("sound");
    assert!((value.figure.value / 60e3 - 1.0).abs() < 0.01, "{value:?}");
    assert_eq!(value.raw.len(), 1);
}

#[test]
fn what_went_wrong_is_refused_with_its_place_and_leaves_nothing() {
    let place = tempfile::tempdir().expect("a folder");
    let mut back = rows();
    back[40].0 = 3.5;
    let mut slipped = rows();
    slipped[60..].iter_mut().for_each(|r| r.2 -= 6.0);
    let text = table(&rows()).replace("\n4.0,", "\nfour,");
    let bad = [
        ("back.csv", table(&back), "line 42"),
        ("slip.csv", table(&slipped), "slip.csv, line 62"),
        ("text.csv", text, "line 42"),
        ("empty.csv", String::new(), "empty"),
    ];
    for (name, text, words) in &bad {
        let file = place.path().join(name);
        fs::write(&file, text).expect("writable");
        let out = place.path().join("out");
        let (code, text, stderr) = run(&["calibrate", "tensile", utf8(&file), "--out", utf8(&out)]);
        assert!(code == 1 && stderr.contains(words), "{name}: {code} {text}{stderr}");
    }
    assert_eq!(names(place.path()), ["back.csv", "empty.csv", "slip.csv", "text.csv"]);
}

/// A window that reaches beyond the pull is said with where it was fitted; exit code 3 where more than a tenth of it is empty.
#[test]
fn a_window_beyond_the_data_is_said() {
    let place = tempfile::tempdir().expect("a folder");
    let file = place.path().join("gel.csv");
    // Strains up to 0.545.
    fs::write(&file, table(&rows())).expect("writable");
    for (strain, expected, said) in [("0,0.5", 0, false), ("0,0.58", 0, true), ("0,5", 3, true)] {
        let out = place.path().join(format!("out-{expected}-{said}"));
        let (code, text, stderr) =
            run(&["calibrate", "tensile", utf8(&file), "--strain", strain, "--out", utf8(&out)]);
        let words = text.contains("and the pull ends at 0.545: it is fitted up to there");
        assert!(code == expected && words == said, "{strain}: {code} {text}{stderr}");
        let value = phantom_rig::calib::reference::ReferenceValue::read(&out.join("tensile.toml"));
        let [low, high] = value.expect("sound").validity.strain.expect("a window");
        assert!(low == 0.0 && high <= 0.5451, "{low} to {high}");
    }
}

/// Of several materials there is no modulus: that comes first, and no number is given for all.
#[test]
fn several_materials_have_no_common_modulus() {
    let place = tempfile::tempdir().expect("a folder");
    let mut files = Vec::new();
    for (name, gain) in [("soft", 0.4), ("middle", 1.0), ("hard", 3.3)] {
        let file = place.path().join(format!("{name}.csv"));
        let scaled: Vec<(f64, f64, f64)> = rows().iter().map(|(t, e, p)| (*t, *e, gain * p)).collect();
        fs::write(&file, table(&scaled)).expect("writable");
        files.push(file);
    }
    let out = place.path().join("out");
    let mut words = vec!["calibrate", "tensile"];
    words.extend(files.iter().map(|file| utf8(file)));
    words.extend(["--out", utf8(&out)]);
    let (code, text, stderr) = run(&words);
    assert_eq!(code, 3, "{text}{stderr}");
    let first = text.lines().next().expect("a line");
    let words = ["not one material: moduli from 24.", " kPa to 19", "there is no common modulus"];
    assert!(words.iter().all(|words| first.contains(words)) && !text.contains("90 %"), "{text}");
    let json = fs::read_to_string(out.join("tensile.json")).expect("written");
    let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    assert!(json["young_modulus_pa"].is_null() && json["not_one_material"].is_string(), "{json:#}");
}

/// A modulus of some pascals has an interval with digits.
#[test]
fn a_small_modulus_has_digits() {
    let place = tempfile::tempdir().expect("a folder");
    let (file, out) = (place.path().join("gel.csv"), place.path().join("out"));
    let line = |(t, e, p): (f64, f64, f64)| format!("{t:.1},{e:.4},{:.9}\n", 1e-3 * p);
    let text = "Time (s),Strain (mm/mm),Stress (kPa)\n".to_owned()
        + &rows().into_iter().map(line).collect::<String>();
    fs::write(&file, text).expect("writable");
    let (code, text, stderr) = run(&["calibrate", "tensile", utf8(&file), "--out", utf8(&out)]);
    assert_eq!(code, 0, "{text}{stderr}");
    // E = 60 Pa; one specimen, so that 5 % of scatter are assumed.
    assert!(text.contains("90 % interval 0.05") && text.contains("to 0.06"), "{text}");
}
