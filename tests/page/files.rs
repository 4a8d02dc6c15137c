//! Do the files of `write_fit` say what the fit says?

use super::synthetic;
use phantom_rig::fem::{Order, Space};
use phantom_rig::inverse::published::Variant;
use phantom_rig::inverse::{Fit, FitMethod, PatchKind};
use phantom_rig::report::{ReportError, Verdict, finding, to_json, trust, verdict, write_fit};
use serde_json::{Map, Value, json};
use std::collections::BTreeSet;
use std::fs;

fn settings() -> Map<String, Value> {
    json!({"element": "P2", "l1_weight": 0.3}).as_object().expect("an object").clone()
}

fn example() -> (phantom_rig::observation::Recording, Fit) {
    let recording = synthetic::recording("bench <A> & \"B\"");
    let fit = synthetic::fit(&recording);
    (recording, fit)
}

#[test]
fn the_contract_keys_hold_the_values_of_the_fit() {
    let (_, fit) = example();
    let json = to_json(&fit, &settings()).expect("JSON");
    assert_eq!(json["format"], "phantom-fit/1");
    assert_eq!(json["recording"], "bench <A> & \"B\"");
    assert_eq!(json["young_modulus_pa"]["value"], 10_482.0);
    assert_eq!(json["young_modulus_pa"]["sd"], 51.0);
    assert_eq!(json["restraint"]["total_n_per_m"]["value"], 124.3);
    assert_eq!(json["restraint"]["total_n_per_m"]["sd"], 3.1);
    let spring = &json["restraint"]["patches"][0];
    assert_eq!(spring["kind"], "springs");
    assert_eq!(spring["centroid_m"], json!([0.12, 0.03, 0.0]));
    assert_eq!(spring["radius_m"], 0.0052);
    assert_eq!(spring["stiffness_n_per_m"], 66.1);
    assert_eq!(spring["sd"], 2.3);
    assert_eq!(json["residual"]["marker_rms_m"], 7.1e-5);
    assert_eq!(json["residual"]["force_rms_n"], 0.00602);
    assert_eq!(json["residual"]["chi2_per_dof"], 1.004);
    assert_eq!(json["settings"]["l1_weight"], 0.3);
    assert_eq!(json["program"]["version"], env!("CARGO_PKG_VERSION"));
}

#[test]
fn a_glued_patch_has_a_bound_and_no_stiffness() {
    let (_, fit) = example();
    let json = to_json(&fit, &settings()).expect("JSON");
    let glued = json["restraint"]["patches"][2].as_object().expect("a patch");
    assert_eq!(glued["kind"], "glued");
    assert_eq!(glued["stiffness_lower_bound_n_per_m"], 2100.0);
    assert!(!glued.contains_key("stiffness_n_per_m") && !glued.contains_key("sd"));
    let springs: f64 = fit
        .patches
        .iter()
        .filter_map(|p| match p.kind {
            PatchKind::Springs { stiffness_n_per_m } => Some(stiffness_n_per_m.value),
            PatchKind::Glued { .. } => None,
        })
        .sum();
    let total = json["restraint"]["total_n_per_m"]["value"].as_f64().expect("a number");
    assert!((total - springs).abs() < 1e-9, "{total} against {springs}");
    let of = json["correlation"]["of"].as_array().expect("a list");
    assert_eq!(of.len(), fit.correlation.len());
    assert_eq!(of[2], "restraint.patches[1].stiffness_n_per_m");
}

/// ±1.645 standard deviations hold 90 % of a normal distribution (Abramowitz & Stegun 1964, table 26.1); a
/// stiffness is never negative.
#[test]
fn the_interval_of_a_stiffness_is_normal_and_not_negative() {
    let (_, mut fit) = example();
    let PatchKind::Springs { stiffness_n_per_m } = &mut fit.patches[1].kind else { panic!("springs") };
    (stiffness_n_per_m.value, stiffness_n_per_m.sd) = (2.0, 3.0);
    let json = to_json(&fit, &settings()).expect("JSON");
    let interval =
        |i: usize, end: usize| json["restraint"]["patches"][i]["interval90"][end].as_f64().expect("a number");
    assert!((interval(0, 0) - (66.1 - 1.6449 * 2.3)).abs() < 1e-3);
    assert!((interval(0, 1) - (66.1 + 1.6449 * 2.3)).abs() < 1e-3);
    assert_eq!(interval(1, 0), 0.0);
}

