//! `predict`: what it says of bodies under dead loads, and what it refuses.

use super::{fixture, run, utf8};
use phantom_rig::dataset::write_bundle;
use phantom_rig::observation::Recording;
use serde_json::Value;
use tempfile::TempDir;

/// One poke in which a weight hangs (N), and every marker goes down by as many tenths of a millimetre a newton.
fn hung(name: &str, force_n: f64, change: impl FnOnce(&mut Recording)) -> TempDir {
    let mut recording = fixture::recording();
    recording.name = name.to_owned();
    recording.pokes.truncate(1);
    recording.stage = None;
    let (start_s, end_s) = (recording.pokes[0].start_s, recording.pokes[0].end_s);
    let acts = |t: f64| (start_s..=end_s).contains(&t);
    for (t, force) in recording.wrench.time_s.iter().zip(&mut recording.wrench.force_n) {
        *force = if acts(*t) { [0.0, 0.0, -force_n] } else { [0.0; 3] };
    }
    let home = fixture::recording().rest_positions();
    for row in &mut recording.markers.rows {
        let at = home[row.marker as usize].0;
        let down =
            if acts(recording.markers.frame_time_s[row.frame as usize]) { 1e-3 * force_n } else { 0.0 };
        row.position_m = [at.x, at.y, at.z - down];
    }
    change(&mut recording);
    let folder = tempfile::tempdir().expect("a temporary folder");
    write_bundle(&recording, folder.path()).expect("writable");
    folder
}

#[test]
fn a_prediction_is_compared_with_what_was_measured() {
    let (light, heavy) = (hung("light", 0.02, |_| {}), hung("heavy", 0.04, |_| {}));
    let (light, heavy) = (utf8(light.path()), utf8(heavy.path()));
    let (code, stdout, stderr) = run(&["predict", light, "--of", heavy, "--json"]);
    assert_eq!(stderr, "");
    let json: Value = serde_json::from_str(&stdout).expect("JSON");
    // One recording shows no difference between recordings.
    assert_eq!((code, &json["one_recording"]), (3, &Value::Bool(true)), "{json}");
    assert_eq!(json["format"], "phantom-prediction/1");
    let modulus = json["young_modulus_pa"]["value"].as_f64().expect("a number");
    let (alone, marker) = (&json["alone"][0], &json["predicted"][0]["markers"][1]);
    assert!((alone["young_modulus_pa"].as_f64().expect("a number") / modulus - 1.0).abs() < 1e-3);
    assert!((marker["measured_m"][2].as_f64().expect("a number") + 4e-5).abs() < 1e-9);
    assert_eq!(marker["marker"], 7);
}

#[test]
fn what_cannot_be_predicted_is_refused() {
    let steady = hung("steady", 0.02, |_| {});
    let other = hung("other", 0.02, |recording| {
        for node in &mut recording.mesh.nodes {
            *node *= 1.01;
        }
    });
    let changing = tempfile::tempdir().expect("a temporary folder");
    write_bundle(&fixture::recording(), changing.path()).expect("writable");
    let (steady, other, changing) = (utf8(steady.path()), utf8(other.path()), utf8(changing.path()));
    for (arguments, code, words) in [
        (&["predict", steady][..], 2, "--force-n"),
        (&["predict", steady, "--force-n", "0,1"], 2, "three numbers"),
        (&["predict", steady, "--force-n", "0,0,-1", "--of", other], 2, "cannot be used with"),
        (&["predict", changing, "--force-n", "0,0,-1"], 1, "a dead load stands still"),
        (&["predict", steady, other, "--force-n", "0,0,-1"], 1, "recordings of one body are wanted"),
        (&["predict", "nowhere", "--force-n", "0,0,-1"], 1, "nowhere"),
    ] {
        let (found, stdout, stderr) = run(arguments);
        assert_eq!((found, stdout.as_str()), (code, ""), "{arguments:?}: {stderr}");
        assert!(stderr.contains(words), "{words:?} is not in {stderr}");
    }
}
