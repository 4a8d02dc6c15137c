//! Does Newton's method behave as its theory says: quadratic convergence, the linear limit, conservation of
//! energy, honest failures, and results that do not depend on threads or on the way.

use crate::bodies::{YOUNG, difference, disc_on_top, dot, norm, read, slab, solid};
use phantom_rig::fem::finite::{Controls, Equilibrium, FiniteError, HeldBody, Loads, Tie};
use phantom_rig::fem::material::{Law, MaterialError};
use phantom_rig::fem::{Order, cell_stiffness};
use phantom_rig::geometry::Vec3;
use phantom_rig::sparse::{Analysis, Ordering, Pattern, SymmetricMatrix};
use std::sync::Arc;

const NU: f64 = 0.47;

fn pressed(body: &HeldBody, depth: f64) -> Loads {
    let patch = disc_on_top(body.space(), 0.028, 0.026, 0.006);
    let mut ties = Tie::pad(&patch, &Vec3::new(0.2 * depth, -0.1 * depth, -depth)).to_vec();
    ties.extend(Tie::springs(&disc_on_top(body.space(), 0.045, 0.02, 0.005), 40.0));
    Loads { ties, ..Loads::default() }
}

fn solve(body: &HeldBody, law: Law, loads: &Loads) -> Equilibrium {
    let controls = Controls { tolerance: 1e-12, ..Controls::default() };
    body.equilibrium(&solid(NU, law), loads, None, &controls).expect("equilibrium")
}

/// K₁ u with the linear stiffness of the whole body, assembled on its own; and K⁻¹ b for functionals b.
struct LinearBody {
    free: Vec<usize>,
    factor: phantom_rig::sparse::Factor,
}

impl LinearBody {
    fn new(body: &HeldBody) -> Self {
        let space = body.space();
        let free: Vec<usize> = body.free().iter().map(|&c| c as usize).collect();
        let mut unknown = vec![usize::MAX; space.components()];
        free.iter().enumerate().for_each(|(x, &c)| unknown[c] = x);
        let lists: Vec<Vec<(usize, u32)>> = space
            .cells()
            .map(|nodes| {
                let components = nodes.iter().flat_map(|&n| [0, 1, 2].map(|i| 3 * n as usize + i));
                let places = components.enumerate().filter(|&(_, c)| unknown[c] != usize::MAX);
                places.map(|(at, c)| (at, unknown[c] as u32)).collect()
            })
            .collect();
        let ids: Vec<Vec<u32>> = lists.iter().map(|l| l.iter().map(|p| p.1).collect()).collect();
        let pattern = Arc::new(Pattern::from_elements(free.len(), ids.iter().map(Vec::as_slice)));
        let mut matrix = SymmetricMatrix::zeros(Arc::clone(&pattern));
        let side = 3 * space.order().cell_nodes();
        for (cell, (list, ids)) in lists.iter().zip(&ids).enumerate() {
            let k = cell_stiffness(space, cell as u32, NU);
            let kept: Vec<f64> =
                list.iter().flat_map(|r| list.iter().map(|c| YOUNG * k[r.0 * side + c.0])).collect();
            matrix.add_element(ids, &kept);
        }
        let analysis = Analysis::new(&pattern, Ordering::MinimumDegree).expect("analysis");
        Self { free, factor: analysis.factor(&matrix).expect("held") }
    }

    /// u = K⁻¹ f over all components.
    fn solve(&self, force: &[f64]) -> Vec<f64> {
        let mut x: Vec<f64> = self.free.iter().map(|&c| force[c]).collect();
        self.factor.solve_in_place(&mut x, 1).expect("as many numbers as unknowns");
        let mut u = vec![0.0; force.len()];
        self.free.iter().zip(x).for_each(|(&c, x)| u[c] = x);
        u
    }
}

