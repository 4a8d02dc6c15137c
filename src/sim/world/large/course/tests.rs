//! Whether sessions at large strain are right: limits, and finer meshes.

use super::super::effect::{Large, StiffeningLaw};
use super::*;
use crate::observation::Noise;
use crate::sim::draw::Instruments;
use crate::sim::hex_mesh::Slab;
use crate::sim::world::effect::Effect;
use crate::sim::world::phantom::{Disc, Phantom, Site};
use crate::sim::world::plan::Press;
use std::sync::OnceLock;

const QUIET: Noise = Noise { force_n: [0.0; 3], torque_nm: [0.0; 3], marker_m: [0.0; 3], stage_m: [0.0; 3] };

/// A small phantom, made once for all tests here.
fn phantom() -> &'static Phantom {
    static PHANTOM: OnceLock<Phantom> = OnceLock::new();
    PHANTOM.get_or_init(|| {
        let plan = PhantomPlan {
            seed: 3,
            slab: Slab { size_m: [0.075, 0.06, 0.024], glue_end_m: 0.031 },
            poisson_ratio: 0.47,
            // Over the free part and over the glue.
            sites: [[0.0517, 0.0323, 0.024], [0.0163, 0.0285, 0.024]]
                .map(|centre_m| Site { centre_m, inward: [0.0, 0.0, -1.0], radius_m: 0.008 })
                .to_vec(),
            patches: vec![Disc { centre_m: [0.053, 0.037, 0.0], radius_m: 0.005 }],
            spots: Vec::new(),
            marker_spacing_m: 0.012,
        };
        Phantom::prepare(&plan).expect("a sound plan")
    })
}

fn world(effects: Vec<Effect>) -> World {
    world_at(0, effects)
}

fn world_at(site: usize, effects: Vec<Effect>) -> World {
    let press = |depth_m| Press { site, direction: [0.0, 0.0, -1.0], depth_m, rate_m_s: 0.004, hold_s: 0.5 };
    World {
        name: "large".to_owned(),
        seed: 1,
        phantom: phantom().plan.clone(),
        young_modulus_pa: 1e4,
        modulus_range_pa: [5e3, 2e4],
        stated_poisson_ratio: 0.47,
        holds: vec![Hold::Springs { patch: 0, stiffness_n_per_m: 100.0 }],
        pokes: vec![press(0.002), press(0.002), press(0.003), press(0.003)],
        instruments: Instruments { noise: QUIET, ..Instruments::default() },
        fit_cell_m: 0.0065,
        effects,
    }
}

fn line(turns: Vec<f64>) -> Line {
    Line { tip: 0, direction: -Vec3::z(), turns }
}

fn body(world: &World) -> SessionBody {
    SessionBody::new(world, phantom(), None).expect("a body")
}

/// Ways of the first tip, corrected, as a session has them.
fn corrected_ways(effects: Vec<Effect>, turns: Vec<f64>) -> Ways {
    corrected_ways_of(&world(effects), turns)
}

fn corrected_ways_of(world: &World, turns: Vec<f64>) -> Ways {
    let line = line(turns);
    let found = ways(world, &line, &phantom().markers, &USUAL).expect("ways");
    corrected(found, &linear(world, &body(world), &line).expect("linear"))
}

/// A tenth of the depth leaves a tenth of what is not linear; weak stiffening is none.
#[test]
fn small_depths_are_linear_and_weak_laws_are_neo_hookean() {
    let neo = corrected_ways(vec![Effect::Large(Large::FiniteStrain)], vec![0.003]).first;
    let world = world(Vec::new());
    let slope = linear(&world, &body(&world), &line(Vec::new())).expect("linear");
    let off = |depth: f64| neo.force(depth)[2] / (depth * slope.force[2]) - 1.0;
    assert!(off(0.003).abs() > 0.01, "{}", off(0.003));
    let ratio = off(2e-4) / off(2e-5);
    assert!(off(2e-5).abs() < 1e-3 && (8.0..12.0).contains(&ratio), "{ratio}");
    let law = |law, stiffening| {
        corrected_ways(vec![Effect::Large(Large::StrainStiffening { law, stiffening })], vec![0.003]).first
    };
    for weak in [law(StiffeningLaw::Fung, 1e-6), law(StiffeningLaw::Yeoh, 1e-6)] {
        assert!((weak.force(0.003)[2] / neo.force(0.003)[2] - 1.0).abs() < 1e-5);
    }
    // Fung's b and Yeoh's c₂ = b/2 agree in the first term beyond neo-Hooke.
    let (fung, yeoh) = (law(StiffeningLaw::Fung, 0.2), law(StiffeningLaw::Yeoh, 0.1));
    let more = |p: &LoadPath| p.force(0.003)[2] / neo.force(0.003)[2] - 1.0;
    assert!(
        more(&fung) > 1e-3 && (more(&yeoh) / more(&fung) - 1.0).abs() < 0.2,
        "{} {}",
        more(&fung),
        more(&yeoh)
    );
}

