//! A calibration as TOML: with all digits, and refused with the file's name where it is none.

use super::InstrumentError;
use crate::units::unread_toml;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::Path;

/// Its text; `name` is for messages.
pub(super) fn text(calibration: &impl Serialize, name: &str) -> Result<String, InstrumentError> {
    toml::to_string(calibration)
        .map_err(|error| InstrumentError::File { file: name.into(), why: error.to_string() })
}

/// Reads a text whose format, told by `format`, must be the expected one; `file` is for messages.
pub(super) fn parse<T: DeserializeOwned>(
    file: &Path,
    text: &str,
    format: impl Fn(&T) -> &str,
    expected: &str,
) -> Result<T, InstrumentError> {
    let refuse = |why: String| InstrumentError::File { file: file.to_owned(), why };
    let read: T = toml::from_str(text).map_err(|error| refuse(unread_toml(text, &error)))?;
    if format(&read) == expected {
        return Ok(read);
    }
    Err(refuse(format!("format is {:?}; expected {expected:?}", format(&read))))
}