/// e_{k+1} ≤ C e_k² near the solution: the exponent between successive residuals tends to 2.
#[test]
fn newton_converges_quadratically() {
    for (order, cells) in [(Order::P1, [8, 7, 4]), (Order::P2, [5, 4, 2])] {
        let body = slab(order, cells);
        for law in [Law::NeoHookean, Law::Yeoh { stiffening: 2.0 }, Law::Fung { stiffening: 2.0 }] {
            let found = solve(&body, law, &pressed(&body, 0.003));
            let last = &found.steps().last().expect("one step").residuals;
            // Above rounding, and close enough for the square to rule.
            let seen: Vec<f64> = last[1..].iter().copied().filter(|&r| r < 0.05 && r > 1e-14).collect();
            let exponents: Vec<f64> =
                seen.windows(3).map(|r| (r[2] / r[1]).ln() / (r[1] / r[0]).ln()).collect();
            let best = exponents.iter().copied().fold(0.0, f64::max);
            assert!(best > 1.7, "{order:?} {law:?}: residuals {last:?}, exponents {exponents:?}");
        }
    }
}

/// A force so small that strains are 1e-7: all laws give the linear solution, to the size of the strain.
#[test]
fn a_small_load_gives_the_linear_solution() {
    for order in [Order::P1, Order::P2] {
        let body = slab(order, [5, 4, 2]);
        let patch = disc_on_top(body.space(), 0.028, 0.026, 0.006);
        let mut loads = Loads { body_force: Vec3::new(0.0, 2e-4, -1e-3), ..Loads::default() };
        loads.push_force(&patch, &Vec3::new(2e-8, 0.0, -1e-7));
        // A body force of b is the force b V / 4 on each corner of P1 cells, and on P2 cells −b V / 20 on
        // corners and b V / 5 on edges.
        let mut force = vec![0.0; body.space().components()];
        loads.forces.iter().for_each(|&(c, f)| force[c as usize] += f);
        for (cell, nodes) in body.space().cells().enumerate() {
            let [a, b, c, d] = body.space().corners(cell as u32);
            let volume = (b - a).cross(&(c - a)).dot(&(d - a)) / 6.0;
            for (at, &n) in nodes.iter().enumerate() {
                let share = match (order, at) {
                    (Order::P1, _) => 0.25,
                    (Order::P2, 0..4) => -0.05,
                    (Order::P2, _) => 0.2,
                };
                for i in 0..3 {
                    force[3 * n as usize + i] += share * volume * loads.body_force[i];
                }
            }
        }
        let linear = LinearBody::new(&body).solve(&force);
        for law in
            [Law::Linear, Law::NeoHookean, Law::Yeoh { stiffening: 1.0 }, Law::Fung { stiffening: 1.0 }]
        {
            let found = solve(&body, law, &loads);
            let error = difference(found.displacement(), &linear) / norm(&linear);
            let limit = if law == Law::Linear { 1e-9 } else { 1e-5 };
            assert!(error < limit, "{order:?} {law:?}: {error:e}");
        }
    }
}

/// A pad moved by little needs the force of the condensed linear body: C F = d, C_ij = b_i · K⁻¹ b_j. The
/// departure is in proportion to the depth.
#[test]
fn a_shallow_pad_agrees_with_the_condensed_compliance() {
    let body = slab(Order::P2, [5, 4, 2]);
    let patch = disc_on_top(body.space(), 0.028, 0.026, 0.006);
    let linear = LinearBody::new(&body);
    let mut compliance = nalgebra::Matrix3::zeros();
    for (j, column) in patch.iter().enumerate() {
        let mut force = vec![0.0; body.space().components()];
        column.iter().for_each(|&(c, w)| force[c as usize] += w);
        let u = linear.solve(&force);
        for (i, row) in patch.iter().enumerate() {
            compliance[(i, j)] = read(row, &u);
        }
    }
    let direction = Vec3::new(0.3, -0.2, -1.0);
    let departure = |depth: f64, law: Law| {
        let displacement = direction * depth;
        let condensed = compliance.try_inverse().expect("compliant") * displacement;
        let loads = Loads { ties: Tie::pad(&patch, &displacement).to_vec(), ..Loads::default() };
        let found = solve(&body, law, &loads);
        for (i, reached) in found.tie_displacements().iter().enumerate() {
            assert!((reached - displacement[i]).abs() < 1e-12 * depth);
        }
        (Vec3::from_column_slice(found.tie_forces()) - condensed).norm() / condensed.norm()
    };
    assert!(departure(1e-3, Law::Linear) < 1e-9);
    let (coarse, fine) = (departure(2e-5, Law::NeoHookean), departure(1e-5, Law::NeoHookean));
    assert!(fine < 2e-3 && (coarse / fine - 2.0).abs() < 0.1, "{coarse:e} {fine:e}");
}

