//! Exports of universal testing machines → tables in SI: time, extension, force, stress and strain of each specimen.
//!
//! Bytes → `encoding` → text → `cells` → rows → `layout` → names, units and data → `plan` and `style` → columns and numbers →
//! `build` → tables → `coherence` and `sense` → units and signs that the numbers bear out. Workbooks enter at the rows.
//!
//! | question | answer |
//! | --- | --- |
//! | what does this file, or this folder, hold? | [`read_file`], [`read_folder`] → [`Export`], a [`Table`] a specimen |
//! | how was it understood? | print the [`Export`]: each [`Decision`] with what shows it, each [`Finding`] |
//! | stress and strain in SI? | [`Table::series`] |
//! | what if it was understood wrongly? | an [`Override`] |
//!
//! Nothing is guessed: a number that may be 1.234 or 1234 is refused, a unit that the numbers contradict is named and gives no SI values
//! until a person says the true one. Nothing is written.

mod build;
mod cells;
mod clock;
mod coherence;
mod dialect;
mod encoding;
mod error;
mod facts;
mod finding;
mod heading;
mod layout;
mod number;
mod overrides;
mod plan;
mod quantity;
mod ratio;
mod read;
mod report;
mod sense;
mod sizes;
mod source;
mod style;
mod table;
#[cfg(test)]
mod tests;
mod unit;
mod vocabulary;
mod workbook;

pub use dialect::{Decision, Dialect};
pub use error::{ExportError, Origin, Place};
pub use facts::{Fact, Loading, Specimen};
pub use finding::{Finding, Weight};
pub use number::NumberStyle;
pub use overrides::{ColumnOverride, Override, Pull, SpecimenOverride, TimeStyle};
pub use quantity::{Quantity, StrainSource};
pub use read::{Export, Folder, read_bytes, read_file, read_folder};
pub use source::Source;
pub use table::{Column, Series, Table, UnitRead, UnitSource};
pub use unit::{Dimension, Unit};
