//! Where the files of a proof lie.
//!
//! | place | content |
//! | --- | --- |
//! | `DIR/conceal.json` | how many draws, and the hash of their seed |
//! | `DIR/recordings/draw-0001/` | a recording bundle |
//! | `DIR/hashes.csv` | SHA-256 of each answer, which carries its own salt |
//! | `DIR/verdicts/draw-0001.json` | what was said of it |
//! | `DIR/pages/draw-0001.html` | the same to look at, where it was asked for |
//! | `DIR/verdicts.csv` | SHA-256 of each verdict; its being there closes them |
//! | `DIR/scorecard.{json,html}` | how well |
//! | `DIR.sealed/draw-0001.sealed` | the answer, encrypted |
//! | `DIR.key` | what opens it |

use super::{ProofError, digest, hex};
use crate::cli::{StagedError, StagedFile};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Hashes by draw.
pub(in crate::cli) type Sums = BTreeMap<String, String>;

const MANIFEST: &str = "conceal.json";
const COLUMNS: [&str; 2] = ["draw", "sha256"];

/// What is said in the open about the draws.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::cli) struct Manifest {
    pub(in crate::cli) format: String,
    pub(in crate::cli) count: u64,
    pub(in crate::cli) phantoms: u64,
    /// Whether draws that conceal nothing were passed over.
    #[serde(default)]
    pub(in crate::cli) with_effect: bool,
    pub(in crate::cli) seed_sha256: String,
}

/// The folder of a proof.
#[derive(Debug, Clone)]
pub(in crate::cli) struct ProofFolder {
    root: PathBuf,
}

/// `draw-0001`, counted from 1.
pub(in crate::cli) fn draw_name(index: u64) -> String {
    format!("draw-{index:04}")
}

impl ProofFolder {
    pub(in crate::cli) fn new(root: &Path) -> Self {
        Self { root: root.to_owned() }
    }

    pub(in crate::cli) fn root(&self) -> &Path {
        &self.root
    }

    pub(in crate::cli) fn recording(&self, draw: &str) -> PathBuf {
        self.root.join("recordings").join(draw)
    }

    pub(in crate::cli) fn verdict(&self, draw: &str) -> PathBuf {
        self.root.join("verdicts").join(draw).with_extension("json")
    }

    pub(in crate::cli) fn page(&self, draw: &str) -> PathBuf {
        self.root.join("pages").join(draw).with_extension("html")
    }

    pub(in crate::cli) fn hashes(&self) -> PathBuf {
        self.root.join("hashes.csv")
    }

    pub(in crate::cli) fn closed(&self) -> PathBuf {
        self.root.join("verdicts.csv")
    }

    /// Beside the folder and not in it: who is given a recording is not given the way to its answer.
    pub(in crate::cli) fn sealed(&self, draw: &str) -> PathBuf {
        self.beside("sealed").join(draw).with_extension("sealed")
    }

    pub(in crate::cli) fn key(&self) -> PathBuf {
        self.beside("key")
    }

    fn beside(&self, what: &str) -> PathBuf {
        let mut name = self.root.components().as_path().as_os_str().to_owned();
        name.push(".");
        name.push(what);
        PathBuf::from(name)
    }

    /// Makes the folders that are not there.
    pub(in crate::cli) fn make(&self) -> Result<(), ProofError> {
        for place in [self.root.join("recordings"), self.root.join("verdicts"), self.beside("sealed")] {
            fs::create_dir_all(&place).map_err(|source| ProofError::System {
                place,
                action: "made",
                source,
            })?;
        }
        Ok(())
    }

    /// The manifest; none when there is none.
    pub(in crate::cli) fn manifest(&self) -> Result<Option<Manifest>, ProofError> {
        let place = self.root.join(MANIFEST);
        if !place.is_file() {
            return Ok(None);
        }
        let text = read(&place)?;
        serde_json::from_slice(&text).map(Some).map_err(|source| ProofError::Json { place, source })
    }

