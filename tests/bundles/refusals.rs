//! Every refusal of the bundle format, each provoked by one spoilt place in a sound bundle, names that place.

use crate::fixture;
use phantom_rig::dataset::{DatasetError, MeshFileError, Suspicion, read_bundle, write_bundle};
use phantom_rig::mesh::MeshError;
use std::fs;
use std::path::Path;

/// Reads the small bundle after `spoil` has changed its folder.
fn read_spoilt(spoil: impl FnOnce(&Path)) -> Result<Vec<Suspicion>, DatasetError> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    write_bundle(&fixture::recording(), folder.path()).expect("writable");
    spoil(folder.path());
    read_bundle(folder.path()).map(|(_, suspicions)| suspicions)
}

fn refused(spoil: impl FnOnce(&Path)) -> DatasetError {
    match read_spoilt(spoil) {
        Err(error) => error,
        Ok(suspicions) => panic!("accepted, with {suspicions:?}"),
    }
}

/// Asserts the variant and that the message holds every one of `words`.
macro_rules! assert_refused {
    ($error:expr, $variant:pat, [$($word:expr),* $(,)?]) => {{
        let error = $error;
        let text = error.to_string();
        assert!(matches!(error, $variant), "another refusal: {error:?}");
        for word in [$($word),*] {
            assert!(text.contains(word), "{text:?} does not name {word:?}");
        }
    }};
}

fn edit(folder: &Path, file: &str, change: impl FnOnce(String) -> String) {
    let path = folder.join(file);
    let text = fs::read_to_string(&path).expect("a file of the bundle");
    let changed = change(text.clone());
    assert_ne!(text, changed, "the test changes something");
    fs::write(path, changed).expect("writable");
}

/// Puts `value` in the place of one field; `row` is the line of the file, the header being 1.
fn set(folder: &Path, file: &str, row: usize, column: &str, value: &str) {
    edit(folder, file, |text| {
        let mut lines: Vec<Vec<String>> =
            text.lines().map(|l| l.split(',').map(str::to_owned).collect()).collect();
        let at = lines[0].iter().position(|c| c == column).expect("a column of the file");
        lines[row - 1][at] = value.to_owned();
        lines.iter().map(|l| l.join(",") + "\n").collect()
    });
}

fn toml(change: (&str, &str)) -> DatasetError {
    refused(|folder| edit(folder, "recording.toml", |t| t.replace(change.0, change.1)))
}

#[test]
fn a_missing_folder_or_file() {
    let nowhere = tempfile::tempdir().expect("a temporary folder").path().join("nothing");
    assert_refused!(
        read_bundle(&nowhere).expect_err("nothing there"),
        DatasetError::NotAFolder { .. },
        ["nothing"]
    );
    for file in ["recording.toml", "pokes.csv", "force.csv", "markers.csv", "mesh.msh"] {
        let error = refused(|folder| fs::remove_file(folder.join(file)).expect("there"));
        assert_refused!(error, DatasetError::MissingFile { .. }, [file, "missing"]);
    }
}

#[test]
fn a_missing_or_repeated_column() {
    for (file, column) in
        [("pokes.csv", "dir_z"), ("force.csv", "tz_nm"), ("markers.csv", "marker"), ("stage.csv", "x_m")]
    {
        let error = refused(|folder| edit(folder, file, |t| t.replacen(column, "other", 1)));
        assert_refused!(error, DatasetError::MissingColumn { .. }, [file, "row 1", column, "other"]);
    }
    let error = refused(|f| edit(f, "stage.csv", |t| t.replacen("y_m", "x_m", 1)));
    assert_refused!(error, DatasetError::RepeatedColumn { .. }, ["stage.csv", "x_m", "twice"]);
}

