//! One CSV file row by row: header names → columns in the order asked for, fields → numbers, or a refusal
//! that names file, line and column.
//!
//! The file is streamed; one row is in memory at a time. A byte order mark, Windows line ends, blank lines,
//! quoted fields, columns in any order and columns that nobody asked for are accepted.

use super::DatasetError;
use super::text::is_utf16;
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

const WHOLE: &str = "a whole number from 0 to 4294967295";
const DECIMAL: &str = "a decimal number such as 0.0125 or 1.25e-2";

/// Characters of a field that a message shows: more than any number or heading of a recording has.
const MOST_SHOWN: usize = 40;

impl RowStart {
    /// The line of the row in `file`, counted anew: only refusals need it, and the CSV reader's own count names
    /// the first of the blank lines before a row instead of the row. 0 when the file can't be read any more.
    pub(super) fn line(self, file: &Path) -> u64 {
        count_lines(file, self.0).unwrap_or(0)
    }
}

/// A CSV file being read, with `N` columns of interest.
pub(super) struct Table<const N: usize> {
    file: PathBuf,
    reader: csv::Reader<BufReader<File>>,
    columns: [&'static str; N],
    /// Where each of `columns` stands in a row.
    at: [usize; N],
    /// Fields of the header.
    width: usize,
    record: csv::ByteRecord,
}

/// Where a row begins, for messages about it after it has been read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RowStart(u64);

impl<const N: usize> Table<N> {
    /// Opens `file` and finds `columns` in its header.
    pub(super) fn open(file: &Path, columns: [&'static str; N]) -> Result<Self, DatasetError> {
        let read = |source| DatasetError::Read { file: file.to_owned(), source };
        let mut bytes = BufReader::with_capacity(1 << 16, File::open(file).map_err(read)?);
        if is_utf16(bytes.fill_buf().map_err(read)?) {
            return Err(DatasetError::Utf16 { file: file.to_owned() });
        }
        let mut reader = csv::ReaderBuilder::new()
            .flexible(true)
            .has_headers(true)
            .buffer_capacity(1 << 16)
            .from_reader(bytes);
        let header = reader.byte_headers().map_err(|e| read(io_error(e)))?;
        let names: Vec<String> =
            header.iter().map(|n| String::from_utf8_lossy(n).trim().to_owned()).collect();
        let mut at = [0; N];
        for (place, &column) in at.iter_mut().zip(&columns) {
            let mut found = names.iter().enumerate().filter(|(_, n)| *n == column).map(|(i, _)| i);
            *place = found.next().ok_or_else(|| missing(file, column, header))?;
            if found.next().is_some() {
                return Err(DatasetError::RepeatedColumn { file: file.to_owned(), column });
            }
        }
        let width = names.len();
        Ok(Self { file: file.to_owned(), reader, columns, at, width, record: csv::ByteRecord::new() })
    }

    /// Goes to the next row; `false` after the last.
    pub(super) fn advance(&mut self) -> Result<bool, DatasetError> {
        let more = self
            .reader
            .read_byte_record(&mut self.record)
            .map_err(|e| DatasetError::Read { file: self.file.clone(), source: io_error(e) })?;
        if more && self.record.len() != self.width {
            let last = self.record.get(self.record.len().saturating_sub(1)).unwrap_or_default();
            return Err(DatasetError::FieldCount {
                file: self.file.clone(),
                row: self.line(self.row()),
                found: self.record.len(),
                expected: self.width,
                last: shown(last),
            });
        }
        Ok(more)
    }

    /// Column `which` of the row as a finite number.
    pub(super) fn number(&self, which: usize) -> Result<f64, DatasetError> {
        let text = self.field(which);
        match text.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            Ok(_) => Err(DatasetError::NonFinite {
                file: self.file.clone(),
                row: self.line(self.row()),
                column: self.columns[which],
                value: text.to_owned(),
            }),
            Err(_) => Err(self.not_a_number(which, DECIMAL)),
        }
    }

    /// Columns `first`, `first + 1`, `first + 2` of the row.
    pub(super) fn vector(&self, first: usize) -> Result<[f64; 3], DatasetError> {
        Ok([self.number(first)?, self.number(first + 1)?, self.number(first + 2)?])
    }

