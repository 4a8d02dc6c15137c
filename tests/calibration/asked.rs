//! What is asked of `calibrate` and makes no sense is a usage error that names the option; a file that is not there is named once.

use super::{names, run, utf8};
use std::fs;

/// Options that no bench has: exit code 2 before anything is read.
#[test]
fn options_that_make_no_sense_are_usage_errors() {
    let place = tempfile::tempdir().expect("a folder");
    let out = place.path().join("out");
    let cases: [(&[&str], &str); 9] = [
        (&["registration", "session", "--tolerance-mm=-1"], "--tolerance-mm -1"),
        (&["registration", "session", "--tolerance-mm", "nan"], "--tolerance-mm NaN"),
        (&["bands", "band.csv", "--parallel", "0"], "--parallel"),
        (&["bands", "band.csv", "--pretension-n=-5"], "--pretension-n -5"),
        (&["bands", "band.csv", "--pretension-n", "0"], "--pretension-n 0"),
        (&["force", "weights.csv", "--gravity", "0"], "--gravity 0"),
        (&["force", "weights.csv", "--lever-mm=-0.1"], "--lever-mm -0.1"),
        (&["tensile", "gel.csv", "--strain", "0.5,0"], "--strain 0.5,0"),
        (&["stage", "gauge.csv", "--tip-um-per-n=-1"], "--tip-um-per-n"),
    ];
    for (words, option) in cases {
        let (code, text, stderr) = run(&[&["calibrate"], words, &["--out", utf8(&out)]].concat());
        assert!(code == 2 && stderr.contains(option), "{words:?}: {code} {text}{stderr}");
    }
    assert!(names(place.path()).is_empty());
}

#[test]
fn what_is_not_there_is_named_once() {
    let place = tempfile::tempdir().expect("a folder");
    let at = |name: &str| place.path().join(name);
    fs::write(at("gel.csv"), "Time (s),Extension (mm),Load (N)\n0,0,0\n1,0.5,2\n2,1.0,4\n3,1.5,6\n")
        .expect("writable");
    let (gel, gone, out) = (at("gel.csv"), at("gone"), at("out"));
    for what in ["import", "tensile"] {
        for words in
            [&["calibrate", what, utf8(&gone)][..], &["calibrate", what, utf8(&gel), "--as", utf8(&gone)]]
        {
            let (code, _, stderr) = run(&[words, &["--out", utf8(&out)]].concat());
            let said = stderr.matches("No such file").count();
            assert!(
                code == 1 && said == 1 && stderr.contains("gone: can't be read"),
                "{words:?}: {code} {stderr}"
            );
        }
    }
}

/// The help shows a default as it would be typed.
#[test]
fn the_default_window_of_strains_is_shown_as_it_is_typed() {
    let (code, text, _) = run(&["calibrate", "tensile", "--help"]);
    assert!(code == 0 && text.contains("[default: 0,0.5]"), "{code} {text}");
}

/// One table is one table, and a range reads as a person writes it.
#[test]
fn an_import_counts_and_ranges_as_people_do() {
    let place = tempfile::tempdir().expect("a folder");
    let (file, out) = (place.path().join("gel.csv"), place.path().join("out"));
    let row = |k: u32| format!("{:.1},{:.2},{}\n", 0.2 + 0.5 * f64::from(k), 0.1 * f64::from(k), 2 * k);
    let text = "Time (s),Extension (mm),Load (N)\n".to_owned() + &(0..31).map(row).collect::<String>();
    fs::write(&file, text).expect("writable");
    let (code, text, stderr) = run(&["calibrate", "import", utf8(&file), "--out", utf8(&out)]);
    let ranges = ["0.2 to 15.2 s", "0 to 0.003 m", "0 to 60 N"];
    assert!(
        code == 0 && text.contains("1 table in ") && ranges.iter().all(|r| text.contains(r)),
        "{code} {text}{stderr}"
    );
}