/// The first way in does not know of softening; back from a turn and in again the force is less, and meets the first way
/// where it turned. At the surface the stiffness left nears 1 − r from above as m falls below the energy of more and more of the body.
#[test]
fn the_way_back_is_softer_and_meets_the_turn() {
    let softening =
        |softening, scale_j_m3| vec![Effect::Large(Large::StressSoftening { softening, scale_j_m3 })];
    let ways = corrected_ways(softening(0.3, 20.0), vec![0.002, 0.003]);
    let world = world(Vec::new());
    let slope = linear(&world, &body(&world), &line(Vec::new())).expect("linear");
    for depth in [0.0013, 0.003] {
        let force = ways.first.force(depth)[2];
        assert!((force / (depth * slope.force[2]) - 1.0).abs() < 1e-6, "{force}");
    }
    for (turn, back) in &ways.again {
        assert!((back.force(*turn)[2] / ways.first.force(*turn)[2] - 1.0).abs() < 1e-5);
        assert!(back.force(0.5 * turn)[2] / ways.first.force(0.5 * turn)[2] < 0.98);
    }
    assert!(ways.again[1].1.force(0.001)[2] > ways.again[0].1.force(0.001)[2] * 1.0001, "deeper, softer");
    let stiffness_left = |scale_j_m3: f64| {
        let mut free = self::world(softening(0.3, scale_j_m3));
        free.holds.clear();
        let unheld = self::ways(&free, &line(vec![0.003]), &[], &USUAL).expect("ways");
        let [first, again] = [&unheld.first, &unheld.again[0].1].map(|p| p.knots()[0].slope.force[2]);
        again / first
    };
    let left = [10.0, 1.0, 0.3].map(stiffness_left);
    assert!(left.windows(2).all(|pair| pair[1] < pair[0]), "{left:?}");
    assert!(left[2] > 0.7 && left[2] < 0.76, "{left:?}");
}

/// No part of the body loses more than r of its stiffness, so neither does the whole of it, anywhere on the way back, however small
/// m is beside the energy under the tip; and the way back never crosses the way in.
#[test]
fn the_way_back_loses_no_more_than_every_point_may() {
    for site in [0, 1] {
        let sound = world_at(site, Vec::new());
        let stiff = linear(&sound, &body(&sound), &line(Vec::new())).expect("linear").force[2];
        for (softening, scale_j_m3) in [(0.3, 10.0), (0.4, 80.0)] {
            let effect = Effect::Large(Large::StressSoftening { softening, scale_j_m3 });
            let ways = corrected_ways_of(&world_at(site, vec![effect]), vec![0.003]);
            let (turn, back) = &ways.again[0];
            let lost =
                (1..200).map(|i| f64::from(i) / 200.0 * turn).map(|d| 1.0 - back.force(d)[2] / (d * stiff));
            let (least, most) = lost.fold((1.0_f64, 0.0_f64), |(low, high), x| (low.min(x), high.max(x)));
            let case = format!("site {site}, r {softening}, m {scale_j_m3}: {least} to {most}");
            println!("{case}");
            assert!(least > -1e-4 && most < softening + 1e-3, "{case}");
        }
    }
}

/// Poke after poke: the second of equal ones is softer on its way in, the third leaves the second's way where that turned.
#[test]
fn a_softening_session_goes_its_ways() {
    let world = world(vec![Effect::Large(Large::StressSoftening { softening: 0.3, scale_j_m3: 20.0 })]);
    let recording = world.record(phantom()).expect("a recording");
    assert_eq!(recording, world.record(phantom()).expect("again"));
    let force = |poke: usize, depth_m: f64| {
        let row = (50.0 * (recording.pokes[poke].start_s + depth_m / 0.004)).round() as usize;
        -recording.wrench.force_n[row][2]
    };
    // Rows of the sensor round to 10 µN.
    let same = 3e-5;
    assert!(force(0, 0.0012) - force(1, 0.0012) > 0.01, "{} {}", force(0, 0.0012), force(1, 0.0012));
    assert!((force(2, 0.0012) - force(1, 0.0012)).abs() < same);
    assert!(force(2, 0.0012) - force(3, 0.0012) > 1e-3);
    assert!((force(2, 0.003) - force(3, 0.003)).abs() < same);
    assert!((force(0, 0.002) - force(1, 0.002)).abs() < same, "the second meets the first where it turned");
}

#[test]
fn turns_are_where_a_tip_goes_back() {
    let depths = [0.0, 1.0, 2.0, 1.0, 0.0, 1.5, 1.5, 0.5, 2.0, 3.0, 0.0];
    let contact =
        |d: f64| Some(Contact { tip: 0, target: Vec3::x() * d, direction: Vec3::x(), inward: Vec3::x() });
    let found = lines(&depths.map(contact));
    assert_eq!(found, vec![Line { tip: 0, direction: Vec3::x(), turns: vec![2.0, 3.0] }]);
}

