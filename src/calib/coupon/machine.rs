//! What can only be told beside something else: grips and machine by a second measure of strain, a wrong unit by the other specimens.

use super::fault::{Fault, Name};
use super::held_out::{helps, line, rms};
use super::marks::between;
use super::specimen::{Kind, Specimen};
use crate::calib::export::{Quantity, StrainSource, Table};

/// Rows at least.
const LEAST_ROWS: usize = 16;
/// Share of the crosshead's way that must be missed for it to matter.
const MATTERS: f64 = 0.005;
/// A reading that predicts so much worse than the best is out.
const WORSE: f64 = 1.25;
/// How far the other specimens may differ among themselves, and a specimen from them behind a unit's factor.
const ALIKE: f64 = 0.15;
/// Least factor that is no scatter of a material.
const LEAST_FACTOR: f64 = 3.0;
/// What puts forces and stresses right that are in another unit than their heading says, and which that may be.
const FORCES: [(f64, &str); 10] = [
    (1e3, "N under a heading in mN, kN under one in N, kPa under one in Pa, or MPa under one in kPa"),
    (1e-3, "mN under a heading in N, N under one in kN, Pa under one in kPa, or kPa under one in MPa"),
    (1e6, "MPa under a heading in Pa, or kN under one in mN"),
    (1e-6, "Pa under a heading in MPa, or mN under one in kN"),
    (4.448_222, "pounds-force under a heading in N"),
    (1.0 / 4.448_222, "N under a heading in pounds-force"),
    (9.806_65, "kilograms-force under a heading in N"),
    (1.0 / 9.806_65, "N under a heading in kilograms-force"),
    (6.894_757, "psi under a heading in kPa"),
    (1.0 / 6.894_757, "kPa under a heading in psi"),
];
/// The same of ways and strains.
const WAYS: [(f64, &str); 8] = [
    (25.4, "inches under a heading in mm"),
    (1.0 / 25.4, "mm under a heading in inches"),
    (10.0, "cm under a heading in mm"),
    (0.1, "mm under a heading in cm"),
    (100.0, "plain strains under a heading in per cent"),
    (0.01, "per cent under a heading of plain strains"),
    (1e3, "m under a heading in mm"),
    (1e-3, "mm under a heading in m"),
];
/// Places at which specimens are compared.
const PLACES: usize = 24;

/// Machine compliance, where a table holds the crosshead's way, an extensometer's strain and the gauge length.
///
/// The excess X − L ε of the crosshead's way is C F + c where grips and machine give way, and k ε + c where L is another length. Fitted on every
/// other row, judged on the rows between; what predicts alike is not told apart.
pub fn compliance(table: &Table) -> Option<Fault> {
    let column = |q| table.column(q).ok().filter(|c| c.si().is_some());
    let strain = column(Quantity::Strain).filter(|c| c.source == Some(StrainSource::Extensometer))?;
    let way = column(Quantity::Extension).filter(|c| c.source != Some(StrainSource::Extensometer))?;
    let load = column(Quantity::Force).or_else(|| column(Quantity::Stress))?;
    let length = table.specimen.gauge_length_m.filter(|l| *l > 0.0)?;
    let series = table.series(&[strain.quantity, way.quantity, load.quantity]).ok()?;
    let [strain, way, force] = &series.values[..] else { return None };
    let top = (0..way.len()).max_by(|a, b| way[*a].total_cmp(&way[*b]))?;
    if top < LEAST_ROWS {
        return None;
    }
    let rows: Vec<usize> = (0..=top).collect();
    let travel = way[top] - way[0];
    let excess: Vec<f64> =
        rows.iter().map(|r| way[*r] - way[0] - length * (strain[*r] - strain[0])).collect();
    let missed = |by: Option<&Vec<f64>>| {
        let every = |list: &[f64], from: usize| -> Vec<f64> {
            rows.iter().skip(from).step_by(2).map(|r| list[*r]).collect()
        };
        let (slope, place, height) = by.map_or((0.0, 0.0, 0.0), |x| line(&every(x, 0), &every(&excess, 0)));
        let unseen = rows.iter().skip(1).step_by(2);
        let left: Vec<f64> =
            unseen.map(|r| excess[*r] - height - by.map_or(0.0, |x| slope * (x[*r] - place))).collect();
        (rms(&left) / travel, slope)
    };
    let (without, _) = missed(None);
    let ((by_force, give), (by_strain, share)) = (missed(Some(force)), missed(Some(strain)));
    let held_out = [without, by_force.min(by_strain)];
    if !helps(held_out) || without < MATTERS {
        return None;
    }
    let sure = |a: f64, b: f64| a * WORSE < b;
    let (name, or) = if sure(by_strain, by_force) {
        (Name::GaugeLength, vec![])
    } else if sure(by_force, by_strain) {
        (Name::Compliance, vec![])
    } else {
        (Name::Compliance, vec![Name::GaugeLength])
    };
    // Nothing stretches the grips when it is pulled less.
    if name == Name::Compliance && give <= 0.0 {
        return None;
    }
    let mut shown = format!(
        "the crosshead goes {:.3} mm farther than the extensometer says for {:.2} mm of gauge length",
        1e3 * excess[top],
        1e3 * length
    );
    if name == Name::GaugeLength || !or.is_empty() {
        shown += &format!(", as if that were {:.2} mm", 1e3 * (length + share));
    }
    Some(Fault { name, or, lines: [series.lines[0], series.lines[top]], shown, held_out: Some(held_out) })
}

