//! Where does a field end? Text → rows of cells, with the separator and what shows it.
//!
//! The separator is the one that splits most lines into the same number of fields that are numbers. Blank lines count as lines, so that
//! numbers of lines are those of an editor.

use super::ExportError;
use super::error::{Origin, Place};
use super::number;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// One field.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Cell {
    /// As it stands there, without blanks around it.
    pub(super) text: String,
    /// Its value where the file says it itself, as workbooks do.
    pub(super) number: Option<f64>,
}

impl Cell {
    pub(super) fn of(text: &str) -> Self {
        Self { text: text.split_whitespace().collect::<Vec<_>>().join(" "), number: None }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.text.is_empty()
    }

    /// Whether it is a number in any style.
    pub(super) fn is_number(&self) -> bool {
        self.number.is_some() || number::hint(&self.text).is_some()
    }
}

/// One line that is not blank.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Row {
    /// Line of the file, from 1.
    pub(super) line: u64,
    pub(super) cells: Vec<Cell>,
}

impl Row {
    /// Cells up to the last that holds something.
    pub(super) fn width(&self) -> usize {
        self.cells.iter().rposition(|c| !c.is_empty()).map_or(0, |last| last + 1)
    }

    /// Whether it is a row of numbers: all of them, or most and at least two.
    pub(super) fn is_data(&self) -> bool {
        let (numbers, filled) = self.counts();
        numbers > 0 && numbers == filled || numbers > 1 && 2 * numbers >= filled
    }

    /// Numbers among its cells, and cells that hold something.
    pub(super) fn counts(&self) -> (usize, usize) {
        let filled = self.cells.iter().filter(|c| !c.is_empty());
        filled.fold((0, 0), |(n, k), cell| (n + usize::from(cell.is_number()), k + 1))
    }
}

/// A sheet of a workbook, or a text file.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Grid {
    pub(super) origin: Arc<Origin>,
    pub(super) rows: Vec<Row>,
    /// What separates fields; none in a workbook.
    pub(super) delimiter: Option<char>,
    pub(super) why: String,
    /// There are quotation marks: fields may hold what separates fields.
    pub(super) quotes: bool,
    /// The last line has no end: it may have been cut off.
    pub(super) open_end: bool,
}

impl Grid {
    /// A cell, by its row and its column, both from 0.
    pub(super) fn place(&self, row: usize, column: usize) -> Place {
        Place { column: column + 1, ..self.line(row) }
    }

    /// A whole row, from 0.
    pub(super) fn line(&self, row: usize) -> Place {
        let line = self.rows.get(row).map_or(0, |r| r.line);
        Place { origin: Arc::clone(&self.origin), line, column: 0 }
    }

    /// The file.
    pub(super) fn file(&self) -> PathBuf {
        self.origin.file.clone()
    }
}

/// Separators in the order in which they win a draw. A blank stands for any number of them.
const DELIMITERS: [char; 5] = [';', '\t', ',', '|', ' '];
/// Lines that a quoted field may span.
const QUOTED_LINES: usize = 8;

/// How people call a separator.
pub(super) fn delimiter_name(delimiter: char) -> String {
    match delimiter {
        '\t' => "tab".to_owned(),
        ' ' => "blanks".to_owned(),
        other => format!("{other:?}"),
    }
}

/// Splits a text, at `wish` if that is given.
pub(super) fn split(file: &Path, text: &str, wish: Option<char>) -> Result<Grid, ExportError> {
    let mut candidates: Vec<(char, Lines, Fit)> = Vec::with_capacity(DELIMITERS.len());
    for delimiter in DELIMITERS.into_iter().filter(|d| wish.is_none_or(|w| w == *d)) {
        let lines = if delimiter == ' ' { blank_rows(text) } else { quoted_rows(text, delimiter as u8) };
        let fit = Fit::of(&lines.rows);
        candidates.push((delimiter, lines, fit));
    }
    let mut best = 0;
    for (i, candidate) in candidates.iter().enumerate() {
        let (held, fit) = (&candidates[best], &candidate.2);
        // Blanks may separate thousands and words; what else separates the same lines is believed. Only a comma may be a decimal sign.
        let blanks = candidate.0 == ' ' && held.0 != ',' && held.2.rows >= fit.rows;
        if fit.score > held.2.score && !blanks {
            best = i;
        }
    }
    let Some((delimiter, Lines { rows, open_quote }, fit)) = candidates.into_iter().nth(best) else {
        return Err(ExportError::Override {
            file: file.to_owned(),
            reason: format!(
                "delimiter = {:?} is none of \";\", \",\", \"|\", tab or a blank",
                wish.unwrap_or_default()
            ),
            nearest: None,
        });
    };
    let origin = Origin { file: file.to_owned(), sheet: None };
    if let Some((line, column, lines)) = open_quote {
        let place = Place { origin: Arc::new(origin), line, column };
        return Err(ExportError::OpenQuote { place, lines });
    }
    let why = match wish {
        Some(_) => "as asked for".to_owned(),
        None => format!("{} lines fall into {} fields each", fit.rows, fit.width),
    };
    let open_end = !text.ends_with(['\n', '\r']);
    let quotes = text.contains('"');
    Ok(Grid { origin: Arc::new(origin), rows, delimiter: Some(delimiter), why, quotes, open_end })
}

