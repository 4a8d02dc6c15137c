//! The room against closed forms, Newton's method and differences.

use super::bench::Poke;
use super::*;
use crate::fem::finite::{Controls, HeldBody, Loads, Solid, Tie};
use crate::fem::material::{Law, Material, Moduli};
use crate::fem::{Order, Profile, Space, Spot};
use crate::geometry::{Disc, Vec3};
use crate::mesh::{Block, block};
use std::sync::Arc;

/// A slab of 60 × 50 × 20 mm glued at its base, poked at its top, on one spring beside.
fn slab(deepest_m: f64) -> Bench {
    let mesh = block(&Block { size_m: [0.06, 0.05, 0.02], cells: [6, 5, 2] }).expect("a block");
    let top = |x: f64, y: f64| Vec3::new(x, y, 0.02);
    Bench {
        mesh,
        fixed: "z-",
        observed: "z+",
        poisson_ratio: 0.45,
        profile: Profile::Uniform,
        pokes: vec![Poke { centre: top(0.026, 0.024), direction: -Vec3::z(), radius_m: 0.007, deepest_m }],
        holds: vec![Hold {
            disc: Disc { centre: top(0.05, 0.025), normal: Vec3::z(), radius: 0.005 },
            softness: 120.0,
        }],
        markers: vec![top(0.013, 0.02), top(0.038, 0.03)],
    }
}

/// A square bar of 10 mm and 40 mm long, clamped at its lower end; ν = 0, so that a uniform traction on the whole of the
/// upper end leaves it homogeneous.
fn bar(deepest_m: f64) -> Bench {
    let mesh = block(&Block { size_m: [0.01, 0.01, 0.04], cells: [2, 2, 4] }).expect("a block");
    let end = Vec3::new(0.005, 0.005, 0.04);
    let pokes = vec![Poke { centre: end, direction: -Vec3::z(), radius_m: 0.009, deepest_m }];
    Bench { mesh, pokes, poisson_ratio: 0.0, holds: Vec::new(), markers: vec![end], ..slab(deepest_m) }
}

fn lab(bench: &Bench) -> Lab {
    Lab::new(bench, Order::P2).expect("a sound bench")
}

fn curves(lab: &Lab, law: Law) -> Curves {
    lab.curves(&[law]).expect("a proper law").remove(0)
}

/// Force along the poke and displacement of the second marker by the braced Newton method, less the linear ones.
fn by_newton(bench: &Bench, law: Law, depth: f64) -> [f64; 2] {
    let space = Arc::new(Space::new(&bench.mesh, Order::P2).expect("a space"));
    let flags: Vec<bool> = space.on_surface(bench.fixed).into_iter().flat_map(|on| [on; 3]).collect();
    let top = space.surface("z+");
    let tip = Spot::disc(&space, top, &bench.pokes[0].centre, bench.pokes[0].radius_m).expect("on top");
    let disc = bench.holds[0].disc;
    let hold = Spot::disc(&space, top, &disc.centre, disc.radius).expect("on top");
    let (marker, _) = Spot::marker(&space, &bench.mesh, "z+", &bench.markers[1]).expect("on top");
    let body = HeldBody::with_pads(space, &flags, std::slice::from_ref(&tip.weights)).expect("held");
    let ties = [
        Tie::pad(&tip.weights, &Vec3::new(0.0, 0.0, -depth)),
        Tie::springs(&hold.weights, 1.0 / bench.holds[0].softness),
    ]
    .concat();
    let read = |law: Law| {
        let moduli = Moduli::new(1.0, bench.poisson_ratio).expect("a solid");
        let solid = Solid::homogeneous(Material::new(moduli, law).expect("a law"));
        let loads = Loads { ties: ties.clone(), ..Loads::default() };
        let found = body.equilibrium(&solid, &loads, None, &Controls::default()).expect("equilibrium");
        [found.tie_forces()[2], marker.of(found.displacement()).x]
    };
    let (with, without) = (read(law), read(Law::Linear));
    [with[0] - without[0], with[1] - without[1]]
}

/// The same mesh, tip and spring, solved by Newton's method with braces: also between the depths that were solved, where
/// the polynomial stands in.
#[test]
fn curves_are_those_of_newtons_method() {
    let bench = slab(0.004);
    let lab = lab(&bench);
    for law in [Law::NeoHookean, Law::Fung { stiffening: 2.0 }, Law::Yeoh { stiffening: 1.0 }] {
        let curves = curves(&lab, law);
        let curve = &curves.pokes[0];
        assert!(curve.stopped.is_none());
        let scale = curve.at(0.004);
        for depth in [0.001, 0.0018, 0.003, 0.004] {
            let [force, marker] = by_newton(&bench, law, depth);
            let here = curve.at(depth);
            assert!(
                (here[2] - force).abs() < 0.01 * scale[2].abs().max(force.abs()),
                "{law:?} {depth}: {here} {force}"
            );
            assert!((here[6] - marker).abs() < 0.01 * scale[6].abs(), "{law:?} {depth}: {here} {marker}");
        }
    }
}

