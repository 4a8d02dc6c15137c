//! Dumb-bells and bands with one thing wrong each, made here by formulas of their own: it must be named, or be among the names that the data
//! cannot tell apart; nothing else may be, and a sound one gets no name. Nothing of the fit is used.

use phantom_rig::calib::bands::Stretching;
use phantom_rig::calib::coupon::{Fault, Name, Specimen, compliance, wrong_units};
use phantom_rig::calib::dumbbell::Pull;
use phantom_rig::calib::export::{Override, read_file};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

/// Strain up to which a dumb-bell is judged.
const WINDOW: f64 = 0.5;

fn noise(sd: f64, rng: &mut ChaCha8Rng) -> f64 {
    Normal::new(0.0, sd).expect("a deviation").sample(rng)
}

/// A dumb-bell of 60 kPa whose stress (Pa) follows from the strain shown; 0.15 % of the greatest as noise.
fn dumbbell(seed: u64, stress: impl Fn(f64) -> f64) -> Pull {
    noisy(seed, 1.5e-3, stress)
}

fn noisy(seed: u64, share: f64, stress: impl Fn(f64) -> f64) -> Pull {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let strain: Vec<f64> = (0..130).map(|k| 0.004 * f64::from(k)).collect();
    let sd = share * stress(WINDOW).abs();
    Pull {
        label: "made".to_owned(),
        file: "made.csv".into(),
        column: 3,
        lines: (2..=strain.len() as u64 + 1).collect(),
        stress: strain.iter().map(|e| stress(*e) + noise(sd, &mut rng)).collect(),
        strain,
        source: None,
        width_m: None,
        thickness_m: None,
        area_m2: None,
        gauge_length_m: None,
        rate_per_s: None,
        temperature_c: None,
    }
}

/// Incompressible and neo-Hookean: the balance of the free sides gives the pressure.
fn neo(strain: f64) -> f64 {
    let (shear, stretch) = (20e3, 1.0 + strain.max(0.0));
    let pressure = shear / stretch;
    (shear * stretch * stretch - pressure) / stretch
}

fn said(faults: &[Fault]) -> Vec<(Name, Vec<Name>)> {
    for f in faults {
        println!("  {}, lines {:?}: {} {:?}", f.words(), f.lines, f.shown, f.held_out);
        let gained = f.held_out.is_some_and(|[without, with]| with < 0.7 * without);
        assert!(gained || f.name == Name::Unexplained, "{f:?}");
    }
    faults.iter().map(|f| (f.name, f.or.clone())).collect()
}

#[test]
fn a_sound_dumbbell_gets_no_name() {
    for seed in 0..20 {
        for share in [1e-4, 2e-3, 0.01] {
            let found = said(&Specimen::of_dumbbell(&noisy(seed, share, neo), WINDOW).diagnose());
            assert!(found.is_empty(), "{seed}, {share}: {found:?}");
        }
    }
}

/// Rows in the slack tell it from a zero; where the file begins behind it, no more than both are said.
#[test]
fn what_is_wrong_with_a_dumbbell_is_named() {
    type Stress = dyn Fn(f64) -> f64;
    let late = |e: f64| neo((1.0 + e) / 1.05 - 1.0);
    let cases: [(&str, Name, &Stress); 4] = [
        ("slack", Name::Slack, &late),
        ("stiffening", Name::Stiffening, &|e| neo(e) * (1.0 + 0.8 * e * e)),
        ("flattening", Name::Flattening, &|e| neo(e) * (1.0 - 0.6 * e * e)),
        ("zero below", Name::SensorZero, &|e| neo(e) - 1.2e3),
    ];
    for (words, name, stress) in cases {
        for seed in 0..4 {
            println!("{words}, {seed}");
            let found = said(&Specimen::of_dumbbell(&dumbbell(seed, stress), WINDOW).diagnose());
            assert_eq!(found, [(name, Vec::new())], "{words} {seed}");
        }
    }
    let mut cut = dumbbell(5, late);
    cut.strain.drain(..25);
    cut.stress.drain(..25);
    cut.lines.drain(..25);
    let found = said(&Specimen::of_dumbbell(&cut, WINDOW).diagnose());
    let [(name, or)] = &found[..] else { panic!("{found:?}") };
    let mut all: Vec<Name> = or.iter().copied().chain([*name]).collect();
    assert!(all.contains(&Name::Slack), "{found:?}");
    all.retain(|n| !matches!(n, Name::Slack | Name::SensorZero));
    assert!(all.is_empty(), "{found:?}");
}