/// How well a separator fits.
#[derive(Debug, Clone, Copy)]
struct Fit {
    /// Most frequent number of fields.
    width: usize,
    /// Lines of numbers that have it.
    rows: usize,
    /// Sum over those lines of the share of fields that are numbers, and a tenth more where a line of as many names is there.
    score: f64,
}

impl Fit {
    fn of(rows: &[Row]) -> Self {
        let mut by_width: BTreeMap<usize, (usize, f64)> = BTreeMap::new();
        for row in rows.iter().filter(|r| r.cells.len() > 1 && r.is_data()) {
            let (numbers, filled) = row.counts();
            let entry = by_width.entry(row.cells.len()).or_default();
            entry.0 += 1;
            entry.1 += numbers as f64 / filled as f64;
        }
        let mut best = Self { width: 0, rows: 0, score: 0.0 };
        for (width, (count, score)) in by_width {
            let names = |row: &Row| row.cells.len() == width && row.counts() == (0, row.width());
            let score = if rows.iter().any(names) { 1.1 * score } else { score };
            if score >= best.score {
                best = Self { width, rows: count, score };
            }
        }
        best
    }
}

/// Lines that a separator was tried on.
struct Lines {
    rows: Vec<Row>,
    /// The first field that spans too many lines: its line and column, and how many.
    open_quote: Option<(u64, usize, usize)>,
}

/// Rows whose fields may stand in quotation marks.
fn quoted_rows(text: &str, delimiter: u8) -> Lines {
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(delimiter)
        .has_headers(false)
        .flexible(true)
        .from_reader(text.as_bytes());
    let (mut rows, mut open_quote) = (Vec::new(), None);
    let mut record = csv::StringRecord::new();
    let (mut line, mut counted) = (1, 0);
    while let Ok(true) = reader.read_record(&mut record) {
        let start = record.position().map_or(counted, |p| p.byte() as usize);
        // The reader's place of a row is before the blank lines above it.
        let start = start + text[start..].bytes().take_while(|b| matches!(b, b'\n' | b'\r')).count();
        line += line_ends(&text[counted..start]);
        counted = start;
        let cells: Vec<Cell> = record.iter().map(Cell::of).collect();
        let spans = record.iter().map(|field| line_ends(field) as usize);
        let long = spans.enumerate().find(|(_, lines)| *lines > QUOTED_LINES);
        open_quote = open_quote.or(long.map(|(at, lines)| (line, at + 1, lines)));
        if cells.iter().any(|c| !c.is_empty()) {
            rows.push(Row { line, cells });
        }
    }
    Lines { rows, open_quote }
}

/// Ends of lines, of whatever kind.
fn line_ends(text: &str) -> u64 {
    let bytes = text.as_bytes();
    let ends = |i: usize| bytes[i] == b'\n' || bytes[i] == b'\r' && bytes.get(i + 1) != Some(&b'\n');
    (0..bytes.len()).filter(|i| ends(*i)).count() as u64
}

