//! The original bytes of an export with their hash, for whoever keeps them beside what was read.

use crate::digest::sha256_hex;
use std::path::{Path, PathBuf};

/// An export as it came.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Source {
    /// The file.
    pub file: PathBuf,
    /// All of its bytes.
    pub bytes: Vec<u8>,
    /// SHA-256 of them, in hexadecimal digits.
    pub sha256: String,
}

impl Source {
    pub(super) fn new(file: &Path, bytes: Vec<u8>) -> Self {
        let sha256 = sha256_hex(&bytes);
        Self { file: file.to_owned(), bytes, sha256 }
    }
}