/// A force before the test may be the sensor's as well as the specimen's.
#[test]
fn a_zero_above_may_be_a_load() {
    let found = said(&Specimen::of_dumbbell(&dumbbell(1, |e| neo(e) + 1.2e3), WINDOW).diagnose());
    assert_eq!(found, [(Name::SensorZero, vec![Name::LoadedBefore])]);
}

/// Cycles of a band of 400 N/m between 0 and 30 mm; `force` knows extension (mm), cycle from 0, and whether it goes out.
fn band(seed: u64, cycles: usize, force: impl Fn(f64, usize, bool) -> f64) -> Stretching {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (mut x, mut f) = (Vec::new(), Vec::new());
    for cycle in 0..cycles {
        for k in 0..240 {
            let out = k < 120;
            let mm = 0.25 * f64::from(if out { k } else { 240 - k });
            x.push(1e-3 * mm);
            f.push(force(mm, cycle, out) + noise(0.01, &mut rng));
        }
    }
    Stretching::new("made".to_owned(), x, f)
}

fn pulls(mm: f64) -> f64 {
    0.4 * f64::max(mm, 0.0)
}

#[test]
fn a_sound_band_gets_no_name_and_a_faulty_one_its_own() {
    type Force = dyn Fn(f64, usize, bool) -> f64;
    let sound: &Force = &|mm, _, _| pulls(mm);
    for seed in 0..10 {
        let found = said(&Specimen::of_bands(&band(seed, 3, sound)).diagnose());
        assert!(found.is_empty(), "{seed}: {found:?}");
        // A pull where the file begins is no fault of a band.
        let found = said(&Specimen::of_bands(&band(seed, 1, |mm, _, _| 3.0 + pulls(mm))).diagnose());
        assert!(found.is_empty(), "{seed}: {found:?}");
    }
    let settles = |cycle: usize| 1.0 - 0.12 * (1.0 - 0.3_f64.powi(cycle as i32));
    let cases: [(&str, Name, &Force); 6] = [
        ("slack", Name::Slack, &|mm, _, _| pulls(mm - 4.0)),
        ("stiffening", Name::Stiffening, &|mm, _, _| pulls(mm) * (1.0 + mm * mm / 1800.0)),
        ("flattening", Name::Flattening, &|mm, _, _| 9.0 * (1.0 - (-mm / 25.0).exp())),
        ("softening", Name::Softening, &move |mm, cycle, _| settles(cycle) * pulls(mm)),
        ("set", Name::Lengthened, &|mm, cycle, _| 1.0 + pulls(mm - 1.2 * cycle as f64 + 3.0)),
        ("zero moved", Name::ZeroMoved, &|mm, cycle, _| pulls(mm) + 0.4 * cycle as f64),
    ];
    for (words, name, force) in cases {
        for seed in 0..3 {
            println!("{words}, {seed}");
            let found = said(&Specimen::of_bands(&band(seed, 3, force)).diagnose());
            let named = found.iter().any(|(n, or)| *n == name || or.contains(&name));
            // A straight line that comes later is one that is off by a force: then both must be said.
            let both = |n: &Name, or: &[Name]| *n == name || or.contains(&name);
            assert!(named && found.iter().all(|(n, or)| both(n, or)), "{words} {seed}: {found:?}");
        }
    }
}

#[test]
fn a_slack_band_shows_the_zero() {
    let found = said(&Specimen::of_bands(&band(3, 2, |mm, _, _| 0.5 + pulls(mm - 5.0))).diagnose());
    assert_eq!(found, [(Name::Slack, Vec::new()), (Name::SensorZero, Vec::new())]);
}

/// Less on the way back: after a first cycle it is memory, in the only one it may be softening, too.
#[test]
fn a_loop_is_memory_once_the_first_cycle_is_over() {
    let loops = |mm: f64, _: usize, out: bool| {
        if out { pulls(mm) } else { pulls(mm) * (0.8 + 0.2 * mm / 30.0) }
    };
    let found = said(&Specimen::of_bands(&band(1, 3, loops)).diagnose());
    assert_eq!(found, [(Name::Memory, Vec::new())]);
    let found = said(&Specimen::of_bands(&band(1, 1, loops)).diagnose());
    assert_eq!(found, [(Name::Memory, vec![Name::Softening])]);
}