/// Rows whose fields stand apart by blanks. Names may hold single blanks: they are told apart by the number of fields below.
fn blank_rows(text: &str) -> Lines {
    let lines: Vec<(u64, &str)> = (1..).zip(text.lines()).filter(|(_, l)| !l.trim().is_empty()).collect();
    let numbers = |line: &str| {
        let fields: Vec<Cell> = blanks(line).map(Cell::of).collect();
        fields.iter().all(Cell::is_number).then_some(fields)
    };
    let mut widths: BTreeMap<usize, usize> = BTreeMap::new();
    for (_, line) in &lines {
        if let Some(fields) = numbers(line) {
            *widths.entry(fields.len()).or_default() += 1;
        }
    }
    let width = widths.iter().max_by_key(|(_, count)| **count).map_or(0, |(width, _)| *width);
    let rows = lines
        .into_iter()
        .map(|(line, text)| Row { line, cells: numbers(text).unwrap_or_else(|| names(text, width)) });
    Lines { rows: rows.collect(), open_quote: None }
}

/// Fields between blanks; a blank that does not break a line stands within a number.
fn blanks(line: &str) -> impl Iterator<Item = &str> {
    line.split([' ', '\t']).map(str::trim).filter(|field| !field.is_empty())
}

/// A line of names: at single blanks, at wider ones or behind brackets, whichever gives as many as asked for.
fn names(text: &str, width: usize) -> Vec<Cell> {
    let single: Vec<Cell> = blanks(text).map(Cell::of).collect();
    let wide: Vec<Cell> =
        text.split("  ").flat_map(|part| part.split('\t')).map(Cell::of).filter(|c| !c.is_empty()).collect();
    let mut bracketed: Vec<Cell> =
        text.split_inclusive([')', ']']).map(Cell::of).filter(|c| !c.is_empty()).collect();
    bracketed.truncate(width + 1);
    let fits = |cells: &Vec<Cell>| cells.len() == width;
    [single, wide, bracketed].into_iter().find(fits).unwrap_or_else(|| vec![Cell::of(text)])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(text: &str) -> Grid {
        split(Path::new("a.csv"), text, None).expect("split")
    }

    fn texts(row: &Row) -> Vec<&str> {
        row.cells.iter().map(|c| c.text.as_str()).collect()
    }

    #[test]
    fn each_separator_is_found() {
        for (text, delimiter) in [
            ("a,b\n1,2\n3,4\n", ','),
            ("a;b\n1,5;2,5\n3,5;4,5\n", ';'),
            ("a\tb\n1,5\t2,5\n3,5\t4,5\n", '\t'),
            ("a|b\n1|2\n3|4\n", '|'),
            ("a b\n1,5 2,5\n3,5 4,5\n", ' '),
            ("x: 1, 2\na;b;c\n\"1\";\"2\";\"3\"\n4;5;6\n", ';'),
            ("a, b\n1, 2\n3, 4\n", ','),
            ("a\tb c\t\n1,5\t2 500,00\t\n2,5\t3 500,00\t\n", '\t'),
            // The comma would make "28 128" a number in thousands.
            ("a b\n1,28 128,57\n2,57 257,14\n", ' '),
        ] {
            assert_eq!(grid(text).delimiter, Some(delimiter), "{text:?}");
        }
    }

    #[test]
    fn lines_are_those_of_an_editor() {
        for end in ["\n", "\r\n", "\r"] {
            let text = ["", "a,b", "", "", "\"1\",\"2\"", "3,4", ""].join(end);
            let grid = grid(&text);
            let lines: Vec<u64> = grid.rows.iter().map(|r| r.line).collect();
            assert_eq!(lines, [2, 5, 6], "{end:?}");
            assert_eq!(texts(&grid.rows[1]), ["1", "2"]);
            assert!(!grid.open_end);
        }
        assert!(grid("a,b\n1,2\n3,4").open_end);
    }

    #[test]
    fn names_with_blanks_between_blanks() {
        let grid = grid("Time (s) Load (N)  Position (mm)\n 1 2 3\n 4 5 6\n");
        assert_eq!(texts(&grid.rows[0]), ["Time (s)", "Load (N)", "Position (mm)"]);
        assert_eq!(texts(&grid.rows[2]), ["4", "5", "6"]);
    }

    #[test]
    fn an_open_quotation_mark_is_named() {
        let rows: String = (0..20).map(|i| format!("{i},{i}\n")).collect();
        let error =
            split(Path::new("a.csv"), &format!("a,b\n1,2\n3,\"4\n{rows}"), Some(',')).expect_err("open");
        assert!(error.to_string().starts_with("a.csv, line 3, column 2: a quotation mark"), "{error}");
    }
}
