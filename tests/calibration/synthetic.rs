//! Dumb-bells and bands with known answers, made here by formulas of their own: stress from the energy's closed derivative in principal stretches,
//! force from lengths of rubber. Nothing of the fit is used.

use phantom_rig::calib::bands::{self, Stretching};
use phantom_rig::calib::dumbbell::{self, Pull};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

/// Repeats; `PHANTOM_RIG_REPEATS` asks for more.
fn repeats() -> usize {
    std::env::var("PHANTOM_RIG_REPEATS").ok().and_then(|n| n.parse().ok()).unwrap_or(400)
}

/// A neo-Hookean bar of shear modulus G = E/3: the Cauchy stress G (λ² − 1/λ) over λ, from the balance of the free sides.
fn nominal(modulus: f64, stretch: f64) -> f64 {
    let shear = modulus / 3.0;
    let pressure = shear / stretch;
    (shear * stretch * stretch - pressure) / stretch
}

/// What a laboratory gets wrong in one pull: a share of the thickness, and slack in the grips.
fn pull(modulus: f64, width_error: f64, gain: f64, rng: &mut ChaCha8Rng) -> Pull {
    let normal = |sd: f64, rng: &mut ChaCha8Rng| Normal::new(0.0, sd).expect("a deviation").sample(rng);
    let (width, thickness, length) = (6e-3, 3e-3, 33e-3);
    let true_area = (width + width_error) * thickness * (1.0 + rng.random_range(-0.02..0.02));
    let slack = rng.random_range(0.0..0.02);
    let mut strain = Vec::new();
    let mut stress = Vec::new();
    for k in 0..120 {
        let shown = f64::from(k) * 0.005;
        let stretch = ((1.0 + shown) / (1.0 + slack)).max(1.0);
        let force = gain * nominal(modulus, stretch) * true_area + normal(1e-3, rng);
        strain.push(shown);
        stress.push(force / (width * thickness));
    }
    Pull {
        label: "made".to_owned(),
        file: "made.csv".into(),
        column: 3,
        lines: (1..=strain.len() as u64).collect(),
        strain,
        stress,
        source: None,
        width_m: Some(width),
        thickness_m: Some(thickness),
        area_m2: Some(width * thickness),
        gauge_length_m: Some(length),
        rate_per_s: None,
        temperature_c: None,
    }
}

#[test]
fn the_modulus_of_made_dumbbells_is_found() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    for modulus in [20e3, 60e3, 350e3] {
        let mut one = pull(modulus, 0.0, 1.0, &mut rng);
        // Exact sizes: what is left is noise and slack.
        let area = 18e-6;
        let slack = 0.012;
        for (e, s) in one.strain.iter().zip(one.stress.iter_mut()) {
            let noise = Normal::new(0.0, 1e-3).expect("a deviation").sample(&mut rng);
            *s = nominal(modulus, ((1.0 + e) / (1.0 + slack)).max(1.0)) + noise / area;
        }
        let found = dumbbell::estimate(&[one], &dumbbell::Settings::default()).expect("sound");
        assert!((found.modulus_pa / modulus - 1.0).abs() < 0.01, "{} {}", found.modulus_pa, modulus);
    }
}

/// Five specimens of one batch, whose moduli scatter by 4 %, with one die and one load cell: how often does the 90 % interval hold the batch's modulus?
#[test]
fn intervals_hold_the_modulus_as_often_as_they_say() {
    let modulus = 60e3;
    let mut rng = ChaCha8Rng::seed_from_u64(20);
    let settings =
        dumbbell::Settings { model: Some(dumbbell::Elastic::NeoHookean), ..dumbbell::Settings::default() };
    let scatter = Normal::new(0.0, 0.04).expect("a deviation");
    let mut held = 0;
    let repeats = repeats();
    for _ in 0..repeats {
        let width = rng.random_range(-0.05e-3..0.05e-3);
        let gain = 1.0 + rng.random_range(-0.005..0.005);
        let length = rng.random_range(-0.5e-3..0.5e-3) / 33e-3;
        let pulls: Vec<Pull> = (0..5)
            .map(|_| {
                let own: f64 = scatter.sample(&mut rng);
                let mut pull = pull(modulus * (1.0 + own), width, gain, &mut rng);
                pull.strain.iter_mut().for_each(|e| *e *= 1.0 + length);
                pull
            })
            .collect();
        let found = dumbbell::estimate(&pulls, &settings).expect("sound");
        held += usize::from((found.interval_90[0]..=found.interval_90[1]).contains(&modulus));
    }
    let share = held as f64 / repeats as f64;
    println!("{held} of {repeats} intervals of 90 % hold the modulus");
    // 87 to 93 %, and the 1.5 % that so many repeats leave open.
    assert!((0.855..=0.945).contains(&share), "{share}");
}

