//! The derivatives of an equilibrium against re-solved equilibria: the remainder of a first-order Taylor
//! expansion must fall with the square of the step.

use crate::bodies::{YOUNG, difference, disc_on_top, norm, slab};
use phantom_rig::fem::Order;
use phantom_rig::fem::finite::{Controls, Equilibrium, HeldBody, Loads, Sensitivity, Solid, Tie, TieKind};
use phantom_rig::fem::material::{Law, Material, Moduli, Parameter};
use phantom_rig::geometry::Vec3;

const NU: f64 = 0.45;
const STIFFENING: f64 = 1.2;

/// A body under everything at once, as a function of the parameter's change.
struct Case {
    body: HeldBody,
    yeoh: bool,
}

impl Case {
    fn new(yeoh: bool) -> Self {
        Self { body: slab(if yeoh { Order::P1 } else { Order::P2 }, [4, 3, 2]), yeoh }
    }

    fn solid(&self, by: Option<&Sensitivity>, t: f64) -> Solid {
        let (mut young, mut poisson, mut stiffening) = (YOUNG, NU, STIFFENING);
        match by {
            Some(Sensitivity::Material(Parameter::YoungModulus)) => young += t,
            Some(Sensitivity::Material(Parameter::PoissonRatio)) => poisson += t,
            Some(Sensitivity::Material(Parameter::Stiffening)) => stiffening += t,
            _ => {}
        }
        let law = if self.yeoh { Law::Yeoh { stiffening } } else { Law::Fung { stiffening } };
        let moduli = Moduli::new(young, poisson).expect("a proper solid");
        let cells = self.body.space().cells().len();
        let mut relative: Vec<f64> = (0..cells).map(|c| 1.0 + 0.1 * (c % 4) as f64).collect();
        if let Some(Sensitivity::ModulusOf(list)) = by {
            list.iter().for_each(|&c| relative[c as usize] *= 1.0 + t);
        }
        Solid::graded(Material::new(moduli, law).expect("a proper law"), relative).expect("positive")
    }

    fn loads(&self, by: Option<&Sensitivity>, t: f64) -> Loads {
        let space = self.body.space();
        let pad = disc_on_top(space, 0.025, 0.024, 0.007);
        let spring = disc_on_top(space, 0.045, 0.02, 0.006);
        let mut ties = Tie::pad(&pad, &Vec3::new(0.0004, -0.0002, -0.0025)).to_vec();
        ties.extend(Tie::springs(&spring, 60.0));
        ties.push(Tie::spring_along(&spring, &Vec3::new(0.6, 0.0, 0.8), 0.0, 0.001));
        ties.push(Tie::spring_along(&spring, &Vec3::new(0.0, 0.6, 0.8), 30.0, 0.001));
        let mut loads = Loads { ties, body_force: Vec3::new(0.0, 0.0, -9.81 * 1050.0), ..Loads::default() };
        match by {
            Some(Sensitivity::TieDisplacement(j)) => loads.ties[*j].displacement += t,
            Some(Sensitivity::TieStiffness(j)) => match &mut loads.ties[*j].kind {
                TieKind::Spring { stiffness } => *stiffness += t,
                TieKind::Rigid => panic!("a pad has no stiffness"),
            },
            Some(Sensitivity::Force(f)) => loads.forces.extend(f.iter().map(|&(c, w)| (c, w * t))),
            _ => {}
        }
        loads
    }

    fn solve(&self, by: Option<&Sensitivity>, t: f64, start: Option<&Equilibrium>) -> Equilibrium {
        let controls = Controls { tolerance: 1e-12, ..Controls::default() };
        let (solid, loads) = (self.solid(by, t), self.loads(by, t));
        self.body.equilibrium(&solid, &loads, start, &controls).expect("equilibrium")
    }
}

