//! What was inferred of an export, and from what: one line a decision, to be read by a person.

use super::cells::{Grid, delimiter_name};
use super::layout::Layout;
use super::number::NumberStyle;
use std::fmt;

/// One decision.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Decision {
    /// About what; the key of the override where there is one.
    pub about: &'static str,
    /// What was taken.
    pub taken: String,
    /// What shows it.
    pub why: String,
}

/// All decisions about a sheet.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Dialect {
    /// The sheet, in a workbook.
    pub sheet: Option<String>,
    /// In the order in which they were made.
    pub decisions: Vec<Decision>,
}

impl Dialect {
    pub(super) fn add(&mut self, about: &'static str, taken: impl Into<String>, why: impl Into<String>) {
        self.decisions.push(Decision { about, taken: taken.into(), why: why.into() });
    }

    /// Decisions about where things stand.
    pub(super) fn add_layout(&mut self, grid: &Grid, layout: &Layout, style: NumberStyle, why: String) {
        if let Some(delimiter) = grid.delimiter {
            self.add("delimiter", delimiter_name(delimiter), grid.why.clone());
        }
        self.add("decimal", format!("{:?}", style.decimal), why);
        if let Some(thousands) = style.thousands {
            self.add("thousands", format!("{thousands:?}"), "the other sign separates decimals");
        }
        let line = |row: usize| grid.rows[row].line.to_string();
        self.add("names_line", line(layout.names), format!("{} columns", layout.width));
        match layout.units {
            Some(row) => self.add("units_line", line(row), "a row of units below the names"),
            None => self.add("units_line", "none", "units stand in the names, if anywhere"),
        }
        for block in &layout.blocks {
            if let (Some(first), Some(last)) = (block.data.first(), block.data.last()) {
                let rows = format!("{} rows of numbers", block.data.len());
                self.add("data", format!("lines {} to {}", line(*first), line(*last)), rows);
            }
        }
        for aside in &layout.aside {
            self.add("left out", aside.clone(), "not part of the table");
        }
        let last = grid.rows.last().and_then(|row| row.cells.last());
        if grid.open_end && last.is_some_and(|cell| cell.is_number()) {
            self.add("end", "open", "the last line has no end: its last number may have been cut off");
        }
    }
}

impl fmt::Display for Dialect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(sheet) = &self.sheet {
            writeln!(f, "  sheet {sheet:?}")?;
        }
        for Decision { about, taken, why } in &self.decisions {
            writeln!(f, "  {about:<10} {taken}  ({why})")?;
        }
        Ok(())
    }
}
