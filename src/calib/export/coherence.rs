//! Do units contradict the numbers? Ratios between columns of one table against what the units and the specimen's sizes make of them.
//!
//! * a unit must measure what the name says;
//! * columns of one quantity that go together have the ratio of their units;
//! * stress = force / area, strain = extension / gauge length, true strain = ln(1 + strain), true stress = stress · (1 + strain);
//! * no machine travels 20 m, no force is 10 MN, no stress 1 TPa, no strain 50.
//!
//! A unit that is contradicted is named with the one that would fit, and not replaced. One that is not given at all is taken from such a
//! ratio where it fits one unit only, and that is said.

use super::error::Place;
use super::facts;
use super::finding::Finding;
use super::quantity::Quantity as Q;
use super::ratio::{LENGTHS, SAME, contradict, disagreement, held, known, shown_by, slope};
use super::sizes;
use super::table::Table;
use super::unit::{self, Dimension};

/// Checks a table: sets units that are shown, marks units that are contradicted.
pub(super) fn check(table: &mut Table) {
    kinds(table);
    duplicates(table);
    sizes::true_strains(table);
    sizes::true_stresses(table);
    sizes::gauge(table);
    sizes::area(table);
    speed(table);
    greatest(table);
    magnitudes(table);
}

/// Units that measure something else than the name says.
fn kinds(table: &mut Table) {
    for i in 0..table.columns.len() {
        let column = &table.columns[i];
        let (Some(unit), Some(dimension)) = (known(column), column.quantity.dimension()) else { continue };
        if unit.dimension == dimension || column.extreme {
            continue;
        }
        let mut what = format!(
            "the unit {:?} measures {}, the name says {}",
            unit.name,
            unit.dimension.words(),
            column.quantity
        );
        what.push_str(&fitting(table, i, dimension));
        table
            .findings
            .push(Finding::contradiction(column.place.clone(), format!("{}: {what}", column.heading)));
        contradict(&mut table.columns[i], &what);
    }
}

/// What the numbers would be in the right kind of unit, going by another column that they follow.
fn fitting(table: &Table, at: usize, dimension: Dimension) -> String {
    let column = &table.columns[at];
    let pairs = table.columns.iter().filter(|c| c.place != column.place && !c.extreme);
    for other in pairs {
        let (Some(ratio), Some(unit)) = (slope(other, column), known(other)) else { continue };
        if dimension == Dimension::Ratio && unit.dimension == Dimension::Length {
            let per_metre = ratio / unit.factor;
            let lengths = [unit::PLAIN_RATIO, unit::PER_CENT]
                .map(|u| format!("{} over {:.4} mm", u.name, 1e3 / (per_metre * u.factor)).replace("-", "−"));
            return format!(
                "; its numbers are {ratio:.6} of {} throughout, a strain in {}",
                other.heading,
                lengths.join(" or in ")
            );
        }
        if unit.dimension == dimension && other.quantity == column.quantity {
            let fits = unit::of_factor(dimension, unit.factor / ratio, SAME);
            let fits = fits.map_or(String::new(), |u| format!(", as if in {}", u.name));
            return format!("; its numbers are {ratio:.6} of {} throughout{fits}", other.heading);
        }
    }
    String::new()
}

/// Numbers that no testing machine gives.
fn magnitudes(table: &mut Table) {
    for column in table.columns.iter_mut().filter(|c| !c.extreme) {
        let most = match column.quantity {
            Q::Extension | Q::Gap => 20.0,
            Q::Force => 1e7,
            Q::Stress | Q::TrueStress => 1e12,
            Q::Strain | Q::TrueStrain => 50.0,
            _ => continue,
        };
        let Some(unit) = known(column) else { continue };
        let largest = column.printed.iter().fold(0.0, |m: f64, v| m.max(unit.to_si(*v).abs()));
        if largest > most {
            let what =
                format!("in {} it goes to {largest:.4e} {}; no test does", unit.name, unit.dimension.si());
            table
                .findings
                .push(Finding::contradiction(column.place.clone(), format!("{}: {what}", column.heading)));
            contradict(column, &what);
        }
    }
}

