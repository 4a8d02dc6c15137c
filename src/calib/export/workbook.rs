//! Sheets of a workbook (xlsx, xlsm, xlsb, xls, ods) → the same rows of cells that texts give.
//!
//! Cells that hold numbers keep them as they are; their text is the shortest that gives the same number, with a point.

use super::ExportError;
use super::cells::{Cell, Grid, Row};
use super::error::Origin;
use calamine::{Data, Reader, open_workbook_auto_from_rs};
use std::io::Cursor;
use std::path::Path;
use std::sync::Arc;

/// How zip archives (xlsx, xlsb, ods) and compound files (xls) begin.
const MARKS: [&[u8]; 2] = [b"PK\x03\x04", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"];

/// Whether the bytes begin as workbooks do.
pub(super) fn is_workbook(bytes: &[u8]) -> bool {
    MARKS.iter().any(|mark| bytes.starts_with(mark))
}

/// Reads all sheets, or the one that is asked for. Blank ones are left out.
pub(super) fn sheets(file: &Path, bytes: &[u8], wish: Option<&str>) -> Result<Vec<Grid>, ExportError> {
    let broken = |message: String| ExportError::Workbook { file: file.to_owned(), message };
    let mut workbook = open_workbook_auto_from_rs(Cursor::new(bytes)).map_err(|e| broken(e.to_string()))?;
    let names = workbook.sheet_names();
    if let Some(wanted) = wish
        && !names.iter().any(|n| n == wanted)
    {
        return Err(ExportError::NoSheet { file: file.to_owned(), wanted: wanted.to_owned(), found: names });
    }
    let mut grids = Vec::new();
    for name in names.iter().filter(|n| wish.is_none_or(|w| w == n.as_str())) {
        let range = workbook.worksheet_range(name).map_err(|e| broken(format!("sheet {name:?}: {e}")))?;
        let Some((top, left)) = range.start() else { continue };
        let rows: Vec<Row> = (u64::from(top) + 1..)
            .zip(range.rows())
            .map(|(line, cells)| {
                let before = std::iter::repeat_with(Cell::default).take(left as usize);
                Row { line, cells: before.chain(cells.iter().map(cell)).collect() }
            })
            .filter(|row: &Row| row.width() > 0)
            .collect();
        if !rows.is_empty() {
            let why = format!("{} rows", rows.len());
            let origin = Arc::new(Origin { file: file.to_owned(), sheet: Some(name.clone()) });
            grids.push(Grid { origin, rows, delimiter: None, why, quotes: true, open_end: false });
        }
    }
    if grids.is_empty() {
        return Err(ExportError::Empty { file: file.to_owned() });
    }
    Ok(grids)
}

fn cell(data: &Data) -> Cell {
    let number = |value: f64| Cell { text: value.to_string(), number: Some(value) };
    match data {
        Data::Empty => Cell::default(),
        Data::Float(value) => number(*value),
        Data::Int(value) => number(*value as f64),
        other => Cell::of(&other.to_string()),
    }
}
