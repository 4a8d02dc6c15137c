//! Is a pull positive? A table as the file has it → forces and stresses that are positive where the specimen is pulled.
//!
//! Whoever stretches a body works on it: force and lengthening grow together. Where they grow against each other one of the two has the
//! other sign; a lengthening or a gap is believed, the force is turned. Where both are negative, numbers cannot tell a pull that is
//! written negative from a compression; words may.

use super::facts::Loading;
use super::finding::Finding;
use super::overrides::Pull;
use super::quantity::Quantity;
use super::table::{Column, Table};

/// Share of the work, from −1 to 1, from which on its sign is believed.
const SURE: f64 = 0.5;

const FORCES: [Quantity; 3] = [Quantity::Force, Quantity::Stress, Quantity::TrueStress];
const LENGTHS: [Quantity; 4] = [Quantity::Extension, Quantity::Gap, Quantity::Strain, Quantity::TrueStrain];

/// Turns what is negative for a pull, and says so.
pub(super) fn settle(table: &mut Table, wish: Option<Pull>) {
    match wish {
        Some(Pull::Positive) => {}
        Some(Pull::Negative) => turn(table, &FORCES, "a pull is negative in the file, as was said"),
        None => by_work(table),
    }
    if wish.is_some() || !falls(table, &LENGTHS) || !falls(table, &FORCES) {
        return;
    }
    match table.loading {
        Some(Loading::Tension) => {
            turn(table, &FORCES, "a tensile test whose forces and lengths are both negative: turned");
            turn(table, &LENGTHS, "turned with the forces");
        }
        Some(_) => {}
        None => {
            let text = "forces and lengths are both negative, and no word says whether that is compression, as it is taken, or a pull: say pull";
            table.findings.push(Finding::note(table.place.clone(), text.to_owned()));
        }
    }
}

fn by_work(table: &mut Table) {
    let pick = |quantity: &Quantity| {
        // Printed too coarsely a length may stand still.
        let moves = |c: &Column| c.printed.iter().any(|v| *v != c.printed[0]);
        let held = |c: &&Column| c.quantity == *quantity && !c.extreme && moves(c);
        table.columns.iter().find(held)
    };
    let Some(length) = LENGTHS.iter().find_map(pick) else { return };
    let gap = length.quantity == Quantity::Gap;
    let (name, mut against) = (length.heading.clone(), Vec::new());
    for (i, force) in table.columns.iter().enumerate() {
        if FORCES.contains(&force.quantity) && !force.extreme && force.rows == length.rows {
            match share(&length.printed, &force.printed) {
                Some(share) if share < -SURE => against.push((i, share)),
                Some(share) if share > SURE => {}
                _ => table.findings.push(Finding::note(
                    force.place.clone(),
                    format!(
                        "{} goes neither with nor against {name}: its sign is left as it is",
                        force.heading
                    ),
                )),
            }
        }
    }
    for (i, share) in against {
        let column = &mut table.columns[i];
        turn_column(column);
        let why =
            if gap { "while the gap closes: compression, negative here" } else { "against a pull: turned" };
        let text = format!("{} grows {why} (share of work {share:.2} against {name})", column.heading);
        table.findings.push(Finding::note(column.place.clone(), text));
    }
}

/// The work from the first row on over what it would be if both always went together.
fn share(length: &[f64], force: &[f64]) -> Option<f64> {
    let (l0, f0) = (length.first()?, force.first()?);
    let (mut work, mut most) = (0.0, 0.0);
    for (l, f) in length.iter().zip(force) {
        let product = (l - l0) * (f - f0);
        work += product;
        most += product.abs();
    }
    (most > 0.0).then(|| work / most)
}

/// Whether the columns of these kinds go below where they begin, all of them.
fn falls(table: &Table, kinds: &[Quantity]) -> bool {
    let mut held =
        table.columns.iter().filter(|c| kinds.contains(&c.quantity) && !c.extreme && c.printed.len() > 1);
    let sum = |c: &Column| c.printed.iter().map(|v| v - c.printed[0]).sum::<f64>();
    held.clone().next().is_some() && held.all(|c| c.quantity != Quantity::Gap && sum(c) < 0.0)
}

fn turn(table: &mut Table, kinds: &[Quantity], why: &str) {
    for column in table.columns.iter_mut().filter(|c| kinds.contains(&c.quantity)) {
        turn_column(column);
        table.findings.push(Finding::note(column.place.clone(), format!("{}: {why}", column.heading)));
    }
}

fn turn_column(column: &mut Column) {
    column.turned = !column.turned;
    column.printed.iter_mut().for_each(|v| *v = -*v);
}
