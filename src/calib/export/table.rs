//! The table of one specimen: columns with what they hold, their units and where each row stands in the file.
//!
//! Signs: a pull and a lengthening are positive. Absent cells are absent: a column knows which rows it has values for.

use super::ExportError;
use super::error::Place;
use super::facts::{Fact, Loading, Specimen};
use super::finding::Finding;
use super::quantity::{Quantity, StrainSource};
use super::unit::Unit;

/// Where a unit comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum UnitSource {
    /// The file names it.
    Stated,
    /// The person who reads the file says it.
    Asked,
    /// The file names none; other columns show it, in these words.
    Shown(String),
}

/// What a column's unit is.
#[derive(Debug, Clone, PartialEq)]
pub enum UnitRead {
    /// Known.
    Known(Unit, UnitSource),
    /// Not named, or not in a way that is known: in which words.
    Open(String),
    /// Named, and contradicted by the numbers: in which words.
    Contradicted(Unit, String),
}

/// One column.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Heading as it is written.
    pub heading: String,
    /// Name without the unit.
    pub name: String,
    /// Place of the heading.
    pub place: Place,
    /// What it holds.
    pub quantity: Quantity,
    /// It holds a few values of another column, such as peaks: never taken for that one.
    pub extreme: bool,
    /// Its unit.
    pub unit: UnitRead,
    /// Where a strain or an extension was measured, if the file says so.
    pub source: Option<StrainSource>,
    /// Values as printed, but for the sign where [`Column::turned`] says so.
    pub printed: Vec<f64>,
    /// Row of the table of each value, from 0.
    pub rows: Vec<usize>,
    /// The sign was turned, so that a pull is positive.
    pub turned: bool,
}

impl Column {
    /// The values in SI, unless the unit is open or contradicted.
    pub fn si(&self) -> Option<Vec<f64>> {
        let UnitRead::Known(unit, _) = &self.unit else { return None };
        Some(self.printed.iter().map(|v| unit.to_si(*v)).collect())
    }

    /// The values in SI.
    ///
    /// # Errors
    /// [`ExportError::UnitOpen`], [`ExportError::UnitContradicted`].
    pub fn si_or_why(&self) -> Result<Vec<f64>, ExportError> {
        let (place, name) = (self.place.clone(), self.heading.clone());
        match &self.unit {
            UnitRead::Open(what) => Err(ExportError::UnitOpen { place, name, what: what.clone() }),
            UnitRead::Contradicted(_, what) => {
                Err(ExportError::UnitContradicted { place, name, what: what.clone() })
            }
            UnitRead::Known(unit, _) => Ok(self.printed.iter().map(|v| unit.to_si(*v)).collect()),
        }
    }
}

/// Columns side by side, in SI.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Line of the file of each row.
    pub lines: Vec<u64>,
    /// One list a quantity, in the order asked for.
    pub values: Vec<Vec<f64>>,
}

/// The rows of one specimen.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// How the file calls the specimen; empty where it holds one only.
    pub label: String,
    /// Line of the names.
    pub place: Place,
    /// All columns, in the order of the file.
    pub columns: Vec<Column>,
    /// Line of the file of each row.
    pub lines: Vec<u64>,
    /// What stands beside the table.
    pub facts: Vec<Fact>,
    /// What that says of the specimen.
    pub specimen: Specimen,
    /// How the specimen was loaded, if words say so.
    pub loading: Option<Loading>,
    /// What was noticed.
    pub findings: Vec<Finding>,
}

impl Table {
    /// All columns of a quantity, but for those of peaks and those without numbers.
    pub fn all(&self, quantity: Quantity) -> impl Iterator<Item = &Column> {
        self.columns.iter().filter(move |c| c.quantity == quantity && !c.extreme && !c.printed.is_empty())
    }

    /// The column of a quantity: the first of those that hold the same. Extensions may begin elsewhere; a column that stands still beside
    /// one that does not is passed over.
    ///
    /// # Errors
    /// [`ExportError::NoColumn`], or [`ExportError::TwoColumns`] when several differ.
    pub fn column(&self, quantity: Quantity) -> Result<&Column, ExportError> {
        let moves = |c: &&Column| c.printed.iter().any(|v| *v != c.printed[0]);
        let any_moves = self.all(quantity).any(|c| moves(&c));
        let mut found = self.all(quantity).filter(|c| !any_moves || moves(c));
        let first = found.next().ok_or_else(|| ExportError::NoColumn {
            place: self.place.clone(),
            quantity,
            found: self.columns.iter().map(|c| format!("{:?}", c.heading)).collect(),
        })?;
        let offset = quantity == Quantity::Extension;
        let differs = |other: &&Column| other.rows != first.rows || !alike(other.si(), first.si(), offset);
        match found.find(differs) {
            None => Ok(first),
            Some(second) => Err(ExportError::TwoColumns {
                place: second.place.clone(),
                quantity,
                first: first.heading.clone(),
                second: second.heading.clone(),
            }),
        }
    }

    /// Several quantities in SI, in the rows that have all of them.
    ///
    /// # Errors
    /// As [`Table::column`] and [`Column::si_or_why`].
    pub fn series(&self, quantities: &[Quantity]) -> Result<Series, ExportError> {
        let mut wanted = Vec::with_capacity(quantities.len());
        let mut have = vec![0; self.lines.len()];
        for quantity in quantities {
            let column = self.column(*quantity)?;
            let values = column.si_or_why()?;
            let mut by_row = vec![None; self.lines.len()];
            for (row, value) in column.rows.iter().zip(values) {
                by_row[*row] = Some(value);
                have[*row] += 1;
            }
            wanted.push(by_row);
        }
        let full = |row: usize| have[row] == quantities.len();
        let pick = |by_row: &Vec<Option<f64>>| {
            (0..by_row.len()).filter(|r| full(*r)).filter_map(|r| by_row[r]).collect()
        };
        Ok(Series {
            lines: (0..self.lines.len()).filter(|r| full(*r)).map(|r| self.lines[r]).collect(),
            values: wanted.iter().map(pick).collect(),
        })
    }
}

/// Whether two columns hold the same but for what rounding did to one of them, and for where they begin if `offset` says so.
fn alike(a: Option<Vec<f64>>, b: Option<Vec<f64>>, offset: bool) -> bool {
    let (Some(a), Some(b)) = (a, b) else { return false };
    let start = |v: &[f64]| if offset { v.first().copied().unwrap_or(0.0) } else { 0.0 };
    let (from_a, from_b) = (start(&a), start(&b));
    let largest = a.iter().fold(0.0, |m: f64, v| m.max((v - from_a).abs()));
    a.len() == b.len() && a.iter().zip(&b).all(|(a, b)| ((a - from_a) - (b - from_b)).abs() <= 1e-3 * largest)
}
