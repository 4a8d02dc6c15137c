//! Why a reference value cannot be used.

use super::ReferenceQuantity;
use std::path::PathBuf;

/// What is wrong with a reference value.
#[derive(Debug, thiserror::Error)]
pub enum ReferenceError {
    /// The file cannot be read.
    #[error("{}: can't be read", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// No TOML, a key that is missing, unknown or of the wrong kind.
    #[error("{}: {why}", file.display())]
    Refused {
        /// The file.
        file: PathBuf,
        /// What the parser says, with line and column.
        why: String,
    },
    /// A value that makes no sense.
    #[error("{}: {key} is {found}; expected {expected}", file.display())]
    Value {
        /// The file.
        file: PathBuf,
        /// The key.
        key: String,
        /// What it holds.
        found: String,
        /// What it should.
        expected: &'static str,
    },
    /// A file that gives no quantity, or several.
    #[error("{}: it gives {}; expected one of {}", file.display(), listed(found), listed(&ReferenceQuantity::ALL))]
    NotOne {
        /// The file.
        file: PathBuf,
        /// What it gives.
        found: Vec<ReferenceQuantity>,
    },
    /// It cannot be put into TOML.
    #[error("the reference value cannot be written as TOML: {why}")]
    Write {
        /// Why.
        why: String,
    },
}

fn listed(quantities: &[ReferenceQuantity]) -> String {
    let names: Vec<&str> = quantities.iter().map(|q| q.key()).collect();
    if names.is_empty() { "no quantity".to_owned() } else { names.join(", ") }
}
