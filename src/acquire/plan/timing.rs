//! Do the motions go where they should, when they should?

use super::fixture::{START_M, bench, plan, poke};
use super::motions::BEFORE_S;
use super::*;
use crate::acquire::protocol::{Protocol, from_poke};

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-9
}

#[test]
fn a_poke_goes_there_in_its_phases() {
    let plan = plan(&poke("hold_s = 0.5\npause_s = 2\nretreat_speed_mm_s = 4"), &bench());
    assert_eq!(plan.violations, []);
    let legs = &plan.steps[0].legs;
    let phases: Vec<&str> = legs.iter().map(|leg| leg.phase.name()).collect();
    // The stage homes above the clearance: one travel, straight there.
    assert_eq!(phases, ["travel", "rest", "approach", "press", "hold", "retreat", "travel"]);
    // Stage coordinates: x from −20 mm, depth from z = 45 mm.
    let targets: Vec<[f64; 2]> =
        legs.iter().filter_map(|leg| leg.motion).map(|m| m.target_m.map(|t| (t * 1e6).round())).collect();
    assert_eq!(targets, [[70e3, 15e3], [70e3, 19e3], [70e3, 23e3], [70e3, 19e3], [70e3, 15e3]]);
    for pair in legs.windows(2) {
        assert!(near(pair[0].end_s(), pair[1].start_s));
        let to = pair[0].motion.map_or(pair[0].from_m, |motion| motion.target_m);
        assert_eq!(to, pair[1].from_m);
    }
}

/// By hand: every motion reaches its speed, `T = L/v + v/a` with a = 200 mm/s².
#[test]
fn durations_are_closed_forms() {
    let plan = plan(&poke("hold_s = 0.5\npause_s = 2\nretreat_speed_mm_s = 4"), &bench());
    let step = &plan.steps[0];
    let travel = 70.0_f64.hypot(15.0) / 30.0 + 30.0 / 200.0;
    let approach = 4.0 / 8.0 + 8.0 / 200.0;
    let press = 4.0 / 2.0 + 2.0 / 200.0;
    let retreat = 4.0 / 4.0 + 4.0 / 200.0;
    // 4 mm at 30 mm/s and 200 mm/s² is a triangle.
    let lift = 2.0 * (4.0_f64 / 200.0).sqrt();
    let expected = [travel, 2.0, approach, press, 0.5, retreat, lift];
    for (leg, expected) in step.legs.iter().zip(expected) {
        assert!(near(leg.duration_s, expected), "{}: {} {expected}", leg.phase.name(), leg.duration_s);
    }
    assert!(near(plan.duration_s, expected.iter().sum()));
    // It touches after 1 mm of the press, at steady speed: 1/2 s and half a ramp of 0.01 s.
    let contact = step.contact.expect("a contact");
    assert!(near(contact.start_s, travel + 2.0 + approach + 0.5 + 0.005));
    assert!(near(contact.end_s, expected[..6].iter().sum::<f64>() - 1.0 / 4.0 - 0.01));
    let bytes = (36_000.0 + 2000.0 + 79_200.0) * (plan.duration_s + BEFORE_S);
    assert!((plan.data_bytes() / bytes - 1.0).abs() < 1e-12);
}

/// At 8 mm/s, 34 ms and 500 mm/s²: 0.272 mm and 0.064 mm.
#[test]
fn overshoot_is_latency_and_braking() {
    let plan = plan(&poke("speed_mm_s = 8"), &bench());
    let contact = plan.steps[0].contact.expect("a contact");
    assert!(near(contact.overshoot_m, 0.272e-3 + 0.064e-3));
    assert!(near(contact.overshoot_n, 0.336e-3 * bench().stiffness_n_per_m[1]));
    let [soft, stiff] = bench().stiffness_n_per_m;
    assert!(near(contact.force_n[0], soft * 3e-3) && near(contact.force_n[1], stiff * 3e-3));
}