/// Pokes and laws that are solved in step keep their places: each is what it is beside fewer, and as deep as it goes.
#[test]
fn curves_that_are_solved_together_are_told_apart() {
    let mut bench = slab(0.003);
    let aslant = Poke { direction: Vec3::new(0.6, 0.0, -0.8), deepest_m: 0.002, ..bench.pokes[0] };
    bench.pokes.push(aslant);
    let lab = lab(&bench);
    let laws = [Law::NeoHookean, Law::Fung { stiffening: 2.0 }];
    let together = lab.curves(&laws).expect("proper laws");
    assert_eq!(together.len(), 2);
    for (both, law) in together.iter().zip(laws) {
        let alone = curves(&lab, law);
        assert_eq!(both.pokes.len(), 2);
        for ((both, alone), poke) in both.pokes.iter().zip(&alone.pokes).zip(&bench.pokes) {
            assert_eq!(both.holds_to_m, poke.deepest_m);
            let (both, alone) = (both.at(0.002), alone.at(0.002));
            assert!((&both - &alone).amax() < 1e-3 * alone.amax(), "{law:?}: {both} {alone}");
        }
    }
    let [straight, stiffer] = [0, 1].map(|law| together[law].pokes[0].at(0.002));
    assert!((&straight - &stiffer).amax() > 0.02 * stiffer.amax(), "{straight} {stiffer}");
}

/// Value and slope vanish at the surface: at a tenth of the depth a hundredth is left, up to the cubic term.
#[test]
fn curves_begin_flat() {
    let lab = lab(&slab(0.002));
    let curves = curves(&lab, Law::Fung { stiffening: 1.0 });
    let curve = &curves.pokes[0];
    assert_eq!(curve.at(0.0).amax(), 0.0);
    assert_eq!(curve.at(-1e-4).amax(), 0.0);
    assert_eq!(curve.slope(0.0).amax(), 0.0);
    let (whole, tenth) = (curve.at(0.002), curve.at(0.0002));
    assert!(tenth[2].abs() < 0.02 * whole[2].abs() && whole[2] != 0.0, "{tenth} {whole}");
    let rate = (curve.at(0.001_501) - curve.at(0.001_499)) / 2e-6;
    assert!((rate - curve.slope(0.0015)).amax() < 1e-6 * curve.slope(0.0015).amax());
}

/// Two depths are enough for the shape.
#[test]
fn rough_curves_have_the_shape() {
    let lab = lab(&slab(0.004));
    let law = Law::Fung { stiffening: 2.0 };
    let (curves, rough) = (curves(&lab, law), lab.rough_curves(&[law]).expect("a proper law").remove(0));
    for depth in [0.001, 0.002, 0.003, 0.004] {
        let (fine, rough) = (curves.pokes[0].at(depth), rough.pokes[0].at(depth));
        assert!((&fine - rough).amax() < 0.1 * curves.pokes[0].at(0.004).amax(), "{depth}");
    }
}

/// Fung and Yeoh at 0 are neo-Hookean; between the knots the polynomial is close to the solved law, and its derivative
/// is that of the values.
#[test]
fn curves_follow_the_stiffening() {
    let lab = lab(&slab(0.004));
    let finite = curves(&lab, Law::NeoHookean);
    for law in [StiffeningLaw::Fung, StiffeningLaw::Yeoh] {
        let [family] = Stiffening::of([law]);
        let at = |b: f64| family.at(&lab, b).expect("a proper law");
        let values = |c: &Curves| c.pokes[0].at(0.0035);
        let zero = values(&finite);
        assert!((values(&at(0.0).curves) - &zero).amax() < 1e-3 * zero.amax());
        for b in [0.4, 2.0, 5.0] {
            let solved = values(&curves(&lab, law.law(b)));
            let between = at(b);
            let change = (&solved - &zero).amax();
            assert!((values(&between.curves) - &solved).amax() < 0.03 * change, "{law:?} {b}");
            let difference = (values(&at(b + 1e-4).curves) - values(&at(b - 1e-4).curves)) / 2e-4;
            let slope = values(&between.by_stiffening);
            assert!((&slope - &difference).amax() < 1e-6 * slope.amax(), "{law:?} {b}");
        }
        // Roughly, from two depths and along a line.
        let roughly = |b: f64| values(&family.roughly(&lab, b).expect("a proper law").curves);
        let two = values(&curves(&lab, law.law(2.0)));
        assert!((roughly(0.0) - &zero).amax() < 0.1 * zero.amax(), "{law:?}");
        assert!((roughly(2.0) - &two).amax() < 0.1 * two.amax(), "{law:?}");
    }
}

