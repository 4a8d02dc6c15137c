//! Answers opened, and held against what was published of them.

use super::folder::{bundle_sum, read};
use super::{ProofError, ProofFolder, Seal, Sums, digest, hex};
use serde::de::DeserializeOwned;
use serde_json::Value;
use std::path::Path;

/// What opens the answers: the given key, or the one beside the proof.
///
/// # Errors
/// [`ProofError::NoKey`], [`ProofError::NotAKey`].
pub(in crate::cli) fn open_key(folder: &ProofFolder, given: Option<&Path>) -> Result<Seal, ProofError> {
    let place = given.map_or_else(|| folder.key(), Path::to_owned);
    if !place.is_file() {
        return Err(ProofError::NoKey { place });
    }
    let text = String::from_utf8_lossy(&read(&place)?).into_owned();
    Seal::of_text(&text).ok_or(ProofError::NotAKey { place })
}

/// The answer of a draw, or some of its keys. It must be the one whose hash was published, and belong to the recording.
///
/// # Errors
/// [`ProofError::Sealed`], [`ProofError::OtherAnswer`], [`ProofError::OtherRecording`], [`ProofError::NotAnAnswer`].
pub(in crate::cli) fn open_answer<T: DeserializeOwned>(
    folder: &ProofFolder,
    seal: &Seal,
    draw: &str,
    published: &Sums,
) -> Result<T, ProofError> {
    let text = seal.open(draw, &read(&folder.sealed(draw))?)?;
    if published.get(draw) != Some(&hex(&digest("phantom-rig answer", &[&text]))) {
        return Err(ProofError::OtherAnswer { draw: draw.to_owned() });
    }
    let unreadable = |source| ProofError::NotAnAnswer { draw: draw.to_owned(), source };
    let value: Value = serde_json::from_slice(&text).map_err(unreadable)?;
    if value["bundle_sha256"] != bundle_sum(&folder.recording(draw))? {
        return Err(ProofError::OtherRecording { draw: draw.to_owned() });
    }
    serde_json::from_value(value).map_err(unreadable)
}
