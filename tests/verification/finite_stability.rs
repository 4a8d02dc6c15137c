//! What is stable under a given displacement may not be under a given force: a shallow clamped arch pressed
//! down at its crown. Its force rises to a limit, falls while the arch goes through, and rises again
//! (Timoshenko & Gere 1961, section 7.6).

use crate::bodies::{cuboid, disc_on_top, held, solid};
use phantom_rig::fem::finite::{Controls, Equilibrium, FiniteError, HeldBody, Loads, Sensitivity, Tie};
use phantom_rig::fem::material::Law;
use phantom_rig::fem::{Functional, Order, Space};
use phantom_rig::geometry::Vec3;
use std::sync::Arc;

const SPAN: f64 = 0.1;
const RISE: f64 = 0.0075;
const THICKNESS: f64 = 0.004;

/// Both ends clamped; the crown's disc is found before the arch is bent, when the top is flat.
fn arch() -> (Arc<Space>, Vec<bool>, [Functional; 3]) {
    let flat = cuboid([SPAN, 0.008, THICKNESS], [12, 1, 1]);
    let crown = disc_on_top(&Space::new(&flat, Order::P2).expect("a space"), 0.5 * SPAN, 0.004, 0.003);
    let mut mesh = flat;
    for p in &mut mesh.nodes {
        p.z += RISE * (std::f64::consts::PI * p.x / SPAN).sin().powi(2);
    }
    let space = Arc::new(Space::new(&mesh, Order::P2).expect("a space"));
    let flags = held(&space, &["x-", "x+"].map(|end| [(end, 0), (end, 1), (end, 2)]).concat());
    (space, flags, crown)
}

fn pressed(crown: &[Functional; 3], depth: f64) -> Loads {
    Loads { ties: Tie::pad(crown, &Vec3::new(0.0, 0.0, -depth)).to_vec(), ..Loads::default() }
}

#[test]
fn a_pad_follows_an_arch_through_its_limit_point() {
    let (space, flags, crown) = arch();
    let rubber = solid(0.45, Law::NeoHookean);
    let body = HeldBody::with_pads(space.clone(), &flags, std::slice::from_ref(&crown)).expect("held");
    let mut last: Option<Equilibrium> = None;
    let (mut forces, mut stiffnesses) = (vec![0.0], Vec::new());
    for k in 1..=24 {
        let loads = pressed(&crown, 1.8 * RISE * f64::from(k) / 24.0);
        let found = body.equilibrium(&rubber, &loads, last.as_ref(), &Controls::default());
        let found = found.expect("stable with the pad given");
        forces.push(-found.tie_forces()[2]);
        let linearisation = body.linearise(&rubber, &found).expect("stable with the pad given");
        let change = linearisation.change(&Sensitivity::TieDisplacement(2)).expect("a tie");
        stiffnesses.push(change.tie_forces[2]);
        last = Some(found);
    }
    let steps: Vec<f64> = forces.windows(2).map(|f| f[1] - f[0]).collect();
    let falls = steps.iter().filter(|s| **s < 0.0).count();
    assert!(steps[0] > 0.0 && steps[23] > 0.0 && falls >= 3, "{forces:?}");
    // The tangent's stiffness is the slope of the curve: central differences, away from the sharpest bends.
    let spacing = 1.8 * RISE / 24.0;
    let stiffest = stiffnesses.iter().fold(0.0_f64, |m, s| s.abs().max(m));
    for k in 1..23 {
        let slope = (forces[k + 1] - forces[k - 1]) / (2.0 * spacing);
        assert!((slope - stiffnesses[k - 1]).abs() < 0.05 * stiffest, "{k}: {slope} {}", stiffnesses[k - 1]);
    }
    // The same state without room for the brace: its tangent is indefinite, and that is said.
    let falling = 1 + steps.iter().position(|s| *s < 0.0).expect("it falls");
    let loads = pressed(&crown, 1.8 * RISE * (falling + 1) as f64 / 24.0);
    let plain = HeldBody::new(space, &flags).expect("held");
    let error = plain.equilibrium(&rubber, &loads, None, &Controls::default()).expect_err("unstable");
    let FiniteError::LoadStepTooSmall { reached, because, .. } = error else { panic!("{error}") };
    assert!(reached > 0.5 && matches!(*because, FiniteError::TangentNotPositiveDefinite { .. }), "{because}");
}
