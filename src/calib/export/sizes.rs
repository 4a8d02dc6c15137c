//! Do stress, strain and the specimen's sizes agree? σ = F / A, ε = u / L, true strain = ln(1 + ε), true stress = σ (1 + ε).

use super::finding::Finding;
use super::quantity::Quantity as Q;
use super::ratio::{LENGTHS, SAME, SIZES, contradict, disagreement, held, known, shown_by, slope, straight};
use super::table::Table;
use super::unit::{self, Unit};

/// True strain against strain, true stress against stress.
pub(super) fn true_strains(table: &mut Table) {
    let (Some(&e), Some(&t)) = (held(table, Q::Strain).first(), held(table, Q::TrueStrain).first()) else {
        return;
    };
    if table.columns[e].rows != table.columns[t].rows {
        return;
    }
    let units = [unit::PLAIN_RATIO, unit::PER_CENT];
    let fits = |u: Unit, v: Unit| {
        let (strain, true_strain) = (&table.columns[e].printed, &table.columns[t].printed);
        let largest = true_strain.iter().fold(0.0, |m: f64, x| m.max(v.to_si(*x).abs()));
        let off = |(e, t): (&f64, &f64)| (v.to_si(*t) - u.to_si(*e).ln_1p()).abs() < LENGTHS * largest;
        // A strain so small that it is its own logarithm shows nothing.
        largest > LENGTHS && strain.iter().zip(true_strain).all(off)
    };
    let pairs = units.iter().flat_map(|u| units.iter().map(move |v| (*u, *v)));
    let found: Vec<(Unit, Unit)> = pairs.filter(|(u, v)| fits(*u, *v)).collect();
    let [(u, v)] = found[..] else { return };
    let why = format!("{} = ln(1 + {})", table.columns[t].heading, table.columns[e].heading);
    for (at, unit) in [(e, u), (t, v)] {
        shown_by(table, at, unit.factor, SAME, &why);
        let column = &table.columns[at];
        if let Some(stated) = known(column).filter(|s| (s.factor / unit.factor - 1.0).abs() > SAME) {
            let what = format!("the unit {:?} contradicts {why}, which fits {}", stated.name, unit.name);
            table
                .findings
                .push(Finding::contradiction(column.place.clone(), format!("{}: {what}", column.heading)));
            contradict(&mut table.columns[at], &what);
        }
    }
}

/// True stress over stress · (1 + strain): 1 where nothing is lost in volume.
pub(super) fn true_stresses(table: &mut Table) {
    let first = |quantity| held(table, quantity).first().copied();
    let (Some(e), Some(s), Some(t)) = (first(Q::Strain), first(Q::Stress), first(Q::TrueStress)) else {
        return;
    };
    let [strain, stress, true_stress] = [e, s, t].map(|i| &table.columns[i]);
    if strain.rows != stress.rows || stress.rows != true_stress.rows {
        return;
    }
    let (Some(u), Some(v), Some(w)) = (known(strain), known(stress), known(true_stress)) else { return };
    let present: Vec<f64> =
        strain.printed.iter().zip(&stress.printed).map(|(e, s)| s * (1.0 + u.to_si(*e))).collect();
    let Some(ratio) = straight(&present, &true_stress.printed) else { return };
    let off = (ratio * w.factor / v.factor).abs();
    let names = format!("{} over {} · (1 + {})", true_stress.heading, stress.heading, strain.heading);
    let place = true_stress.place.clone();
    if (off - 1.0).abs() <= SIZES {
        table.findings.push(Finding::note(place, format!("{names} is {off:.4}, as it should be")));
    } else if let Some(fits) = disagreement(stress, true_stress, v, w, off, SIZES) {
        let what = format!("{names} is {off:.4} by the units, and should be 1{fits}");
        table.findings.push(Finding::contradiction(place, what.clone()));
        contradict(&mut table.columns[s], &what);
        contradict(&mut table.columns[t], &what);
    }
}