#[test]
fn a_force_ends_a_press_where_the_stiffness_says_so() {
    let bench = Bench { stiffness_n_per_m: [200.0, 200.0], ..bench() };
    let plan = plan(&poke("until_force_n = 0.4\ndepth_limit_mm = 4"), &bench);
    let press = plan.steps[0].legs[3];
    let depth = press.depth_m.expect("depths");
    assert!(near(depth[0], -1e-3) && near(depth[1], 2e-3));
    // It aims at the bound all the same, and goes back from where it is expected to have ended.
    assert_eq!(press.motion.map(|m| (m.target_m[1] * 1e6).round()), Some(24e3));
    assert!(near(press.duration_s, 3.0 / 2.0 + 2.0 / 200.0));
    assert!((plan.steps[0].legs[4].from_m[1] - 0.022).abs() < 1e-12);
    let contact = plan.steps[0].contact.expect("a contact");
    // 2 mm/s for 34 ms and the 15 ms in which a force is known, then 200 mm/s²: 0.098 mm + 0.010 mm.
    assert!(near(contact.force_n[1], 0.4 + 200.0 * 0.108e-3));
}

#[test]
fn cycles_go_to_and_fro_between_their_ends() {
    let steps = "[[step]]\nkind = \"cycles\"\nsite_mm = [50, 75, 25]\noffset_mm = 2\namplitude_mm = 1\ncycles = 3\nspeed_mm_s = 4\n";
    let plan = plan(steps, &bench());
    assert_eq!(plan.violations, []);
    let ends: Vec<f64> = plan.steps[0]
        .legs
        .iter()
        .filter(|leg| matches!(leg.phase, Phase::Press | Phase::Cycle))
        .map(|leg| leg.depth_m.expect("depths")[1] * 1e3)
        .collect();
    assert_eq!(ends.iter().map(|d| d.round()).collect::<Vec<_>>(), [1.0, 3.0, 1.0, 3.0, 1.0, 3.0, 1.0]);
    let cycle = plan.steps[0].legs.iter().find(|leg| leg.phase == Phase::Cycle).expect("a cycle");
    assert!(near(cycle.duration_s, 2.0 / 4.0 + 4.0 / 200.0));
}

/// From a place beside the phantom and below its top: up, aside, and never through it.
#[test]
fn travel_rises_before_it_goes_aside() {
    let air = "[[step]]\nkind = \"air\"\nsite_mm = [115, 75, 18]\n";
    let plan = plan(&format!("{air}{}", poke("")), &bench());
    assert_eq!(plan.violations, []);
    let first = &plan.steps[0].legs;
    let down: Vec<[f64; 2]> = first
        .iter()
        .take_while(|leg| leg.phase == Phase::Travel)
        .filter_map(|leg| leg.motion)
        .map(|m| m.target_m.map(|t| (t * 1e6).round()))
        .collect();
    assert_eq!(down, [[135e3, 15e3], [135e3, 22e3]], "across at the clearance, then down beside");
    let second = &plan.steps[1].legs;
    assert_eq!(second[0].motion.map(|m| m.target_m.map(|t| (t * 1e6).round())), Some([135e3, 15e3]));
    assert_eq!(second[1].motion.map(|m| m.target_m.map(|t| (t * 1e6).round())), Some([70e3, 15e3]));
    assert!(plan.steps[0].contact.is_none());
}

/// Where nothing is touched the tip goes as fast as the slower axis may; a press that is too fast is refused, not slowed down.
#[test]
fn travel_is_as_fast_as_the_axes_may_go() {
    let mut limits = bench().limits;
    limits.speed_m_s = [0.02, 0.004];
    let slow = Bench { limits, ..bench() };
    let plan = plan(&poke(""), &slow);
    assert_eq!(plan.violations, []);
    let legs = &plan.steps[0].legs;
    let mut fastest = [0.0_f64; 2];
    for leg in legs {
        let Some(motion) = leg.motion else { continue };
        let way: [f64; 2] = std::array::from_fn(|i| (motion.target_m[i] - leg.from_m[i]).abs());
        let length = f64::hypot(way[0], way[1]);
        for axis in 0..2 {
            let speed = motion.speed_m_s * way[axis] / length;
            assert!(speed <= limits.speed_m_s[axis] * (1.0 + 1e-9), "{leg:?}");
            fastest[axis] = fastest[axis].max(speed);
        }
    }
    // A hundredth less, since steps of the stage turn a way a little.
    assert!(near(fastest[1], 0.99 * 0.004) && fastest[0] > 0.015, "{fastest:?}");
}

