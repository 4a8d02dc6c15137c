//! Blocks of rows → one table a specimen: numbers read, absent cells left out, times checked.

use super::ExportError;
use super::cells::{Cell, Grid, Row};
use super::clock::{self, Printed};
use super::coherence;
use super::error::Place;
use super::facts::{self, Fact};
use super::finding::Finding;
use super::layout::Layout;
use super::number::{self, NumberStyle};
use super::overrides::Override;
use super::plan::{self, Plan};
use super::quantity::Quantity;
use super::sense;
use super::table::{Column, Table, UnitRead, UnitSource};
use super::unit;

/// Everything that the tables of a sheet are built from.
pub(super) struct Parts<'a> {
    pub(super) grid: &'a Grid,
    pub(super) layout: &'a Layout,
    pub(super) plans: &'a [Plan],
    pub(super) style: NumberStyle,
    pub(super) wish: &'a Override,
}

impl Parts<'_> {
    /// Builds all tables of the sheet.
    pub(super) fn tables(&self) -> Result<Vec<Table>, ExportError> {
        let mut tables = Vec::new();
        let period = plan::period(self.plans).max(1);
        let common = self.layout.blocks.first().map_or_else(Vec::new, |b| self.facts(&b.before));
        for (number, block) in self.layout.blocks.iter().enumerate() {
            let mut facts = if number > 0 { self.facts(&block.before) } else { Vec::new() };
            facts.extend(common.iter().cloned());
            if number + 1 == self.layout.blocks.len() {
                facts.extend(self.facts(&self.layout.after));
            }
            for (rows, label) in self.specimens(&block.data) {
                for (side, plans) in self.plans.chunks(period).enumerate() {
                    let mut table = self.table(&rows, plans, &facts)?;
                    table.label.clone_from(&label);
                    let sides = self.plans.len() / period;
                    if table.label.is_empty() && self.layout.blocks.len() * sides > 1 {
                        table.label = (number * sides + side + 1).to_string();
                    }
                    tables.push(table);
                }
            }
        }
        for table in &mut tables {
            coherence::check(table);
            sense::settle(table, self.wish.pull);
        }
        Ok(tables)
    }

    fn facts(&self, rows: &[usize]) -> Vec<Fact> {
        facts::read(rows.iter().map(|r| &self.grid.rows[*r]), self.style, self.grid.delimiter)
    }

    /// Rows by what the column of specimens says, in the order in which they come.
    fn specimens(&self, data: &[usize]) -> Vec<(Vec<usize>, String)> {
        let Some(plan) = self.plans.iter().find(|p| p.quantity == Quantity::Specimen) else {
            return vec![(data.to_vec(), String::new())];
        };
        let mut groups: Vec<(Vec<usize>, String)> = Vec::new();
        for &row in data {
            let label = &self.grid.rows[row].cells[plan.at].text;
            match groups.iter_mut().find(|(_, l)| l == label) {
                Some((rows, _)) => rows.push(row),
                None => groups.push((vec![row], label.clone())),
            }
        }
        groups
    }

    fn table(&self, rows: &[usize], plans: &[Plan], facts: &[Fact]) -> Result<Table, ExportError> {
        let cell = |row: usize, plan: &Plan| &self.grid.rows[row].cells[plan.at];
        let filled = |row: &usize| {
            plans.iter().any(|p| !number::is_absent(&cell(*row, p).text) || cell(*row, p).number.is_some())
        };
        let rows: Vec<usize> = rows.iter().copied().filter(filled).collect();
        let headings: Vec<String> = plans.iter().map(|p| p.heading.clone()).collect();
        let place = Place {
            column: 0,
            ..plans.first().map_or_else(|| self.grid.line(self.layout.names), |p| p.place.clone())
        };
        let mut table = Table {
            label: String::new(),
            place,
            columns: Vec::with_capacity(plans.len()),
            lines: rows.iter().map(|r| self.grid.rows[*r].line).collect(),
            facts: facts.to_vec(),
            specimen: facts::specimen(facts, &self.wish.specimen),
            loading: facts::loading(facts, &headings),
            findings: Vec::new(),
        };
        let said = facts::strain_source(facts);
        for plan in plans {
            let (at, mut printed) = self.values(&rows, plan)?;
            if plan.quantity == Quantity::Time && !plan.extreme && !printed.is_empty() {
                let times: Vec<Printed> = (at.iter().zip(&printed))
                    .map(|(i, value)| Printed {
                        text: cell(rows[*i], plan).text.clone(),
                        value: *value,
                        place: self.grid.place(rows[*i], plan.at),
                    })
                    .collect();
                let read = clock::check(&times, &plan.heading, self.style.decimal, self.wish.time)?;
                table.findings.extend(read.note.map(|note| Finding::note(plan.place.clone(), note)));
                printed = read.values;
            }
            let clock = rows.first().is_some_and(|r| number::is_clock(&cell(*r, plan).text));
            let open = matches!(plan.unit, UnitRead::Open(_)) && plan.quantity == Quantity::Time;
            let seconds =
                UnitRead::Known(unit::SECOND, UnitSource::Shown("hours, minutes and seconds".to_owned()));
            table.columns.push(Column {
                heading: plan.heading.clone(),
                name: plan.name.clone(),
                place: plan.place.clone(),
                quantity: plan.quantity,
                extreme: plan.extreme,
                unit: if clock && open { seconds } else { plan.unit.clone() },
                source: plan.source.or(said.filter(|_| plan.quantity == Quantity::Strain)),
                printed,
                rows: at,
                turned: false,
            });
        }
        Ok(table)
    }

    /// The numbers of a column with the rows that have them.
    fn values(&self, rows: &[usize], plan: &Plan) -> Result<(Vec<usize>, Vec<f64>), ExportError> {
        let (mut at, mut printed) = (Vec::with_capacity(rows.len()), Vec::with_capacity(rows.len()));
        if plan.is_text {
            return Ok((at, printed));
        }
        for (i, &row) in rows.iter().enumerate() {
            let Row { cells, .. } = &self.grid.rows[row];
            let Cell { text, number } = &cells[plan.at];
            if number.is_none() && number::is_absent(text) {
                continue;
            }
            let value = number.or_else(|| number::value(text, self.style));
            let (place, name, text) = (self.grid.place(row, plan.at), plan.heading.clone(), text.clone());
            match value {
                None => {
                    let decimal = Some(self.style.decimal);
                    return Err(ExportError::TextInNumbers { place, name, text, decimal });
                }
                Some(value) if !value.is_finite() => {
                    return Err(ExportError::NotFinite { place, name, text });
                }
                Some(value) => {
                    at.push(i);
                    printed.push(value);
                }
            }
        }
        Ok((at, printed))
    }
}
