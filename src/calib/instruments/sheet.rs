//! A table that a person keeps at the bench: CSV → columns in SI, or a refusal with file, line and column.
//!
//! Headings carry the unit: `mass_g`, `target_mm`. A quantity stands in one column and one unit.

use super::InstrumentError;
use std::path::{Path, PathBuf};

/// Units that a heading may end with, and one of each in SI.
pub(super) type Units = &'static [(&'static str, f64)];

pub(super) const LENGTH: Units = &[("mm", 1e-3), ("um", 1e-6), ("m", 1.0)];
pub(super) const MASS: Units = &[("g", 1e-3), ("kg", 1.0)];
pub(super) const FORCE: Units = &[("n", 1.0), ("mn", 1e-3)];
pub(super) const TORQUE: Units = &[("nm", 1.0), ("nmm", 1e-3)];
pub(super) const TIME: Units = &[("s", 1.0), ("min", 60.0), ("h", 3600.0)];
/// Degrees Celsius stay what they are.
pub(super) const TEMPERATURE: Units = &[("c", 1.0)];
/// A number without a unit.
pub(super) const PLAIN: Units = &[("", 1.0)];

/// A table as text.
pub(super) struct Sheet {
    file: PathBuf,
    headings: Vec<String>,
    rows: Vec<(u64, Vec<String>)>,
}

/// Where a quantity stands in a table.
#[derive(Debug, Clone, Copy)]
pub(super) struct Column {
    index: usize,
    scale: f64,
}

impl Sheet {
    /// Reads a file with at least `needed` rows below the headings.
    pub(super) fn read(file: &Path, needed: usize) -> Result<Self, InstrumentError> {
        let bytes =
            std::fs::read(file).map_err(|source| InstrumentError::Read { file: file.to_owned(), source })?;
        Self::parse(file, &bytes, needed)
    }

    pub(super) fn parse(file: &Path, bytes: &[u8], needed: usize) -> Result<Self, InstrumentError> {
        let no_table = |why: String| InstrumentError::NoTable { file: file.to_owned(), why };
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        if bytes.trim_ascii().is_empty() {
            return Err(no_table("the file is empty".to_owned()));
        }
        let mut reader =
            csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(bytes);
        let headings =
            reader.headers().map_err(|e| no_table(e.to_string()))?.iter().map(str::to_lowercase).collect();
        let mut rows = Vec::new();
        for record in reader.records() {
            let record = record.map_err(|e| no_table(e.to_string()))?;
            let line = record.position().map_or(0, csv::Position::line);
            rows.push((line, record.iter().map(str::to_owned).collect()));
        }
        let sheet = Self { file: file.to_owned(), headings, rows };
        if sheet.rows.len() < needed {
            return Err(InstrumentError::TooFewRows {
                file: file.to_owned(),
                found: sheet.rows.len(),
                needed,
            });
        }
        Ok(sheet)
    }

    pub(super) fn file(&self) -> &Path {
        &self.file
    }

    pub(super) fn len(&self) -> usize {
        self.rows.len()
    }

    /// Line of a row, from 1.
    pub(super) fn line(&self, row: usize) -> u64 {
        self.rows[row].0
    }

    /// The column of a quantity, if there is one.
    pub(super) fn find(&self, name: &str, units: Units) -> Result<Option<Column>, InstrumentError> {
        let named = |unit: &str| if unit.is_empty() { name.to_owned() } else { format!("{name}_{unit}") };
        let mut found: Option<Column> = None;
        for (index, heading) in self.headings.iter().enumerate() {
            let Some((_, scale)) = units.iter().find(|(unit, _)| *heading == named(unit)) else { continue };
            if let Some(first) = found {
                return Err(InstrumentError::MixedUnits {
                    file: self.file.clone(),
                    column: index + 1,
                    first: self.headings[first.index].clone(),
                    second: heading.clone(),
                });
            }
            found = Some(Column { index, scale: *scale });
        }
        Ok(found)
    }