/// An axis that goes up when the tip does, as a mill's: the same places, the other sign.
#[test]
fn the_second_axis_may_lead_out() {
    let mounting =
        crate::device::Mounting::new([-0.02, 0.075, 0.045], [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], 1e-4)
            .expect("two axes");
    let mut limits = bench().limits;
    limits.travel_m[1] = [-0.035, 0.0];
    let steps = format!("[[step]]\nkind = \"air\"\nsite_mm = [115, 75, 18]\n{}", poke(""));
    let (down, up) = (plan(&steps, &bench()), plan(&steps, &Bench { mounting, limits, ..bench() }));
    assert_eq!(up.violations, []);
    let targets = |plan: &Plan, sign: f64| -> Vec<[f64; 2]> {
        let motions = plan.steps.iter().flat_map(|step| &step.legs).filter_map(|leg| leg.motion);
        motions.map(|m| [m.target_m[0], sign * m.target_m[1]].map(|t| (t * 1e7).round())).collect()
    };
    assert_eq!(targets(&down, 1.0), targets(&up, -1.0));
    assert!(near(down.duration_s, up.duration_s));
}

/// On skew axes the stage goes farther than the tip; the tip's speed is what was asked for.
#[test]
fn speeds_are_those_of_the_tip_also_on_skew_axes() {
    let slanted = (0.1_f64, (1.0 - 0.01_f64).sqrt());
    let mounting = crate::device::Mounting::new(
        [-0.02, 0.075, 0.045],
        [[slanted.1, 0.0, slanted.0], [0.0, 0.0, -1.0]],
        1e-4,
    )
    .expect("two axes");
    let plan = plan(&poke(""), &Bench { mounting, ..bench() });
    for leg in &plan.steps[0].legs {
        let Some(motion) = leg.motion else { continue };
        let way = std::array::from_fn(|i| motion.target_m[i] - leg.from_m[i]);
        let (tip, stage) = (mounting.moved_by(way).norm(), f64::hypot(way[0], way[1]));
        let expected = if leg.phase == Phase::Press { 0.002 } else { motion.speed_m_s * tip / stage };
        assert!(near(motion.speed_m_s * tip / stage, expected));
        let alone = Trapezoid::new(stage, motion.speed_m_s, motion.acceleration_m_s2).duration_s();
        assert!(near(alone, leg.duration_s), "{}", leg.phase.name());
    }
    let across = plan.steps[0].legs[0].motion.expect("a motion");
    assert!(across.speed_m_s > 0.0301, "the way is not at right angles: {}", across.speed_m_s);
}

#[test]
fn the_examples_can_be_run_and_drawn() {
    for (file, text, pokes) in [
        ("five-pokes.toml", include_str!("../../../rigs/protocols/five-pokes.toml"), 5),
        ("grid-and-cycles.toml", include_str!("../../../rigs/protocols/grid-and-cycles.toml"), 18),
    ] {
        let protocol = Protocol::parse(file, text, &[]).expect("sound");
        let steps = protocol.expand();
        let plan = Plan::new(protocol.name(), &steps, &bench(), START_M);
        assert_eq!(plan.pokes(), pokes);
        let table = plan.table();
        assert_eq!(table.lines().count(), steps.len() + 4, "title, recording, blank, head");
        let drawing = plan.drawing(&bench());
        assert!(drawing.starts_with("<svg") && drawing.contains("depth (mm)") && !drawing.contains("NaN"));
        assert!(
            Plan::is_drawing(&drawing.as_bytes()[..1024]) && !Plan::is_drawing(b"<svg xmlns=\"\"></svg>")
        );
        let rest = from_poke(&steps, 3).expect("there is one");
        let rest = Plan::new(protocol.name(), rest, &bench(), [0.05, 0.01]);
        assert_eq!(rest.steps[0].step.poke, Some(3));
        rest.checked().expect("sound");
        plan.checked().expect("sound");
    }
}
