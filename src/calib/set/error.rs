//! Why a calibration set cannot be used.

use crate::calib::CalibError;
use crate::calib::instruments::InstrumentError;
use crate::calib::lens::LensError;
use crate::calib::reference::ReferenceError;
use std::path::PathBuf;

/// What is wrong with a set, or with a file that it names.
#[derive(Debug, thiserror::Error)]
pub enum SetError {
    /// A file cannot be read.
    #[error("{}: can't be read", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// No TOML, a key missing, unknown or senseless.
    #[error("{}: {why}", file.display())]
    Refused {
        /// The set.
        file: PathBuf,
        /// What is wrong, with line and column where the parser tells.
        why: String,
    },
    /// A file is no longer what it was when the set was put together.
    #[error(
        "{}: its SHA-256 begins with {}, in the set {} with {}: it was changed since; put the set together anew",
        file.display(), &found[..12], set.display(), expected.get(..12).unwrap_or(expected)
    )]
    Changed {
        /// The set.
        set: PathBuf,
        /// The file.
        file: PathBuf,
        /// Its hash.
        found: String,
        /// The one in the set.
        expected: String,
    },
    /// The calibration of an instrument cannot be used.
    #[error(transparent)]
    Instrument(#[from] InstrumentError),
    /// A reference value cannot be used.
    #[error(transparent)]
    Reference(#[from] ReferenceError),
    /// The lens cannot be used.
    #[error("{}: no lens", file.display())]
    Lens {
        /// The file.
        file: PathBuf,
        /// What is wrong with it.
        source: LensError,
    },
    /// The registration cannot be used.
    #[error("{}: no registration", file.display())]
    Registration {
        /// The file.
        file: PathBuf,
        /// What is wrong with it.
        source: CalibError,
    },
    /// A calibration that cannot be: its own maker, or its numbers, say so.
    #[error("{}: {why}; no set takes it: put its table right and calibrate again", file.display())]
    Implausible {
        /// The file.
        file: PathBuf,
        /// What speaks against it.
        why: String,
    },
    /// It cannot be written.
    #[error("the set cannot be written as TOML: {why}")]
    Write {
        /// Why.
        why: String,
    },
}