    /// Column `which` of the row as a whole number.
    pub(super) fn whole(&self, which: usize) -> Result<u32, DatasetError> {
        self.field(which).parse().map_err(|_| self.not_a_number(which, WHOLE))
    }

    /// Column 0 of the row as a time not before `previous_s`. Equal times are sorted too.
    pub(super) fn time(&self, previous_s: Option<f64>) -> Result<f64, DatasetError> {
        let time_s = self.number(0)?;
        match previous_s {
            Some(previous_s) if time_s < previous_s => Err(DatasetError::UnsortedTime {
                file: self.file.clone(),
                row: self.line(self.row()),
                column: self.columns[0],
                time_s,
                previous_s,
            }),
            _ => Ok(time_s),
        }
    }

    /// Where the row begins.
    pub(super) fn row(&self) -> RowStart {
        RowStart(self.record.position().map_or(0, csv::Position::byte))
    }

    /// The line of a row of this file.
    pub(super) fn line(&self, row: RowStart) -> u64 {
        row.line(&self.file)
    }

    /// The field as text without surrounding blanks; the empty text when it is not UTF-8.
    fn field(&self, which: usize) -> &str {
        std::str::from_utf8(&self.record[self.at[which]]).unwrap_or_default().trim()
    }

    fn not_a_number(&self, which: usize, expected: &'static str) -> DatasetError {
        DatasetError::NotANumber {
            file: self.file.clone(),
            row: self.line(self.row()),
            column: self.columns[which],
            value: shown(&self.record[self.at[which]]),
            expected,
        }
    }
}

/// A column is missing: from the header of a table, or because this is none.
fn missing(file: &Path, column: &'static str, header: &csv::ByteRecord) -> DatasetError {
    // A tab or a letter of another encoding stands in tables that people make.
    let obeyed = |name: &[u8]| name.trim_ascii().iter().any(|byte| byte.is_ascii_control() && *byte != b'\t');
    let is_foreign = !header.is_empty() && header.iter().all(|name| std::str::from_utf8(name).is_err());
    if is_foreign || header.iter().any(obeyed) {
        return DatasetError::NoTable { file: file.to_owned() };
    }
    DatasetError::MissingColumn { file: file.to_owned(), column, found: header.iter().map(shown).collect() }
}

/// A field as it may stand in a message, whatever it holds: without what a terminal would obey, and cut off where it is long.
fn shown(field: &[u8]) -> String {
    let text = String::from_utf8_lossy(field);
    let plain = text.trim().chars().map(|c| if c.is_control() { char::REPLACEMENT_CHARACTER } else { c });
    let cut = if text.trim().chars().count() > MOST_SHOWN { "…" } else { "" };
    plain.take(MOST_SHOWN).chain(cut.chars()).collect()
}

/// The line of the first byte at or after `start` that is not part of a line end.
fn count_lines(file: &Path, start: u64) -> std::io::Result<u64> {
    let mut line = 1;
    for (at, byte) in BufReader::new(File::open(file)?).bytes().enumerate() {
        match byte? {
            b'\n' => line += 1,
            b'\r' => {}
            _ if at as u64 >= start => break,
            _ => {}
        }
    }
    Ok(line)
}

/// Whether a file ends in a line end, as every complete CSV file that this program writes does.
pub(super) fn ends_with_newline(file: &Path) -> std::io::Result<bool> {
    use std::io::{Seek, SeekFrom};
    let mut bytes = File::open(file)?;
    if bytes.seek(SeekFrom::End(0))? == 0 {
        return Ok(false);
    }
    bytes.seek(SeekFrom::End(-1))?;
    let mut last = [0];
    bytes.read_exact(&mut last)?;
    Ok(matches!(last[0], b'\n' | b'\r'))
}

fn io_error(error: csv::Error) -> std::io::Error {
    match error.into_kind() {
        csv::ErrorKind::Io(source) => source,
        // Byte records of any width: nothing but input and output can fail.
        other => std::io::Error::other(format!("{other:?}")),
    }
}
