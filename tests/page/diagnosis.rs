//! Do the files and the page of a diagnosis say what the diagnosis says?

use super::browser;
use super::picture::{drawn_share, pixels};
use super::view::{SCREEN, assert_quiet, part};
use super::{readings, synthetic};
use phantom_rig::diagnose::{Diagnosis, Estimate, Found, Parameter, Physics};
use phantom_rig::report::{conclusion, diagnosis_json, diagnosis_page, evidence, is_sure, write_diagnosis};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::fs;

fn json_of(diagnosis: &Diagnosis) -> Value {
    diagnosis_json(diagnosis, &Map::new()).expect("JSON")
}

#[test]
fn the_contract_keys_hold_the_values_of_the_diagnosis() {
    let recording = synthetic::recording("bench-07");
    let json = json_of(&readings::relaxation(&recording));
    assert_eq!(json["format"], "phantom-diagnosis/1");
    assert_eq!(json["recording"], "bench-07");
    let mismatch = &json["mismatch"];
    assert_eq!(mismatch["detected"], true);
    assert_eq!(mismatch["p_value"], 1e-9);
    assert_eq!(mismatch["channels"], json!(["force", "markers"]));
    assert_eq!(mismatch["pokes"], json!([2, 3]));
    assert_eq!(mismatch["phases"], json!(["hold"]));
    assert_eq!(mismatch["region"], Value::Null);
    assert_eq!(json["verdict"]["physics"], json!(["viscoelastic-relaxation"]));
    assert_eq!(json["verdict"]["confidence"], 0.97);
    assert_eq!(json["verdict"]["ambiguous_with"], json!([]));
    let evidence = json!({
        "explained_share": 0.98, "gain_over_least": 900.0, "margin_share": 0.4, "left_deviations": 1.5, "effects": 1,
    });
    assert_eq!(json["verdict"]["evidence"], evidence);
    let expected = json!({
        "relaxed_fraction": [{"value": 0.22, "sd": 0.01}],
        "time_constant_s": [{"value": 4.0, "sd": 0.5}],
    });
    assert_eq!(json["parameters"]["viscoelastic-relaxation"], expected);
    let first = &json["candidates"][0];
    assert_eq!(first["physics"], "viscoelastic-relaxation");
    assert_eq!(first["held_out_chi2_per_dof"], 1.02);
    assert_eq!((&first["selected"], &json["candidates"][1]["selected"]), (&json!(true), &json!(false)));
    assert_eq!(json["candidates"][2]["held_out_chi2_per_dof"], Value::Null);
    assert_eq!(json["candidates"][3]["physics"], "baseline");
    assert_eq!(json["baseline"]["young_modulus_pa"], json!({"value": 10_000.0, "sd": 90.0}));
    assert_eq!(json["baseline"]["held_out_chi2_per_dof"], 14.2);
    assert_eq!(json["extended"]["young_modulus_pa"]["value"], 8_700.0);
    let patches = &json["extended"]["restraint_patches"];
    assert_eq!((&patches[0]["kind"], &patches[1]["kind"]), (&json!("springs"), &json!("glued")));
    assert_eq!((&patches[0]["stiffness_n_per_m"], &patches[0]["sd"]), (&json!(124.3), &json!(2.4)));
    assert_eq!(json["next_poke"], Value::Null);
}

#[test]
fn each_kind_of_verdict_has_its_form() {
    let recording = synthetic::recording("bench-07");
    let nothing = json_of(&readings::nothing(&recording));
    assert_eq!(nothing["verdict"]["physics"], json!([]));
    assert_eq!(nothing["mismatch"]["detected"], false);
    assert_eq!(nothing["verdict"]["evidence"], Value::Null);
    let unexplained = json_of(&readings::unexplained(&recording));
    assert_eq!(unexplained["verdict"]["physics"], json!(["unexplained"]));
    assert_eq!(unexplained["verdict"]["confidence"], Value::Null);
    let set = json_of(&readings::set(&recording));
    assert_eq!(set["verdict"]["ambiguous_with"], json!(["base-debonding"]));
    assert_eq!(set["mismatch"]["region"], json!({"centroid_m": [0.068, 0.052, 0.006], "radius_m": 0.011}));
    // One number stands by itself where the catalogue has no list.
    assert_eq!(set["parameters"]["inclusion"]["radius_m"], json!({"value": 0.007, "sd": 0.001}));
    assert_eq!(set["next_poke"]["separates"], json!(["inclusion", "base-debonding"]));
    assert_eq!(set["next_poke"]["site_m"], json!([0.05, 0.05, 0.025]));
}