/// Specimens of one material whose numbers are those of another unit: at least three, the others alike. Index and fault.
///
/// Held out: the specimen's own rows, predicted from the others as they stand, and with the factor of a unit.
pub fn wrong_units(specimens: &[Specimen]) -> Vec<(usize, Fault)> {
    if specimens.len() < 3 || specimens.iter().any(|s| s.kind != Kind::Dumbbell) {
        return Vec::new();
    }
    let curves: Vec<Vec<(f64, f64)>> =
        specimens.iter().filter_map(|s| s.branches.iter().find(|b| b.loading).map(|b| s.points(b))).collect();
    if curves.len() < specimens.len() {
        return Vec::new();
    }
    (0..specimens.len()).filter_map(|i| Some((i, unit_of(specimens, &curves, i)?))).collect()
}

fn unit_of(specimens: &[Specimen], curves: &[Vec<(f64, f64)>], of: usize) -> Option<Fault> {
    let others: Vec<usize> = (0..curves.len()).filter(|k| *k != of).collect();
    let reach = |k: usize| curves[k].last().map_or(0.0, |p| p.0);
    let common = others.iter().map(|k| reach(*k)).fold(f64::INFINITY, f64::min);
    // What the others say at a strain, and whether they agree.
    let said = |x: f64| -> Option<f64> {
        let mut values: Vec<f64> = others.iter().filter_map(|k| between(&curves[*k], x)).collect();
        values.sort_by(f64::total_cmp);
        let middle = *values.get(values.len() / 2)?;
        let alike = values.iter().all(|v| (v / middle - 1.0).abs() < ALIKE);
        (values.len() == others.len() && alike && middle > 0.0).then_some(middle)
    };
    let missed = |stretch: f64, factor: f64| -> Option<f64> {
        let far = common.min(reach(of) * stretch);
        let left: Vec<f64> = (1..=PLACES)
            .map(|k| far * (0.2 + 0.8 * k as f64 / PLACES as f64))
            .filter_map(|x| Some(between(&curves[of], x / stretch)? * factor / said(x)? - 1.0))
            .collect();
        (2 * left.len() > PLACES).then(|| rms(&left))
    };
    let plain = missed(1.0, 1.0);
    let mut tried: Vec<(f64, String)> = Vec::new();
    for (factor, words) in FORCES {
        tried.extend(missed(1.0, factor).map(|m| (m, format!("its forces times {factor:.4} ({words})"))));
    }
    for (factor, words) in WAYS {
        tried.extend(missed(factor, 1.0).map(|m| (m, format!("its strains times {factor:.4} ({words})"))));
    }
    tried.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (best, words) = tried.first()?;
    let without = plain.unwrap_or(1.0);
    // A factor that far from one, and met that closely, is no scatter.
    if *best > ALIKE || without < 1.0 - 1.0 / LEAST_FACTOR || !helps([without, *best]) {
        return None;
    }
    let close: Vec<&str> =
        tried.iter().filter(|t| t.0 <= ALIKE && t.0 < 2.0 * best.max(0.02)).map(|t| t.1.as_str()).collect();
    let specimen = &specimens[of];
    let lines = [specimen.lines[0], specimen.lines[specimen.lines.len() - 1]];
    let shown = format!(
        "it follows the other {} within {:.1} % with {}{}",
        others.len(),
        100.0 * best,
        words,
        close[1..].iter().map(|w| format!(", or {w}")).collect::<String>()
    );
    Some(Fault { name: Name::WrongUnit, or: Vec::new(), lines, shown, held_out: Some([without, *best]) })
}
