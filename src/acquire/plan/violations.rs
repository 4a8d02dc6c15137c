//! Is everything that the bench must not do told, with its figures, and all of it at once?

use super::fixture::{START_M, bench, plan, poke};
use super::*;
use crate::acquire::protocol::{ListedPoke, Protocol};
use crate::geometry::Mat3;

fn told(steps: &str, bench: &Bench) -> Vec<String> {
    plan(steps, bench).violations.iter().map(ToString::to_string).collect()
}

/// Exactly one violation, which says all of `words`.
fn only(steps: &str, bench: &Bench, words: &[&str]) {
    let told = told(steps, bench);
    assert_eq!(told.len(), 1, "{told:#?}");
    for word in words {
        assert!(told[0].contains(word), "{told:#?} lacks {word}");
    }
}

#[test]
fn each_violation_is_told_with_its_figures() {
    let at = |site: &str, rest: &str| format!("[[step]]\nkind = \"poke\"\nsite_mm = {site}\n{rest}\n");
    let b = bench();
    only(&poke(""), &Bench { tip_radius_m: 0.08, ..bench() }, &["over an edge", "hangs 30.00 mm"]);
    only(
        &at("[50, 80, 25]", ""),
        &b,
        &["step 1.1.1 (poke, line 6), poke 1: ", "lies 5.00 mm beside the plane"],
    );
    only(
        &at("[50, 75, 26]", ""),
        &b,
        &["(50.00, 75.00, 26.00) mm lies 1.00 mm above the phantom's surface", "0.40 mm"],
    );
    let below = told(&at("[50, 75, 24]", ""), &b);
    assert!(below.iter().any(|v| v.contains("lies 1.00 mm below the phantom's surface")), "{below:#?}");
    assert_eq!(told(&at("[50, 75, 24.61]", ""), &b), Vec::<String>::new());
    only(&at("[5, 75, 25]", ""), &b, &["the tip at (5.00, 75.00, 25.00) mm hangs 3.00 mm over an edge"]);
    only(&poke("direction = [1, 0, 0]"), &b, &["leans 90°", "at most 45°"]);
    only(
        &poke("speed_mm_s = 60\nretreat_speed_mm_s = 1"),
        &b,
        &["press moves axis 1 at 60.000 mm/s; the stage allows 50.000 mm/s"],
    );
    let mut limits = bench().limits;
    limits.acceleration_m_s2[0] = 0.1;
    only(
        &poke(""),
        &Bench { limits, ..bench() },
        &["travel accelerates axis 0 at 195.6 mm/s²; the stage allows 100.0 mm/s²"],
    );
    limits = bench().limits;
    limits.travel_m[1][1] = 0.0225;
    only(
        &poke(""),
        &Bench { limits, ..bench() },
        &["press takes axis 1 to 23.000 mm, outside its travel from 0.000 to 22.500 mm"],
    );
    let mut phantom = bench().phantom;
    phantom.low_m[2] = 0.0225;
    only(
        &poke(""),
        &Bench { phantom, ..bench() },
        &["goes 3.00 mm deep; the phantom is 2.50 mm thick there"],
    );
}

#[test]
fn loads_are_checked_channel_by_channel() {
    // The pad on a layer of 20 kPa: near 0.56 N/mm.
    let mut load = bench().load;
    load.force_n[2] = 1.5;
    only(
        &poke(""),
        &Bench { load, ..bench() },
        &["Fz may reach 1.6", "N at 3.00 mm; the stage is stopped at 1.5 N"],
    );
    load = bench().load;
    load.force_n[1] = 31.0;
    only(
        &poke(""),
        &Bench { load, ..bench() },
        &["bench: the limit of Fy is 31 N, the sensor measures up to 30 N"],
    );
    // 8 mm/s goes 0.336 mm on: 0.19 N.
    load = bench().load;
    load.range[2] = 5.1;
    let told = told(&poke("speed_mm_s = 8"), &Bench { load, ..bench() });
    assert_eq!(told.len(), 2, "the approach as well: {told:#?}");
    assert!(
        told[0].starts_with("bench: stopped at 8.000 mm/s it goes 0.336 mm on, and Fz by up to 0.18"),
        "{told:#?}"
    );
    assert!(told[1].contains("above the limit of 5 N; the sensor measures up to 5.1 N"), "{told:#?}");
}

/// A sensor whose x, y, z lie along the phantom's y, z, x feels a poke along z in its y.
#[test]
fn a_turned_sensor_feels_a_poke_in_another_channel() {
    let mut load = bench().load;
    load.sensor.to_phantom = Mat3::new(0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0);
    load.force_n = [5.0, 1.5, 5.0];
    only(&poke(""), &Bench { load, ..bench() }, &["Fy may reach 1.6", "the stage is stopped at 1.5 N"]);
}

/// A force across the sensor's axis makes a torque about its origin, 40 mm from the tip.
#[test]
fn a_slanted_poke_loads_the_torque_channels() {
    let mut load = bench().load;
    load.torque_nm = 0.03;
    let steps = poke("direction = [0.5, 0, -0.8660254]");
    let bench = Bench { load, ..bench() };
    // Half of 3 mm × 0.56 N/mm across, times 40 mm: 0.0334 N·m about y.
    only(&steps, &bench, &["Ty may reach 0.033 N·m", "stopped at 0.03 N·m"]);
}