/// Equal work and energy along a path: Simpson's rule over the pad's force against its displacement, and the
/// energy in the body and its springs. The rule's error falls with the fourth power of the spacing.
#[test]
fn the_work_of_the_pad_is_the_stored_energy() {
    let body = slab(Order::P2, [4, 3, 2]);
    for law in [Law::NeoHookean, Law::Fung { stiffening: 1.5 }] {
        let solid = solid(NU, law);
        let mismatch = |intervals: usize| {
            let mut last: Option<Equilibrium> = None;
            let mut power = vec![0.0];
            let depth = 0.004;
            for k in 1..=intervals {
                let loads = pressed(&body, depth * k as f64 / intervals as f64);
                let found = body.equilibrium(&solid, &loads, last.as_ref(), &Controls::default());
                let found = found.expect("equilibrium");
                power.push(dot(&found.tie_forces()[..3], &found.tie_displacements()[..3]) / (k as f64));
                last = Some(found);
            }
            // Forces times the displacement of one interval.
            let work: f64 = power.windows(3).step_by(2).map(|p| (p[0] + 4.0 * p[1] + p[2]) / 3.0).sum();
            let end = last.expect("some interval");
            let springs: f64 =
                end.tie_displacements()[3..].iter().map(|value| 0.5 * 40.0 * value * value).sum();
            assert!(springs > 1e-4 * end.energy(), "the springs take part");
            (work / (end.energy() + springs) - 1.0).abs()
        };
        let (coarse, fine) = (mismatch(4), mismatch(8));
        assert!(fine < 1e-5 && coarse / fine > 8.0, "{law:?}: {coarse:e} {fine:e}");
    }
}

/// Elastic: the end does not depend on the load steps, on the start, or on the number of threads; for threads
/// not even in the last bit.
#[test]
fn the_equilibrium_does_not_depend_on_the_way_or_on_threads() {
    let body = slab(Order::P2, [4, 3, 2]);
    let loads = pressed(&body, 0.004);
    let whole = solve(&body, Law::NeoHookean, &loads);
    let small = Controls { first_step: 0.2, tolerance: 1e-12, ..Controls::default() };
    let material = solid(NU, Law::NeoHookean);
    let stepped = body.equilibrium(&material, &loads, None, &small).expect("equilibrium");
    assert!(stepped.steps().len() >= 3);
    let start = solve(&body, Law::NeoHookean, &pressed(&body, -0.001));
    let continued = body.equilibrium(&material, &loads, Some(&start), &small).expect("equilibrium");
    for other in [&stepped, &continued] {
        let error = difference(other.displacement(), whole.displacement()) / norm(whole.displacement());
        assert!(error < 1e-10, "{error:e}");
    }
    for threads in [1, 2, 5] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let again = pool.install(|| solve(&body, Law::NeoHookean, &loads));
        assert_eq!(again.displacement(), whole.displacement(), "{threads} threads");
        assert_eq!(again.tie_forces(), whole.tie_forces());
    }
}