#[test]
fn the_first_thing_is_a_sentence() {
    let recording = synthetic::recording("bench-07");
    let relaxation = readings::relaxation(&recording);
    assert_eq!(
        conclusion(&relaxation),
        "Relaxation was left out: 22 % of the stress decays with 4.0 s; held-out misfit falls from 14.2 to 1.02; \
         the modulus moves from 10.00 kPa to 8.70 kPa; least sure: the time constant (± 12 %)"
    );
    assert_eq!(
        evidence(&relaxation),
        "The misfit shows in the force along the poke and the markers along z, while it stays, most in pokes 2 and 3. \
         By chance it would be as large less than once in 10,000 recordings. Confidence 97 %."
    );
    let misfits = |before, after| {
        let mut diagnosis = readings::relaxation(&recording);
        diagnosis.baseline.held_out_chi2_per_dof = before;
        diagnosis.extended.held_out_chi2_per_dof = after;
        conclusion(&diagnosis)
    };
    assert!(misfits(1.003, 0.998).contains("misfit falls from 1.003 to 0.998;"));
    assert!(misfits(1.00301, 1.00328).contains("misfit rises from 1.0030 to 1.0033;"));
    assert!(misfits(1.0, 1.0).contains("misfit stays at 1.00;"));
    let mut small = readings::relaxation(&recording);
    small.mismatch.p_value = 0.43;
    let said = evidence(&small);
    assert!(
        said.contains(
            "Taken as a whole it is no larger than noise and elements leave it in 43 % of recordings;"
        ),
        "{said}"
    );
    assert!(!said.contains("By chance"), "{said}");
    let nothing = readings::nothing(&recording);
    assert_eq!(
        conclusion(&nothing),
        "Nothing was left out that this recording shows: the modulus is 10.00 kPa"
    );
    assert_eq!(
        evidence(&nothing),
        "Noise and elements leave a misfit as large in 43 % of recordings. Confidence 98 %."
    );
    let unexplained = conclusion(&readings::unexplained(&recording));
    assert!(unexplained.contains("no entry of the catalogue explains"), "{unexplained}");
    let set = conclusion(&readings::set(&recording));
    assert!(
        set.starts_with(
            "An inclusion or a debonded part of the base was left out; this recording cannot tell which. \
             If an inclusion: 0.31 times as stiff as the rest, 7.0 mm in radius, at (70.0, 50.0, 8.0) mm; "
        ),
        "{set}"
    );
    let sure = [relaxation, nothing, readings::unexplained(&recording), readings::set(&recording)];
    assert_eq!(sure.map(|d| is_sure(&d)), [true, true, false, false]);
}

