//! What a person should see of a calibrated instrument, and of a fit beside its reference: a sentence, tables, plots. One file that needs
//! nothing but itself.

mod comparison;
mod force;
mod sheet;
mod specimen;
mod stage;

pub use comparison::comparison_page;
pub use force::force_page;
pub use specimen::{Curve, SpecimenTable, specimen_page};
pub use stage::stage_page;
