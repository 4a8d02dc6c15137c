//! The page of a specimen: what was found, its tables, measured and modelled curves.

use super::sheet::{Decades, Plot, Sheet, Trace};
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

/// The page. `axes`: words across and up, with units; `decades`: across in decades, for points above zero.
///
/// # Errors
/// [`ReportError::Json`].
pub fn specimen_page(
    [title, source, sentence]: [&str; 3],
    remarks: &[String],
    tables: &[SpecimenTable],
    axes: [&'static str; 2],
    decades: bool,
    curves: &[Curve],
) -> Result<String, ReportError> {
    let mut sheet = Sheet::default();
    if !remarks.is_empty() {
        sheet.list("Before trusting the figures", remarks);
    }
    let traces = curves.iter().map(|curve| {
        let (x, y) = thinned(&curve.points, decades).into_iter().unzip();
        Trace { name: curve.name.clone(), x, y, sd: None, line: curve.line }
    });
    let note = "Dots are measured, lines are modelled.";
    let traces = traces.collect();
    let decades = if decades { Decades::Across } else { Decades::None };
    sheet.plot(Plot { title: "Measured and modelled", note, across: axes[0], up: axes[1], decades, traces });
    for table in tables {
        sheet.table(table.title, &table.head, &table.rows, table.note);
    }
    sheet.page(title, source, sentence, remarks.is_empty())
}

/// About so many points, evenly by their number, or evenly in decades.
fn thinned(points: &[(f64, f64)], decades: bool) -> Vec<(f64, f64)> {
    let above = points.iter().copied().filter(|p| !decades || p.0 > 0.0);
    if !decades {
        return above.step_by(points.len().div_ceil(POINTS).max(1)).collect();
    }
    let above: Vec<(f64, f64)> = above.collect();
    let (Some(first), Some(last)) = (above.first(), above.last()) else { return above };
    let step = (last.0 / first.0).ln() / POINTS as f64;
    let mut next = f64::NEG_INFINITY;
    let mut kept = Vec::new();
    for (k, point) in above.iter().enumerate() {
        // What happens fast late, such as the way back, is kept: a point that differs from the last one kept.
        let place = point.0.ln();
        let moved = kept.last().is_some_and(|last: &(f64, f64)| {
            (last.1 - point.1).abs() > 0.02 * first.1.abs().max(last.1.abs())
        });
        if place >= next || moved || k + 1 == above.len() {
            kept.push(*point);
            next = place + step;
        }
    }
    kept
}