/// What is in no catalogue is said with what it leads to, alone or beside an entry; other programs read that no entry explains it.
#[test]
fn what_is_no_entry_is_said_all_the_same() {
    let recording = synthetic::recording("bench-07");
    let mut drags = readings::relaxation(&recording);
    drags.verdict.physics.clear();
    (drags.verdict.unexplained, drags.verdict.explained_by) = (true, vec![Physics::StickyRestraint]);
    let parameter = |id, value, sd| Parameter { id, values: vec![Estimate { value, sd }], list: false };
    drags.parameters = vec![Found {
        physics: Physics::StickyRestraint,
        parameters: vec![parameter("stiffness_ratio", 0.75, 0.03), parameter("slip_m", 2.1e-4, 1e-5)],
        law: None,
    }];
    assert_eq!(
        conclusion(&drags),
        "Dry friction beside the restraint was left out, which is no entry of the catalogue: the restraint pulls 75 % harder at first, and \
         slides after 0.21 mm; held-out misfit falls from 14.2 to 1.02; the modulus moves from 10.00 kPa to 8.70 kPa; least sure: the slip \
         (± 4.8 %)"
    );
    assert!(evidence(&drags).ends_with("Confidence 97 %."), "{}", evidence(&drags));
    assert!(!is_sure(&drags));
    let json = json_of(&drags);
    assert_eq!(json["verdict"]["physics"], json!(["unexplained"]));
    assert_eq!(json["verdict"]["explained_by"], json!(["sticky-restraint"]));
    assert_eq!(json["parameters"]["sticky-restraint"]["slip_m"]["value"], json!(2.1e-4));
    let mut both = drags.clone();
    both.verdict.explained_by.push(Physics::CameraLag);
    let said = conclusion(&both);
    assert!(
        said.starts_with(
            "Dry friction beside the restraint and a late camera were left out; not all of that are entries of the catalogue: "
        ),
        "{said}"
    );
    drags.verdict.ambiguous_with = vec![Physics::BandViscosity];
    let said = conclusion(&drags);
    assert!(
        said.contains(
            "dry friction beside the restraint or relaxation of the restraint may have been left out"
        ),
        "{said}"
    );
}

/// Every entry of the catalogue can be named, with and without parameters.
#[test]
fn two_effects_and_every_entry_make_a_sentence() {
    let recording = synthetic::recording("bench-07");
    let mut diagnosis = readings::relaxation(&recording);
    diagnosis.verdict.physics.push(Physics::StageCompliance);
    diagnosis.parameters.push(Found {
        physics: Physics::StageCompliance,
        parameters: vec![Parameter {
            id: "compliance_m_per_n",
            values: vec![Estimate { value: 2.5e-4, sd: 1e-5 }],
            list: false,
        }],
        law: None,
    });
    let text = conclusion(&diagnosis);
    assert!(text.starts_with("Relaxation and give of the stage were left out: "), "{text}");
    assert!(text.contains("22 % of the stress decays with 4.0 s; 0.250 mm/N; "), "{text}");
    let mut seen = BTreeMap::new();
    for &physics in Physics::ALL {
        diagnosis.verdict.physics = vec![physics];
        let text = conclusion(&diagnosis);
        assert!(text.contains(" was left out"), "{text}");
        assert_eq!(seen.insert(text, physics), None, "{physics} is called like another");
    }
}

#[test]
fn the_folder_holds_page_json_and_the_next_poke() {
    let recording = synthetic::recording("bench-07");
    let folder = synthetic::kept_folder("diagnosis-files");
    let written =
        write_diagnosis(&folder, &readings::set(&recording), &recording, &Map::new()).expect("written");
    let names: Vec<&str> =
        written.iter().map(|p| p.file_name().and_then(|n| n.to_str()).expect("a name")).collect();
    assert_eq!(names, ["diagnosis.html", "diagnosis.json", "next-poke.csv"]);
    let text = fs::read_to_string(folder.join("diagnosis.json")).expect("a file");
    assert_eq!(serde_json::from_str::<Value>(&text).expect("JSON"), json_of(&readings::set(&recording)));
    let mut table = csv::Reader::from_path(folder.join("next-poke.csv")).expect("a table");
    let header = table.headers().expect("a header").clone();
    let row = table.records().next().expect("a row").expect("a row");
    let get = |name: &str| -> f64 {
        let at = header.iter().position(|h| h == name).unwrap_or_else(|| panic!("no column {name}"));
        row[at].parse().expect("a number")
    };
    // The last of seven pokes ends at 63 s and a poke follows the other by 1 s; 3 mm in and out at 2 mm/s, held 2 s.
    assert_eq!((get("poke"), get("start_s"), get("end_s")), (8.0, 64.0, 69.0));
    assert_eq!((get("site_x_m"), get("dir_z"), get("radius_m")), (0.05, -1.0, 0.008));
    assert_eq!((get("depth_m"), get("rate_m_s"), get("hold_s")), (0.003, 0.002, 2.0));
    let without = synthetic::kept_folder("diagnosis-without");
    let written = write_diagnosis(&without, &readings::relaxation(&recording), &recording, &Map::new());
    assert_eq!(written.expect("written").len(), 2);
}

