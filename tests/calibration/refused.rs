//! `calibrate bands` and `calibrate relaxation` refuse what is no test: with file, line and column, and nothing is written.

use super::{names, run, utf8};
use std::fs;

/// Time (s), extension (mm), force (N): out and back.
fn band() -> Vec<[f64; 3]> {
    let way = |k: u32| if k < 60 { 0.5 * f64::from(k) } else { 0.5 * f64::from(120 - k) };
    (0..120).map(|k| [0.1 * f64::from(k), way(k), 0.2 * way(k) + 0.001 * f64::from(k % 3)]).collect()
}

/// A ramp of 2 s and a hold of 18 s whose force falls.
fn held() -> Vec<[f64; 3]> {
    let force = |t: f64| if t < 2.0 { 2.0 * t } else { 2.5 + 1.5 * (-(t - 2.0) / 4.0).exp() };
    (0..200).map(|k| 0.1 * f64::from(k)).map(|t| [t, (0.5 * t).min(1.0), force(t)]).collect()
}

fn table(rows: &[[f64; 3]]) -> String {
    let line = |[t, x, f]: &[f64; 3]| format!("{t:.1},{x:.4},{f:.4}\n");
    "Time (s),Extension (mm),Load (N)\n".to_owned() + &rows.iter().map(line).collect::<String>()
}

/// Every file is refused with these words behind its name, and no folder is left.
fn refused(command: &str, cases: &[(&str, String, &str)]) {
    let place = tempfile::tempdir().expect("a folder");
    let mut left: Vec<&str> = Vec::new();
    for (name, text, words) in cases {
        let file = place.path().join(name);
        fs::write(&file, text).expect("writable");
        left.push(name);
        let out = place.path().join("out");
        let (code, text, stderr) = run(&["calibrate", command, utf8(&file), "--out", utf8(&out)]);
        println!("{stderr}");
        let said = stderr.split(name).nth(1).is_some_and(|behind| behind.starts_with(words));
        assert!(code == 1 && said, "{name}: {code} {text}{stderr}");
    }
    left.sort_unstable();
    assert_eq!(names(place.path()), left);
}

/// What is wrong with any table.
fn spoiled(rows: &[[f64; 3]]) -> Vec<(&'static str, String, &'static str)> {
    let mut back = rows.to_vec();
    back[40][0] = 3.5;
    let still: Vec<[f64; 3]> = rows.iter().map(|[t, _, f]| [*t, 3.0, *f]).collect();
    let text = table(rows).replace("\n4.0,", "\n4.0,about ");
    let head = "Time (s),Extension (in),Extension (mm),Load (N)\n";
    // What is called millimetres is centimetres.
    let mixed: String =
        rows.iter().map(|[t, x, f]| format!("{t:.1},{:.6},{:.6},{f:.4}\n", x / 25.4, x / 10.0)).collect();
    vec![
        ("empty.csv", String::new(), ": the file is empty"),
        ("row.csv", table(&rows[..1]), ", line 2: the table has 1 row"),
        ("text.csv", text, ", line 42, column 2"),
        ("back.csv", table(&back), ", line 42, column 1"),
        ("still.csv", table(&still), ", line 1, column 2"),
        ("mixed.csv", head.to_owned() + &mixed, ", line 1, column 3"),
    ]
}

#[test]
fn what_is_no_test_of_bands() {
    let mut slipped = band();
    slipped[40..].iter_mut().for_each(|r| r[2] -= 1.0);
    let mut cases = spoiled(&band());
    cases.push(("slip.csv", table(&slipped), ", line 42, column 3: the force falls from"));
    refused("bands", &cases);
}

/// What the export itself calls a bend or a press has no stiffness of bands.
#[test]
fn a_bend_is_no_pull_of_bands() {
    let place = tempfile::tempdir().expect("a folder");
    for (name, label, how) in [
        ("bent.csv", "Flexure extension at Maximum Load", "bent"),
        ("pressed.csv", "Compressive extension at Maximum Load", "pressed"),
    ] {
        let (file, out) = (place.path().join(name), place.path().join("out"));
        let head = format!("Maximum Load : {label},\"30.0\",mm\n\n");
        fs::write(&file, head + &table(&band())).expect("writable");
        let (code, text, stderr) = run(&["calibrate", "bands", utf8(&file), "--out", utf8(&out)]);
        let words = format!("not pulled but {how}, as the export says");
        let said = stderr.contains(name) && stderr.contains(&words);
        assert!(code == 1 && said && !out.exists(), "{name}: {code} {text}{stderr}");
    }
}

