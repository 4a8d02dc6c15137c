//! Recordings made by other programs, read in place. Skipped when they are not there.

use phantom_rig::dataset::{Suspicion, read_bundle, rest_noise, write_bundle};
use phantom_rig::observation::Recording;
use std::path::{Path, PathBuf};

/// Folders of the practice recordings whose names begin with `prefix`.
fn practice(prefix: &str) -> Vec<PathBuf> {
    let data = std::env::var_os("PHANTOM_RIG_DATA")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared"), PathBuf::from);
    let Ok(entries) = std::fs::read_dir(data.join("practice")) else {
        println!("skipped: no data");
        return Vec::new();
    };
    let mut folders: Vec<PathBuf> = entries
        .map(|e| e.expect("a readable entry").path())
        .filter(|p| p.file_name().is_some_and(|n| n.to_string_lossy().starts_with(prefix)))
        .collect();
    folders.sort();
    assert!(!folders.is_empty(), "no {prefix}* in {}", data.display());
    folders
}

fn read(folder: &Path) -> (Recording, Vec<Suspicion>) {
    read_bundle(folder).unwrap_or_else(|e| panic!("{e}"))
}

/// The slab of the brief: 150 × 100 × 25 mm, glued for x ≤ 60 mm, seven pokes, nothing suspicious.
#[test]
fn practice_recordings_read_without_suspicion() {
    for folder in practice("practice-") {
        let (recording, suspicions) = read(&folder);
        assert!(suspicions.is_empty(), "{}: {suspicions:?}", folder.display());
        assert!((recording.mesh.volume() / (0.15 * 0.1 * 0.025) - 1.0).abs() < 1e-9);
        let area = |name: &str| -> f64 {
            recording.mesh.surface(name).iter().map(|&f| recording.mesh.triangle(f).area()).sum()
        };
        assert!((area("fixed") / (0.06 * 0.1) - 1.0).abs() < 1e-9);
        assert!((area("search") / (0.09 * 0.1) - 1.0).abs() < 1e-9);
        for name in ["fixed", "search"] {
            for &face in recording.mesh.surface(name) {
                assert!(recording.mesh.triangle(face).normal().z < -0.999, "{name} faces outward");
            }
        }
        assert_eq!(recording.pokes.len(), 7);
        assert!(recording.stage.is_some());
        // The noise was made to be what recording.toml states: the estimate is good to about 1/√(2 dof).
        for (channel, noise) in rest_noise(&recording).channels() {
            let tolerance = 5.0 / (2.0 * noise.degrees_of_freedom as f64).sqrt();
            for ratio in noise.ratio() {
                assert!((ratio - 1.0).abs() < tolerance, "{channel}: {ratio} ± {tolerance}");
            }
        }
    }
}

#[test]
fn beam_recordings_read_without_a_stage() {
    for folder in practice("beam-") {
        let (recording, _) = read(&folder);
        assert!(recording.stage.is_none());
        assert_eq!(recording.markers.numbers, [1, 2, 3], "hold_markers.csv is not part of the format");
        assert!((recording.mesh.volume() / (0.03 * 0.03 * 0.1) - 1.0).abs() < 1e-9);
        let gravity = recording.phantom.gravity.expect("the weight acts");
        assert!(!gravity.at_rest && (gravity.acceleration_m_s2.norm() - 9.8).abs() < 0.02);
    }
}

#[test]
fn what_is_written_reads_back_equal() {
    for folder in practice("practice-01").into_iter().chain(practice("beam-load52-a")) {
        let (recording, _) = read(&folder);
        let copy = tempfile::tempdir().expect("a temporary folder");
        write_bundle(&recording, copy.path()).expect("writable");
        assert_eq!(read(copy.path()).0, recording);
    }
}
