//! `check`: sound, suspicious and refused bundles.

use super::{fixture, names, run, utf8};
use phantom_rig::dataset::write_bundle;
use phantom_rig::observation::Recording;
use serde_json::Value;
use tempfile::TempDir;

fn bundle(change: impl FnOnce(&mut Recording)) -> TempDir {
    let mut recording = fixture::recording();
    change(&mut recording);
    let folder = tempfile::tempdir().expect("a temporary folder");
    write_bundle(&recording, folder.path()).expect("writable");
    folder
}

#[test]
fn a_sound_bundle_is_described() {
    let folder = bundle(|_| {});
    let (code, stdout, stderr) = run(&["check", utf8(folder.path())]);
    assert_eq!((code, stderr.as_str()), (0, ""));
    assert!(stdout.starts_with("small: sound\n"), "{stdout}");
    // Sizes from the fixture: 60 × 40 × 20 mm in 4 × 2 × 2 cells of six tetrahedra, 80 frames at 20 Hz, a
    // marker of three missing in every fifth frame.
    for words in [
        "60.0 × 40.0 × 20.0 mm, 48.0 cm³",
        "45 nodes, 96 tetrahedra",
        "fixed    8 triangles, 12.00 cm²",
        "observed 16 triangles, 24.00 cm²",
        "bonded pad",
        "80 instants at 20.0 Hz, no gap in a poke",
        "3 markers, 224 rows; 6.67 % occluded, most often marker 7 (20.00 %)",
        "until 1 s: 20 frames, every marker in at least 16",
    ] {
        assert!(stdout.contains(words), "{words:?} is not in\n{stdout}");
    }
}

#[test]
fn json_holds_the_same_for_programs() {
    let folder = bundle(|_| {});
    let (code, stdout, _) = run(&["check", "--json", utf8(folder.path())]);
    assert_eq!(code, 0);
    let json: Value = serde_json::from_str(&stdout).expect("JSON");
    assert_eq!(json["format"], "phantom-check/1");
    assert_eq!(json["recording"], "small");
    assert_eq!(json["sound"], true);
    assert_eq!(json["contents"]["pokes"][1]["poke"], 2);
    assert_eq!(json["contents"]["frames"]["rows"], 80);
    assert_eq!(json["contents"]["stage"]["gaps_in_pokes"], 0);
    // The stage goes down by 2 mm in each poke of 1 s, with a ripple of 10 µm.
    let depth = json["contents"]["pokes"][0]["depth_m"][1].as_f64().expect("a depth");
    assert!((depth - 0.002).abs() < 1.01e-5, "{depth}");
    // The ripple has an amplitude of one sigma: its sample deviation is sigma · √(n / (n − 1)).
    let force = &json["rest_noise"]["force"];
    let dof = force["degrees_of_freedom"].as_f64().expect("a number");
    let ratio = force["measured"][0].as_f64().expect("a number") / 0.006;
    assert!((ratio - ((dof + 1.0) / dof).sqrt()).abs() < 1e-12, "{ratio}");
}

/// A stepper reports its steps: 40 rows without the least noise. What varies by a thousandth of what is stated is another matter.
#[test]
fn a_stage_that_stands_exactly_still_is_not_suspected() {
    for (noise_m, suspected) in [(0.0, false), (1e-8, true)] {
        let folder = bundle(|r| {
            r.rest_until_s = 2.0;
            r.pokes.remove(0);
            let stage = r.stage.as_mut().expect("a stage");
            for (n, row) in stage.displacement_m[..40].iter_mut().enumerate() {
                *row = [if n % 2 == 0 { noise_m } else { -noise_m }; 3];
            }
        });
        let (_, stdout, _) = run(&["check", utf8(folder.path())]);
        assert_eq!(stdout.contains("the stage's noise at rest"), suspected, "{stdout}");
    }
}

#[test]
fn gaps_in_pokes_and_what_is_missing_are_counted() {
    for (gone, said) in [
        (
            1.21..1.59,
            "1 gap in a poke of 0.400 s: nothing is interpolated across, 7 instants missing in pokes",
        ),
        (1.21..1.29, "no gap in a poke, 1 instant missing in a poke"),
    ] {
        let folder = bundle(|r| {
            let wrench = std::mem::take(&mut r.wrench);
            for (i, t) in wrench.time_s.into_iter().enumerate().filter(|(_, t)| !gone.contains(t)) {
                r.wrench.time_s.push(t);
                r.wrench.force_n.push(wrench.force_n[i]);
                r.wrench.torque_nm.push(wrench.torque_nm[i]);
            }
        });
        let (code, stdout, _) = run(&["check", utf8(folder.path())]);
        assert_eq!(code, 0);
        assert!(stdout.contains(said), "{stdout}");
    }
}

