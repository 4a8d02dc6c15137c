//! The page of a specimen: what was found, its tables, measured and modelled curves.

use super::sheet::{Plot, Sheet, Trace};
use crate::report::ReportError;

/// Points of a curve are thinned to about so many.
const POINTS: usize = 1_500;

/// A table of such a page; the first column heads its rows.
#[derive(Debug, Clone, PartialEq)]
pub struct SpecimenTable {
    /// Above it.
    pub title: &'static str,
    /// Names of columns.
    pub head: Vec<&'static str>,
    /// Cells.
    pub rows: Vec<Vec<String>>,
    /// Below it.
    pub note: &'static str,
}

/// A curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// In the legend.
    pub name: String,
    /// Across and up.
    pub points: Vec<(f64, f64)>,
    /// Drawn as a line: modelled.
    pub line: bool,
}

/// The page. `axes`: words across and up, with units; `log`: across and up in decades.
///
/// # Errors
/// [`ReportError::Json`].
pub fn specimen_page(
    [title, source, sentence]: [&str; 3],
    remarks: &[String],
    tables: &[SpecimenTable],
    axes: [&'static str; 2],
    log: bool,
    curves: &[Curve],
) -> Result<String, ReportError> {
    let mut sheet = Sheet::default();
    if !remarks.is_empty() {
        sheet.list("Before trusting the figures", remarks);
    }
    let traces = curves.iter().map(|curve| {
        let step = curve.points.len().div_ceil(POINTS).max(1);
        let (x, y) = curve.points.iter().step_by(step).copied().unzip();
        Trace { name: curve.name.clone(), x, y, sd: None, line: curve.line }
    });
    let note = "Dots are measured, lines are modelled.";
    let traces = traces.collect();
    sheet.plot(Plot { title: "Measured and modelled", note, across: axes[0], up: axes[1], log, traces });
    for table in tables {
        sheet.table(table.title, &table.head, &table.rows, table.note);
    }
    sheet.page(title, source, sentence, remarks.is_empty())
}
