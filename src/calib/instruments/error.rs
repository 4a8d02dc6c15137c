//! Why an instrument could not be calibrated, with the place in its table.

use crate::units::counted;
use std::path::PathBuf;

/// What is wrong with a table, or with what it says.
#[derive(Debug, thiserror::Error)]
pub enum InstrumentError {
    /// The file cannot be read.
    #[error("{}: can't be read", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// No text in UTF-8, or rows of unequal length.
    #[error("{}: {why}", file.display())]
    NoTable {
        /// The file.
        file: PathBuf,
        /// What the reader says, with the line.
        why: String,
    },
    /// Too few rows for anything.
    #[error("{}: {} below the headings; at least {needed} are needed", file.display(), counted(*found, "row", "rows"))]
    TooFewRows {
        /// The file.
        file: PathBuf,
        /// Rows found.
        found: usize,
        /// Rows needed.
        needed: usize,
    },
    /// A heading is missing.
    #[error("{}, line 1: no column {}; there are {}", file.display(), expected.join(" or "), found.join(", "))]
    NoColumn {
        /// The file.
        file: PathBuf,
        /// What it may be called, with each unit.
        expected: Vec<String>,
        /// Headings found.
        found: Vec<String>,
    },
    /// One quantity in two units.
    #[error("{}, line 1, column {column}: {second} beside {first}: mixed units; keep one of them", file.display())]
    MixedUnits {
        /// The file.
        file: PathBuf,
        /// Column of the second, from 1.
        column: usize,
        /// One heading.
        first: String,
        /// The other.
        second: String,
    },
    /// A cell that holds what it should not.
    #[error("{}, line {line}, column {column} ({heading}): {found}; expected {expected}", file.display())]
    Cell {
        /// The file.
        file: PathBuf,
        /// Line, from 1.
        line: u64,
        /// Column, from 1.
        column: usize,
        /// Its heading.
        heading: String,
        /// What it holds.
        found: String,
        /// What it should.
        expected: &'static str,
    },
    /// The rows leave something open.
    #[error("{}: {rows} rows say nothing of {}; hang weights in further directions or at further levers", file.display(), parts.join(", nor of "))]
    Unobservable {
        /// The file.
        file: PathBuf,
        /// Rows.
        rows: usize,
        /// What cannot be told.
        parts: Vec<String>,
    },
    /// A line that is to be left out does not exist.
    #[error("{}: there is no row on line {line} to leave out", file.display())]
    NoSuchLine {
        /// The file.
        file: PathBuf,
        /// The line.
        line: u64,
    },
    /// What was found cannot be inverted, or is not finite.
    #[error("{}: {what}", file.display())]
    Singular {
        /// The file.
        file: PathBuf,
        /// What came out.
        what: &'static str,
    },
    /// Runs that do not fit together.
    #[error("{}: {why}", file.display())]
    Runs {
        /// The file.
        file: PathBuf,
        /// What is missing or doubled.
        why: String,
    },
    /// A press that does not begin before contact.
    #[error(
        "{}: the press begins in contact: over its first rows the force rises by {rise_n:.2} N already, {:.0} N/mm later on; begin some steps \
         before the tip touches", file.display(), 1e-3 * slope_n_per_m
    )]
    InContact {
        /// The file.
        file: PathBuf,
        /// Rise of the force over the first rows (N).
        rise_n: f64,
        /// Slope in contact (N/m).
        slope_n_per_m: f64,
    },
    /// A calibration file that is none.
    #[error("{}: {why}", file.display())]
    File {
        /// The file.
        file: PathBuf,
        /// What is wrong.
        why: String,
    },
}
