//! A force sensor with known faults under dead weights: found within what is stated, and a wrong weight named.

use super::bench::{Dice, ForceBench, WeightRow};
use nalgebra::Vector3;
use phantom_rig::calib::instruments::force::{
    DriftLog, ForceFound, Hold, Known, Weights, calibrate_force, drift,
};

fn weights(rows: &[WeightRow]) -> Weights {
    let hold = |(number, row): (usize, &WeightRow)| Hold {
        line: number as u64 + 2,
        mass_kg: row.mass_kg,
        direction: Vector3::from(row.direction),
        lever_m: Vector3::from(row.lever_m),
        reading: row.reading,
        time_s: Some(row.time_s),
        temperature_c: None,
    };
    Weights { file: "weights.csv".into(), holds: rows.iter().enumerate().map(hold).collect() }
}

fn known(bench: &ForceBench) -> Known {
    Known {
        mass_share: bench.mass_share,
        scale_share: bench.scale_share,
        direction_rad: bench.direction_rad,
        lever_m: bench.lever_m,
        ..Known::default()
    }
}

fn one(seed: u64) -> (ForceBench, ForceFound) {
    let mut dice = Dice::new(seed);
    let bench = ForceBench::new(&mut dice);
    let rows = bench.table(&mut dice);
    let found = calibrate_force(&weights(&rows), &known(&bench)).expect("enough weights");
    (bench, found)
}

/// Benches that are drawn; `PHANTOM_RIG_REPEATS` asks for more.
fn repeats() -> u64 {
    std::env::var("PHANTOM_RIG_REPEATS").ok().and_then(|n| n.parse().ok()).unwrap_or(60)
}

/// The 90 % intervals hold the truth in 87 to 93 % of the cases: 36 sensitivities, 6 biases at mid-table and 6 drifts of each bench.
#[test]
fn intervals_hold_the_truth_as_often_as_they_say() {
    let (mut inside, mut all, mut alarms) = ([0_u32; 3], [0_u32; 3], 0_u32);
    for seed in 0..repeats() {
        let (bench, found) = one(seed);
        let mut count = |kind: usize, value: f64, sd: f64, truth: f64| {
            inside[kind] += u32::from((value - truth).abs() < found.half_90 * sd);
            all[kind] += 1;
        };
        for i in 0..6 {
            for j in 0..6 {
                count(0, found.sensitivity[i][j], found.sensitivity_sd[i][j], bench.sensitivity[i][j]);
            }
            let middle_s = 20.0 * (found.rows as f64 - 1.0) / 2.0;
            count(1, found.bias[i], found.bias_sd[i], bench.bias[i] + bench.drift_per_s[i] * middle_s);
            let [slope, sd] = found.per_second.expect("times are told")[i];
            count(2, slope, sd, bench.drift_per_s[i]);
        }
        alarms += u32::from(!found.misfits.is_empty());
    }
    let share: Vec<f64> = inside.iter().zip(all).map(|(i, a)| f64::from(*i) / f64::from(a)).collect();
    println!(
        "{} benches; inside 90 %: sensitivities, biases, drifts {share:.3?}; sound tables with a row named {alarms}",
        repeats()
    );
    // One in a hundred is meant; rows at one place share a cause, which the test of a row takes for independent.
    assert!(f64::from(alarms) <= 3.0 + 0.03 * repeats() as f64, "{alarms}");
    // Three deviations of a count of so many independent cases, besides: the sensitivities of a bench share causes.
    for (share, all) in share.iter().zip(all) {
        let slack = 3.0 * (0.09 / f64::from(all)).sqrt();
        assert!((0.87 - slack..=0.93 + slack).contains(share), "{share} of {all}");
    }
}

/// Sound tables whose places are as uncertain as the defaults state, or better, and those of a sensor with a fifth of the noise: a row is named
/// in one table of a hundred, whatever the places are worth.
#[test]
fn false_names_are_as_rare_as_stated() {
    let stated = Known::default();
    let tables = (repeats() / 4).max(10);
    let (mut alarms, mut unloaded) = (0, 0);
    let cases = [(1.0, 1.0), (0.5, 1.0), (0.0, 1.0), (1.0, 0.2), (0.3, 0.2), (0.0, 0.2)];
    for (case, (share, quiet)) in cases.into_iter().enumerate() {
        let mut named = 0;
        for seed in 0..tables {
            let mut dice = Dice::new(40_000 + 10_000 * case as u64 + seed);
            let mut bench = ForceBench::new(&mut dice);
            bench.direction_rad = share * stated.direction_rad;
            bench.lever_m = share * stated.lever_m;
            bench.mass_share = stated.mass_share;
            bench.scale_share = stated.scale_share;
            bench.noise = bench.noise.map(|noise| quiet * noise);
            let rows = bench.table(&mut dice);
            let found = calibrate_force(&weights(&rows), &stated).expect("enough weights");
            named += u32::from(!found.misfits.is_empty());
            unloaded += found.misfits.iter().filter(|m| m.mass_kg == 0.0).count();
        }
        println!("places at {share} of what is stated, noise at {quiet}: a row named in {named} of {tables}");
        alarms += named;
    }
    println!("in all {alarms} of {} tables; rows without a weight: {unloaded}", 6 * tables);
    // Stated is 1 %; the mean of so many tables and three deviations of a Poisson number.
    let expected = 0.01 * 6.0 * tables as f64;
    assert!(f64::from(alarms) <= expected + 3.0 * expected.sqrt(), "{alarms} for {expected}");
}