#[test]
fn suspicions_degrade_and_are_listed() {
    type Spoil = fn(&mut Recording);
    let spoilt: [(&str, Spoil); 8] = [
        ("phantom's force on the tip", |r| {
            r.wrench.force_n.iter_mut().for_each(|f| f[2] = -f[2]);
        }),
        ("is the stage's sign turned", |r| {
            let stage = r.stage.as_mut().expect("a stage");
            stage.displacement_m.iter_mut().for_each(|u| u[2] = -u[2]);
        }),
        ("leads out of the phantom", |r| {
            r.pokes[0].direction.z = 1.0;
            r.pokes[1].direction.z = 1.0;
        }),
        ("the marker's noise at rest is 10.", |r| r.noise.marker_m[0] = 5e-6),
        ("0.00 times the stated one", |r| {
            // 20 rows of rest are too few to tell; 40 are enough.
            r.rest_until_s = 2.0;
            r.pokes.remove(0);
            r.wrench.force_n[..40].iter_mut().for_each(|f| f[2] = 0.0);
        }),
        ("times the stated one along x, y, z: is it in mN?", |r| {
            r.rest_until_s = 2.0;
            r.pokes.remove(0);
            for (i, f) in r.wrench.force_n[..40].iter_mut().enumerate() {
                let sign = if i % 2 == 0 { 1e3 } else { -1e3 };
                (0..3).for_each(|axis| f[axis] = sign * r.noise.force_n[axis]);
            }
        }),
        ("phantom.density_kg_m3 is 1.05 kg/m³", |r| r.phantom.density_kg_m3 = 1.05),
        ("the largest displacement (stage.csv)", |r| {
            let stage = r.stage.as_mut().expect("a stage");
            stage.displacement_m.iter_mut().for_each(|u| *u = u.map(|x| 1e3 * x));
        }),
    ];
    for (words, change) in spoilt {
        let folder = bundle(change);
        let (code, stdout, stderr) = run(&["check", utf8(folder.path())]);
        assert_eq!((code, stderr.as_str()), (3, ""), "{words}: {stdout}");
        assert!(stdout.contains("suspicion") && stdout.contains(words), "{words:?} is not in\n{stdout}");
        let (code, stdout, _) = run(&["--json", "check", utf8(folder.path())]);
        let json: Value = serde_json::from_str(&stdout).expect("JSON");
        assert_eq!((code, &json["sound"]), (3, &Value::Bool(false)));
        assert!(json["suspicions"].to_string().contains(words), "{json}");
    }
}

#[test]
fn a_refusal_is_one_line_and_writes_nothing() {
    let folder = bundle(|r| r.wrench.force_n[4][1] = f64::NAN);
    let before = names(folder.path());
    let (code, stdout, stderr) = run(&["check", utf8(folder.path())]);
    assert_eq!((code, stdout.as_str()), (1, ""));
    assert_eq!(stderr.lines().count(), 1, "{stderr}");
    for word in ["error:", "force.csv", "row 6", "fy_n", "NaN", "finite"] {
        assert!(stderr.contains(word), "{word:?} is not in {stderr}");
    }
    assert_eq!(names(folder.path()), before);
    let (code, stdout, _) = run(&["check", "--json", utf8(folder.path())]);
    let json: Value = serde_json::from_str(&stdout).expect("JSON");
    assert_eq!((code, &json["format"]), (1, &Value::from("phantom-error/1")));
    assert!(json["error"].to_string().contains("row 6"), "{json}");
}

#[test]
fn a_mesh_error_is_told_with_its_file() {
    let folder = bundle(|r| r.mesh.tets[3].swap(1, 2));
    let (code, _, stderr) = run(&["check", utf8(folder.path())]);
    assert_eq!(code, 1);
    assert!(stderr.contains("mesh.msh: tetrahedron 3 has volume -"), "{stderr}");
}

#[test]
fn quiet_says_it_with_the_exit_code_alone() {
    let folder = bundle(|_| {});
    assert_eq!(run(&["check", "--quiet", utf8(folder.path())]), (0, String::new(), String::new()));
}
