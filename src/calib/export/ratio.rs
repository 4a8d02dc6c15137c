//! Is one column a constant multiple of another, and which unit would make it the right one?

use super::finding::Finding;
use super::quantity::Quantity;
use super::table::{Column, Table, UnitRead, UnitSource};
use super::unit::{self, Unit};

/// Printed digits leave this much between columns of the same quantity.
pub(super) const SAME: f64 = 2e-3;
/// Sizes of specimens are measured to this share.
pub(super) const SIZES: f64 = 0.02;
/// Gauge lengths and speeds hold to this share.
pub(super) const LENGTHS: f64 = 0.05;
/// A ratio is constant if what a straight line leaves is less than this share of the range (root mean square).
pub(super) const STRAIGHT: f64 = 2e-3;

/// Columns of a quantity that have numbers, without peaks.
pub(super) fn held(table: &Table, quantity: Quantity) -> Vec<usize> {
    let fits = |c: &Column| c.quantity == quantity && !c.extreme && c.printed.len() > 2;
    (0..table.columns.len()).filter(|i| fits(&table.columns[*i])).collect()
}

pub(super) fn known(column: &Column) -> Option<Unit> {
    match &column.unit {
        UnitRead::Known(unit, _) => Some(*unit),
        _ => None,
    }
}

/// The slope of y over x, both as printed, if it is constant; columns with the same rows only.
pub(super) fn slope(x: &Column, y: &Column) -> Option<f64> {
    (x.rows == y.rows).then(|| straight(&x.printed, &y.printed)).flatten()
}

pub(super) fn straight(x: &[f64], y: &[f64]) -> Option<f64> {
    let n = x.len() as f64;
    let (mean_x, mean_y) = (x.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
    let (mut xx, mut xy) = (0.0, 0.0);
    for (x, y) in x.iter().zip(y) {
        xx += (x - mean_x).powi(2);
        xy += (x - mean_x) * (y - mean_y);
    }
    let slope = xy / xx;
    let left = x.iter().zip(y).map(|(x, y)| (y - mean_y - slope * (x - mean_x)).powi(2)).sum::<f64>();
    let range = y.iter().copied().fold(f64::MIN, f64::max) - y.iter().copied().fold(f64::MAX, f64::min);
    (slope.is_normal() && (left / n).sqrt() < STRAIGHT * range).then_some(slope)
}

/// Marks a unit as contradicted unless a person said it.
pub(super) fn contradict(column: &mut Column, what: &str) {
    if let UnitRead::Known(unit, UnitSource::Stated | UnitSource::Shown(_)) = column.unit {
        column.unit = UnitRead::Contradicted(unit, what.to_owned());
    }
}

pub(super) fn show(column: &mut Column, unit: Unit, why: String) {
    column.unit = UnitRead::Known(unit, UnitSource::Shown(why));
}

/// Takes an open unit from its factor, if one unit has that.
pub(super) fn shown_by(table: &mut Table, at: usize, factor: f64, tolerance: f64, why: &str) {
    let column = &mut table.columns[at];
    let open = matches!(column.unit, UnitRead::Open(_));
    let Some(dimension) = column.quantity.dimension().filter(|_| open) else { return };
    if let Some(unit) = unit::of_factor(dimension, factor, tolerance) {
        show(column, unit, format!("{} fits {why}", unit.name));
        let text = format!("{}: no unit is given; {} fits {why}", column.heading, unit.name);
        table.findings.push(Finding::note(column.place.clone(), text));
    }
}

/// Which other unit of either column would set a ratio right that is `off` times what it should be; none where no unit does.
pub(super) fn disagreement(
    x: &Column,
    y: &Column,
    u: Unit,
    v: Unit,
    off: f64,
    tolerance: f64,
) -> Option<String> {
    let fit = |column: &Column, unit: Unit, factor: f64| {
        let other = unit::of_factor(unit.dimension, factor, tolerance)?;
        Some(format!("{} would fit in {}", column.heading, other.name))
    };
    let fits: Vec<String> =
        [fit(x, u, u.factor * off), fit(y, v, v.factor / off)].into_iter().flatten().collect();
    (!fits.is_empty()).then(|| format!("; {}", fits.join(", or ")))
}