#[test]
fn a_specimen_in_another_unit_is_found_among_others() {
    let made = |seed: u64, gain: f64| dumbbell(seed, move |e| gain * neo(e));
    let of = |gains: [f64; 4]| -> Vec<Specimen> {
        gains
            .iter()
            .enumerate()
            .map(|(i, g)| Specimen::of_dumbbell(&made(i as u64, *g), f64::INFINITY))
            .collect()
    };
    assert!(wrong_units(&of([1.0, 1.04, 0.96, 1.1])).is_empty());
    // Twice as stiff is no unit.
    assert!(wrong_units(&of([1.0, 1.04, 0.96, 2.0])).is_empty());
    // Newtons under a heading in millinewtons read a thousandth of what they are.
    for (factor, words) in [
        (1e-3, "its forces times 1000.0000 (N under a heading in mN,"),
        (1e3, "its forces times 0.0010 (mN under a heading in N,"),
        (4.448_222, "(N under a heading in pounds-force)"),
        (1.0 / 9.806_65, "(kilograms-force under a heading in N)"),
    ] {
        let found = wrong_units(&of([1.0, factor, 0.96, 1.04]));
        let [(1, fault)] = &found[..] else { panic!("{factor}: {found:?}") };
        println!("{factor}: {}", fault.shown);
        assert!(fault.name == Name::WrongUnit && fault.shown.contains(words), "{}", fault.shown);
    }
}

/// A pull with an extensometer beside the crosshead: what the crosshead goes farther is the grips' where it follows the force, another gauge
/// length where it follows the strain.
#[test]
fn grips_that_give_way_are_told_by_an_extensometer() {
    let place = tempfile::tempdir().expect("a folder");
    let found = |name: &str, give_mm_per_n: f64, length_mm: f64| {
        let mut rng = ChaCha8Rng::seed_from_u64(9);
        let mut text =
            "Specimen Thickness (mm);3\nSpecimen Width (mm);6\nSpecimen Length (mm);33\n;\n".to_owned();
        text += "Time (s);Extension (mm);Strain (Video axial) (mm/mm);Load (N)\n";
        for k in 0..120 {
            let strain = 0.004 * f64::from(k);
            let newtons = 10.0 * neo(strain) * 18e-6;
            let way = length_mm * strain + give_mm_per_n * newtons + noise(2e-3, &mut rng);
            text += &format!("{:.1};{way:.5};{strain:.5};{newtons:.5}\n", 0.1 * f64::from(k));
        }
        let file = place.path().join(name);
        std::fs::write(&file, text).expect("writable");
        let export = read_file(&file, &Override::default()).expect("an export");
        compliance(&export.tables[0])
    };
    assert_eq!(found("stiff.csv", 0.0, 33.0), None);
    let gives = found("gives.csv", 1.0, 33.0).expect("a fault");
    println!("{} {:?}", gives.shown, gives.held_out);
    assert_eq!((gives.name, gives.or), (Name::Compliance, Vec::new()));
    let longer = found("longer.csv", 0.0, 36.0).expect("a fault");
    println!("{} {:?}", longer.shown, longer.held_out);
    assert_eq!((longer.name, longer.or), (Name::GaugeLength, Vec::new()));
}

/// Three cycles that lie on each other are not longer with cycles, whatever their loop looks like; a loop that gives energy is no memory.
#[test]
fn equal_cycles_are_not_longer_and_no_specimen_gives_energy() {
    let says = |found: &[(Name, Vec<Name>)], name: Name| {
        found.iter().any(|(n, or)| *n == name || or.contains(&name))
    };
    let found = said(
        &Specimen::of_bands(&band(4, 3, |mm, _, out| 2.0 + pulls(if out { mm } else { mm - 2.0 })))
            .diagnose(),
    );
    assert!(says(&found, Name::Memory) && !says(&found, Name::Lengthened), "{found:?}");
    let found = said(
        &Specimen::of_bands(&band(4, 3, |mm, _, out| 2.0 + pulls(if out { mm } else { mm + 1.0 })))
            .diagnose(),
    );
    assert!(
        says(&found, Name::Play) && !says(&found, Name::Memory) && !says(&found, Name::Lengthened),
        "{found:?}"
    );
}

#[test]
fn a_sensor_at_its_end_is_no_flattening() {
    let found = said(&Specimen::of_bands(&band(2, 2, |mm, _, _| pulls(mm))).diagnose());
    assert_eq!(found, []);
    let mut clipped = band(2, 2, |mm, _, _| pulls(mm));
    clipped.force_n.iter_mut().for_each(|f| *f = f.min(9.0));
    let found = said(&Specimen::of_bands(&clipped).diagnose());
    assert_eq!(found, [(Name::Saturated, Vec::new())]);
}