/// A lever that was written down wrong for all weights of a place is named, though these weights agree with each other.
#[test]
fn a_wrong_place_is_named() {
    let mut dice = Dice::new(12);
    let bench = ForceBench::new(&mut dice);
    let mut rows = bench.table(&mut dice);
    // Rows 20 to 23 hang at (0, 50, 0) mm along x; 60 mm are written down.
    for row in &mut rows[20..24] {
        assert_eq!(row.lever_m, [0.0, 0.05, 0.0]);
        row.lever_m[1] = 0.06;
    }
    let found = calibrate_force(&weights(&rows), &known(&bench)).expect("enough weights");
    let heaviest = found.misfits.first().expect("a misfit");
    assert!(found.misfits.iter().all(|m| (22..=25).contains(&m.line)), "{:?}", found.misfits);
    assert!(heaviest.as_mass_kg.is_none() && heaviest.component == "Mz", "{heaviest:?}");
}

/// A reading that is put right gives the wrench back, and a turn of the sensor is told from its gains.
#[test]
fn the_correction_undoes_the_sensor() {
    let (bench, found) = one(7);
    let wrench = [0.4, -0.3, -1.2, 0.02, 0.01, -0.015];
    let reading: [f64; 6] =
        std::array::from_fn(|i| (0..6).map(|j| bench.sensitivity[i][j] * wrench[j]).sum());
    let back: [f64; 6] = std::array::from_fn(|i| (0..6).map(|j| found.correction[i][j] * reading[j]).sum());
    for i in 0..6 {
        let sd = (0..6).map(|j| (found.correction_sd[i][j] * reading[j]).powi(2)).sum::<f64>().sqrt();
        assert!((back[i] - wrench[i]).abs() < 4.0 * sd, "{i}: {} for {} ± {sd}", back[i], wrench[i]);
        assert!(sd < 0.02, "{i}: ± {sd}");
    }
    let mut dice = Dice::new(3);
    let mut turned = ForceBench::new(&mut dice);
    // 30° about z, gains of 1.1, 0.9 and 1 along the sensor's axes, which read the opposite of what pulls.
    let (s, c) = 30_f64.to_radians().sin_cos();
    turned.sensitivity = [[0.0; 6]; 6];
    for i in 0..3 {
        turned.sensitivity[3 + i][3 + i] = 1.0;
    }
    let rotation = [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]];
    let gains = [1.1, 0.9, 1.0];
    for i in 0..3 {
        for (entry, part) in turned.sensitivity[i].iter_mut().zip(rotation[i]) {
            *entry = -gains[i] * part;
        }
    }
    let rows = turned.table(&mut dice);
    let found = calibrate_force(&weights(&rows), &known(&turned)).expect("enough weights");
    assert!(!found.reads_pull);
    // By polar decomposition the nearest rotation of diag(1.1, 0.9, 1) R is R itself.
    assert!(
        (found.turn_rad[2] - 30_f64.to_radians()).abs() < 4.0 * found.turn_sd_rad[2],
        "{:?}",
        found.turn_rad
    );
    assert!(found.turn_sd_rad[2] < 5e-3);
}

#[test]
fn a_wrong_weight_is_named_with_what_it_is_and_kept() {
    let mut dice = Dice::new(11);
    let bench = ForceBench::new(&mut dice);
    let mut rows = bench.table(&mut dice);
    // 200 g was written down where 150 g hung: 3/4 of the force beyond zero.
    let at = 15;
    assert!(rows[at].mass_kg == 0.2);
    for c in 0..6 {
        let zero = rows[12].reading[c];
        rows[at].reading[c] = zero + 0.75 * (rows[at].reading[c] - zero);
    }
    let found = calibrate_force(&weights(&rows), &known(&bench)).expect("enough weights");
    assert_eq!(found.rows, rows.len());
    let [misfit] = &found.misfits[..] else { panic!("one: {:?}", found.misfits) };
    assert_eq!(misfit.line, at as u64 + 2);
    let [mass, sd] = misfit.as_mass_kg.expect("a weight explains it");
    assert!((mass - 0.15).abs() < 4.0 * sd && sd < 2e-3, "{mass} ± {sd}");
    assert!(misfit.to_string().contains("line 17") && misfit.to_string().contains("200.0 g"), "{misfit}");
    // Without it the table is sound; a line that is none is refused.
    let without = weights(&rows).without(&[misfit.line]).expect("there");
    assert!(calibrate_force(&without, &known(&bench)).expect("enough").misfits.is_empty());
    assert!(without.without(&[misfit.line]).expect_err("gone").to_string().contains("line 17"));
    // A sideways pull is no other weight.
    let mut rows = bench.table(&mut dice);
    rows[23].reading[1] += 0.3;
    let found = calibrate_force(&weights(&rows), &known(&bench)).expect("enough weights");
    assert_eq!(found.misfits.iter().map(|m| (m.line, m.as_mass_kg)).collect::<Vec<_>>(), [(25, None)]);
}

