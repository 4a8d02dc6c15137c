//! One export → its tables, with what was inferred. The only files that are opened are those to be read; nothing is written.

use super::ExportError;
use super::build::Parts;
use super::cells::{self, Grid};
use super::dialect::Dialect;
use super::encoding;
use super::layout;
use super::overrides::Override;
use super::plan;
use super::quantity::Quantity;
use super::report;
use super::source::Source;
use super::style;
use super::table::Table;
use super::workbook;
use std::fmt;
use std::path::{Path, PathBuf};

/// Endings of names by which exports are looked for in a folder.
const ENDINGS: [&str; 11] = ["csv", "txt", "tsv", "dat", "asc", "tra", "xlsx", "xlsm", "xlsb", "xls", "ods"];

/// An export that was read.
#[derive(Debug, Clone, PartialEq)]
pub struct Export {
    /// As it came.
    pub source: Source,
    /// What was inferred, a sheet each.
    pub dialects: Vec<Dialect>,
    /// A specimen each.
    pub tables: Vec<Table>,
}

impl fmt::Display for Export {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        report::write(f, self)
    }
}

/// The exports of a folder, in the natural order of their names.
#[derive(Debug)]
pub struct Folder {
    /// Those that were read.
    pub exports: Vec<Export>,
    /// Those that were not, and why. Lists of results have such names too: whether one matters the caller decides.
    pub refused: Vec<(PathBuf, ExportError)>,
}

/// Reads a file.
///
/// # Errors
/// [`ExportError`], with file, line and column.
pub fn read_file(file: &Path, wish: &Override) -> Result<Export, ExportError> {
    let bytes = std::fs::read(file).map_err(|source| ExportError::Read { file: file.to_owned(), source })?;
    read_bytes(file, bytes, wish)
}

/// Reads the bytes of a file; `file` is named in refusals.
///
/// # Errors
/// [`ExportError`], with file, line and column.
pub fn read_bytes(file: &Path, bytes: Vec<u8>, wish: &Override) -> Result<Export, ExportError> {
    let mut dialects = Vec::new();
    let mut tables = Vec::new();
    if workbook::is_workbook(&bytes) {
        let grids = workbook::sheets(file, &bytes, wish.sheet.as_deref())?;
        let mut refused = None;
        for grid in grids {
            let mut dialect = Dialect { sheet: grid.origin.sheet.clone(), ..Dialect::default() };
            match sheet(grid, dialect.clone(), wish) {
                Ok((dialect, found)) => {
                    dialects.push(dialect);
                    tables.extend(found);
                }
                // Sheets of notes and results have no table; that is said unless no sheet has one.
                Err(
                    error @ (ExportError::NoTable { .. }
                    | ExportError::NoHeader { .. }
                    | ExportError::TooFewRows { .. }),
                ) => {
                    dialect.add("left out", "the whole sheet", error.to_string());
                    dialects.push(dialect);
                    refused.get_or_insert(error);
                }
                Err(error) => return Err(error),
            }
        }
        if let (true, Some(error)) = (tables.is_empty(), refused) {
            return Err(error);
        }
        label_by_sheet(&mut tables);
    } else {
        let decoded = encoding::decode(file, &bytes, wish.encoding.as_deref())?;
        if decoded.text.trim().is_empty() {
            return Err(ExportError::Empty { file: file.to_owned() });
        }
        let grid = cells::split(file, &decoded.text, wish.delimiter)?;
        let mut dialect = Dialect::default();
        dialect.add("encoding", decoded.encoding, decoded.why);
        let (dialect, found) = sheet(grid, dialect, wish)?;
        dialects.push(dialect);
        tables = found;
    }
    Ok(Export { source: Source::new(file, bytes), dialects, tables })
}

fn sheet(
    mut grid: Grid,
    mut dialect: Dialect,
    wish: &Override,
) -> Result<(Dialect, Vec<Table>), ExportError> {
    if !wish.names.is_empty() {
        layout::insert_names(&mut grid, &wish.names)?;
    }
    let grid = &grid;
    let layout = layout::find(grid, wish)?;
    let plans = plan::columns(grid, &layout, wish)?;
    let mut skip = vec![true; layout.width];
    for plan in plans.iter().filter(|p| p.quantity != Quantity::Specimen && !p.is_text) {
        skip[plan.at] = false;
    }
    let (style, why) = style::infer(grid, &layout, &skip, wish)?;
    dialect.add_layout(grid, &layout, style, why);
    let tables = Parts { grid, layout: &layout, plans: &plans, style, wish }.tables()?;
    Ok((dialect, tables))
}

/// Sheets are specimens: their names are labels where the sheet holds one specimen only.
fn label_by_sheet(tables: &mut [Table]) {
    if tables.len() > 1 {
        for table in tables.iter_mut().filter(|t| t.label.is_empty()) {
            table.label = table.place.origin.sheet.clone().unwrap_or_default();
        }
    }
}

/// Reads every export that lies in a folder.
///
/// # Errors
/// [`ExportError::Read`], [`ExportError::EmptyFolder`], or the first refusal where no file could be read.
pub fn read_folder(folder: &Path, wish: &Override) -> Result<Folder, ExportError> {
    let unreadable = |source| ExportError::Read { file: folder.to_owned(), source };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_lowercase();
        if path.is_file() && ENDINGS.contains(&ending.as_str()) {
            files.push(path);
        }
    }
    files.sort_by_key(|path| natural(&path.file_name().unwrap_or_default().to_string_lossy()));
    let mut read = Folder { exports: Vec::new(), refused: Vec::new() };
    for file in files {
        match read_file(&file, wish) {
            Ok(export) => read.exports.push(export),
            Err(error) => read.refused.push((file, error)),
        }
    }
    if read.exports.is_empty() {
        let none = ExportError::EmptyFolder { folder: folder.to_owned(), endings: ENDINGS.join(", ") };
        return Err(read.refused.into_iter().next().map_or(none, |(_, error)| error));
    }
    Ok(read)
}

/// A name cut into text and numbers, so that 2 comes before 10.
fn natural(name: &str) -> Vec<(String, u64)> {
    let mut parts = vec![(String::new(), 0_u64)];
    let mut in_number = false;
    for c in name.chars() {
        let last = parts.len() - 1;
        match c.to_digit(10) {
            Some(digit) => {
                parts[last].1 = parts[last].1.saturating_mul(10).saturating_add(u64::from(digit));
                in_number = true;
            }
            None if in_number => {
                parts.push((c.to_lowercase().collect(), 0));
                in_number = false;
            }
            None => parts[last].0.extend(c.to_lowercase()),
        }
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_in_natural_order() {
        let mut names = ["Specimen_10.csv", "Specimen_9.csv", "a 1.csv", "Specimen_1.csv"];
        names.sort_by_key(|n| natural(n));
        assert_eq!(names, ["a 1.csv", "Specimen_1.csv", "Specimen_9.csv", "Specimen_10.csv"]);
    }
}