#[test]
fn a_field_that_is_no_finite_number() {
    for (file, column) in
        [("pokes.csv", "site_y_m"), ("force.csv", "fy_n"), ("markers.csv", "z_m"), ("stage.csv", "z_m")]
    {
        for value in ["nan", "inf", "-Infinity", "1e999"] {
            let error = refused(|folder| set(folder, file, 3, column, value));
            assert_refused!(error, DatasetError::NonFinite { .. }, [file, "row 3", column, value]);
        }
        for value in ["", "1.2.3", "0x10", "1 2", "12 mm"] {
            let error = refused(|folder| set(folder, file, 3, column, value));
            assert_refused!(error, DatasetError::NotANumber { .. }, [file, "row 3", column, value]);
        }
    }
    for (file, column) in [("pokes.csv", "poke"), ("markers.csv", "marker")] {
        for value in ["-1", "1.5", "4294967296", "seven"] {
            let error = refused(|folder| set(folder, file, 2, column, value));
            assert_refused!(error, DatasetError::NotANumber { .. }, [file, "row 2", column, value, "whole"]);
        }
    }
}

/// Blank lines before a row must not shift the row that a message names.
#[test]
fn rows_are_counted_as_lines_of_the_file() {
    let error = refused(|folder| {
        set(folder, "force.csv", 4, "fx_n", "oops");
        edit(folder, "force.csv", |t| t.replacen('\n', "\r\n\r\n\n", 3));
    });
    assert_refused!(error, DatasetError::NotANumber { row: 10, .. }, ["force.csv", "row 10", "fx_n", "oops"]);
}

#[test]
fn a_row_that_is_cut_off_or_too_long() {
    let error = refused(|folder| {
        edit(folder, "markers.csv", |t| t.trim_end().rsplit_once(',').expect("a comma").0.to_owned());
    });
    assert_refused!(
        error,
        DatasetError::FieldCount { found: 4, expected: 5, .. },
        ["markers.csv", "cut off"]
    );
    let error = refused(|folder| set(folder, "stage.csv", 5, "y_m", "0,5"));
    assert_refused!(error, DatasetError::FieldCount { row: 5, found: 5, expected: 4, .. }, ["stage.csv"]);
    let error = refused(|folder| fs::write(folder.join("force.csv"), "").expect("writable"));
    assert_refused!(error, DatasetError::MissingColumn { .. }, ["force.csv", "t_s"]);
}

/// A file cut inside its last number can't be told from a whole one, except that its last line has no end.
#[test]
fn a_file_that_may_be_cut_inside_its_last_number() {
    let suspicions = read_spoilt(|folder| {
        edit(folder, "markers.csv", |t| t[..t.len() - 3].to_owned());
    });
    let suspicions = suspicions.expect("a readable bundle");
    assert!(matches!(&suspicions[..], [Suspicion::NoFinalNewline { file }] if file.ends_with("markers.csv")));
}

#[test]
fn a_table_without_rows() {
    for file in ["force.csv", "markers.csv", "stage.csv"] {
        let error = refused(|f| edit(f, file, |t| t.lines().next().expect("a header").to_owned() + "\n"));
        assert_refused!(error, DatasetError::NoRows { .. }, [file]);
    }
    let error = refused(|f| edit(f, "pokes.csv", |t| t.lines().next().expect("a header").to_owned()));
    assert_refused!(error, DatasetError::NoPokes { .. }, ["pokes.csv"]);
}

#[test]
fn time_that_runs_backwards() {
    for file in ["force.csv", "markers.csv", "stage.csv"] {
        let error = refused(|folder| set(folder, file, 9, "t_s", "-0.01"));
        assert_refused!(error, DatasetError::UnsortedTime { row: 9, .. }, [file, "row 9", "t_s", "-0.01"]);
    }
    // Time stamps rounded to equality are still sorted.
    let read = read_spoilt(|folder| set(folder, "force.csv", 4, "t_s", "0.05"));
    assert_eq!(read.unwrap_or_else(|e| panic!("{e}")), []);
}

#[test]
fn a_marker_twice_in_a_frame() {
    let error = refused(|folder| set(folder, "markers.csv", 3, "marker", "3"));
    assert_refused!(error, DatasetError::RepeatedMarker { row: 3, marker: 3, .. }, ["markers.csv", "row 3"]);
}