    /// The column of a quantity.
    pub(super) fn need(&self, name: &str, units: Units) -> Result<Column, InstrumentError> {
        let named = |unit: &str| if unit.is_empty() { name.to_owned() } else { format!("{name}_{unit}") };
        self.find(name, units)?.ok_or_else(|| InstrumentError::NoColumn {
            file: self.file.clone(),
            expected: units.iter().map(|(unit, _)| named(unit)).collect(),
            found: self.headings.clone(),
        })
    }

    /// The text of a cell.
    pub(super) fn text(&self, row: usize, column: Column) -> &str {
        self.rows[row].1.get(column.index).map_or("", String::as_str)
    }

    /// A number in SI.
    pub(super) fn number(&self, row: usize, column: Column) -> Result<f64, InstrumentError> {
        let text = self.text(row, column);
        match text.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value * column.scale),
            _ => Err(self.refuse(row, column, format!("{text:?}"), "a number, the unit in the heading only")),
        }
    }

    /// Numbers of a column in SI.
    pub(super) fn numbers(&self, column: Column) -> Result<Vec<f64>, InstrumentError> {
        (0..self.len()).map(|row| self.number(row, column)).collect()
    }

    /// Times in SI, none of which is before the one above it.
    pub(super) fn times(&self, column: Column) -> Result<Vec<f64>, InstrumentError> {
        let times = self.numbers(column)?;
        match times.windows(2).position(|pair| pair[1] < pair[0]) {
            None => Ok(times),
            Some(before) => {
                let found = format!("{} after {}", self.text(before + 1, column), self.text(before, column));
                Err(self.refuse(before + 1, column, found, "time that does not go back"))
            }
        }
    }

    /// What is said of a cell that cannot be.
    pub(super) fn refuse(
        &self,
        row: usize,
        column: Column,
        found: String,
        expected: &'static str,
    ) -> InstrumentError {
        InstrumentError::Cell {
            file: self.file.clone(),
            line: self.line(row),
            column: column.index + 1,
            heading: self.headings[column.index].clone(),
            found,
            expected,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sheet(text: &str) -> Result<Sheet, InstrumentError> {
        Sheet::parse(Path::new("a.csv"), text.as_bytes(), 2)
    }

    #[test]
    fn columns_come_in_si_and_wrong_cells_are_named() -> Result<(), InstrumentError> {
        let good = sheet("\u{feff}time_min,target_mm\n# a remark\n0,1.5\n2, 2.5\n1,x\n")?;
        assert_eq!(good.number(1, good.need("target", LENGTH)?)?, 2.5e-3);
        let time = good.need("time", TIME)?;
        assert_eq!(good.numbers(time)?, [0.0, 120.0, 60.0]);
        let said = |error: InstrumentError| error.to_string();
        let back = said(good.times(time).expect_err("back"));
        assert!(back.contains("a.csv, line 5, column 1 (time_min): 1 after 2"), "{back}");
        let text = said(good.numbers(good.need("target", LENGTH)?).expect_err("text"));
        assert!(text.contains("line 5, column 2 (target_mm): \"x\""), "{text}");
        let none = said(good.need("mass", MASS).expect_err("none"));
        assert!(none.contains("mass_g or mass_kg") && none.contains("target_mm"), "{none}");
        assert!(good.find("temperature", TEMPERATURE)?.is_none());
        Ok(())
    }

    #[test]
    fn tables_that_are_none_are_refused() {
        for (text, words) in [
            ("", "the file is empty"),
            (" \n\n", "the file is empty"),
            ("a,b\n1,2\n", "1 row below the headings; at least 2"),
            ("a,b\n1,2\n1,2,3\n", "line: 3"),
        ] {
            let error = sheet(text).err().expect(words).to_string();
            assert!(error.contains(words), "{words}: {error}");
        }
        let mixed = sheet("mass_g,mass_kg\n1,2\n1,2\n").expect("a table").need("mass", MASS);
        let mixed = mixed.expect_err("mixed").to_string();
        assert!(mixed.contains("column 2: mass_kg beside mass_g: mixed units"), "{mixed}");
    }
}