#[test]
fn what_the_fit_could_not_determine_is_null() {
    let (_, mut fit) = example();
    fit.method = FitMethod::Published(Variant::Published);
    fit.young_modulus_pa.sd = f64::INFINITY;
    fit.residual.chi2_per_dof = f64::NAN;
    let json = to_json(&fit, &settings()).expect("JSON");
    assert_eq!(json["method"], "published");
    assert_eq!(json["young_modulus_pa"]["sd"], Value::Null);
    assert_eq!(json["residual"]["chi2_per_dof"], Value::Null);
    assert_eq!(json["residual"]["explained"], false);
}

#[test]
fn more_than_noise_leaves_is_not_explained() {
    let (recording, fit) = example();
    let explained = |fit: &Fit| to_json(fit, &settings()).expect("JSON")["residual"]["explained"].clone();
    assert_eq!(explained(&fit), true);
    assert_eq!(explained(&synthetic::unexplained(&recording)), false);
}

#[test]
fn every_file_is_there_and_the_tables_have_a_row_for_each_value() {
    let (recording, fit) = example();
    let folder = synthetic::kept_folder("files");
    let written = write_fit(&folder, &fit, &recording, &settings()).expect("written");
    let names: BTreeSet<String> = written
        .iter()
        .map(|p| p.strip_prefix(&folder).expect("inside").to_string_lossy().into_owned())
        .collect();
    for name in ["fit.json", "forces.csv", "residuals.csv", "vtk/poke-001.vtu", "vtk/poke-007-markers.vtp"] {
        assert!(names.contains(name), "{name} is missing from {names:?}");
    }
    assert!(written.iter().all(|p| fs::metadata(p).expect("a file").len() > 0));

    let text = fs::read_to_string(folder.join("fit.json")).expect("readable");
    let read: Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(read, to_json(&fit, &settings()).expect("JSON"));
    assert!(text.find("\"format\"") < text.find("\"recording\""), "the format comes first");

    let rows = |name: &str| -> Vec<csv::StringRecord> {
        let mut reader = csv::Reader::from_path(folder.join(name)).expect("a table");
        reader.records().map(|r| r.expect("a row")).collect()
    };
    assert_eq!(rows("forces.csv").len(), fit.pokes.iter().map(|p| p.samples.len()).sum::<usize>());
    let residuals = rows("residuals.csv");
    assert_eq!(residuals.len(), fit.pokes.iter().map(|p| p.markers.len()).sum::<usize>());
    let marker = &fit.pokes[0].markers[3];
    assert_eq!(residuals[3][2], marker.number.to_string());
    let left: f64 = residuals[3][14].parse().expect("a number");
    assert_eq!(left, marker.measured_m.z - marker.modelled_m.z);
}

#[test]
fn elements_of_second_order_are_written_as_such() {
    let (recording, mut fit) = example();
    let space = Space::new(&recording.mesh, Order::P2).expect("a sound mesh");
    for poke in &mut fit.pokes {
        poke.node_displacement_m = space.nodes().iter().map(|p| 0.01 * p).collect();
    }
    let folder = tempfile::tempdir().expect("a folder");
    write_fit(folder.path(), &fit, &recording, &settings()).expect("written");
    let grid = fs::read_to_string(folder.path().join("vtk/poke-001.vtu")).expect("a grid");
    let (points, cells) = (space.nodes().len(), recording.mesh.tets.len());
    let piece = format!("<Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{cells}\">");
    assert!(grid.contains(&piece), "{piece}");
}

