//! A stage's calibration as a file: TOML with all digits, which a calibration set names and a session keeps.

use super::{Compliance, Positioning};
use crate::calib::Day;
use crate::calib::instruments::{InstrumentError, doubt, toml_file};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// What the file begins with.
const FORMAT: &str = "phantom-stage-calibration/1";

/// A stage's calibration with where it comes from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StageFile {
    format: String,
    /// When the runs were made.
    pub date: Day,
    /// Which stage; empty where nobody wrote it down.
    pub serial: String,
    /// What its maker wants to be known of it.
    pub note: String,
    /// Name and SHA-256 of each table.
    pub tables: Vec<[String; 2]>,
    /// Yielding of stage, sensor and frame (m/N), with its standard deviation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub compliance_m_per_n: Option<[f64; 2]>,
    /// What speaks against the whole, as sentences: a set takes no such file.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub doubts: Vec<String>,
    /// Each axis.
    pub axis: Vec<AxisFile>,
}

/// One axis. Lengths in metres; pairs are a value and its standard deviation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AxisFile {
    /// Its name: `0` or `1` for the first or second axis of the rig file, or the letters of both; empty where it holds for both.
    pub name: String,
    /// Way made over way asked for, less one.
    pub scale: [f64; 2],
    /// How far it stays behind when it turns round.
    pub backlash_m: [f64; 2],
    /// What runs scatter, root mean square.
    pub scatter_m: f64,
    /// A of ISO 230-2.
    pub accuracy_m: [f64; 2],
    /// R.
    pub repeatability_m: [f64; 2],
    /// B.
    pub reversal_m: [f64; 2],
    /// E.
    pub systematic_m: [f64; 2],
    /// M.
    pub mean_deviation_m: [f64; 2],
    /// Lowest and highest target.
    pub range_m: [f64; 2],
    /// Lines of the table that other runs contradict.
    pub misfits: Vec<u64>,
}

impl AxisFile {
    fn new(found: &Positioning) -> Self {
        let [accuracy_m, repeatability_m, reversal_m, systematic_m, mean_deviation_m] =
            found.iso.map(|figure| [figure.value, figure.sd]);
        let target = |at: Option<&super::At>| at.map_or(0.0, |a| a.target_m);
        Self {
            name: found.axis.clone(),
            scale: [found.scale.value, found.scale.sd],
            backlash_m: [found.backlash.value, found.backlash.sd],
            scatter_m: found.scatter_m,
            accuracy_m,
            repeatability_m,
            reversal_m,
            systematic_m,
            mean_deviation_m,
            range_m: [target(found.at.first()), target(found.at.last())],
            misfits: found.strange.iter().map(|strange| strange.line).collect(),
        }
    }

    /// Standard deviation of a place that the stage reports, when its scale is put right: backlash that may stand either way (uniform over
    /// its width), and what runs scatter (m).
    pub fn place_sd_m(&self) -> f64 {
        (self.backlash_m[0] / 12_f64.sqrt()).hypot(self.scatter_m)
    }
}

impl StageFile {
    /// The file of a calibration. `tables`: name and hash of each; `doubts`: what speaks against it.
    pub fn new(
        axes: &[Positioning],
        compliance: Option<&Compliance>,
        date: Day,
        serial: String,
        note: String,
        tables: Vec<[String; 2]>,
        doubts: Vec<String>,
    ) -> Self {
        Self {
            format: FORMAT.to_owned(),
            date,
            serial,
            note,
            tables,
            compliance_m_per_n: compliance.map(|c| [c.m_per_n, c.sd_m_per_n]),
            doubts,
            axis: axes.iter().map(AxisFile::new).collect(),
        }
    }

    /// What speaks against its use, as sentences: what its maker was told, or a travel that no stage has.
    pub fn doubts(&self) -> Vec<String> {
        if self.doubts.is_empty() {
            return self.axis.iter().filter_map(|axis| doubt::of_travel(&axis.name, axis.range_m)).collect();
        }
        self.doubts.clone()
    }

    /// Its text.
    ///
    /// # Errors
    /// [`InstrumentError::File`]: a value that TOML cannot hold.
    pub fn text(&self) -> Result<String, InstrumentError> {
        toml_file::text(self, "stage.toml")
    }

    /// Reads and checks a text; `file` is for messages.
    ///
    /// # Errors
    /// [`InstrumentError::File`]: no TOML, another format, a key missing or unknown, numbers that cannot be.
    pub fn parse(file: &Path, text: &str) -> Result<Self, InstrumentError> {
        let refuse = |why: String| Err(InstrumentError::File { file: file.to_owned(), why });
        let read: Self = toml_file::parse(file, text, |read: &Self| &read.format, FORMAT)?;
        for axis in &read.axis {
            let pairs = [axis.scale, axis.backlash_m, axis.accuracy_m, axis.repeatability_m, axis.reversal_m];
            if pairs.iter().any(|[value, sd]| !(value.is_finite() && sd.is_finite() && *sd >= 0.0)) {
                return refuse(format!("axis {:?}: a value or a deviation is no number", axis.name));
            }
            if let Some(doubt) = doubt::of_scale(&axis.name, 1.0 + axis.scale[0]) {
                return refuse(doubt);
            }
        }
        if read
            .compliance_m_per_n
            .is_some_and(|[value, sd]| !(value.is_finite() && sd.is_finite() && sd >= 0.0))
        {
            return refuse("compliance_m_per_n is no number".to_owned());
        }
        Ok(read)
    }

    /// What it says of an axis of the rig, by number from 0. A table without names of axes is that of all of them; letters count in the
    /// order of the alphabet, as the rig file lists them.
    pub fn axis(&self, number: usize) -> Option<&AxisFile> {
        let named = |axis: &&AxisFile| axis.name.is_empty() || axis.name == number.to_string();
        let numbered = self.axis.iter().any(|axis| axis.name.parse::<usize>().is_ok());
        self.axis.iter().find(named).or_else(|| self.axis.get(number).filter(|_| !numbered))
    }
}