/// A soft stage: depth and force on the path add up to what was reported.
#[test]
fn a_soft_stage_goes_less_deep() {
    let path = corrected_ways(vec![Effect::Large(Large::FiniteStrain)], vec![0.003]).first;
    let depth = reached(&path, 0.003, -Vec3::z(), 1e-3);
    assert!((depth - 1e-3 * path.force(depth)[2] - 0.003).abs() < 1e-9 && depth < 0.0029);
}

/// Processor time of this program so far (s).
fn processor_s() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").expect("Linux");
    let fields: Vec<&str> = stat.rsplit(") ").next().expect("fields").split(' ').collect();
    [11, 12].iter().map(|&i| fields[i].parse::<f64>().expect("ticks") / 100.0).sum()
}

/// Meshes against a finer one, at 3 mm, corrected alike: force and markers, in per cent of their peak, with times.
#[test]
#[ignore = "minutes: a study, run by name with --nocapture"]
fn refinement_study() -> Result<(), SimError> {
    let plan = crate::sim::world::stock(1, 0);
    let phantom = Phantom::prepare(&plan)?;
    let mut world = world(Vec::new());
    let press = |site: usize, depth_m: f64| Press {
        site,
        direction: plan.sites[site].inward,
        depth_m,
        rate_m_s: 0.004,
        hold_s: 1.0,
    };
    world.phantom = plan.clone();
    world.holds.push(Hold::Springs { patch: 1, stiffness_n_per_m: 60.0 });
    world.pokes = [(0, 0.003), (0, 0.002), (1, 0.003), (2, 0.003), (3, 0.003), (8, 0.002), (0, 0.003)]
        .map(|(site, depth)| press(site, depth))
        .into();
    let fine = Cut {
        cell_m: 0.008,
        glue_end_m: 0.003,
        tip_share: 0.25,
        patch_share: 0.7,
        spot_share: 0.4,
        growth: 0.7,
        halvings: 3,
        along: 2,
    };
    let others = [
        USUAL,
        Cut { along: 3, ..USUAL },
        Cut { tip_share: 0.35, growth: 1.0, halvings: 3, ..USUAL },
        Cut { tip_share: 0.35, growth: 1.0, halvings: 3, along: 3, ..USUAL },
    ];
    let cases = [
        Large::FiniteStrain,
        Large::StrainStiffening { law: StiffeningLaw::Fung, stiffening: 2.0 },
        Large::StressSoftening { softening: 0.3, scale_j_m3: 20.0 },
    ];
    for large in cases {
        world.effects = vec![Effect::Large(large)];
        let start = processor_s();
        world.record(&phantom)?;
        println!("{large:?}: a session takes {:.2} s", processor_s() - start);
        let body = SessionBody::new(&world, &phantom, None)?;
        for tip in [0, 2, 4] {
            let (direction, depth) = (
                Vec3::from(world.phantom.sites[world.touched()[tip]].inward),
                if tip < 4 { 0.003 } else { 0.002 },
            );
            let line = Line { tip, direction, turns: vec![depth] };
            let slope = linear(&world, &body, &line)?;
            let on = |cut: &Cut| -> Result<(Ways, f64), SimError> {
                let start = processor_s();
                let ways = corrected(ways(&world, &line, &phantom.markers, cut)?, &slope);
                Ok((ways, processor_s() - start))
            };
            let exact = on(&fine)?.0;
            let of = |w: &Ways, at: f64, back: bool| {
                let path = if back && !w.again.is_empty() { &w.again[0].1 } else { &w.first };
                let moved: Vec<f64> = (0..phantom.markers.len()).flat_map(|m| path.watched(at, m)).collect();
                (Vec3::from(path.force(at)).dot(&direction), moved)
            };
            for cut in &others {
                let (found, seconds) = on(cut)?;
                print!("  tip {tip}, rim {}, {} points, {seconds:.2} s:", cut.tip_share, cut.along);
                for (at, back) in [(depth, false), (0.5 * depth, true)] {
                    let ((f, u), (g, v)) = (of(&found, at, back), of(&exact, at, back));
                    let straight = at * Vec3::from(slope.force).dot(&direction);
                    let peak = v.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
                    let apart = u.iter().zip(&v).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
                    print!(
                        " at {:.2} mm force {:+.3} % off linear, {:+.3} % off finer, markers {:.3} %;",
                        1e3 * at,
                        100.0 * (g / straight - 1.0),
                        100.0 * (f / g - 1.0),
                        100.0 * apart / peak
                    );
                }
                println!();
            }
        }
    }
    Ok(())
}