#[test]
fn every_kind_of_diagnosis_shows_without_a_network() {
    let recording = synthetic::recording("bench <i>07</i>");
    let kinds = [
        ("relaxation", readings::relaxation(&recording)),
        ("set", readings::set(&recording)),
        ("nothing", readings::nothing(&recording)),
        ("unexplained", readings::unexplained(&recording)),
    ];
    let settings = json!({"quick": true, "bundle": "<b>x</b>"});
    let settings = settings.as_object().expect("an object");
    let Some(mut browser) = browser::start(SCREEN.0, SCREEN.1) else {
        println!("skipped: no Chromium");
        return;
    };
    for (kind, diagnosis) in kinds {
        let text = diagnosis_page(&diagnosis, &recording, settings).expect("a page");
        let folder = synthetic::kept_folder(&format!("diagnosis-{kind}"));
        let file = folder.join("diagnosis.html");
        fs::write(&file, text).expect("a file");
        browser.open(&file);
        let head = browser.evaluate("document.querySelector('h1').innerText");
        assert_eq!(head, format!("{}.", conclusion(&diagnosis)));
        assert_eq!(browser.evaluate("document.querySelector('.bar strong').textContent"), "bench <i>07</i>");
        let held = browser.evaluate("document.getElementById('phantom').data.map(t => t.hovertext).filter(t => /springs|glued/.test(t))");
        assert_eq!(held, json!(["springs, 124.3 ± 2.4 N/m", "glued"]));
        let table = browser.evaluate("document.body.innerText");
        let row = "springs, 124.3 ± 2.4 N/m\t120.00 ± 0.40\t50.00 ± 0.30\t0.00\t5.0 (assumed)";
        assert!(table.as_str().expect("text").contains(row), "{table}");
        let widths = browser.evaluate("[document.documentElement.scrollWidth, innerWidth]");
        assert_eq!(widths, json!([SCREEN.0, SCREEN.0]), "the page is wider than the screen");
        let whole = browser.picture(true);
        fs::write(folder.join("light.png"), &whole).expect("a picture");
        let drawn = pixels(&whole);
        for id in ["phantom", "force", "force-left", "marker-left"] {
            let part = part(&mut browser, id);
            let share = drawn_share(&drawn, part);
            assert!(share > 0.02, "{kind}: plot {id} is empty: {share:.4} of {part:?} drawn");
        }
        assert_quiet(&browser);
    }
}

/// Curves and places that could not be determined.
#[test]
fn a_meagre_diagnosis_still_makes_a_page() {
    let recording = synthetic::recording("meagre");
    let mut diagnosis = readings::unexplained(&recording);
    diagnosis.curves.clear();
    diagnosis.candidates.clear();
    diagnosis.mismatch.p_value = f64::NAN;
    diagnosis.baseline.held_out_chi2_per_dof = f64::NAN;
    diagnosis.baseline.young_modulus_pa.sd = f64::INFINITY;
    let text = diagnosis_page(&diagnosis, &recording, &Map::new()).expect("a page");
    assert!(text.contains("are not those of fit.html"), "what “Nothing left out” is, beside its figures");
    let Some(mut browser) = browser::start(SCREEN.0, SCREEN.1) else { return };
    let file = synthetic::kept_folder("diagnosis-meagre").join("diagnosis.html");
    fs::write(&file, text).expect("a file");
    browser.open(&file);
    let said = browser.evaluate("document.querySelector('.headline p').textContent");
    assert!(said.as_str().expect("text").contains("How sure this is is not known."), "{said}");
    assert_quiet(&browser);
}
