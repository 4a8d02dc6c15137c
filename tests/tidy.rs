//! The rules of the house that a compiler does not check: who may import whom, how long a file may be, and
//! that every file says what question it answers.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Rooms of floor 0: anybody may import them; among themselves only what is listed in [`MAY_IMPORT`].
const GROUND: [&str; 6] = ["units", "clock", "geometry", "digest", "mesh", "sparse"];

/// What each room may import besides the ground floor. Peers are never listed.
const MAY_IMPORT: [(&str, &[&str]); 21] = [
    ("units", &[]),
    ("clock", &[]),
    ("geometry", &[]),
    ("digest", &[]),
    ("mesh", &["geometry"]),
    ("sparse", &[]),
    ("device", &[]),
    ("observation", &[]),
    ("fem", &[]),
    ("driver", &["device"]),
    ("sim", &["device", "observation"]),
    ("session", &["device"]),
    ("track", &["device"]),
    ("calib", &["device", "observation", "track"]),
    ("inverse", &["fem", "observation"]),
    ("dataset", &["device", "session", "track", "calib", "observation"]),
    ("diagnose", &["inverse", "fem", "calib", "observation"]),
    ("acquire", &["device", "session"]),
    ("rig", &["driver", "sim", "session", "track", "calib", "device", "observation"]),
    ("report", &["session", "calib", "inverse", "diagnose", "observation", "fem"]),
    (
        "cli",
        &[
            "device",
            "observation",
            "fem",
            "driver",
            "session",
            "track",
            "calib",
            "inverse",
            "dataset",
            "diagnose",
            "acquire",
            "rig",
            "report",
            "sim",
        ],
    ),
];

/// The only files outside `sim` and `rig` that may name `sim`: the commands that make concealed draws.
const DRAWS: [&str; 4] = ["src/cli/bench.rs", "src/cli/draw.rs", "src/cli/conceal.rs", "src/cli/demo.rs"];

const LONGEST_FILE: usize = 800;

fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("a readable folder") {
        let path = entry.expect("a readable entry").path();
        if path.is_dir() {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
    found.sort();
    found
}

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Every room named after `crate::`, also inside `use crate::{a, b::c}`.
fn imported(text: &str) -> Vec<String> {
    let mut rooms = Vec::new();
    for part in text.split("crate::").skip(1) {
        if let Some(list) = part.strip_prefix('{') {
            let mut depth = 0_usize;
            let mut name = String::new();
            for c in list.chars() {
                match c {
                    '{' => depth += 1,
                    '}' if depth == 0 => break,
                    '}' => depth -= 1,
                    ',' if depth == 0 => rooms.push(std::mem::take(&mut name)),
                    _ if depth == 0 => name.push(c),
                    _ => {}
                }
            }
            rooms.push(name);
        } else {
            rooms.push(part.to_owned());
        }
    }
    rooms
        .iter()
        .map(|r| r.trim().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>())
        .filter(|r| !r.is_empty())
        .collect()
}

fn without_comments(text: &str) -> String {
    text.lines().filter(|l| !l.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n")
}

#[test]
fn rooms_import_only_lower_floors() {
    let may: BTreeMap<&str, &[&str]> = MAY_IMPORT.into_iter().collect();
    let mut wrong = Vec::new();
    for path in sources(&root().join("src")) {
        let relative = path.strip_prefix(root()).expect("inside the project").to_string_lossy().into_owned();
        let Some((room, _)) = relative.trim_start_matches("src/").split_once('/') else { continue };
        let allowed = may.get(room).unwrap_or_else(|| panic!("{relative}: room {room} is not on the map"));
        for other in imported(&without_comments(&fs::read_to_string(&path).expect("readable"))) {
            let ground = GROUND.contains(&other.as_str()) && !GROUND.contains(&room);
            let known = may.contains_key(other.as_str());
            let sim_named = other == "sim" && room == "cli" && !DRAWS.contains(&relative.as_str());
            if known && other != room && ((!ground && !allowed.contains(&other.as_str())) || sim_named) {
                wrong.push(format!("{relative} imports {other}"));
            }
        }
    }
    assert!(wrong.is_empty(), "imports that the map of rooms forbids:\n{}", wrong.join("\n"));
}

#[test]
fn every_file_is_short_and_says_what_it_answers() {
    let mut wrong = Vec::new();
    for folder in ["src", "tests", "benches", "firmware_proto/src"] {
        for path in sources(&root().join(folder)) {
            let text = fs::read_to_string(&path).expect("readable");
            let lines = text.lines().count();
            if lines > LONGEST_FILE {
                wrong.push(format!("{}: {lines} lines, at most {LONGEST_FILE}", path.display()));
            }
            if !text.starts_with("//!") {
                wrong.push(format!("{}: does not open with //!", path.display()));
            }
            let stem = path.file_stem().and_then(|s| s.to_str()).unwrap_or_default();
            if ["utils", "util", "common", "misc", "helpers"].contains(&stem) {
                wrong.push(format!("{}: a name that answers no question", path.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// A front door holds documentation, modules and public names, no algorithms.
#[test]
fn front_doors_hold_no_algorithms() {
    for path in sources(&root().join("src")) {
        if path.file_name().is_some_and(|n| n == "mod.rs") {
            let text = without_comments(&fs::read_to_string(&path).expect("readable"));
            assert!(!text.contains("fn "), "{} defines a function", path.display());
        }
    }
}

#[test]
fn only_sparse_names_faer() {
    for path in sources(&root().join("src")) {
        let inside = path.strip_prefix(root().join("src")).expect("inside src").starts_with("sparse");
        let text = without_comments(&fs::read_to_string(&path).expect("readable"));
        assert!(inside || !text.contains("faer::"), "{} names faer", path.display());
    }
}

/// Whoever prints an error prints its chain of causes: one that holds its cause in its own text says it twice.
#[test]
fn no_error_says_its_cause_itself() {
    for folder in ["src", "firmware_proto/src"] {
        for path in sources(&root().join(folder)) {
            let text = fs::read_to_string(&path).expect("readable");
            for variant in text.split("#[error(").skip(1) {
                let says = variant.split("\n    },").next().unwrap_or(variant);
                let (words, fields) = says.split_once(")]\n").unwrap_or((says, ""));
                // A cause is a field of that name, or what is marked as one: in a tuple, or with its name in this line or the next.
                let marked = fields.split("#[from]").flat_map(|part| part.split("#[source]")).skip(1);
                let names = marked.filter_map(|part| {
                    let (name, _) = part.trim_start().split_once(':')?;
                    name.chars().all(|c| c.is_alphanumeric() || c == '_').then_some(name)
                });
                let first = fields.lines().next().unwrap_or_default();
                let in_tuple = first.contains("(#[from]") || first.contains("(#[source]");
                let causes = names.chain(["source"]).chain(in_tuple.then_some("0"));
                for cause in causes {
                    let says_it =
                        words.contains(&format!("{{{cause}}}")) || words.contains(&format!("{{{cause}:"));
                    assert!(!says_it, "{}: #[error({words})]", path.display());
                }
            }
        }
    }
}