#[test]
fn sensitivities_predict_what_re_solving_finds() {
    for case in [Case::new(false), Case::new(true)] {
        let solid = case.solid(None, 0.0);
        let at = case.solve(None, 0.0, None);
        let linearisation = case.body.linearise(&solid, &at).expect("stable");
        let force = disc_on_top(case.body.space(), 0.02, 0.03, 0.006)[0].clone();
        let parameters = [
            (Sensitivity::Material(Parameter::YoungModulus), 400.0),
            (Sensitivity::Material(Parameter::PoissonRatio), 2e-3),
            (Sensitivity::Material(Parameter::Stiffening), 0.2),
            (Sensitivity::ModulusOf((20..90).collect()), 0.1),
            (Sensitivity::TieStiffness(5), 5.0),
            (Sensitivity::TieStiffness(6), 5.0),
            (Sensitivity::TieDisplacement(2), 1e-4),
            (Sensitivity::TieDisplacement(7), 1e-3),
            (Sensitivity::Force(force), 5e-3),
        ];
        for (by, size) in parameters {
            let change = linearisation.change(&by).expect("a known parameter");
            let remainders = |t: f64| {
                let moved = case.solve(Some(&by), t, Some(&at));
                let expand = |x: &[f64], dx: &[f64]| -> Vec<f64> {
                    x.iter().zip(dx).map(|(x, dx)| x + t * dx).collect()
                };
                let u = expand(at.displacement(), &change.displacement);
                let f = expand(at.tie_forces(), &change.tie_forces);
                (difference(moved.displacement(), &u), difference(moved.tie_forces(), &f))
            };
            let (coarse, fine) = (remainders(size), remainders(0.5 * size));
            let (u_order, f_order) = ((coarse.0 / fine.0).log2(), (coarse.1 / fine.1).log2());
            assert!(norm(&change.displacement) > 0.0 && norm(&change.tie_forces) > 0.0, "{by:?}");
            assert!((u_order - 2.0).abs() < 0.15, "displacement by {by:?}: order {u_order}, {fine:?}");
            assert!((f_order - 2.0).abs() < 0.15, "forces by {by:?}: order {f_order}, {fine:?}");
        }
    }
}

/// E and all that pulls with a stiffness or a force may be scaled together without moving anything:
/// E ∂u/∂E + Σ k ∂u/∂k + ∂u/∂(loads) = 0.
#[test]
fn a_common_scale_of_modulus_stiffness_and_force_moves_nothing() {
    let body = slab(Order::P2, [4, 3, 2]);
    let patch = disc_on_top(body.space(), 0.025, 0.024, 0.007);
    let mut loads = Loads {
        ties: Tie::springs(&disc_on_top(body.space(), 0.045, 0.02, 0.006), 60.0).to_vec(),
        ..Loads::default()
    };
    loads.push_force(&patch, &Vec3::new(0.02, 0.01, -0.15));
    let moduli = Moduli::new(YOUNG, NU).expect("a proper solid");
    let solid = Solid::homogeneous(Material::new(moduli, Law::NeoHookean).expect("a proper law"));
    let at = body.equilibrium(&solid, &loads, None, &Controls::default()).expect("equilibrium");
    let linearisation = body.linearise(&solid, &at).expect("stable");
    let change = |by: Sensitivity| linearisation.change(&by).expect("a known parameter").displacement;
    let mut parts = vec![(YOUNG, change(Sensitivity::Material(Parameter::YoungModulus)))];
    parts.extend((0..3).map(|j| (60.0, change(Sensitivity::TieStiffness(j)))));
    parts.push((1.0, change(Sensitivity::Force(loads.forces.clone()))));
    let mut sum = vec![0.0; body.space().components()];
    for (scale, part) in &parts {
        sum.iter_mut().zip(part).for_each(|(s, p)| *s += scale * p);
    }
    assert!(norm(&sum) < 1e-8 * YOUNG * norm(&parts[0].1), "{:e}", norm(&sum));
}
