//! Can this be at all, or was a column in another unit than its heading says?
//!
//! Force sensors and stages of a rig are within a few per cent of their data sheet; one that is off by half is broken, or its table is. Units that
//! are mistaken for one another lie farther apart: the two nearest that are looked for here by a factor of 2.2 (a pound for a kilogram).
//! So a factor between [`MOST`] and its inverse is the instrument's own, whatever it is, and one outside is a doubt. Where it is within
//! [`NEAR`] of the ratio of two units, these are named.
//!
//! Tests: here, and `tests/calibration/doubts.rs` on whole tables.

use crate::units::three_digits;
use nalgebra::{Matrix3, Matrix6};

/// Largest factor that an instrument is off its data sheet by; the least is its inverse.
const MOST: f64 = 1.5;
/// The same of a stage: the scale of a screw is better than the gain of a sensor, and a session's positions are put right by no more.
const MOST_OF_STAGE: f64 = 1.2;
/// How far a factor may be off the ratio of two units to be taken for it: what the instrument itself may be off.
const NEAR: f64 = 1.1;
/// A stage is calibrated over its whole travel. One of less than that is not made; a tenth of a millimetre in metres is a tenth of a metre.
const LEAST_TRAVEL_M: f64 = 1e-4;
/// None on a bench goes farther; two millimetres under a heading in metres are that far.
const MOST_TRAVEL_M: f64 = 2.0;
/// A press has eight rows at least, of some micrometres each.
const LEAST_PRESS_M: f64 = 1e-6;
/// No rig comes from so far, nor yields so far; a tenth of a millimetre under a heading in m is that far.
const MOST_PRESS_M: f64 = 0.1;