/// Two columns of one quantity that go together.
fn duplicates(table: &mut Table) {
    for quantity in [Q::Time, Q::Extension, Q::Force, Q::Stress, Q::Strain] {
        let columns = held(table, quantity);
        for (n, &a) in columns.iter().enumerate() {
            for &b in &columns[n + 1..] {
                let (x, y) = (&table.columns[a], &table.columns[b]);
                let Some(ratio) = slope(x, y) else { continue };
                let names = format!("{} and {}", x.heading, y.heading);
                let place = y.place.clone();
                match (known(x), known(y)) {
                    (Some(u), Some(v)) => {
                        let off = ratio * v.factor / u.factor;
                        if (off.abs() - 1.0).abs() <= SAME {
                            let note = format!("{names} hold the same (ratio {ratio:.6}, as their units)");
                            table.findings.push(Finding::note(place, note));
                        } else if let Some(what) = disagreement(x, y, u, v, off.abs(), SAME) {
                            let what = format!(
                                "{names} have the ratio {ratio:.6}, their units {:.6}{what}",
                                u.factor / v.factor
                            );
                            table.findings.push(Finding::contradiction(place, what.clone()));
                            contradict(&mut table.columns[a], &what);
                            contradict(&mut table.columns[b], &what);
                        }
                    }
                    (Some(u), None) => shown_by(table, b, u.factor / ratio.abs(), SAME, &names),
                    (None, Some(v)) => shown_by(table, a, v.factor * ratio.abs(), SAME, &names),
                    (None, None) => {}
                }
            }
        }
    }
}

/// How fast the specimen is stretched against the stated speed: shows a strain's unit, contradicts nothing, for a test may have stages.
fn speed(table: &mut Table) {
    let (Some(speed), Some(&t)) = (table.specimen.speed_m_s, held(table, Q::Time).first()) else { return };
    let strains = held(table, Q::Strain).into_iter().zip(table.specimen.gauge_length_m.map(|l| speed / l));
    let moves = held(table, Q::Extension).into_iter().map(|x| (x, speed)).chain(strains);
    for (y, expected) in moves.collect::<Vec<_>>() {
        let (time, column) = (&table.columns[t], &table.columns[y]);
        let Some(unit) = known(time).filter(|_| time.rows == column.rows) else { continue };
        let mut rates: Vec<f64> = time
            .printed
            .windows(2)
            .zip(column.printed.windows(2))
            .map(|(t, y)| ((y[1] - y[0]) / (unit.to_si(t[1]) - unit.to_si(t[0]))).abs())
            .filter(|rate| rate.is_finite())
            .collect();
        rates.sort_by(f64::total_cmp);
        let Some(&rate) = rates.get(rates.len() / 2).filter(|r| **r > 0.0) else { continue };
        match known(column) {
            None => shown_by(table, y, expected / rate, LENGTHS, "the stated speed"),
            Some(unit) => {
                let share = rate * unit.factor / expected;
                let text = format!("{} changes at {share:.4} of the stated speed (median)", column.heading);
                table.findings.push(Finding::note(column.place.clone(), text));
            }
        }
    }
}

/// The stated greatest force is in the table.
fn greatest(table: &mut Table) {
    let Some(&x) = held(table, Q::Force).first() else { return };
    let column = &table.columns[x];
    let Some(unit) = known(column) else { return };
    let largest = column.printed.iter().fold(0.0, |m: f64, v| m.max(unit.to_si(*v).abs()));
    let checked: Vec<Finding> = facts::greatest_forces(&table.facts)
        .map(|(fact, stated)| {
            let place = Place { line: fact.line, column: 0, ..column.place.clone() };
            let text = format!(
                "{} is {}; {} goes to {:.6} {}",
                fact.name,
                fact.text,
                column.heading,
                largest / unit.factor,
                unit.name
            );
            let agree = (stated.abs() / largest - 1.0).abs() <= SAME;
            if agree { Finding::note(place, text) } else { Finding::contradiction(place, text) }
        })
        .collect();
    table.findings.extend(checked);
}
