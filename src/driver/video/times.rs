//! When each image file was taken: CSV with the columns `frame` (a number) and `time_s` (seconds on any clock, one for both streams),
//! both rising from row to row. Other columns are left alone.

use super::super::DriverError;
use std::fs::File;
use std::path::Path;

/// One row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Taken {
    /// Number of the frame.
    pub(super) frame: u32,
    /// When it was taken (s).
    pub(super) time_s: f64,
}

/// Reads and checks a file; there is at least one row.
///
/// # Errors
/// [`DriverError`] with file and line: not there, no such column, a value that is no number, numbers or times that do not rise.
pub(super) fn read(file: &Path) -> Result<Vec<Taken>, DriverError> {
    let opened = File::open(file).map_err(|source| DriverError::VideoTimes { file: file.into(), source })?;
    let mut table = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(opened);
    let broken = |source: csv::Error| DriverError::VideoTimes { file: file.into(), source: source.into() };
    let header = table.headers().map_err(broken)?.clone();
    let column = |name: &'static str| {
        let column = header.iter().position(|column| column == name);
        column.ok_or_else(|| DriverError::VideoTimesColumn { file: file.into(), column: name })
    };
    let (frames, times) = (column("frame")?, column("time_s")?);
    let mut rows: Vec<Taken> = Vec::new();
    for (index, record) in table.records().enumerate() {
        let record = record.map_err(broken)?;
        let line = record.position().map_or(index as u64 + 2, csv::Position::line);
        let text = |column: usize| record.get(column).unwrap_or_default();
        let refused = |column: usize, expected: String| DriverError::VideoTimesRow {
            file: file.into(),
            line,
            found: format!("{} {:?}", &header[column], text(column)),
            expected,
        };
        let frame = text(frames).parse().ok().filter(|&frame| frame < NUMBERS);
        let frame: u32 = frame.ok_or_else(|| refused(frames, format!("a whole number below {NUMBERS}")))?;
        let time_s: f64 = text(times).parse().unwrap_or(f64::NAN);
        if !time_s.is_finite() {
            return Err(refused(times, "a time in seconds".to_owned()));
        }
        if let Some(before) = rows.last() {
            if frame <= before.frame {
                return Err(refused(frames, format!("more than {}, the row before", before.frame)));
            }
            if time_s <= before.time_s {
                return Err(refused(times, format!("later than {} s, the row before", before.time_s)));
            }
        }
        rows.push(Taken { frame, time_s });
    }
    if rows.is_empty() {
        let (found, expected) = ("nothing".to_owned(), "a row for each frame".to_owned());
        return Err(DriverError::VideoTimesRow { file: file.into(), line: 2, found, expected });
    }
    Ok(rows)
}

/// OpenCV counts no further.
const NUMBERS: u32 = 1_000_000_000;