    /// The manifest, which must be there.
    pub(in crate::cli) fn made(&self) -> Result<Manifest, ProofError> {
        let missing = || ProofError::NoDraws { place: self.root.clone(), file: MANIFEST };
        self.manifest()?.ok_or_else(missing)
    }

    pub(in crate::cli) fn write_manifest(&self, manifest: &Manifest) -> anyhow::Result<()> {
        let text = serde_json::to_string_pretty(manifest)? + "\n";
        Ok(replace(&self.root.join(MANIFEST), text.as_bytes())?)
    }
}

/// The bytes of a file.
pub(super) fn read(place: &Path) -> Result<Vec<u8>, ProofError> {
    fs::read(place).map_err(|source| ProofError::System { place: place.to_owned(), action: "read", source })
}

/// A file appears, or its content is replaced, as a whole.
pub(in crate::cli) fn replace(place: &Path, content: &[u8]) -> Result<(), StagedError> {
    let staged = StagedFile::new(place, true)?;
    fs::write(staged.path(), content).map_err(|source| StagedError::System {
        place: place.to_owned(),
        action: "written",
        source,
    })?;
    staged.finish()
}

/// A table of hashes; empty when there is no such file.
pub(in crate::cli) fn read_sums(place: &Path) -> Result<Sums, ProofError> {
    if !place.is_file() {
        return Ok(Sums::new());
    }
    let table = |source| ProofError::Table { place: place.to_owned(), source };
    let mut reader = csv::Reader::from_path(place).map_err(table)?;
    reader.deserialize().collect::<Result<Sums, _>>().map_err(table)
}

/// Writes a table of hashes as a whole.
pub(in crate::cli) fn write_sums(place: &Path, sums: &Sums) -> Result<(), StagedError> {
    let mut text = COLUMNS.join(",") + "\n";
    for (draw, sum) in sums {
        text.push_str(&format!("{draw},{sum}\n"));
    }
    replace(place, text.as_bytes())
}

/// Hash of all files of a bundle, by name and content; hidden ones are not part of it.
pub(in crate::cli) fn bundle_sum(bundle: &Path) -> Result<String, ProofError> {
    let unreadable = |source| ProofError::System { place: bundle.to_owned(), action: "read", source };
    let mut files = Vec::new();
    for entry in fs::read_dir(bundle).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if !name.starts_with('.') {
            files.push((name, path));
        }
    }
    files.sort();
    let mut parts = Vec::new();
    for (name, path) in files {
        parts.push(name.into_bytes());
        parts.push(read(&path)?);
    }
    let parts: Vec<&[u8]> = parts.iter().map(Vec::as_slice).collect();
    Ok(hex(&digest("phantom-rig bundle", &parts)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_lie_beside_the_recordings() {
        for root in ["proofs/one", "proofs/one/"] {
            let folder = ProofFolder::new(Path::new(root));
            assert_eq!(folder.sealed("draw-0001"), Path::new("proofs/one.sealed/draw-0001.sealed"));
            assert_eq!(folder.key(), Path::new("proofs/one.key"));
            assert!(!folder.sealed("draw-0001").starts_with(folder.root()));
        }
    }

    #[test]
    fn sums_are_read_as_they_were_written() {
        let place = tempfile::tempdir().expect("a temporary folder");
        let file = place.path().join("hashes.csv");
        assert_eq!(read_sums(&file).expect("nothing yet"), Sums::new());
        let sums = Sums::from([(draw_name(1), "ab".to_owned()), (draw_name(12), "cd".to_owned())]);
        write_sums(&file, &sums).expect("written");
        assert_eq!(read_sums(&file).expect("read"), sums);
    }

    #[test]
    fn the_sum_of_a_bundle_is_of_names_and_contents() {
        let place = tempfile::tempdir().expect("a temporary folder");
        let write = |name: &str, text: &str| fs::write(place.path().join(name), text).expect("written");
        let sum = || bundle_sum(place.path()).expect("a sum");
        write("a.csv", "1");
        let first = sum();
        write(".mark", "hidden");
        assert_eq!(sum(), first);
        write("a.csv", "2");
        assert_ne!(sum(), first);
    }
}
