//! A calibration set as a file: names, hashes and validity; the values stay in the files that it names, beside it.
//!
//! ```toml
//! format = "phantom-calibration-set/1"
//! name = "bench 2, autumn"
//! valid_from = "2026-11-24"
//! valid_until = "2027-11-24"
//!
//! [force]
//! file = "force/force.toml"     # from the set's own folder
//! sha256 = "…"
//! serial = "FT12345"            # of the device that it holds for; may be left out
//! says = "…"                    # residuals and uncertainty, for people
//! ```
//!
//! `[stage]`, `[lens]` and `[registration]` likewise, and `[[reference]]` for each reference value.

use super::SetError;
use crate::calib::instruments::force::ForceFile;
use crate::calib::instruments::stage::StageFile;
use crate::calib::lens::LensFile;
use crate::calib::reference::ReferenceValue;
use crate::calib::{Day, RegistrationFile};
use crate::digest::sha256_hex;
use crate::units::unread_toml;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::{Path, PathBuf};

/// What the file begins with.
const FORMAT: &str = "phantom-calibration-set/1";

/// One file of a set.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Part {
    /// Path from the set's folder.
    pub file: String,
    /// SHA-256 of its bytes.
    pub sha256: String,
    /// Serial number of the device that it holds for; empty where it does not matter.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub serial: String,
    /// Residuals and uncertainty, for people.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub says: String,
}

/// The file's keys.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Keys {
    pub(super) format: String,
    pub(super) name: String,
    pub(super) valid_from: Day,
    pub(super) valid_until: Day,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) force: Option<Part>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) stage: Option<Part>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) lens: Option<Part>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) registration: Option<Part>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) reference: Vec<Part>,
}

impl Keys {
    pub(super) fn new(name: String, valid: [Day; 2]) -> Self {
        let [valid_from, valid_until] = valid;
        Self {
            format: FORMAT.to_owned(),
            name,
            valid_from,
            valid_until,
            force: None,
            stage: None,
            lens: None,
            registration: None,
            reference: Vec::new(),
        }
    }
}

/// A set with everything that it names, read and checked.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrationSet {
    /// Its file.
    pub file: PathBuf,
    /// Its text.
    pub text: String,
    /// Its name.
    pub name: String,
    /// First and last day on which it holds.
    pub valid: [Day; 2],
    /// The force sensor's calibration, its text, and the serial number that it holds for.
    pub force: Option<(ForceFile, String)>,
    /// The stage's calibration and its text.
    pub stage: Option<(StageFile, String)>,
    /// The lens and its text.
    pub lens: Option<(LensFile, String)>,
    /// The registration and its text.
    pub registration: Option<(RegistrationFile, String)>,
    /// Reference values.
    pub references: Vec<ReferenceValue>,
    force_serial: String,
}

/// Why a set should not be used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Doubt {
    /// It holds from a later day on.
    NotYet {
        /// Of the set.
        name: String,
        /// First day.
        from: Day,
        /// Today.
        today: Day,
    },
    /// It held until an earlier day.
    Expired {
        /// Of the set.
        name: String,
        /// Last day.
        until: Day,
        /// Today.
        today: Day,
    },
    /// It was made with another sensor.
    OtherSensor {
        /// Of the set.
        name: String,
        /// Serial number in the set.
        expected: String,
        /// Serial number that the sensor tells.
        found: String,
    },
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotYet { name, from, today } => {
                write!(f, "calibration set {name:?} holds from {from} on; today is {today}")
            }
            Self::Expired { name, until, today } => {
                write!(f, "calibration set {name:?} held until {until}; today is {today}")
            }
            Self::OtherSensor { name, expected, found } => {
                write!(f, "calibration set {name:?} is of force sensor {expected}; this one says {found:?}")
            }
        }
    }
}

impl CalibrationSet {
    /// Reads a set and everything that it names.
    ///
    /// # Errors
    /// [`SetError`]: a file is missing, was changed, or holds no calibration.
    pub fn read(file: &Path) -> Result<Self, SetError> {
        let text = text_of(file)?;
        let refuse = |why: String| SetError::Refused { file: file.to_owned(), why };
        let keys: Keys = toml::from_str(&text).map_err(|error| refuse(unread_toml(&text, &error)))?;
        if keys.format != FORMAT {
            return Err(refuse(format!("format is {:?}; expected {FORMAT:?}", keys.format)));
        }
        if keys.valid_until < keys.valid_from {
            return Err(refuse(format!("valid from {} until {}", keys.valid_from, keys.valid_until)));
        }
        let mut set = Self {
            file: file.to_owned(),
            name: keys.name,
            valid: [keys.valid_from, keys.valid_until],
            force: None,
            stage: None,
            lens: None,
            registration: None,
            references: Vec::new(),
            force_serial: keys.force.as_ref().map(|p| p.serial.clone()).unwrap_or_default(),
            text,
        };
        if let Some((place, text)) = keys.force.as_ref().map(|part| named(file, part)).transpose()? {
            set.force = Some((ForceFile::parse(&place, &text)?, text));
        }
        if let Some((place, text)) = keys.stage.as_ref().map(|part| named(file, part)).transpose()? {
            set.stage = Some((StageFile::parse(&place, &text)?, text));
        }
        if let Some((place, text)) = keys.lens.as_ref().map(|part| named(file, part)).transpose()? {
            let lens = LensFile::parse(&text).map_err(|source| SetError::Lens { file: place, source })?;
            set.lens = Some((lens, text));
        }
        if let Some((place, text)) = keys.registration.as_ref().map(|part| named(file, part)).transpose()? {
            let read = RegistrationFile::parse(&text);
            let read = read.map_err(|source| SetError::Registration { file: place, source })?;
            set.registration = Some((read, text));
        }
        for part in &keys.reference {
            let (place, text) = named(file, part)?;
            set.references.push(ReferenceValue::parse(&place, &text)?);
        }
        Ok(set)
    }

    /// What speaks against its use on a day, with a force sensor that tells this serial number (none: not asked yet).
    pub fn doubts(&self, today: Day, force_serial: Option<&str>) -> Vec<Doubt> {
        let [from, until] = self.valid;
        let name = || self.name.clone();
        let mut doubts = Vec::new();
        if today < from {
            doubts.push(Doubt::NotYet { name: name(), from, today });
        }
        if today > until {
            doubts.push(Doubt::Expired { name: name(), until, today });
        }
        if let Some(found) = force_serial
            && !self.force_serial.is_empty()
            && found != self.force_serial
        {
            let (expected, found) = (self.force_serial.clone(), found.to_owned());
            doubts.push(Doubt::OtherSensor { name: name(), expected, found });
        }
        doubts
    }
}

/// First and last day on which the set of this text holds; none of a text that is none.
pub fn valid_days(text: &str) -> Option<[Day; 2]> {
    let keys: Keys = toml::from_str(text).ok()?;
    Some([keys.valid_from, keys.valid_until])
}

/// Place and text of a file that a set names, if it is still what it was.
fn named(set: &Path, part: &Part) -> Result<(PathBuf, String), SetError> {
    let file = set.parent().unwrap_or(Path::new("")).join(&part.file);
    let text = text_of(&file)?;
    let found = sha256_hex(text.as_bytes());
    if found == part.sha256 {
        return Ok((file, text));
    }
    Err(SetError::Changed { set: set.to_owned(), file, found, expected: part.sha256.clone() })
}

pub(super) fn text_of(file: &Path) -> Result<String, SetError> {
    std::fs::read_to_string(file).map_err(|source| SetError::Read { file: file.to_owned(), source })
}