/// A body pressed beyond what it can bear: the curve ends where equilibrium does, or half of the way from the depth before to the one that
/// failed, and says why.
#[test]
fn a_curve_ends_where_equilibrium_does() {
    let mut ends = Vec::new();
    for deepest in [0.01, 0.015, 0.03] {
        let curves = curves(&lab(&slab(deepest)), Law::NeoHookean);
        let curve = &curves.pokes[0];
        assert!(curve.stopped.is_some() == (curve.holds_to_m < deepest), "{}", curve.holds_to_m);
        assert!(curve.at(deepest).iter().all(|x| x.is_finite()));
        ends.push(curve.holds_to_m / deepest);
    }
    assert!(ends[2] < 1.0, "{ends:?}");
    let halfway = |end: &f64| [0.15, 0.45, 0.725, 0.925].iter().any(|half| (end - half).abs() < 1e-9);
    assert!(ends.iter().any(halfway), "{ends:?}");
}

/// F = −E A x/L (1 − r (1 − exp(−E (x_max² − x²)/(2 L² m)))) for a bar, by hand.
#[test]
fn a_bar_softens_as_by_hand() {
    let (young, area, length) = (1e4, 1e-4, 0.04);
    let lab = lab(&bar(0.004));
    let softening = lab.softening().expect("solvable");
    let softened = &softening.pokes[0];
    assert!((softened.mean_density * 2.0 * length * length - 1.0).abs() < 1e-6);
    for (x, deepest, r, m) in [
        (0.002, 0.004, 0.3, 20.0),
        (0.001, 0.004, 0.6, 5.0),
        (0.003, 0.0035, 0.2, 100.0),
        (0.0, 0.004, 0.5, 1.0),
        (0.0039, 0.004, 0.5, 300.0),
    ] {
        let q = (deepest * deepest - x * x) / (2.0 * length * length);
        let expected = young * area * x / length * r * (1.0 - (-young * q / m).exp());
        let found = young * softened.at(x, deepest, r, m, young).value[2];
        let whole = young * area * deepest / length * r;
        assert!((found - expected).abs() < 3e-3 * whole, "{x}: {found} {expected}");
    }
}

/// Nothing without r or on the first way down; on the way up less force the farther up; derivatives by differences.
#[test]
fn softening_acts_on_the_way_back_only() {
    let lab = lab(&slab(0.004));
    let softening = lab.softening().expect("solvable");
    let softened = &softening.pokes[0];
    let at = |x: f64, r: f64, log_m: f64| softened.at(x, 0.004, r, log_m.exp(), 1e4);
    assert_eq!(at(0.002, 0.0, 3.0).value.amax(), 0.0);
    assert_eq!(softened.at(0.004, 0.004, 0.3, 20.0, 1e4).value.amax(), 0.0);
    // Share of the linear force that is lost.
    let lost = |x: f64| at(x, 0.3, 3.0).value[2] / x;
    let shares: Vec<f64> = (1..40).map(|k| lost(1e-4 * f64::from(k))).collect();
    assert!(shares.windows(2).all(|s| s[0] > s[1]) && shares[38] > 0.0, "{shares:?}");
    for (x, r, log_m) in [(0.0015, 0.3, 2.0), (0.003, 0.5, 5.0), (0.0035, 0.1, 1.0)] {
        let here = at(x, r, log_m);
        let central = |up: Softer, down: Softer, step: f64| (up.value - down.value) / (2.0 * step);
        let cases = [
            (here.by_softening, central(at(x, r + 1e-5, log_m), at(x, r - 1e-5, log_m), 1e-5)),
            (here.by_log_scale, central(at(x, r, log_m + 1e-5), at(x, r, log_m - 1e-5), 1e-5)),
            (here.by_depth, central(at(x + 1e-8, r, log_m), at(x - 1e-8, r, log_m), 1e-8)),
        ];
        for (exact, difference) in cases {
            assert!((&exact - &difference).amax() < 1e-4 * exact.amax(), "{x} {r}: {exact} {difference}");
        }
    }
}