#[test]
fn a_marker_that_nobody_saw_at_rest() {
    let last = fixture::recording().markers.rows.len() + 1;
    let error = refused(|folder| set(folder, "markers.csv", last, "marker", "99"));
    assert_refused!(
        error,
        DatasetError::MarkerNotAtRest { marker: 99, .. },
        ["markers.csv", "marker 99", "3.95 s", "1 s", &format!("row {last}")]
    );
}

#[test]
fn pokes_that_cannot_be() {
    let spoilt = |row, column: &str, value: &str| refused(|f| set(f, "pokes.csv", row, column, value));
    assert_refused!(spoilt(3, "poke", "1"), DatasetError::RepeatedPoke { .. }, ["row 3", "poke 1"]);
    assert_refused!(
        spoilt(2, "end_s", "1.0"),
        DatasetError::EndBeforeStart { .. },
        ["row 2", "end_s", "poke 1", "1 s"]
    );
    assert_refused!(
        spoilt(3, "start_s", "1.5"),
        DatasetError::OverlappingPokes { .. },
        ["row 3", "start_s", "poke 2", "poke 1", "2 s"]
    );
    assert_refused!(
        spoilt(2, "start_s", "0.9"),
        DatasetError::PokeInRest { .. },
        ["row 2", "0.9 s", "rest_until_s = 1 s"]
    );
    assert_refused!(
        spoilt(2, "dir_z", "-1.002"),
        DatasetError::DirectionNotUnit { .. },
        ["row 2", "dir_z", "-1.002", "expected 1"]
    );
    assert_refused!(
        spoilt(3, "radius_m", "-0.004"),
        DatasetError::RadiusNotPositive { .. },
        ["row 3", "radius_m", "poke 2", "-0.004"]
    );
    let error = refused(|f| {
        edit(f, "pokes.csv", |t| {
            let lines: Vec<&str> = t.lines().collect();
            format!("{}\n{}\n{}\n", lines[0], lines[2], lines[1])
        });
    });
    assert_refused!(error, DatasetError::UnsortedTime { .. }, ["pokes.csv", "row 3", "start_s"]);
}

#[test]
fn a_direction_that_is_almost_unit_is_made_so() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    write_bundle(&fixture::recording(), folder.path()).expect("writable");
    set(folder.path(), "pokes.csv", 2, "dir_z", "-0.9995");
    let (recording, _) = read_bundle(folder.path()).expect("within the tolerance");
    assert_eq!(recording.pokes[0].direction.z, -1.0);
}

