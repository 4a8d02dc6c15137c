//! `diagnose`: what it leaves behind, what it ends with, and what it refuses.

use super::{names, run, utf8};
use phantom_rig::dataset::{read_bundle, write_bundle};
use phantom_rig::observation::Recording;
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

/// Diagnoses what `change` makes of the demo recording.
fn changed(change: impl FnOnce(&mut Recording)) -> (i32, Value, String) {
    let demo = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs/demo");
    let mut recording = read_bundle(&demo).expect("the demo recording").0;
    change(&mut recording);
    let place = tempfile::tempdir().expect("a temporary folder");
    let bundle = place.path().join("bundle");
    write_bundle(&recording, &bundle).expect("writable");
    let (code, stdout, stderr) = run(&["diagnose", utf8(&bundle), "--quick", "--print-only", "--json"]);
    (code, serde_json::from_str(&stdout).unwrap_or(Value::Null), stderr)
}

/// What a recording cannot decide is not decided: nothing is named, and what would help is said.
#[test]
fn one_poke_names_nothing() {
    let (code, json, stderr) = changed(|recording| recording.pokes.truncate(1));
    assert_eq!(code, 3, "{stderr}");
    let verdict = &json["verdict"];
    let physics = verdict["physics"].as_array().expect("a list");
    assert!(physics.is_empty() || physics == &["unexplained"], "{verdict}");
    assert!(verdict["confidence"].as_f64().expect("a number") <= 0.5, "{verdict}");
    let remarks = json["remarks"].to_string();
    assert!(remarks.contains("at least 2 are needed"), "{remarks}");
}

/// Without a stage the wrench drives the model.
#[test]
fn a_recording_without_a_stage_names_nothing() {
    let (code, json, stderr) = changed(|recording| recording.stage = None);
    assert_eq!(code, 3, "{stderr}");
    let physics = json["verdict"]["physics"].as_array().expect("a list");
    assert!(physics.is_empty() || physics == &["unexplained"], "{}", json["verdict"]);
    assert!(json["remarks"].to_string().contains("without stage.csv"), "{}", json["remarks"]);
}

/// A factor on the force is a factor on the modulus: only what the operator expects can speak against it.
#[test]
fn a_force_in_the_wrong_unit_is_not_believed() {
    let (code, json, stderr) = changed(|recording| {
        let inside =
            recording.wrench.time_s.iter().position(|&t| t >= recording.rest_until_s).expect("pokes");
        recording.wrench.force_n[inside..].iter_mut().flatten().for_each(|f| *f *= 4.448);
    });
    assert_eq!(code, 3, "{stderr}");
    let verdict = &json["verdict"];
    assert!(verdict["ambiguous_with"].to_string().contains("force-gain"), "{verdict}");
    assert!(json["remarks"].to_string().contains("outside the range"), "{}", json["remarks"]);
}

#[test]
fn a_sensor_that_reads_nothing_is_refused() {
    let (code, _, stderr) = changed(|recording| recording.wrench.force_n.fill([0.0; 3]));
    assert_eq!(code, 1, "{stderr}");
    assert!(stderr.contains("force"), "{stderr}");
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
