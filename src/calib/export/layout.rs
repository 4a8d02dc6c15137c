//! Where do names, units and numbers stand? Rows of cells → blocks of data with their rows of names and units.
//!
//! The longest run of rows of numbers is the table; the nearest row of names above it names the columns. Other runs under the same
//! names are further specimens; runs under other names (results, statistics) are left aside and said.

use super::ExportError;
use super::cells::{Cell, Grid, Row};
use super::overrides::Override;
use super::{quantity, unit};

/// Fewer rows are no table.
const FEWEST_ROWS: usize = 2;

/// Rows of numbers of one specimen; all numbers are indices of rows.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Block {
    pub(super) data: Vec<usize>,
    /// Rows above it that belong to it: preamble.
    pub(super) before: Vec<usize>,
}

/// A sheet taken apart.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Layout {
    pub(super) names: usize,
    pub(super) units: Option<usize>,
    /// Number of columns.
    pub(super) width: usize,
    pub(super) blocks: Vec<Block>,
    /// Rows behind the last block.
    pub(super) after: Vec<usize>,
    /// What was left out, by its lines.
    pub(super) aside: Vec<String>,
}

/// Consecutive rows of numbers, and the rows between them and the run above.
struct Run {
    above: Vec<usize>,
    data: Vec<usize>,
}

/// Finds the parts of a sheet.
pub(super) fn find(grid: &Grid, wish: &Override) -> Result<Layout, ExportError> {
    let rows = &grid.rows;
    let (runs, after) = runs(rows);
    let mut main = main_run(grid, &runs, wish)?;
    let (names, units) = loop {
        match asked_names(grid, wish)?.or_else(|| names_above(rows, &runs[main].above)) {
            Some(found) => break found,
            // A broken row splits a table: its first part has the names.
            None if main > 0 && !runs[main].above.is_empty() => main -= 1,
            None => return Err(ExportError::NoHeader { place: grid.line(runs[main].data[0]) }),
        }
    };
    let width = rows[names].width().max(units.map_or(0, |u| rows[u].width()));
    let mut layout = Layout { names, units, width, blocks: Vec::new(), after, aside: Vec::new() };
    let mut open = false;
    for (index, run) in runs.iter().enumerate() {
        let lines =
            format!("lines {} to {}", rows[run.data[0]].line, rows[run.data[run.data.len() - 1]].line);
        let heads = names_above(rows, &run.above);
        let same = heads.is_some_and(|(other, _)| other == names || same_names(&rows[other], &rows[names]));
        let label = run.above.first().is_some_and(|r| is_label(&rows[*r]));
        if index == main || same || open && label && heads.is_none() {
            let before =
                run.above.iter().copied().filter(|r| Some(*r) != units && heads.is_none_or(|h| h.0 != *r));
            let before = before.filter(|r| heads.and_then(|h| h.1) != Some(*r)).collect();
            layout.blocks.push(Block { data: run.data.clone(), before });
            open = true;
        } else if let Some((other, _)) = heads {
            let names: Vec<&str> = rows[other].cells.iter().map(|c| c.text.as_str()).collect();
            layout.aside.push(format!("{lines}: a table of other columns ({})", names.join(", ")));
            open = false;
        } else if open && let Some(&broken) = run.above.first() {
            if quantity::is_statistic(first_text(&rows[broken])) {
                layout.aside.push(format!("{lines}: statistics"));
                open = false;
            } else {
                let column =
                    rows[broken].cells.iter().position(|c| !c.is_empty() && !c.is_number()).unwrap_or(0);
                return Err(ExportError::TextInNumbers {
                    place: grid.place(broken, column),
                    name: rows[names].cells.get(column).map_or(String::new(), |c| c.text.clone()),
                    text: rows[broken].cells[column].text.clone(),
                    decimal: None,
                });
            }
        } else {
            layout.aside.push(format!("{lines}: numbers without names"));
        }
    }
    for block in &mut layout.blocks {
        check_rows(grid, width, block, &mut layout.aside)?;
    }
    Ok(layout)
}