#[test]
fn what_the_weights_cannot_tell_is_named() {
    let mut dice = Dice::new(5);
    let bench = ForceBench::new(&mut dice);
    let rows = bench.table(&mut dice);
    let only = |keep: &dyn Fn(&WeightRow) -> bool| {
        let kept: Vec<WeightRow> = rows.iter().filter(|r| keep(r)).copied().collect();
        calibrate_force(&weights(&kept), &known(&bench)).map(|f| f.told).map_err(|e| e.to_string())
    };
    assert_eq!(only(&|_| true), Ok(6));
    // Through the origin only: forces, and what moments they seem to make.
    assert_eq!(only(&|r| r.lever_m == [0.0; 3]), Ok(3));
    let flat = only(&|r| r.lever_m == [0.0; 3] && r.direction[2] == 0.0).expect_err("no Fz");
    assert!(flat.contains("Fz"), "{flat}");
    let no_twist = only(&|r| r.direction[2] == -1.0 || r.lever_m[2] != 0.0).expect_err("no Mz");
    assert!(no_twist.contains("Mz"), "{no_twist}");
}

/// A zero that drifts and warms is seen; one that only rustles is not called drifting.
#[test]
fn the_drift_log_tells_trend_from_noise() {
    let log = |per_s: f64, per_k: f64, seed: u64| {
        let mut dice = Dice::new(seed);
        let time_s: Vec<f64> = (0..600).map(|k| 10.0 * f64::from(k)).collect();
        let warmth: Vec<f64> = time_s.iter().map(|t| 22.0 + 2.0 * (t / 900.0).sin()).collect();
        let readings = time_s.iter().zip(&warmth).map(|(t, w)| {
            std::array::from_fn(|c| {
                let moved = if c == 2 { per_s * t + per_k * (w - 22.0) } else { 0.0 };
                moved + 0.005 * dice.normal()
            })
        });
        DriftLog {
            file: "drift.csv".into(),
            readings: readings.collect(),
            time_s,
            temperature_c: Some(warmth),
        }
    };
    let found = drift(&log(2e-6, 3e-3, 1)).expect("a log");
    let there: Vec<_> = found.trends.iter().filter(|t| t.is_there()).collect();
    assert_eq!(there.iter().map(|t| (t.component, t.per)).collect::<Vec<_>>(), [("Fz", "s"), ("Fz", "K")]);
    assert!((there[0].slope - 2e-6).abs() < 4.0 * there[0].sd, "{there:?}");
    assert!((there[1].slope - 3e-3).abs() < 4.0 * there[1].sd, "{there:?}");
    // White noise of 5 mN: σ(τ) = 5 mN / √(rows in a span).
    for (k, sigma) in found.allan[0].iter().take(5).enumerate() {
        let white = 0.005 / (f64::from(1 << k)).sqrt();
        assert!((sigma / white - 1.0).abs() < 0.35, "{k}: {sigma} for {white}");
    }
    let quiet = (0..40)
        .filter(|s| drift(&log(0.0, 0.0, 100 + s)).expect("a log").trends.iter().any(|t| t.is_there()));
    assert!(quiet.count() <= 2);
    // A channel that stands still, at a number that sums do not hold exactly, and one that flips its last digit: no trend.
    let mut still = log(0.0, 0.0, 5);
    for (k, reading) in still.readings.iter_mut().enumerate() {
        reading[4] = 0.1;
        reading[5] = if k == 599 { 0.0124 } else { 0.0123 };
    }
    let found = drift(&still).expect("a log");
    assert!(found.trends.iter().all(|t| !t.is_there()), "{:?}", found.trends);
    // The last digit that wanders away is one.
    for (k, reading) in still.readings.iter_mut().enumerate() {
        reading[5] = 0.0123 + 1e-4 * (k / 100) as f64;
    }
    let found = drift(&still).expect("a log");
    let there: Vec<_> = found.trends.iter().filter(|t| t.is_there()).map(|t| (t.component, t.per)).collect();
    assert_eq!(there, [("Mz", "s")]);
    let mut same = log(0.0, 3e-3, 1);
    same.temperature_c = Some(same.time_s.iter().map(|t| 20.0 + t / 600.0).collect());
    assert!(drift(&same).expect("a log").not_apart);
}