#[test]
fn ways_through_the_phantom_are_told() {
    // Beside the slab by 0.2 mm, which the tolerance takes for touching; 8 mm of tip.
    let air = |x: f64| format!("[[step]]\nkind = \"air\"\nsite_mm = [{x}, 75, 20]\n");
    let close = told(&air(108.2), &bench());
    assert!(
        !close.is_empty() && close.iter().all(|v| v.contains("comes closer to the phantom than 0.40 mm")),
        "{close:#?}"
    );
    assert!(
        close
            .iter()
            .any(|v| v.contains("its press from (108.20, 75.00, 21.00) to (108.20, 75.00, 17.00) mm")),
        "{close:#?}"
    );
    assert_eq!(told(&air(108.6), &bench()), Vec::<String>::new());
    // In the air above it: clear until it comes down.
    let above = |z: f64| format!("[[step]]\nkind = \"air\"\nsite_mm = [50, 75, {z}]\n");
    assert_eq!(told(&above(28.6), &bench()), Vec::<String>::new());
    let touching = told(&above(28.3), &bench());
    assert!(touching.iter().any(|v| v.contains("press")), "{touching:#?}");

    // The stage stands with its tip in the gel: the way out goes through it.
    let protocol =
        "format = \"phantom-protocol/1\"\nname = \"n\"\n".to_owned() + &poke("speed_mm_s = 2\ndepth_mm = 1");
    let steps = Protocol::parse("p", &protocol, &[]).expect("sound").expand();
    let inside = Plan::new("n", &steps, &bench(), [0.07, 0.022]);
    assert!(matches!(inside.violations[0].breach, Breach::Ploughs { .. }), "{:?}", inside.violations);
}

#[test]
fn rest_between_contacts_is_kept() {
    let steps = poke("pause_s = 0\nrepeats = 3");
    // From the surface, up and down: 1 mm at 2 mm/s with half a ramp, the lift, the approach, 1 mm again.
    let rest = 0.505 + 2.0 * (4.0_f64 / 200.0).sqrt() + 0.54 + 0.505;
    assert_eq!(told(&steps, &bench()), Vec::<String>::new());
    let bench = Bench { least_rest_s: 2.0, ..bench() };
    let plan = plan(&steps, &bench);
    assert_eq!(plan.violations.len(), 1, "{:?}", plan.violations);
    let Breach::TooSoon { rest_s, least_s } = plan.violations[0].breach else {
        panic!("{:?}", plan.violations)
    };
    assert!((rest_s - rest).abs() < 1e-3 && least_s == 2.0, "{rest_s} {rest}");
    let told = plan.violations[0].to_string();
    assert!(told.starts_with("step 1.1.2 (poke, line 6), poke 2: it touches 1.8"), "{told}");
    assert!(told.ends_with("(in 2 repeats)"), "{told}");
}

#[test]
fn a_poke_for_another_tip_is_refused() {
    let poke = ListedPoke {
        site_m: [0.05, 0.075, 0.025],
        direction: [0.0, 0.0, -1.0],
        radius_m: 0.006,
        depth_m: 0.003,
        rate_m_s: 0.002,
        hold_s: 0.5,
    };
    let protocol = Protocol::of_pokes("list", "n", &[poke], 2.0).expect("sound");
    let plan = Plan::new("n", &protocol.expand(), &bench(), START_M);
    let told: Vec<String> = plan.violations.iter().map(ToString::to_string).collect();
    assert_eq!(told.len(), 1);
    assert!(told[0].contains("meant for a tip of radius 6.00 mm; mounted is one of 8.00 mm"), "{told:#?}");
}

#[test]
fn everything_is_told_at_once() {
    let steps = format!(
        "{}{}",
        poke("speed_mm_s = 60\ndepth_mm = 12"),
        "[[step]]\nkind = \"poke\"\nsite_mm = [5, 75, 27]\n"
    );
    let plan = plan(&steps, &bench());
    let steps_told: Vec<u32> = plan.violations.iter().filter_map(|v| v.at).map(|at| at.id.step).collect();
    assert!(steps_told.iter().filter(|s| **s == 1).count() >= 3, "{:?}", plan.violations);
    assert!(steps_told.iter().filter(|s| **s == 2).count() == 2, "{:?}", plan.violations);
    assert!(plan.table().contains("It can't be run"));
    assert!(plan.drawing(&bench()).contains("Can't be run"));
    let refused = plan.checked().expect_err("refused").to_string();
    assert!(
        refused.starts_with("the bench can't do this; nothing was moved\n") && refused.lines().count() > 5
    );
}

#[test]
fn a_bench_whose_figures_make_no_sense_moves_nothing() {
    for (bench, words) in [
        (Bench { acceleration_m_s2: 0.0, ..bench() }, "the acceleration (m/s²) is 0; expected more than 0"),
        (Bench { travel_speed_m_s: f64::NAN, ..bench() }, "the travel speed (m/s) is NaN"),
        (
            Bench { run_up_m: 1e-4, ..bench() },
            "the run-up (m) is 0.0001; expected at least twice the surface tolerance",
        ),
        (Bench { clearance_m: 1e-3, ..bench() }, "the clearance (m) is 0.001; expected more than the run-up"),
        (
            Bench { stiffness_n_per_m: [200.0, 100.0], ..bench() },
            "the greatest stiffness (N/m) is 100; expected at least",
        ),
        (
            Bench { phantom: PhantomBox { low_m: [0.0; 3], high_m: [0.1, 0.0, 0.1] }, ..bench() },
            "the phantom's extent",
        ),
    ] {
        let plan = plan(&poke(""), &bench);
        assert_eq!(plan.violations.len(), 1, "{words}");
        assert!(plan.violations[0].to_string().contains(words), "{}", plan.violations[0]);
        assert!(plan.steps[0].legs.is_empty());
        assert!(plan.drawing(&bench).starts_with("<svg"));
    }
}