/// Rows that are a table's: sound widths, no statistics, no last row that was cut off.
fn check_rows(
    grid: &Grid,
    width: usize,
    block: &mut Block,
    aside: &mut Vec<String>,
) -> Result<(), ExportError> {
    let rows = &grid.rows;
    if let Some(at) = block.data.iter().position(|r| quantity::is_statistic(first_text(&rows[*r]))) {
        aside.push(format!("from line {}: statistics", rows[block.data[at]].line));
        block.data.truncate(at);
    }
    if let Some(&last) = block.data.last()
        && grid.open_end
        && last + 1 == rows.len()
        && rows[last].cells.len() < width
    {
        aside.push(format!(
            "line {}: cut off after {} of {width} fields",
            rows[last].line,
            rows[last].cells.len()
        ));
        block.data.pop();
    }
    for &row in &block.data {
        let found = if rows[row].width() > width { rows[row].width() } else { rows[row].cells.len() };
        if rows[row].width() > width || rows[row].cells.len() < width {
            let doubled = found == 2 * width && grid.delimiter == Some(',');
            let hint = if doubled {
                ": is the decimal sign a comma too? Numbers need quotation marks then"
            } else {
                ""
            };
            let last = rows[row].cells[found - 1].text.clone();
            return Err(ExportError::RowWidth { place: grid.line(row), found, expected: width, last, hint });
        }
    }
    if block.data.len() < FEWEST_ROWS {
        let at = block.data.first().or(block.before.last()).copied().unwrap_or(0);
        return Err(ExportError::TooFewRows {
            place: grid.line(at),
            found: block.data.len(),
            needed: FEWEST_ROWS,
        });
    }
    Ok(())
}

/// Puts names that were asked for above the longest run of numbers.
pub(super) fn insert_names(grid: &mut Grid, names: &[String]) -> Result<(), ExportError> {
    let (runs, _) = runs(&grid.rows);
    let main = main_run(grid, &runs, &Override::default())?;
    let first = runs[main].data[0];
    let line = grid.rows[first].line;
    grid.rows.insert(first, Row { line, cells: names.iter().map(|n| Cell::of(n)).collect() });
    Ok(())
}

fn first_text(row: &Row) -> &str {
    row.cells.iter().find(|c| !c.is_empty()).map_or("", |c| c.text.as_str())
}

/// A row that names a specimen and nothing else.
fn is_label(row: &Row) -> bool {
    let (_, filled) = row.counts();
    filled <= 2 && quantity::meaning(first_text(row)).quantity == quantity::Quantity::Specimen
}

fn runs(rows: &[Row]) -> (Vec<Run>, Vec<usize>) {
    let mut runs: Vec<Run> = Vec::new();
    let mut above: Vec<usize> = Vec::new();
    for (i, row) in rows.iter().enumerate() {
        if !row.is_data() {
            above.push(i);
        } else if let Some(run) = runs.last_mut().filter(|_| above.is_empty()) {
            run.data.push(i);
        } else {
            runs.push(Run { above: std::mem::take(&mut above), data: vec![i] });
        }
    }
    (runs, above)
}

/// The longest run, or the one below the names that were asked for.
fn main_run(grid: &Grid, runs: &[Run], wish: &Override) -> Result<usize, ExportError> {
    let rows = &grid.rows;
    let none =
        || ExportError::NoTable { file: grid.file(), lines: rows.last().map_or(0, |r| r.line as usize) };
    if let Some((names, _)) = asked_names(grid, wish)? {
        return runs.iter().position(|r| r.data[0] > names).ok_or_else(none);
    }
    let mut longest: Option<usize> = None;
    for (i, run) in runs.iter().enumerate() {
        let wide = run.data.iter().any(|r| rows[*r].width() > 1);
        if wide && longest.is_none_or(|l| run.data.len() > runs[l].data.len()) {
            longest = Some(i);
        }
    }
    longest.ok_or_else(none)
}

/// Rows of names and units that were asked for by their lines.
fn asked_names(grid: &Grid, wish: &Override) -> Result<Option<(usize, Option<usize>)>, ExportError> {
    let find = |key: &str, line: u64| {
        grid.rows.iter().position(|r| r.line == line).ok_or_else(|| ExportError::Override {
            file: grid.file(),
            reason: format!("{key} = {line}, and that line is blank or not there"),
            nearest: None,
        })
    };
    let Some(names) = wish.names_line else { return Ok(None) };
    let units = wish.units_line.map(|line| find("units_line", line)).transpose()?;
    Ok(Some((find("names_line", names)?, units)))
}