#[test]
fn a_fit_of_another_mesh_is_refused_before_anything_is_written() {
    let (recording, mut fit) = example();
    fit.pokes[2].node_displacement_m.pop();
    let folder = tempfile::tempdir().expect("a folder");
    let refused = write_fit(folder.path(), &fit, &recording, &settings());
    assert!(matches!(refused, Err(ReportError::OtherMesh { poke: 3, .. })), "{refused:?}");
    assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 0);
}

#[test]
fn a_folder_that_does_not_exist_is_named() {
    let (recording, fit) = example();
    let folder = tempfile::tempdir().expect("a folder").path().join("absent");
    let error = write_fit(&folder, &fit, &recording, &settings()).expect_err("no such folder");
    assert!(error.to_string().contains("absent"), "{error}");
}

/// Maps are seeded anew at every use, so that an order left to one of them would differ between two writings.
#[test]
fn the_same_fit_leaves_the_same_bytes() {
    let (recording, fit) = example();
    let write = || {
        let folder = tempfile::tempdir().expect("a folder");
        let written = write_fit(folder.path(), &fit, &recording, &settings()).expect("written");
        written.iter().map(|p| fs::read(p).expect("readable")).collect::<Vec<_>>()
    };
    assert!(write() == write(), "two writings differ");
}

/// The residual is judged by the root mean square: χ² of 16.8 per degree of freedom is 4.1 times the noise.
#[test]
fn the_headline_says_what_was_found_and_how_far_to_trust_it() {
    let (_, mut fit) = example();
    assert_eq!(
        finding(&fit),
        "Young’s modulus 10.482 ± 0.051 kPa; 2 restraint patches, together 124.3 ± 3.1 N/m, and 1 glued patch"
    );
    assert_eq!(verdict(&fit), Verdict::Explained);
    assert_eq!(trust(&fit), "The model explains the recording down to the noise.");
    fit.patches.truncate(1);
    assert!(finding(&fit).ends_with("; 1 restraint patch of 124.3 ± 3.1 N/m"));
    fit.patches.clear();
    assert!(finding(&fit).ends_with("; no restraint found"));

    fit.residual.chi2_per_dof = fit.residual.chi2_per_dof_limit + 1e-6;
    assert!(matches!(verdict(&fit), Verdict::Unexplained(_)), "just above the limit");
    let said = trust(&fit);
    let figures: Vec<&str> = said.split(" ×").filter_map(|part| part.split(' ').next_back()).collect();
    assert_ne!(figures[0], figures[1], "{said}");
    fit.residual.chi2_per_dof = 16.8;
    let said = trust(&fit);
    assert!(said.contains("4.10 × the noise, and noise alone leaves at most"), "{said}");
    assert!(said.contains("off by more than they say") && said.contains("`phantom-rig diagnose`"), "{said}");

    fit.residual.chi2_per_dof = 0.25;
    assert_eq!(verdict(&fit), Verdict::NoiseOverstated(0.5));
    assert!(trust(&fit).contains("only 0.50 × the stated noise"));
    // What is expected where a camera sways lies above 1, and so does what is too little.
    fit.residual.chi2_per_dof = 1.05;
    (fit.residual.chi2_per_dof_expected, fit.residual.chi2_per_dof_limit) = (1.2, 1.3);
    assert_eq!(verdict(&fit), Verdict::NoiseOverstated((1.05_f64 / 1.2).sqrt()));
    fit.residual.chi2_per_dof = 1.15;
    assert_eq!(verdict(&fit), Verdict::Explained);
    fit.young_modulus_expected_pa = [1e3, 8e3];
    assert_eq!(verdict(&fit), Verdict::Unexpected);
    assert!(trust(&fit).contains("outside the range that the operator expects"));
    fit.settled = false;
    assert_eq!(verdict(&fit), Verdict::Unsettled);
    assert!(trust(&fit).contains("not come to rest"));
    fit.residual.chi2_per_dof = f64::NAN;
    assert_eq!(verdict(&fit), Verdict::Unjudged);
}
