//! `calibrate import`: exports as they come, wrong ones by file, line and column.

use super::{names, run, utf8};
use serde_json::Value;
use std::fs;

/// A pull as a German machine writes it: semicolons, decimal commas, units below the names, in the encoding of its Windows.
fn german() -> Vec<u8> {
    let mut text = "Prüfer;Müller\r\nProbendicke a0;2,00;mm\r\nProbenbreite b0;6,00;mm\r\n\r\n".to_owned();
    text += "Prüfzeit;Standardweg;Standardkraft\r\ns;mm;N\r\n";
    for k in 0..40 {
        let (seconds, mm, newtons) = (0.5 * f64::from(k), 0.25 * f64::from(k), 1200.0 + 12.5 * f64::from(k));
        let comma = |value: f64| format!("{value:.2}").replace('.', ",");
        text += &format!("{};{};{}\r\n", comma(seconds), comma(mm), comma(newtons));
    }
    // Each of these letters is one byte of that encoding, with the same number.
    text.chars().map(|c| u8::try_from(u32::from(c)).expect("a letter of Latin-1")).collect()
}

#[test]
fn an_export_becomes_a_table_in_si_beside_its_original() {
    let place = tempfile::tempdir().expect("a folder");
    let at = |name: &str| place.path().join(name);
    fs::write(at("pull.csv"), german()).expect("writable");
    let (file, out) = (at("pull.csv"), at("out"));
    let (code, text, stderr) = run(&["calibrate", "import", utf8(&file), "--out", utf8(&out)]);
    assert_eq!(code, 0, "{text}{stderr}");
    assert!(text.contains("windows-1252") && text.contains("40 rows"), "{text}");
    assert_eq!(fs::read(out.join("originals/pull.csv")).expect("kept"), german());
    let table = fs::read_to_string(out.join("pull.csv")).expect("a table");
    let lines: Vec<&str> = table.lines().collect();
    assert_eq!(lines[0], "line,time (Prüfzeit),extension (Standardweg),force (Standardkraft)");
    assert_eq!((lines[1], lines[2]), ("1,s,m,N", "7,0.0,0.0,1200.0"));
    let last: Vec<f64> = lines[41].split(',').map(|cell| cell.parse().expect("a number")).collect();
    let expected = [46.0, 19.5, 9.75e-3, 1687.5];
    assert!(last.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{last:?}");
    let json = fs::read_to_string(out.join("import.json")).expect("JSON");
    let json: Value = serde_json::from_str(&json).expect("JSON");
    let file = &json["files"][0];
    assert_eq!(file["sha256"].as_str().map(str::len), Some(64), "{json:#}");
    let area = file["tables"][0]["area_m2"].as_f64().expect("from the preamble");
    assert!((area - 12e-6).abs() < 1e-15, "{area}");
    // Again into the same folder: it is of the same kind.
    let (code, text, stderr) = run(&["calibrate", "import", utf8(&at("pull.csv")), "--out", utf8(&out)]);
    assert_eq!(code, 0, "{text}{stderr}");
}

#[test]
fn a_unit_that_its_numbers_contradict_is_left_out_until_it_is_said() {
    let place = tempfile::tempdir().expect("a folder");
    let at = |name: &str| place.path().join(name);
    let mut text = "Time (s),Position (in),Position (mm),Load (N)\n".to_owned();
    for k in 0..60 {
        let inches = 0.01 * f64::from(k);
        // What is called millimetres is centimetres.
        text += &format!("{},{inches:.4},{:.5},{:.3}\n", 0.1 * f64::from(k), 2.54 * inches, 3.0 * inches);
    }
    fs::write(at("a.csv"), text).expect("writable");
    let (file, out) = (at("a.csv"), at("out"));
    let (code, text, _) = run(&["calibrate", "import", utf8(&file), "--out", utf8(&out)]);
    assert!(code == 3 && text.contains("CONTRADICTION") && text.contains("--as"), "{code} {text}");
    let head = |out: &std::path::Path| {
        let table = fs::read_to_string(out.join("a.csv")).expect("a table");
        table.lines().next().expect("a heading").to_owned()
    };
    assert!(!head(&out).contains("extension"), "{}", head(&out));
    let said = "[column.\"Position (in)\"]\nunit = \"in\"\n[column.\"Position (mm)\"]\nunit = \"cm\"\n";
    fs::write(at("as.toml"), said).expect("writable");
    let (wish, again) = (at("as.toml"), at("again"));
    let (code, text, stderr) =
        run(&["calibrate", "import", utf8(&file), "--as", utf8(&wish), "--out", utf8(&again)]);
    assert_eq!(code, 0, "{text}{stderr}");
    assert!(head(&again).contains("extension (Position)"), "{}", head(&again));
}

#[test]
fn what_is_no_export_is_refused_where_it_goes_wrong_and_nothing_is_written() {
    let place = tempfile::tempdir().expect("a folder");
    let at = |name: &str| place.path().join(name);
    let good = "Time (s),Extension (mm),Load (N)\n0,0,0\n1,0.5,2\n2,1.0,4\n3,1.5,6\n4,2.0,8\n";
    let cases = [
        ("text.csv", good.replace("2,1.0,4", "2,broken,4"), "line 4"),
        ("back.csv", good.replace("3,1.5,6", "1.5,1.5,6"), "line 5"),
        ("empty.csv", String::new(), "empty.csv"),
        ("row.csv", "Time (s),Extension (mm),Load (N)\n0,0,0\n".to_owned(), "row.csv"),
    ];
    for (name, text, words) in &cases {
        fs::write(at(name), text).expect("writable");
        let (file, out) = (at(name), at("out"));
        let (code, text, stderr) = run(&["calibrate", "import", utf8(&file), "--out", utf8(&out)]);
        assert!(code == 1 && stderr.contains(words), "{name}: {code} {text}{stderr}");
    }
    fs::write(at("good.csv"), good).expect("writable");
    fs::write(at("wish.toml"), "delimeter = \";\"\n").expect("writable");
    let (file, wish, out) = (at("good.csv"), at("wish.toml"), at("out"));
    let (code, text, stderr) =
        run(&["calibrate", "import", utf8(&file), "--as", utf8(&wish), "--out", utf8(&out)]);
    assert!(code == 1 && stderr.contains("delimiter"), "{code} {text}{stderr}");
    assert_eq!(
        names(place.path()),
        ["back.csv", "empty.csv", "good.csv", "row.csv", "text.csv", "wish.toml"]
    );
}