/// Strain over extension against the gauge length.
pub(super) fn gauge(table: &mut Table) {
    let (Some(&x), Some(&y)) = (held(table, Q::Extension).first(), held(table, Q::Strain).first()) else {
        return;
    };
    let Some(ratio) = slope(&table.columns[x], &table.columns[y]) else { return };
    let expected =
        table.specimen.gauge_length_m.map(|l| (1.0 / l, format!("a gauge length of {:.4} mm", 1e3 * l)));
    let length = |per_metre: f64| format!("the gauge length is {:.4} mm", 1e3 / per_metre);
    ratio_check(table, (x, y), ratio, expected, LENGTHS, length);
}

/// Stress over force against the cross-section.
pub(super) fn area(table: &mut Table) {
    let specimen = table.specimen;
    if let (Some(stated), Some(sizes)) = (specimen.stated_area_m2, specimen.area_of_sizes_m2())
        && (stated / sizes - 1.0).abs() > SIZES
    {
        let text = format!(
            "the cross-section is said to be {:.4} mm²; its sizes give {:.4} mm²",
            1e6 * stated,
            1e6 * sizes
        );
        table.findings.push(Finding::contradiction(table.place.clone(), text));
    }
    let (Some(&x), Some(&y)) = (held(table, Q::Force).first(), held(table, Q::Stress).first()) else {
        return;
    };
    let Some(ratio) = slope(&table.columns[x], &table.columns[y]) else { return };
    let expected = specimen.area_m2().map(|a| (1.0 / a, format!("a cross-section of {:.4} mm²", 1e6 * a)));
    let size = |per_area: f64| {
        let area = 1.0 / per_area;
        let diameter = (4.0 * area.abs() / std::f64::consts::PI).sqrt();
        format!("the cross-section is {:.4} mm², round {:.4} mm across", 1e6 * area, 1e3 * diameter)
    };
    ratio_check(table, (x, y), ratio, expected, SIZES, size);
}

/// A constant ratio of y over x against what the specimen's sizes make it (SI).
fn ratio_check(
    table: &mut Table,
    (x, y): (usize, usize),
    ratio: f64,
    expected: Option<(f64, String)>,
    tolerance: f64,
    say: impl Fn(f64) -> String,
) {
    let (a, b) = (&table.columns[x], &table.columns[y]);
    let (place, names) = (b.place.clone(), format!("{} over {}", b.heading, a.heading));
    match (known(a), known(b), expected) {
        (Some(u), Some(v), None) => {
            let text = format!("{names} is constant: {}", say(ratio * v.factor / u.factor));
            table.findings.push(Finding::note(place, text));
        }
        (Some(u), Some(v), Some((expected, size))) => {
            let off = (ratio * v.factor / u.factor / expected).abs();
            let text = format!("{names} is constant: {}; said is {size}", say(ratio * v.factor / u.factor));
            if (off - 1.0).abs() <= tolerance {
                table.findings.push(Finding::note(place, text));
                return;
            }
            let fits = disagreement(a, b, u, v, off, tolerance);
            let what = format!(
                "{text}{}",
                fits.clone().unwrap_or_else(|| "; a size is wrong, or a unit".to_owned())
            );
            table.findings.push(Finding::contradiction(place, what.clone()));
            if fits.is_some() {
                contradict(&mut table.columns[x], &what);
                contradict(&mut table.columns[y], &what);
            }
        }
        (Some(u), None, Some((expected, size))) => {
            shown_by(
                table,
                y,
                (expected * u.factor / ratio).abs(),
                tolerance,
                &format!("{names} with {size}"),
            );
        }
        (None, Some(v), Some((expected, size))) => {
            shown_by(
                table,
                x,
                (ratio * v.factor / expected).abs(),
                tolerance,
                &format!("{names} with {size}"),
            );
        }
        _ => {}
    }
}