#[test]
fn slack_and_slope_of_a_made_band_are_found() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let noise = Normal::new(0.0, 0.01).expect("a deviation");
    for (slack_mm, slope, second) in [(3.2, 120.0, 0.0), (1.7, 800.0, 400.0), (6.05, 150.0, 150.0)] {
        let mut x = Vec::new();
        let mut force = Vec::new();
        for k in 0..300 {
            let mm = 0.1 * f64::from(k);
            // A second band beside it, 9 mm longer.
            let one = slope * 1e-3 * f64::max(mm - slack_mm, 0.0);
            let two = second * 1e-3 * f64::max(mm - slack_mm - 9.0, 0.0);
            x.push(1e-3 * mm);
            force.push(one + two + noise.sample(&mut rng));
        }
        let made = Stretching::new("made".to_owned(), x, force);
        let found = bands::estimate(&made, &bands::Settings::default()).expect("sound");
        let line = &found.branches[found.chosen].line;
        println!(
            "slack {slack_mm} mm: {:.3}, slope {slope} N/m: {:.2}",
            1e3 * line.slack_m,
            line.slope_n_per_m
        );
        assert!((1e3 * line.slack_m - slack_mm).abs() < 0.05, "{line:?}");
        assert!((line.slope_n_per_m / slope - 1.0).abs() < 0.01, "{line:?}");
        // The pull lies behind the knee, where there is one.
        let off = (found.stiffness_n_per_m - slope - second).abs();
        assert!(off < 4.0 * found.sd_n_per_m && found.sd_n_per_m < 0.01 * slope, "{off} of {found:?}");
    }
}

/// A bend that cracks half way and stiffens again: a line through its end would be slack where the table carries load, and is refused.
#[test]
fn load_in_what_seems_slack_is_no_band() {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let noise = Normal::new(0.0, 0.05).expect("a deviation");
    let x: Vec<f64> = (0..300).map(|k| 1e-4 * f64::from(k)).collect();
    // Up to 20 N within 5 mm, down to 10 N slowly, then up to 60 N.
    let force = |x: &f64| {
        let mm = 1e3 * x;
        let up = 4.0 * mm.min(5.0);
        let down = (mm - 5.0).clamp(0.0, 15.0) / 15.0 * 10.0;
        up - down + 5.0 * (mm - 20.0).max(0.0) + noise.sample(&mut rng)
    };
    let force: Vec<f64> = x.iter().map(force).collect();
    let made = Stretching::new("made".to_owned(), x, force);
    let error = bands::estimate(&made, &bands::Settings::default()).expect_err("no band").to_string();
    assert!(error.contains("made: a line through the loading is slack up to"), "{error}");
}

/// A curve without noise and without slack, to all digits or to some, of a gel or of a rubber: its own model and its modulus.
#[test]
fn an_exact_dumbbell_has_its_modulus() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for modulus in [60.0, 60e3] {
        for step in [0.0, 1e-9, 1e-7, 1e-5] {
            let mut one = pull(modulus, 0.0, 1.0, &mut rng);
            for (e, s) in one.strain.iter().zip(one.stress.iter_mut()) {
                let exact = nominal(modulus, 1.0 + e);
                *s = if step > 0.0 { (exact / (step * modulus)).round() * step * modulus } else { exact };
            }
            let found = dumbbell::estimate(&[one], &dumbbell::Settings::default()).expect("sound");
            assert_eq!(found.model, dumbbell::Elastic::NeoHookean, "{modulus} {step}");
            assert!(
                (found.modulus_pa / modulus - 1.0).abs() < 1e-3,
                "{modulus} {step}: {}",
                found.modulus_pa
            );
        }
    }
}
