//! The table of dead weights: what hung where, and what the sensor read.
//!
//! | column | holds |
//! | --- | --- |
//! | `mass_g` or `mass_kg` | the weight; 0 for nothing |
//! | `dir_x`, `dir_y`, `dir_z` | where the weight pulls, along the axes of the tool; made a unit vector |
//! | `lever_x_mm`, … (may be missing) | a point of the line along which it pulls, from the sensor's origin |
//! | `fx_n` … `fz_n`, `tx_nm` … `tz_nm` | the sensor's reading, mean of a second or more at rest |
//! | `time_s`, `temperature_c` (may be missing) | when, and how warm the sensor was |

use crate::calib::instruments::InstrumentError;
use crate::calib::instruments::sheet::{
    Column, FORCE, LENGTH, MASS, PLAIN, Sheet, TEMPERATURE, TIME, TORQUE,
};
use crate::geometry::Vec3;
use std::path::{Path, PathBuf};

/// One weight, hung once. SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hold {
    /// Line in the table, from 1.
    pub line: u64,
    /// The weight (kg).
    pub mass_kg: f64,
    /// Where it pulls: a unit vector.
    pub direction: Vec3,
    /// A point of its line of pull, from the sensor's origin (m).
    pub lever_m: Vec3,
    /// What the sensor read (N, N·m).
    pub reading: [f64; 6],
    /// When (s).
    pub time_s: Option<f64>,
    /// How warm it was (°C).
    pub temperature_c: Option<f64>,
}

/// The table.
#[derive(Debug, Clone, PartialEq)]
pub struct Weights {
    /// Its file.
    pub file: PathBuf,
    /// Its rows.
    pub holds: Vec<Hold>,
}

/// Rows below which nothing can be said: three directions, and one more for the zero.
const FEWEST: usize = 4;

impl Weights {
    /// Reads and checks a table.
    ///
    /// # Errors
    /// [`InstrumentError`] with line and column.
    pub fn read(file: &Path) -> Result<Self, InstrumentError> {
        Self::of(&Sheet::read(file, FEWEST)?)
    }

    fn of(sheet: &Sheet) -> Result<Self, InstrumentError> {
        let mass = sheet.need("mass", MASS)?;
        let direction = columns(sheet, ["dir_x", "dir_y", "dir_z"], PLAIN)?;
        let lever = match sheet.find("lever_x", LENGTH)? {
            Some(_) => Some(columns(sheet, ["lever_x", "lever_y", "lever_z"], LENGTH)?),
            None => None,
        };
        let force = columns(sheet, ["fx", "fy", "fz"], FORCE)?;
        let torque = columns(sheet, ["tx", "ty", "tz"], TORQUE)?;
        let times = sheet.find("time", TIME)?.map(|column| sheet.times(column)).transpose()?;
        let warmth =
            sheet.find("temperature", TEMPERATURE)?.map(|column| sheet.numbers(column)).transpose()?;
        let mut holds = Vec::with_capacity(sheet.len());
        for row in 0..sheet.len() {
            let three = |columns: [Column; 3]| -> Result<Vec3, InstrumentError> {
                let [x, y, z] = columns;
                Ok(Vec3::new(sheet.number(row, x)?, sheet.number(row, y)?, sheet.number(row, z)?))
            };
            let mass_kg = sheet.number(row, mass)?;
            if mass_kg < 0.0 {
                return Err(sheet.refuse(row, mass, sheet.text(row, mass).to_owned(), "0 or more"));
            }
            let pull = three(direction)?;
            let unit = pull.try_normalize(1e-6);
            let direction = match (unit, mass_kg > 0.0) {
                (Some(unit), _) => unit,
                (None, false) => Vec3::zeros(),
                (None, true) => {
                    let expected = "a direction: a weight pulls somewhere";
                    return Err(sheet.refuse(row, direction[0], "(0, 0, 0)".to_owned(), expected));
                }
            };
            let (f, t) = (three(force)?, three(torque)?);
            holds.push(Hold {
                line: sheet.line(row),
                mass_kg,
                direction,
                lever_m: lever.map_or(Ok(Vec3::zeros()), three)?,
                reading: [f.x, f.y, f.z, t.x, t.y, t.z],
                time_s: times.as_ref().map(|t| t[row]),
                temperature_c: warmth.as_ref().map(|t| t[row]),
            });
        }
        Ok(Self { file: sheet.file().to_owned(), holds })
    }

    /// Without the rows of these lines.
    ///
    /// # Errors
    /// [`InstrumentError::NoSuchLine`].
    pub fn without(mut self, lines: &[u64]) -> Result<Self, InstrumentError> {
        for &line in lines {
            if self.holds.iter().all(|hold| hold.line != line) {
                return Err(InstrumentError::NoSuchLine { file: self.file, line });
            }
        }
        self.holds.retain(|hold| !lines.contains(&hold.line));
        Ok(self)
    }
}

fn columns(
    sheet: &Sheet,
    names: [&str; 3],
    units: crate::calib::instruments::sheet::Units,
) -> Result<[Column; 3], InstrumentError> {
    let [x, y, z] = names.map(|name| sheet.need(name, units));
    Ok([x?, y?, z?])
}
