//! What will each column be? Rows of names and units → name, quantity and unit of every column, wishes included.

use super::ExportError;
use super::cells::{Cell, Grid};
use super::error::Place;
use super::heading::{self, Heading};
use super::layout::Layout;
use super::number;
use super::overrides::Override;
use super::quantity::{self, Quantity, StrainSource};
use super::table::{UnitRead, UnitSource};
use super::unit::{self, Dimension};

/// A column before its numbers are read.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Plan {
    pub(super) heading: String,
    pub(super) name: String,
    pub(super) place: Place,
    /// Number of the column, from 0.
    pub(super) at: usize,
    pub(super) quantity: Quantity,
    pub(super) extreme: bool,
    pub(super) unit: UnitRead,
    pub(super) source: Option<StrainSource>,
    /// Its cells are text.
    pub(super) is_text: bool,
}

/// Plans all columns but those that are to be ignored.
pub(super) fn columns(grid: &Grid, layout: &Layout, wish: &Override) -> Result<Vec<Plan>, ExportError> {
    let mut plans = Vec::with_capacity(layout.width);
    let mut wished: Vec<&str> = Vec::new();
    for at in 0..layout.width {
        let blank = |row: usize| grid.rows[row].cells.get(at).is_none_or(Cell::is_empty);
        if blank(layout.names) && layout.blocks.iter().flat_map(|b| &b.data).all(|r| blank(*r)) {
            continue;
        }
        let plan = column(grid, layout, wish, at)?;
        let asked = wish.of(&plan.heading, &plan.name);
        wished.extend(
            [plan.heading.as_str(), plan.name.as_str()]
                .map(|n| wish.column.get_key_value(n))
                .iter()
                .flatten()
                .map(|(k, _)| k.as_str()),
        );
        if !asked.is_some_and(|a| a.ignore) {
            plans.push(plan);
        }
    }
    if let Some(unknown) = wish.column.keys().find(|k| !wished.contains(&k.as_str())) {
        let alike = |p: &&Plan| (1e6 * strsim::jaro_winkler(unknown, &p.heading)) as u64;
        return Err(ExportError::Override {
            file: grid.file(),
            reason: format!("[column.{unknown:?}] names no column of this export"),
            nearest: plans.iter().max_by_key(alike).map(|p| format!("[column.{:?}]", p.heading)),
        });
    }
    by_unit(&mut plans);
    Ok(plans)
}

fn column(grid: &Grid, layout: &Layout, wish: &Override, at: usize) -> Result<Plan, ExportError> {
    let text = |row: usize| grid.rows[row].cells.get(at).map_or("", |c| c.text.as_str());
    let written = text(layout.names).to_owned();
    let heading = if written.is_empty() { format!("column {}", at + 1) } else { written };
    let Heading { name, unit: in_heading, unit_text } = heading::read(&heading);
    let row_text = layout.units.map_or("", |row| unit::bare(text(row)));
    let in_row = unit::parse(row_text);
    let asked = wish.unit_of(&heading, &name);
    if let (None, Some(a), Some(b), Some(row)) = (asked, in_heading, in_row, layout.units)
        && a != b
    {
        let in_row = row_text.to_owned();
        return Err(ExportError::TwoUnits {
            place: grid.place(row, at),
            heading,
            in_heading: unit_text,
            in_row,
        });
    }
    let meaning = quantity::meaning(&name);
    let unit = match (asked, in_heading.or(in_row)) {
        (Some(unit), _) => UnitRead::Known(unit, UnitSource::Asked),
        (None, Some(unit)) => UnitRead::Known(unit, UnitSource::Stated),
        (None, None) if meaning.quantity == Quantity::Cycle => {
            UnitRead::Known(unit::PLAIN_RATIO, UnitSource::Shown("a count".to_owned()))
        }
        (None, None) if row_text.is_empty() => UnitRead::Open("no unit is given that is known".to_owned()),
        (None, None) => UnitRead::Open(format!("the unit {row_text:?} is not known")),
    };
    let dimension = match &unit {
        UnitRead::Known(unit, _) => Some(unit.dimension),
        _ => None,
    };
    let asked_quantity = wish.of(&heading, &name).and_then(|w| w.quantity);
    let quantity = asked_quantity.unwrap_or(match (meaning.quantity, dimension) {
        (_, Some(Dimension::Ratio)) if meaning.length_or_ratio => Quantity::Strain,
        (q, Some(d)) if meaning.by_letter && q.dimension() != Some(d) => Quantity::Other,
        // "Cycle time", "strain gauge (mV)": a rate or a count with another unit is something else.
        (Quantity::Cycle, Some(d)) if d != Dimension::Ratio => Quantity::Other,
        (q, _) => q,
    });
    let strains = matches!(quantity, Quantity::Strain | Quantity::TrueStrain | Quantity::Extension);
    let source = quantity::strain_source(&name).filter(|_| strains);
    let extreme = quantity::is_extreme(&name);
    let is_text = is_text(grid, layout, at);
    Ok(Plan {
        place: grid.place(layout.names, at),
        heading,
        name,
        at,
        quantity,
        extreme,
        unit,
        source,
        is_text,
    })
}

/// Whether most cells of the column are text.
fn is_text(grid: &Grid, layout: &Layout, at: usize) -> bool {
    let cells = layout.blocks.iter().flat_map(|b| &b.data).filter_map(|r| grid.rows[*r].cells.get(at));
    let (mut numbers, mut texts) = (0_usize, 0_usize);
    for cell in cells.filter(|c| !number::is_absent(&c.text)) {
        *if cell.is_number() { &mut numbers } else { &mut texts } += 1;
    }
    texts > numbers
}

/// What no name tells, a unit may: the only column in newtons holds the force.
fn by_unit(plans: &mut [Plan]) {
    for quantity in [Quantity::Time, Quantity::Force, Quantity::Stress, Quantity::Extension] {
        let known = plans.iter().any(|p| p.quantity == quantity && !p.extreme);
        let fits = |p: &Plan| match &p.unit {
            UnitRead::Known(unit, _) => quantity.dimension() == Some(unit.dimension),
            _ => false,
        };
        let spare = |p: &Plan| p.quantity == Quantity::Other && !p.extreme && fits(p);
        let unnamed: Vec<usize> = (0..plans.len()).filter(|i| spare(&plans[*i])).collect();
        if let ([only], false) = (unnamed.as_slice(), known) {
            plans[*only].quantity = quantity;
        }
    }
}

/// Columns that repeat the same headings stand for specimens side by side: how many columns each has.
pub(super) fn period(plans: &[Plan]) -> usize {
    let divides = |p: &usize| plans.len().is_multiple_of(*p);
    let repeats = |p: &usize| (0..plans.len() - p).all(|i| plans[i].heading == plans[i + p].heading);
    (2..=plans.len() / 2).filter(divides).find(repeats).unwrap_or(plans.len())
}