/// The rows of names and units right above a run.
fn names_above(rows: &[Row], above: &[usize]) -> Option<(usize, Option<usize>)> {
    // Lines of dashes and labels of specimens may stand between names and numbers.
    let between = |r: &usize| is_rule(&rows[*r]) || rows[*r].counts().1 == 1;
    let mut candidates = above.iter().rev().copied().filter(|r| !between(r));
    let lowest = candidates.next().filter(|r| is_names(&rows[*r]))?;
    if is_units(&rows[lowest])
        && let Some(names) = candidates.next().filter(|r| is_names(&rows[*r]))
    {
        return Some((names, Some(lowest)));
    }
    Some((lowest, None))
}

/// A line of dashes.
fn is_rule(row: &Row) -> bool {
    let dashes = |c: &Cell| c.text.len() > 2 && c.text.chars().all(|c| matches!(c, '-' | '=' | '_' | '—'));
    row.cells.iter().all(|c| c.is_empty() || dashes(c))
}

fn is_names(row: &Row) -> bool {
    let (numbers, filled) = row.counts();
    filled > 1 && 2 * numbers < filled
}

fn is_units(row: &Row) -> bool {
    let filled: Vec<&Cell> = row.cells.iter().filter(|c| !c.is_empty()).collect();
    let known = filled.iter().filter(|c| unit::parse(&c.text).is_some()).count();
    let bracketed = filled.iter().filter(|c| unit::bare(&c.text).len() < c.text.len()).count();
    known > 0 && 2 * known >= filled.len() || bracketed == filled.len() && !filled.is_empty()
}

fn same_names(a: &Row, b: &Row) -> bool {
    let texts =
        |row: &Row| row.cells[..row.width()].iter().map(|c| c.text.to_lowercase()).collect::<Vec<_>>();
    texts(a) == texts(b)
}

#[cfg(test)]
mod tests {
    use super::super::cells;
    use super::*;
    use std::path::Path;

    fn layout(text: &str) -> Result<Layout, ExportError> {
        find(&cells::split(Path::new("a.csv"), text, None)?, &Override::default())
    }

    #[test]
    fn preamble_names_units_and_results() {
        let text = "Machine,X\nResult,Max\n1,5\n2,6\n\nTime,Load\n(s),(N)\n0,1\n1,2\n2,3\n\nMaximum,3\n";
        let layout = layout(text).expect("a table");
        assert_eq!((layout.names, layout.units, layout.width), (4, Some(5), 2));
        assert_eq!(layout.blocks, [Block { data: vec![6, 7, 8], before: vec![] }]);
        assert_eq!(layout.after, [9]);
        assert!(layout.aside[0].contains("lines 3 to 4"), "{:?}", layout.aside);
    }

    #[test]
    fn repeated_names_are_specimens() {
        for between in ["Specimen 2\nt,F\n", "t,F\n", "Specimen 2\n", "Results\nA,B\n1,2\nt,F\n"] {
            let layout =
                layout(&format!("Specimen 1\nt,F\n0,1\n1,2\n2,3\n{between}0,1\n1,3\n")).expect("tables");
            assert_eq!(layout.blocks.len(), 2, "{between:?}");
            assert_eq!(layout.blocks[1].data.len(), 2, "{between:?}");
        }
    }

    #[test]
    fn what_is_no_table_is_refused_with_its_place() {
        for (text, words) in [
            ("a\nb\n", "no table in its 2 lines"),
            ("t,F\n0,1\n", "line 2: the table has 1 row"),
            ("0,1\n1,2\n", "line 1: the numbers begin here, and no names"),
            ("t,F\n0,1\n1,oops\n2,3\n3,4\n", "line 3, column 2 (F): \"oops\""),
            ("t,F\n0,1\n1,2\nx,1\n2,3\n", "line 4, column 1 (t): \"x\""),
            ("t,F\n0,1\n1,2,3\n2,3\n", "line 3: 3 fields where the names are 2"),
            ("t,F,u\n0,1,1\n1,2\n2,3,4\n", "line 3: 2 fields where the names are 3"),
            ("t,F\n0,1,0,2\n0,2,0,3\n", "decimal sign a comma too"),
        ] {
            let error = layout(text).expect_err(text).to_string();
            assert!(error.contains(words), "{text:?}: {error}");
        }
    }

    #[test]
    fn a_last_line_that_was_cut_off_is_left_out() {
        let layout = layout("t,F,u\n0,1,2\n1,2,3\n2,3").expect("a table");
        assert_eq!(layout.blocks[0].data.len(), 2);
        assert!(layout.aside[0].contains("line 4: cut off"), "{:?}", layout.aside);
    }
}
