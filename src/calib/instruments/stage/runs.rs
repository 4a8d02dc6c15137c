//! The table of a gauge: where the stage was sent, from which side, and where the gauge found it.
//!
//! | column | holds |
//! | --- | --- |
//! | `target_mm` | where it was sent |
//! | `reading_mm` | where the gauge found it |
//! | `direction` | `up`: it came from below; `down`: from above (also `+`, `-`) |
//! | `run` | number of the run; in a run each target is approached once from each side |
//! | `axis` (may be missing) | name of the axis |
//! | `time_s` (may be missing) | when |

use crate::calib::instruments::InstrumentError;
use crate::calib::instruments::sheet::{LENGTH, PLAIN, Sheet, TIME};
use crate::units::counted;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// From which side a target was approached.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Approach {
    /// From below: the position went up.
    Up,
    /// From above.
    Down,
}

/// One row (m).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StageReading {
    /// Line in the table, from 1.
    pub line: u64,
    /// Where it was sent.
    pub target_m: f64,
    /// Where the gauge found it.
    pub reading_m: f64,
    /// From which side.
    pub approach: Approach,
    /// In which run.
    pub run: u32,
}

/// The runs of one axis.
#[derive(Debug, Clone, PartialEq)]
pub struct StageRuns {
    /// The file.
    pub file: PathBuf,
    /// Name of the axis; empty where the table has none.
    pub axis: String,
    /// Rows, as in the table.
    pub rows: Vec<StageReading>,
}

/// Three targets, twice, from both sides.
const FEWEST: usize = 12;

impl StageRuns {
    /// Reads and checks a table: the runs of each axis.
    ///
    /// # Errors
    /// [`InstrumentError`] with line and column, or with what is missing or doubled.
    pub fn read(file: &Path) -> Result<Vec<Self>, InstrumentError> {
        let sheet = Sheet::read(file, FEWEST)?;
        let (target, reading) = (sheet.need("target", LENGTH)?, sheet.need("reading", LENGTH)?);
        let (direction, run) = (sheet.need("direction", PLAIN)?, sheet.need("run", PLAIN)?);
        let axis = sheet.find("axis", PLAIN)?;
        if let Some(time) = sheet.find("time", TIME)? {
            sheet.times(time)?;
        }
        let mut axes: BTreeMap<String, Vec<StageReading>> = BTreeMap::new();
        for row in 0..sheet.len() {
            let approach = match sheet.text(row, direction).to_lowercase().as_str() {
                "up" | "+" => Approach::Up,
                "down" | "-" | "−" => Approach::Down,
                other => {
                    return Err(sheet.refuse(row, direction, format!("{other:?}"), "up, down, + or -"));
                }
            };
            let number = sheet.number(row, run)?;
            if number.fract() != 0.0 || !(0.0..1e6).contains(&number) {
                return Err(sheet.refuse(row, run, sheet.text(row, run).to_owned(), "the number of a run"));
            }
            let name = axis.map_or("", |column| sheet.text(row, column)).to_owned();
            axes.entry(name).or_default().push(StageReading {
                line: sheet.line(row),
                target_m: sheet.number(row, target)?,
                reading_m: sheet.number(row, reading)?,
                approach,
                run: number as u32,
            });
        }
        axes.into_iter().map(|(axis, rows)| Self { file: file.to_owned(), axis, rows }.checked()).collect()
    }

    /// The targets, ascending (m).
    pub fn targets(&self) -> Vec<f64> {
        let mut targets: Vec<f64> = self.rows.iter().map(|row| row.target_m).collect();
        targets.sort_by(f64::total_cmp);
        targets.dedup();
        targets
    }

    /// Each target from both sides, equally often, at least twice; no run twice.
    fn checked(self) -> Result<Self, InstrumentError> {
        let refuse = |why: String| {
            let why = if self.axis.is_empty() { why } else { format!("axis {}: {why}", self.axis) };
            Err(InstrumentError::Runs { file: self.file.clone(), why })
        };
        let targets = self.targets();
        if targets.len() < 3 {
            return refuse(format!(
                "{}; at least 3 are needed, better 5",
                counted(targets.len(), "target", "targets")
            ));
        }
        let mut runs: Vec<u32> = self.rows.iter().map(|row| row.run).collect();
        runs.sort_unstable();
        runs.dedup();
        if runs.len() < 2 {
            return refuse("one run says nothing of repeatability; make 5".to_owned());
        }
        for (target, run) in targets.iter().flat_map(|t| runs.iter().map(move |r| (*t, *r))) {
            for (approach, side) in [(Approach::Up, "below"), (Approach::Down, "above")] {
                let same = |row: &&StageReading| {
                    row.target_m == target && row.run == run && row.approach == approach
                };
                let lines: Vec<u64> = self.rows.iter().filter(same).map(|row| row.line).collect();
                let at = format!("target {} mm from {side} in run {run}", 1e3 * target);
                match lines[..] {
                    [_] => {}
                    [] => return refuse(format!("{at} is missing")),
                    [first, second, ..] => {
                        return refuse(format!("{at} twice, on lines {first} and {second}"));
                    }
                }
            }
        }
        Ok(self)
    }
}