/// A tip that stays where it is bears half of a bar that is glued at its other end.
#[test]
fn the_weight_of_a_bar_is_borne_as_by_hand() {
    let bench = bar(0.004);
    let lab = lab(&bench);
    let weight = lab.weight().expect("it bears it");
    let half = 0.5 * 1e-4 * 0.04;
    let acting = &weight[0].acting;
    assert!((acting[(2, 2)] + half).abs() < 1e-9 * half, "{} {half}", acting[(2, 2)]);
    assert!(acting[(5, 2)].abs() < 1e-12);
}

/// The strain under the weight changes the answer as Newton's method has it: a slab made so that, sagged, it is the
/// bench's, pressed by little, less the linear answer of the bench.
#[test]
fn strain_under_the_weight_changes_the_stiffness() {
    let bench = Bench { holds: Vec::new(), ..slab(0.004) };
    let lab = lab(&bench);
    // 4 m/s² on 1050 kg/m³ of 10 kPa.
    let g = 0.42;
    let predicted = g * lab.weight().expect("it bears it")[0].strained[(2, 2)];
    let body_force = Vec3::z() * g;
    let load = lab.body.body_force(&body_force);
    let sag = lab.untouched.linear(&lab.body, &load, &[]).expect("solvable").displacement;
    let sagged = Space::new(&bench.mesh, Order::P2).expect("a space");
    // Only corners move: the sag of the block's edges' middles is nearly the mean of their ends'.
    let mut mesh = bench.mesh.clone();
    for (n, p) in mesh.nodes.iter_mut().enumerate() {
        *p -= Vec3::new(sag[3 * n], sag[3 * n + 1], sag[3 * n + 2]);
    }
    let space = Arc::new(Space::new(&mesh, Order::P2).expect("a space"));
    let flags: Vec<bool> = space.on_surface("z-").into_iter().flat_map(|on| [on; 3]).collect();
    // The tip's weights are those of the sagged shape.
    let tip = Spot::disc(&sagged, sagged.surface("z+"), &bench.pokes[0].centre, 0.007).expect("on top");
    let body = HeldBody::new(space, &flags).expect("held");
    let moduli = Moduli::new(1.0, bench.poisson_ratio).expect("a solid");
    let rubber = Solid::homogeneous(Material::new(moduli, Law::NeoHookean).expect("a law"));
    let tight = Controls { tolerance: 1e-12, ..Controls::default() };
    let rest = body
        .equilibrium(&rubber, &Loads { body_force, ..Loads::default() }, None, &tight)
        .expect("it bears its weight");
    let at_rest = tip.of(rest.displacement());
    let step = 1e-6;
    let moved = at_rest - Vec3::z() * step;
    let loads = Loads { body_force, ties: Tie::pad(&tip.weights, &moved).to_vec(), ..Loads::default() };
    let pressed = body.equilibrium(&rubber, &loads, Some(&rest), &tight).expect("equilibrium");
    let linear = lab.seats[0].along.tie_forces[2];
    let found = pressed.tie_forces()[2] / step - linear;
    assert!((found - predicted).abs() < 0.15 * predicted.abs(), "{found} {predicted}, of {linear}");
}

/// A law adds as good as the same where springs are half a radius aside and softer by a third.
#[test]
fn what_a_law_adds_hardly_knows_where_springs_are() {
    let depth = 0.004;
    let added = |bench: &Bench| {
        let curves = curves(&lab(bench), Law::Fung { stiffening: 2.0 });
        curves.pokes[0].at(depth)
    };
    let mut bench = slab(depth);
    let here = added(&bench);
    bench.holds[0].disc.centre.x -= 0.0025;
    bench.holds[0].softness *= 1.35;
    let there = added(&bench);
    assert!((there[2] / here[2] - 1.0).abs() < 5e-4, "{here} {there}");
    let [before, after] = [&here, &there].map(|all| all.rows(3, 6).into_owned());
    assert!((&after - &before).norm() < 0.02 * before.norm(), "{before} {after}");
    assert_ne!(here, there);
}

/// Both laws of stiffening begin at the same one, whose curves they share.
#[test]
fn laws_of_stiffening_begin_at_one() {
    let lab = lab(&slab(0.003));
    let [fung, yeoh] = Stiffening::of([StiffeningLaw::Fung, StiffeningLaw::Yeoh]);
    let shared = [&fung, &yeoh].map(|law| law.at_zero(&lab).expect("a proper law"));
    assert!(Arc::ptr_eq(&shared[0], &shared[1]));
    for law in [StiffeningLaw::Fung, StiffeningLaw::Yeoh] {
        let own = curves(&lab, law.law(0.0)).pokes[0].at(0.003);
        let shared = shared[0].pokes[0].at(0.003);
        assert!((&own - &shared).amax() < 1e-9 * shared.amax(), "{law:?}");
    }
}