/// Springs stiff enough become a pad, springs without stiffness nothing.
#[test]
fn springs_lie_between_nothing_and_a_pad() {
    let body = slab(Order::P1, [6, 5, 3]);
    let patch = disc_on_top(body.space(), 0.028, 0.026, 0.006);
    let depth = Vec3::new(0.0, 0.0, -0.002);
    let tied = |ties: Vec<Tie>| solve(&body, Law::NeoHookean, &Loads { ties, ..Loads::default() });
    let pad = tied(Tie::pad(&patch, &depth).to_vec());
    let across = |stiffness: f64| {
        let mut ties = Tie::pad(&patch, &depth).to_vec();
        ties[2] = Tie::spring_along(&patch, &Vec3::z(), stiffness, depth.z);
        tied(ties)
    };
    let stiff = across(1e9);
    assert!(difference(stiff.displacement(), pad.displacement()) < 1e-5 * norm(pad.displacement()));
    let slack = across(0.0);
    assert!(norm(slack.displacement()) == 0.0 && slack.tie_forces()[2] == 0.0);
    // In between: the force is what the spring's stretch says, and balances at both ends.
    let middle = across(100.0);
    let stretch = middle.tie_displacements()[2] - depth.z;
    assert!((middle.tie_forces()[2] + 100.0 * stretch).abs() < 1e-12);
    let reaction: f64 = middle.reactions().iter().filter(|(c, _)| c % 3 == 2).map(|r| r.1).sum();
    assert!((reaction + middle.tie_forces()[2]).abs() < 1e-8 * reaction.abs());
}

#[test]
fn failures_are_told_apart() {
    let body = slab(Order::P1, [5, 4, 2]);
    let neo = solid(NU, Law::NeoHookean);
    let once = Controls { iterations: 1, smallest_step: 1.0, ..Controls::default() };
    let error = body.equilibrium(&neo, &pressed(&body, 0.004), None, &once).expect_err("one iteration");
    let FiniteError::LoadStepTooSmall { reached: 0.0, because, .. } = error else { panic!("{error}") };
    assert!(matches!(*because, FiniteError::OutOfIterations { iterations: 1, .. }), "{because}");

    let few = Controls { total_iterations: 2, ..Controls::default() };
    let error = body.equilibrium(&neo, &pressed(&body, 0.004), None, &few).expect_err("two iterations");
    assert!(matches!(error, FiniteError::OutOfIterations { iterations: 2, .. }), "{error}");

    // Pushed through its own base: no step size helps, and the last reason is a cell turned inside out.
    let one_step = Controls { smallest_step: 1.0, ..Controls::default() };
    let error = body.equilibrium(&neo, &pressed(&body, 0.1), None, &one_step).expect_err("through the base");
    let FiniteError::LoadStepTooSmall { because, .. } = error else { panic!("{error}") };
    let FiniteError::Cell { source: MaterialError::Inverted { jacobian }, .. } = *because else {
        panic!("{because}")
    };
    assert!(jacobian <= 0.0);

    // A softening law loses stability.
    let soft = solid(NU, Law::Yeoh { stiffening: -30.0 });
    let error = body.equilibrium(&soft, &pressed(&body, 0.006), None, &one_step).expect_err("unstable");
    let FiniteError::LoadStepTooSmall { because, .. } = error else { panic!("{error}") };
    assert!(matches!(*because, FiniteError::TangentNotPositiveDefinite { .. }), "{because}");

    // The same place tied twice.
    let mut twice = pressed(&body, 0.001);
    let pad = twice.ties[2].clone();
    twice.ties.push(pad);
    let error = body.equilibrium(&neo, &twice, None, &Controls::default()).expect_err("tied twice");
    assert!(matches!(error, FiniteError::TiesDependent { ties: 7 }), "{error}");

    let loose = Loads { prescribed: vec![(body.free()[0] as usize, 0.0)], ..Loads::default() };
    let error = body.equilibrium(&neo, &loose, None, &Controls::default()).expect_err("not held");
    assert!(matches!(error, FiniteError::NotHeld { .. }), "{error}");
}