/// A ratio of two units, and which column would hold what.
type Ratio = (f64, &'static str);

/// What a force that is read over one that hung may come from.
const LOADS: &[Ratio] = &[
    (1e3, "the masses are probably kilograms under mass_g, or the readings mN under a heading in N"),
    (
        1e-3,
        "the masses are probably grams under mass_kg, or milligrams under mass_g, or the readings N under a heading in mN",
    ),
    (1e6, "the masses are probably kilograms under mass_g, and the readings mN under a heading in N"),
    (1e-6, "the masses are probably milligrams under mass_kg"),
    (9.80665, "the readings are probably multiplied by gravity once too often"),
    (
        1.0 / 9.80665,
        "the masses are probably N under mass_kg or mN under mass_g, or the readings kgf under a heading in N",
    ),
    (101.972, "the readings are probably gf under a heading in N"),
    (
        4.44822,
        "the readings are probably turned from lbf into N twice, in the sensor's configuration and in the table",
    ),
    (
        1.0 / 4.44822,
        "the readings are probably lbf under a heading in N, by the sensor's configuration or in the table",
    ),
    (1.0 / 2.20462, "the masses are probably pounds under mass_kg"),
    (453.592, "the masses are probably pounds under mass_g"),
    (28.3495, "the masses are probably ounces under mass_g"),
];

/// What a moment over one that was made, where forces are right, may come from.
const LEVERS: &[Ratio] = &[
    (1e3, "the levers are probably metres under a heading in mm, or the moments N·mm under one in N·m"),
    (1e-3, "the levers are probably millimetres under a heading in m, or the moments N·m under one in N·mm"),
    (10.0, "the levers are probably centimetres under a heading in mm"),
    (25.4, "the levers are probably inches under a heading in mm"),
    (8.850_75, "the moments are probably lbf·in under a heading in N·m"),
    (0.112_985, "the moments are probably turned from lbf·in into N·m twice"),
];

/// What a way over the one asked for may come from.
const WAYS: &[Ratio] = &[
    (
        1e3,
        "the readings are probably mm under a heading in m or µm under one in mm, or the targets metres under one in mm",
    ),
    (
        1e-3,
        "the readings are probably metres under a heading in mm, or the targets mm under one in m or µm under one in mm",
    ),
    (10.0, "the targets are probably centimetres under a heading in mm"),
    (0.1, "the readings are probably centimetres under a heading in mm"),
    (25.4, "the targets are probably inches under a heading in mm"),
    (1.0 / 25.4, "the readings are probably inches under a heading in mm"),
];

/// What speaks against sensitivities of which `told` columns were told (N/N, N·m/(N·m)), as sentences; none where nothing does.
pub(super) fn of_sensitivities(a: &[[f64; 6]; 6], told: usize) -> Vec<String> {
    let force = Matrix3::from_fn(|i, j| a[i][j]);
    let mut doubts = of_block(&force, "forces", LOADS);
    if told == 6 && doubts.is_empty() {
        doubts.extend(of_block(&Matrix3::from_fn(|i, j| a[3 + i][3 + j]), "moments", LEVERS));
    }
    doubts
}

/// The same of the matrix that puts readings right; a matrix that cannot be inverted says nothing.
pub(super) fn of_correction(c: &[[f64; 6]; 6], told: usize) -> Vec<String> {
    let inverse = Matrix6::from_fn(|i, j| c[i][j]).try_inverse();
    let rows = |a: Matrix6<f64>| std::array::from_fn(|i| std::array::from_fn(|j| a[(i, j)]));
    inverse.map_or_else(Vec::new, |a| of_sensitivities(&rows(a), told))
}

/// A turn of the sensor changes no singular value: their geometric mean is the gain of the whole, each is that of one axis.
fn of_block(block: &Matrix3<f64>, what: &str, ratios: &[Ratio]) -> Vec<String> {
    let gains = block.singular_values();
    let whole = gains.product().cbrt();
    if is_far(whole, MOST) {
        return vec![format!(
            "{what} are read {} times as large as they were hung, where a sensor is within a few per cent of once{}",
            three_digits(whole),
            because(whole, ratios)
        )];
    }
    let odd = gains.iter().copied().find(|gain| is_far(*gain, MOST));
    let say = |gain| {
        format!(
            "{what} along one axis are read {} times as large as they were hung, along the others not: a column in another unit, or a broken axis",
            three_digits(gain)
        )
    };
    odd.map(say).into_iter().collect()
}

/// What speaks against an axis that makes `factor` of the way asked for.
pub(super) fn of_scale(name: &str, factor: f64) -> Option<String> {
    is_far(factor, MOST_OF_STAGE).then(|| {
        format!(
            "{}the stage goes {} times as far as asked, where one is within a few per cent of once{}",
            of(name),
            three_digits(factor),
            because(factor, WAYS)
        )
    })
}

/// What speaks against an axis with targets from one place to another.
pub(super) fn of_travel(name: &str, range_m: [f64; 2]) -> Option<String> {
    let travel_m = range_m[1] - range_m[0];
    let (shown, because) = if travel_m < LEAST_TRAVEL_M {
        let shown = format!("all targets lie within {} mm", three_digits(1e3 * travel_m));
        (shown, "metres under headings in mm")
    } else if travel_m > MOST_TRAVEL_M {
        let shown = format!("the targets lie {} m apart", three_digits(travel_m));
        (shown, "mm under headings in m, or µm under headings in mm")
    } else {
        return None;
    };
    Some(format!(
        "{}{shown}, where a stage is calibrated over its whole travel: targets and readings are probably {because}",
        of(name)
    ))
}

fn of(name: &str) -> String {
    if name.is_empty() { String::new() } else { format!("axis {name}: ") }
}

/// What speaks against a press over such a way.
pub(super) fn of_press(way_m: f64) -> Option<String> {
    let (long, because) = if way_m < LEAST_PRESS_M {
        (format!("{} µm", three_digits(1e6 * way_m)), "metres under a heading in mm")
    } else if way_m > MOST_PRESS_M {
        (format!("{} mm", three_digits(1e3 * way_m)), "mm under a heading in m, or µm under one in mm")
    } else {
        return None;
    };
    Some(format!(
        "the whole press is {long} long, where its steps are some micrometres each: positions are probably {because}"
    ))
}

fn is_far(factor: f64, most: f64) -> bool {
    !(1.0 / most..=most).contains(&factor.abs())
}

/// The nearest ratio of two units, if one is near.
fn because(factor: f64, ratios: &[Ratio]) -> String {
    let off = |ratio: &Ratio| (factor.abs() / ratio.0).ln().abs();
    let nearest = ratios.iter().min_by(|a, b| off(a).total_cmp(&off(b)));
    let near = nearest.filter(|ratio| off(ratio) < NEAR.ln());
    near.map_or_else(
        || ": a column is in another unit than its heading says, or the instrument is broken".to_owned(),
        |(_, words)| format!(": {words}"),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scaled(force: f64, moment: f64) -> [[f64; 6]; 6] {
        std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                if i != j {
                    0.0
                } else if i < 3 {
                    force
                } else {
                    moment
                }
            })
        })
    }

    #[test]
    fn units_are_named_by_their_ratio_and_what_is_near_one_is_not_doubted() {
        for (force, moment, words) in [
            (1003.0, 1001.0, "kilograms under mass_g"),
            (0.00101, 0.00099, "grams under mass_kg"),
            (0.102, 0.102, "kgf under a heading in N"),
            (0.2248, 0.2248, "lbf under a heading in N"),
            (1.01, 990.0, "levers are probably metres"),
            (0.99, 25.0, "inches under a heading in mm"),
            (3.0, 3.0, "or the instrument is broken"),
        ] {
            let [doubt] = &of_sensitivities(&scaled(force, moment), 6)[..] else { panic!("one of {words}") };
            assert!(doubt.contains(words), "{words}: {doubt}");
            // The inverse, as a file holds it, says the same.
            let inverse = scaled(1.0 / force, 1.0 / moment);
            assert_eq!(&of_correction(&inverse, 6)[0], doubt);
        }
        for gain in [0.7, 1.0, -1.02, 1.4] {
            assert!(of_sensitivities(&scaled(gain, gain), 6).is_empty(), "{gain}");
        }
        // Moments that were not told are not judged.
        assert!(of_sensitivities(&scaled(1.0, 1e3), 3).is_empty());
        let mut one = scaled(1.0, 1.0);
        one[1][1] = 1.9;
        assert!(of_sensitivities(&one, 6)[0].contains("along one axis"));
    }

    #[test]
    fn an_axis_is_doubted_by_its_factor_and_by_its_travel() {
        let said = |doubt: Option<String>, words: &str| doubt.is_some_and(|doubt| doubt.contains(words));
        assert_eq!((of_scale("", 1.0008), of_travel("", [1e-3, 32e-3])), (None, None));
        assert!(said(of_scale("0", 1.001e-3), "axis 0: the stage goes 0.00100 times"));
        assert!(said(of_scale("", 25.42), "inches") && said(of_scale("", 1.3), "broken"));
        assert!(said(of_scale("", 998.0), "readings are probably mm under a heading in m"));
        assert!(said(of_travel("", [1e-6, 32e-6]), "within 0.0310 mm"));
        assert!(said(of_travel("", [1.0, 32.0]), "31.0 m apart"));
        assert!(of_travel("", [0.0, 1.5]).is_none() && of_press(3e-4).is_none() && of_press(5e-3).is_none());
        assert!(said(of_press(3e-7), "metres under a heading in mm"));
        assert!(said(of_press(0.3), "300 mm long") && said(of_press(0.3), "mm under a heading in m"));
    }
}
