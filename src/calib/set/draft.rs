//! A calibration set in the making: files → a text that names them with their hashes.

use super::SetError;
use super::file::{Keys, Part, text_of};
use crate::calib::instruments::force::ForceFile;
use crate::calib::instruments::stage::StageFile;
use crate::calib::lens::LensFile;
use crate::calib::reference::ReferenceValue;
use crate::calib::{Day, RegistrationFile};
use crate::digest::sha256_hex;
use crate::units::{counted, with_sd};
use std::path::{Path, PathBuf};

/// What a set is to hold. Files are named from the folder in which the set will lie.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Draft {
    /// Its name.
    pub name: String,
    /// First and last day.
    pub valid: [Day; 2],
    /// The force sensor's calibration.
    pub force: Option<PathBuf>,
    /// The stage's.
    pub stage: Option<PathBuf>,
    /// The lens.
    pub lens: Option<PathBuf>,
    /// Where the camera stands.
    pub registration: Option<PathBuf>,
    /// Reference values.
    pub references: Vec<PathBuf>,
}

/// The text of a set.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Drafted {
    /// The text.
    pub text: String,
    /// What the calibrations say against themselves and are taken with, as sentences with the file's name.
    pub remarks: Vec<String>,
}

impl Draft {
    /// The text of the set, which is to lie in `folder`. Every file is read, so that a set names nothing that is none.
    ///
    /// # Errors
    /// [`SetError`]: a file that is missing, holds no calibration, or one that cannot be.
    pub fn text(&self, folder: &Path) -> Result<Drafted, SetError> {
        let mut remarks = Vec::new();
        let mut keys = Keys::new(self.name.clone(), self.valid);
        let part = |name: &PathBuf| -> Result<(PathBuf, String, Part), SetError> {
            let place = folder.join(name);
            let text = text_of(&place)?;
            let (file, sha256) = (name.to_string_lossy().into_owned(), sha256_hex(text.as_bytes()));
            Ok((place, text, Part { file, sha256, serial: String::new(), says: String::new() }))
        };
        if let Some(name) = &self.force {
            let (place, text, mut part) = part(name)?;
            let force = ForceFile::parse(&place, &text)?;
            refuse(&place, force.doubts())?;
            remarks.extend(contradicted(name, &force.table, &force.misfits));
            let gain = |i: usize| with_sd(force.correction[i][i], force.correction_sd[i][i], 1.0, "");
            part.says = format!(
                "force gains put right by {}, {}, {} up to {:.2} N",
                gain(0),
                gain(1),
                gain(2),
                force.range_n
            );
            part.serial = force.serial;
            keys.force = Some(part);
        }
        if let Some(name) = &self.stage {
            let (place, text, mut part) = part(name)?;
            let stage = StageFile::parse(&place, &text)?;
            refuse(&place, stage.doubts())?;
            let table = stage.tables.first().map_or("its table", |[name, _]| name);
            let misfits: Vec<u64> = stage.axis.iter().flat_map(|a| a.misfits.iter().copied()).collect();
            remarks.extend(contradicted(name, table, &misfits));
            let axis = |a: &crate::calib::instruments::stage::AxisFile| {
                let backlash = with_sd(a.backlash_m[0], a.backlash_m[1], 1e6, "µm");
                format!(
                    "axis {:?}: scale {:+.2e} ± {:.1e}, backlash {backlash}",
                    a.name, a.scale[0], a.scale[1]
                )
            };
            part.says = stage.axis.iter().map(axis).collect::<Vec<_>>().join("; ");
            part.serial = stage.serial;
            keys.stage = Some(part);
        }
        if let Some(name) = &self.lens {
            let (place, text, mut part) = part(name)?;
            let lens = LensFile::parse(&text).map_err(|source| SetError::Lens { file: place, source })?;
            part.says = format!(
                "focal length {:.1} ± {:.1} px, {:.3} px left",
                lens.focal_px[0], lens.focal_sd_px[0], lens.rms_px
            );
            keys.lens = Some(part);
        }
        if let Some(name) = &self.registration {
            let (place, text, mut part) = part(name)?;
            let read = RegistrationFile::parse(&text);
            let read = read.map_err(|source| SetError::Registration { file: place, source })?;
            part.says = format!("{}, {:.3} mm left", counted(read.points, "point", "points"), read.rms_mm);
            keys.registration = Some(part);
        }
        for name in &self.references {
            let (place, text, mut part) = part(name)?;
            let value = ReferenceValue::parse(&place, &text)?;
            let (scale, unit) = value.quantity.shown();
            let figure = with_sd(value.figure.value, value.figure.sd, scale, unit);
            part.says = format!("{}: {} {figure}", value.name, value.quantity.name());
            keys.reference.push(part);
        }
        let text = toml::to_string(&keys).map_err(|error| SetError::Write { why: error.to_string() })?;
        Ok(Drafted { text, remarks })
    }
}

/// Refuses a calibration that something speaks against.
fn refuse(file: &Path, doubts: Vec<String>) -> Result<(), SetError> {
    match doubts.into_iter().next() {
        Some(why) => Err(SetError::Implausible { file: file.to_owned(), why }),
        None => Ok(()),
    }
}

/// That rows are in a calibration though the others contradict them.
fn contradicted(file: &Path, table: &str, lines: &[u64]) -> Option<String> {
    let list = lines.iter().map(u64::to_string).collect::<Vec<_>>().join(", ");
    let (line, rows) = if lines.len() == 1 { ("line", "it is") } else { ("lines", "they are") };
    let text = format!(
        "{}: the other rows contradict {line} {list} of {table}, and {rows} in the result",
        file.display()
    );
    (!lines.is_empty()).then_some(text)
}
