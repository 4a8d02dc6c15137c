//! A force sensor's calibration as a file: TOML with all digits, which a calibration set names and a session keeps.

use super::ForceFound;
use crate::calib::Day;
use crate::calib::instruments::{InstrumentError, doubt, toml_file};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// What the file begins with.
const FORMAT: &str = "phantom-force-calibration/1";

/// Along which axes directions and levers were given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Frame {
    /// Those of the sensor, as the drawing of its mounting has them.
    Sensor,
    /// Those of the phantom.
    Phantom,
}

/// A calibration with where it comes from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ForceFile {
    format: String,
    /// When the weights were hung.
    pub date: Day,
    /// Serial number of the sensor's own calibration; empty where nobody wrote it down.
    pub serial: String,
    /// What its maker wants to be known of it.
    pub note: String,
    /// Along which axes the wrench comes out.
    pub frame: Frame,
    /// The table of weights.
    pub table: String,
    /// SHA-256 of that.
    pub table_sha256: String,
    /// Rows used.
    pub rows: usize,
    /// Components that were told, 3 or 6.
    pub told: usize,
    /// Largest force that was hung (N).
    pub range_n: f64,
    /// Largest moment that was hung (N·m).
    pub range_nm: f64,
    /// Noise of a row, root mean square (N, N·m).
    pub noise: [f64; 6],
    /// Half of a 90 % interval over its standard deviation.
    pub half_90: f64,
    /// Reading without load (N, N·m): for the record, a run takes its own zero.
    pub bias: [f64; 6],
    /// Its standard deviations.
    pub bias_sd: [f64; 6],
    /// Turns the axes of the directions into the sensor's: axis times angle (rad).
    pub turn_rad: [f64; 3],
    /// Its standard deviations.
    pub turn_sd_rad: [f64; 3],
    /// Rows of the matrix that makes a wrench on the tool of a reading less its zero.
    pub correction: [[f64; 6]; 6],
    /// Their standard deviations.
    pub correction_sd: [[f64; 6]; 6],
    /// Lines of the table that the others contradict.
    pub misfits: Vec<u64>,
    /// Lines of the table that were left out, as asked.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub left_out: Vec<u64>,
    /// What speaks against the whole, as sentences: a set takes no such file.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub doubts: Vec<String>,
}

impl ForceFile {
    /// The file of a calibration. `table`: name and hash of the weights' table; `left_out`: its lines that were not used.
    pub fn new(
        found: &ForceFound,
        frame: Frame,
        date: Day,
        serial: String,
        note: String,
        table: (String, String),
        left_out: &[u64],
    ) -> Self {
        Self {
            format: FORMAT.to_owned(),
            date,
            serial,
            note,
            frame,
            table: table.0,
            table_sha256: table.1,
            rows: found.rows,
            told: found.told,
            range_n: found.range[0],
            range_nm: found.range[1],
            noise: found.noise,
            half_90: found.half_90,
            bias: found.bias,
            bias_sd: found.bias_sd,
            turn_rad: found.turn_rad,
            turn_sd_rad: found.turn_sd_rad,
            correction: found.correction,
            correction_sd: found.correction_sd,
            misfits: found.misfits.iter().map(|misfit| misfit.line).collect(),
            left_out: left_out.to_vec(),
            doubts: found.doubts(),
        }
    }

    /// What speaks against its use, as sentences: what its maker was told, or gains that no sensor has.
    pub fn doubts(&self) -> Vec<String> {
        if self.doubts.is_empty() {
            doubt::of_correction(&self.correction, self.told)
        } else {
            self.doubts.clone()
        }
    }

    /// Its text.
    ///
    /// # Errors
    /// [`InstrumentError::File`]: a value that TOML cannot hold.
    pub fn text(&self) -> Result<String, InstrumentError> {
        toml_file::text(self, "force.toml")
    }

    /// Reads and checks a text; `file` is for messages.
    ///
    /// # Errors
    /// [`InstrumentError::File`]: no TOML, another format, a key missing or unknown, numbers that cannot be.
    pub fn parse(file: &Path, text: &str) -> Result<Self, InstrumentError> {
        let refuse = |why: String| Err(InstrumentError::File { file: file.to_owned(), why });
        let read: Self = toml_file::parse(file, text, |read: &Self| &read.format, FORMAT)?;
        let numbers = read.correction.iter().flatten();
        if let Some(bad) = numbers.clone().find(|x| !x.is_finite()) {
            return refuse(format!("correction holds {bad}"));
        }
        if read.correction_sd.iter().flatten().chain(&read.noise).any(|sd| !(sd.is_finite() && *sd >= 0.0)) {
            return refuse("a standard deviation is negative or no number".to_owned());
        }
        let matrix = nalgebra::Matrix6::from_fn(|i, j| read.correction[i][j]);
        if matrix.try_inverse().is_none() {
            return refuse("correction cannot be inverted: a reading that answers to nothing".to_owned());
        }
        Ok(read)
    }

    /// The wrench on the tool, from a reading (N, N·m) less its zero.
    pub fn wrench(&self, reading: [f64; 6]) -> [f64; 6] {
        self.correction.map(|row| row.iter().zip(reading).map(|(c, r)| c * r).sum())
    }
}