#[test]
fn what_does_not_lie_on_the_phantom() {
    let error = refused(|f| set(f, "pokes.csv", 3, "site_z_m", "0.0245"));
    assert_refused!(
        error,
        DatasetError::SiteOffSurface { poke: 2, suspected: None, .. },
        ["pokes.csv", "row 3", "site_z_m", "poke 2", "0.0045", "0.004 m"]
    );
    let mut recording = fixture::recording();
    recording.max_standoff_m = 0.001;
    for row in recording.markers.rows.iter_mut().filter(|r| r.marker == 2) {
        row.position_m[2] += 0.005;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    write_bundle(&recording, folder.path()).expect("writable");
    assert_refused!(
        read_bundle(folder.path()).expect_err("too far"),
        DatasetError::MarkerOffSurface { marker: 12, suspected: None, .. },
        ["markers.csv", "row 3", "marker 12", "0.0053", "0.001 m", "observed"]
    );
}

#[test]
fn a_mesh_in_millimetres_is_called_so() {
    let mut recording = fixture::recording();
    recording.mesh.nodes.iter_mut().for_each(|p| *p *= 1000.0);
    let folder = tempfile::tempdir().expect("a temporary folder");
    write_bundle(&recording, folder.path()).expect("writable");
    assert_refused!(
        read_bundle(folder.path()).expect_err("another unit"),
        DatasetError::SiteOffSurface { .. },
        ["mesh.msh is in millimetres", "expected metres"]
    );
}

#[test]
fn sites_or_markers_in_millimetres_are_called_so() {
    let millimetres = |change: &dyn Fn(&mut phantom_rig::observation::Recording)| {
        let mut recording = fixture::recording();
        change(&mut recording);
        let folder = tempfile::tempdir().expect("a temporary folder");
        write_bundle(&recording, folder.path()).expect("writable");
        read_bundle(folder.path()).expect_err("another unit")
    };
    let error = millimetres(&|r| r.pokes.iter_mut().for_each(|p| p.site *= 1000.0));
    assert_refused!(
        error,
        DatasetError::SiteOffSurface { .. },
        ["the sites in", "pokes.csv are in millimetres"]
    );
    let error = millimetres(&|r| {
        r.pokes.iter_mut().for_each(|p| {
            p.site *= 1000.0;
            p.radius_m *= 1000.0;
        });
    });
    assert_refused!(error, DatasetError::SiteOffSurface { .. }, ["pokes.csv are in millimetres"]);
    let error = millimetres(&|r| {
        r.markers.rows.iter_mut().for_each(|m| m.position_m = m.position_m.map(|x| 1000.0 * x));
    });
    assert_refused!(error, DatasetError::MarkerOffSurface { .. }, ["markers.csv are in millimetres"]);
}

#[test]
fn a_manifest_that_says_something_else() {
    let unknown = toml(("phantom-recording/1", "phantom-recording/2"));
    assert_refused!(
        unknown,
        DatasetError::UnknownFormat { .. },
        ["recording.toml", "phantom-recording/2", "phantom-recording/1"]
    );
    let absent = toml(("format = \"phantom-recording/1\"\n", ""));
    assert_refused!(absent, DatasetError::UnknownFormat { .. }, ["absent"]);
    assert_refused!(
        toml(("density_kg_m3", "density")),
        DatasetError::ManifestKey { .. },
        ["recording.toml", "row 7", "density"]
    );
    assert_refused!(
        toml(("name = \"small\"\n", "")),
        DatasetError::ManifestKey { .. },
        ["recording.toml", "missing", "name"]
    );
    assert_refused!(toml(("\"pad\"", "\"cone\"")), DatasetError::ManifestKey { .. }, ["cone", "pad"]);
    assert_refused!(toml(("[tip]", "[tip")), DatasetError::NotToml { .. }, ["recording.toml", "row 10"]);
}

#[test]
fn a_manifest_with_impossible_values() {
    for (from, to, key) in [
        ("0.47", "0.5", "phantom.poisson_ratio"),
        ("1050.0", "-1050.0", "phantom.density_kg_m3"),
        ("[5000.0, 20000.0]", "[20000.0, 5000.0]", "phantom.modulus_range_pa"),
        ("[0.00005, 0.00005, 0.0001]", "[0.00005, 0.0, 0.0001]", "noise.marker_m"),
        ("[0.00005, 0.00005, 0.0001]", "[0.00005, nan, 0.0001]", "noise.marker_m"),
        ("rest_until_s = 1.0", "rest_until_s = inf", "rest_until_s"),
        ("max_standoff_m = 0.01", "max_standoff_m = 0.0", "markers.max_standoff_m"),
        ("\"pad\"", "\"sphere\"", "tip.sphere_radius_m"),
        ("\"pad\"", "\"pad\"\nsphere_radius_m = 0.01", "tip.sphere_radius_m"),
        ("[tip]", "gravity_at_rest = true\n[tip]", "phantom.gravity_at_rest"),
        ("[tip]", "gravity_m_s2 = [0, 0, -9.81]\n[tip]", "phantom.gravity_at_rest"),
        ("[tip]", "gravity_m_s2 = [0, 0, nan]\ngravity_at_rest = true\n[tip]", "phantom.gravity_m_s2"),
    ] {
        let spelt = toml((from, to));
        assert_refused!(spelt, DatasetError::ManifestValue { .. }, ["recording.toml", key, "expected"]);
    }
}

#[test]
fn utf16_is_refused_and_windows_text_is_read() {
    let utf16 = |text: String| -> Vec<u8> {
        std::iter::once(0xfeff).chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect()
    };
    for file in ["recording.toml", "pokes.csv", "force.csv", "markers.csv", "stage.csv"] {
        let error = refused(|folder| {
            let text = fs::read_to_string(folder.join(file)).expect("there");
            fs::write(folder.join(file), utf16(text)).expect("writable");
        });
        assert_refused!(error, DatasetError::Utf16 { .. }, [file, "UTF-16", "UTF-8"]);
        let read = read_spoilt(|folder| {
            edit(folder, file, |t| format!("\u{feff}{}", t.replace('\n', "\r\n")));
        });
        assert_eq!(read.unwrap_or_else(|e| panic!("{file}: {e}")), []);
    }
    let error = refused(|folder| {
        let mut bytes = fs::read(folder.join("recording.toml")).expect("there");
        let name = bytes.windows(5).position(|w| w == b"small").expect("the name");
        bytes[name] = 0xe4;
        fs::write(folder.join("recording.toml"), bytes).expect("writable");
    });
    assert_refused!(error, DatasetError::NotUtf8 { row: 2, .. }, ["recording.toml"]);
}

/// Columns are found by their names, and those that nobody asked for may hold anything.
#[test]
fn columns_in_another_order_and_extra_columns_are_read() {
    let reversed = |text: String| -> String {
        let row = |line: &str| line.split(',').rev().collect::<Vec<_>>().join(",");
        text.lines().map(|l| format!("\"a, quoted; text\",{}\n", row(l))).collect()
    };
    for file in ["pokes.csv", "force.csv", "markers.csv", "stage.csv"] {
        let read = read_spoilt(|folder| edit(folder, file, reversed));
        assert_eq!(read.unwrap_or_else(|e| panic!("{e}")), []);
    }
}

#[test]
fn a_mesh_that_cannot_be_computed_on() {
    let mesh = |error: DatasetError| match error {
        DatasetError::Mesh { file, source } => {
            assert!(file.ends_with("mesh.msh"));
            source
        }
        other => panic!("another refusal: {other}"),
    };
    for group in ["fixed", "search", "observed"] {
        let error = refused(|f| edit(f, "mesh.msh", |t| t.replace(&format!("\"{group}\""), "\"other\"")));
        assert_refused!(error, DatasetError::MissingSurface { .. }, ["mesh.msh", group, "other"]);
    }
    let error = mesh(refused(|f| edit(f, "mesh.msh", |t| t.replace("\"phantom\"", "\"ghost\""))));
    assert!(matches!(&error, MeshFileError::NoPhantom { found } if found == &["ghost"]), "{error}");
    let spoilt = |change: &dyn Fn(&mut phantom_rig::mesh::TetMesh)| {
        let mut recording = fixture::recording();
        change(&mut recording.mesh);
        let folder = tempfile::tempdir().expect("a temporary folder");
        write_bundle(&recording, folder.path()).expect("writable");
        mesh(read_bundle(folder.path()).expect_err("a bad mesh"))
    };
    let error = spoilt(&|m| m.tets[7].swap(0, 1));
    assert!(matches!(error, MeshFileError::Mesh(MeshError::Inverted { tet: 7, .. })), "{error}");
    let error = spoilt(&|m| {
        let island = m.tets[0].map(|n| m.nodes[n as usize] + phantom_rig::geometry::Vec3::x());
        let first = m.nodes.len() as u32;
        m.nodes.extend(island);
        m.tets.push([first, first + 1, first + 2, first + 3]);
    });
    assert!(matches!(error, MeshFileError::Mesh(MeshError::Disconnected { smallest: 1, .. })), "{error}");
    let error = spoilt(&|m| m.nodes[3].y = f64::NAN);
    assert!(matches!(error, MeshFileError::NonFinite { node: 4, .. }), "{error}");
}
