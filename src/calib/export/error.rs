//! Why an export was not read, with the place where it went wrong.

use super::quantity::Quantity;
use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;

/// A file, or a sheet of a workbook.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Origin {
    /// The file.
    pub file: PathBuf,
    /// The sheet, in a workbook.
    pub sheet: Option<String>,
}

/// A cell of a file, as a person finds it there.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// File and sheet.
    pub origin: Arc<Origin>,
    /// Line or row, from 1.
    pub line: u64,
    /// Field of that line, from 1; 0 where the whole line is meant.
    pub column: usize,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.origin.file.display())?;
        if let Some(sheet) = &self.origin.sheet {
            write!(f, ", sheet {sheet:?}")?;
        }
        write!(f, ", line {}", self.line)?;
        if self.column > 0 {
            write!(f, ", column {}", self.column)?;
        }
        Ok(())
    }
}

/// Why an export was not read.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The file or folder cannot be read at all.
    #[error("{}: can't be read", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// Nothing in it.
    #[error("{}: the file is empty", file.display())]
    Empty {
        /// The file.
        file: PathBuf,
    },
    /// Bytes that are no text and no workbook.
    #[error(
        "{}: byte {byte} is 0x{value:02x}, which no text has: export it as text or as a workbook", file.display()
    )]
    NotText {
        /// The file.
        file: PathBuf,
        /// Where, from 0.
        byte: usize,
        /// What stands there.
        value: u8,
    },
    /// A workbook that cannot be opened.
    #[error("{}: not a workbook that can be read: {message}", file.display())]
    Workbook {
        /// The file.
        file: PathBuf,
        /// What its reader says.
        message: String,
    },
    /// The workbook has no sheet of that name.
    #[error("{}: no sheet {wanted:?}; there are {}", file.display(), found.join(", "))]
    NoSheet {
        /// The file.
        file: PathBuf,
        /// Name asked for.
        wanted: String,
        /// Names that are there.
        found: Vec<String>,
    },
    /// A folder without any export.
    #[error("{}: no file in it has the name of an export ({endings})", folder.display())]
    EmptyFolder {
        /// The folder.
        folder: PathBuf,
        /// Endings looked for.
        endings: String,
    },
    /// No rows of numbers.
    #[error(
        "{}: no table in its {lines} lines: no two lines that follow one another have two numbers each",
        file.display()
    )]
    NoTable {
        /// The file.
        file: PathBuf,
        /// Lines that were looked at.
        lines: usize,
    },
    /// A table of one row.
    #[error("{place}: the table has {found} row; at least {needed} are needed")]
    TooFewRows {
        /// Its first row.
        place: Place,
        /// Rows found.
        found: usize,
        /// Rows needed.
        needed: usize,
    },
    /// Numbers without names above.
    #[error(
        "{place}: the numbers begin here, and no names of columns stand above them: say names = [\"…\", \"…\"]"
    )]
    NoHeader {
        /// The first row of numbers.
        place: Place,
    },
    /// A row of another width.
    #[error("{place}: {found} fields where the names are {expected}; the last is {last:?}{hint}")]
    RowWidth {
        /// The row.
        place: Place,
        /// Its fields.
        found: usize,
        /// Fields of the names.
        expected: usize,
        /// Its last field.
        last: String,
        /// What it may come from.
        hint: &'static str,
    },
    /// Quotation marks that are opened and not closed.
    #[error("{place}: a quotation mark is opened here and closed {lines} lines later or never")]
    OpenQuote {
        /// Where it opens.
        place: Place,
        /// Lines that it would span.
        lines: usize,
    },
    /// Text where numbers should be.
    #[error(
        "{place} ({name}): {text:?} is not a number{}", decimal.map_or(String::new(), |d| format!(" with the decimal sign {d:?}"))
    )]
    TextInNumbers {
        /// The cell.
        place: Place,
        /// Name of its column.
        name: String,
        /// Its text.
        text: String,
        /// Decimal sign of the table, once it is known.
        decimal: Option<char>,
    },
    /// A number beyond what a double holds.
    #[error("{place} ({name}): {text:?} is too large for a number")]
    NotFinite {
        /// The cell.
        place: Place,
        /// Name of its column.
        name: String,
        /// Its text.
        text: String,
    },
    /// A sign that may separate decimals or thousands.
    #[error(
        "{place}: {text:?} may be {with_decimals} or {with_thousands}, and no other number tells which: \
         say decimal = \".\" or decimal = \",\""
    )]
    DecimalAmbiguous {
        /// The cell.
        place: Place,
        /// Its text.
        text: String,
        /// Its value if the sign separates decimals.
        with_decimals: f64,
        /// Its value if the sign separates thousands.
        with_thousands: f64,
    },
    /// Two decimal signs in a table.
    #[error(
        "{place}: {text:?} has another decimal sign than {other:?} in line {other_line}, column {other_column}"
    )]
    DecimalMixed {
        /// The cell.
        place: Place,
        /// Its text.
        text: String,
        /// A number with the other sign.
        other: String,
        /// Its line.
        other_line: u64,
        /// Its column.
        other_column: usize,
    },
    /// A time before the one above it.
    #[error(
        "{place} ({name}): {text:?} comes after {previous:?} in line {previous_line}: time goes back{hint}"
    )]
    TimeBack {
        /// The cell.
        place: Place,
        /// Name of its column.
        name: String,
        /// Its text.
        text: String,
        /// The time above it.
        previous: String,
        /// Where that stands.
        previous_line: u64,
        /// What it may come from.
        hint: &'static str,
    },
    /// A heading and the row of units below it name different units.
    #[error("{place}: the heading {heading:?} says {in_heading:?}, the row of units says {in_row:?}")]
    TwoUnits {
        /// The cell of the row of units.
        place: Place,
        /// The heading.
        heading: String,
        /// Its unit.
        in_heading: String,
        /// The other one.
        in_row: String,
    },
    /// What is asked for is not in the table.
    #[error("{place}: no column holds {quantity}; there are {}", found.join(", "))]
    NoColumn {
        /// Line of the names.
        place: Place,
        /// What was asked for.
        quantity: Quantity,
        /// The columns that are there.
        found: Vec<String>,
    },
    /// Two columns that could be meant.
    #[error(
        "{place}: {first:?} and {second:?} both hold {quantity} and differ: say ignore = true for one of them"
    )]
    TwoColumns {
        /// Line of the names.
        place: Place,
        /// What was asked for.
        quantity: Quantity,
        /// One of them.
        first: String,
        /// The other.
        second: String,
    },
    /// A column whose unit is not known.
    #[error("{place} ({name}): {what}: say unit = \"…\" under [column.{name:?}]")]
    UnitOpen {
        /// The heading.
        place: Place,
        /// The column.
        name: String,
        /// Why it is not known.
        what: String,
    },
    /// A column whose unit its numbers contradict.
    #[error("{place} ({name}): {what}: say the true unit = \"…\" under [column.{name:?}]")]
    UnitContradicted {
        /// The heading.
        place: Place,
        /// The column.
        name: String,
        /// What contradicts it.
        what: String,
    },
    /// A file of wishes that cannot be followed.
    #[error("{}: {reason}{}", file.display(), nearest.as_ref().map_or(String::new(), |n| format!("\ndid you mean {n}?")))]
    Override {
        /// The file of wishes, or the export that they do not fit.
        file: PathBuf,
        /// What is wrong.
        reason: String,
        /// The known key that is most alike.
        nearest: Option<String>,
    },
}
