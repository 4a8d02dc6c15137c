//! `diagnose`: what it leaves behind, what it ends with, and what it refuses.

use super::{fixture, names, run, utf8};
use phantom_rig::dataset::write_bundle;
use serde_json::Value;
use std::path::Path;

/// The exit code says whether the verdict stands alone with confidence; folder and standard output say the same.
#[test]
fn a_diagnosis_leaves_page_and_json() {
    let place = tempfile::tempdir().expect("a temporary folder");
    let out = place.path().join("result");
    let demo = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs/demo");
    let (code, stdout, stderr) = run(&["diagnose", utf8(&demo), "--quick", "--json", "--out", utf8(&out)]);
    assert_eq!(stderr, "");
    let json: Value = serde_json::from_str(&stdout).expect("JSON");
    assert_eq!(json["format"], "phantom-diagnosis/1");
    let file = std::fs::read_to_string(out.join("diagnosis.json")).expect("a file");
    assert_eq!(serde_json::from_str::<Value>(&file).expect("JSON"), json);
    let verdict = &json["verdict"];
    let alone = verdict["ambiguous_with"] == Value::Array(Vec::new())
        && verdict["physics"] != serde_json::json!(["unexplained"]);
    let sure = alone && verdict["confidence"].as_f64().is_some_and(|c| c >= 0.9);
    assert_eq!(code, if sure { 0 } else { 3 }, "{verdict}");
    let found = names(&out);
    assert!(["diagnosis.html", "diagnosis.json"].iter().all(|n| found.iter().any(|f| f == n)), "{found:?}");
    assert_eq!(found.iter().any(|n| n == "next-poke.csv"), !json["next_poke"].is_null());
    assert_eq!(names(place.path()), ["result"]);
}

#[test]
fn one_poke_is_refused_and_nothing_is_written() {
    let mut recording = fixture::recording();
    recording.pokes.truncate(1);
    let place = tempfile::tempdir().expect("a temporary folder");
    let (bundle, out) = (place.path().join("bundle"), place.path().join("out"));
    write_bundle(&recording, &bundle).expect("writable");
    let (code, stdout, stderr) = run(&["diagnose", utf8(&bundle), "--quick", "--out", utf8(&out)]);
    assert_eq!((code, stdout.as_str()), (1, ""));
    assert!(stderr.contains("at least 2 are needed"), "{stderr}");
    assert_eq!(names(place.path()), ["bundle"]);
}

#[test]
fn a_share_is_between_none_and_all() {
    for share in ["0", "1", "-0.1", "NaN"] {
        let (code, _, stderr) = run(&["diagnose", "nowhere", &format!("--false-alarm={share}")]);
        assert_eq!(code, 2, "{share}: {stderr}");
    }
    let (code, _, stderr) = run(&["diagnose", "nowhere", "--print-only", "--out", "x"]);
    assert_eq!(code, 2, "{stderr}");
}