/// A pull below where the loading begins was not measured: said, with exit code 3. Of several bands that of one is told too.
#[test]
fn a_pull_below_the_loading_is_said_and_one_of_several_bands_is_told() {
    let place = tempfile::tempdir().expect("a folder");
    let (file, out) = (place.path().join("two.csv"), place.path().join("out"));
    // Out and back from a pull of 2 N at 200 N/m.
    let loaded: Vec<[f64; 3]> = band().iter().map(|[t, x, f]| [*t, *x, f + 2.0]).collect();
    fs::write(&file, table(&loaded)).expect("writable");
    let bands = |pull: &str| {
        let words = ["calibrate", "bands", utf8(&file), "--parallel", "2", "--pretension-n", pull];
        run(&[&words[..], &["--out", utf8(&out)]].concat())
    };
    let (code, text, stderr) = bands("1");
    let words = "a pull of 1.00 N was not measured: the loading begins at 2.0";
    assert!(code == 3 && text.contains(words), "{code} {text}{stderr}");
    let (_, text, _) = bands("4");
    assert!(!text.contains("was not measured"), "{text}");
    let first = text.lines().next().expect("a line");
    assert!(
        first.contains("of 2 bands together, 100.") || first.contains("of 2 bands together, 99."),
        "{first}"
    );
}

#[test]
fn what_is_no_test_of_relaxation() {
    let never: Vec<[f64; 3]> = (0..100).map(|k| 0.1 * f64::from(k)).map(|t| [t, t, 2.0 * t]).collect();
    let none: Vec<[f64; 3]> = held().iter().map(|[t, x, _]| [*t, *x, 1.0]).collect();
    let mut cases = spoiled(&held());
    cases.push(("never-held.csv", table(&never), ", line 1, column 2"));
    cases.push(("no-force.csv", table(&none), ", line 1, column 3"));
    refused("relaxation", &cases);
}

/// A share that relaxes is a reference value like the others, with the hash of its raw file.
#[test]
fn a_hold_becomes_a_reference_value() {
    let place = tempfile::tempdir().expect("a folder");
    let (file, out) = (place.path().join("gel.csv"), place.path().join("out"));
    // One branch of 4 s behind a ramp of 0.2 s: 1.5 of 4 N relax, and the ramp takes a fortieth of it.
    let tau = 4.0;
    let on_ramp = |t: f64| 1.5 / 0.2 * tau * (1.0 - (-t / tau).exp());
    let force = |t: f64| {
        if t < 0.2 { 2.5 * t / 0.2 + on_ramp(t) } else { 2.5 + on_ramp(0.2) * (-(t - 0.2) / tau).exp() }
    };
    let rows: Vec<[f64; 3]> =
        (0..1200).map(|k| 0.02 * f64::from(k)).map(|t| [t, (5.0 * t).min(1.0), force(t)]).collect();
    let line = |[t, x, f]: &[f64; 3]| format!("{t:.2},{x:.4},{f:.5}\n");
    let text = "Time (s),Extension (mm),Load (N)\n".to_owned() + &rows.iter().map(line).collect::<String>();
    fs::write(&file, &text).expect("writable");
    let (code, text, stderr) =
        run(&["calibrate", "relaxation", utf8(&file), "--date", "2026-11-02", "--out", utf8(&out)]);
    assert!(code == 0 || code == 3, "{text}{stderr}");
    assert_eq!(names(&out).len(), 4, "{:?}", names(&out));
    let toml = out.join("relaxation.toml");
    let value = phantom_rig::calib::reference::ReferenceValue::read(&toml).expect("sound");
    assert_eq!(value.quantity, phantom_rig::calib::reference::ReferenceQuantity::RelaxedFraction);
    assert!((value.figure.value - 0.375).abs() < 2.0 * value.figure.sd, "{value:?}");
    assert!(value.figure.sd < 0.03, "{value:?}");
    assert_eq!(value.raw[0].sha256.len(), 64);
    // A diagnosis knows such a share, a fit does not.
    let diagnosis = place.path().join("diagnosis.json");
    let said = |share: f64| {
        format!(
            "{{\"format\": \"phantom-diagnosis/1\", \"parameters\": {{\"viscoelastic-relaxation\": {{\"relaxed_fraction\": \
             [{{\"value\": {share}, \"sd\": 0.01}}], \"time_constant_s\": [{{\"value\": 4.1, \"sd\": 0.3}}]}}}}}}"
        )
    };
    for (share, expected) in [(0.37, 0), (0.6, 3)] {
        fs::write(&diagnosis, said(share)).expect("writable");
        let (code, text, stderr) =
            run(&["calibrate", "compare", utf8(&diagnosis), "--reference", utf8(&toml)]);
        assert_eq!(code, expected, "{text}{stderr}");
    }
    fs::write(&diagnosis, "{\"format\": \"phantom-fit/1\"}").expect("writable");
    let (code, _, stderr) = run(&["calibrate", "compare", utf8(&diagnosis), "--reference", utf8(&toml)]);
    assert!(code == 2 && stderr.contains("relaxed fraction"), "{code} {stderr}");
}
