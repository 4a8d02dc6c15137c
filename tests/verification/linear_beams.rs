//! A slender bar clamped at one end and loaded by a wrench at the other: beam theory, and no locking.

use crate::bodies::cuboid;
use phantom_rig::fem::{Model, Order, Spot, wrench_loads};
use phantom_rig::geometry::Vec3;

const LENGTH: f64 = 0.4;
const DEPTH: f64 = 0.01;

/// Deflection of the end, along z, under a unit force along z and a unit moment about y, for a unit modulus.
fn end(order: Order, across: usize, nu: f64) -> [f64; 2] {
    let mesh = cuboid([LENGTH, DEPTH, DEPTH], [20 * across, across, across]);
    let model = Model::new(&mesh, order, nu, "x-").expect("held");
    let centre = Vec3::new(LENGTH, 0.5 * DEPTH, 0.5 * DEPTH);
    let space = model.space();
    let spot = Spot::disc(space, space.surface("x+"), &centre, 0.4 * DEPTH).expect("on the end");
    let [.., force_z, _, moment_y, _] = wrench_loads(space, &spot, &centre).expect("loads");
    let nodal = model.respond_to(&[force_z, moment_y]).expect("solved");
    [spot.of(&nodal[0]).z, spot.of(&nodal[1]).z]
}

/// Second moment of area of the square section.
const INERTIA: f64 = DEPTH * DEPTH * DEPTH * DEPTH / 12.0;

/// Beam theory: under a force `L³/3EI + L/κGA` with Timoshenko's shear, `κ = 10 (1 + ν) / (12 + 11 ν)` (Cowper
/// 1966); under a moment about y `−L²/2EI`.
fn beam(nu: f64) -> [f64; 2] {
    let (shear_modulus, area) = (0.5 / (1.0 + nu), DEPTH * DEPTH);
    let shear = LENGTH / (10.0 * (1.0 + nu) / (12.0 + 11.0 * nu) * shear_modulus * area);
    [LENGTH.powi(3) / (3.0 * INERTIA) + shear, -LENGTH.powi(2) / (2.0 * INERTIA)]
}

/// The clamp keeps the section from changing its shape over a length of about one depth (Saint-Venant), which beam
/// theory does not know: with ν = 0 the section has no wish to change.
#[test]
fn a_cantilever_bends_as_beam_theory_says() {
    for (nu, tolerance) in [(0.0, 1e-3), (0.3, 5e-3)] {
        for ((found, theory), load) in
            end(Order::P2, 3, nu).into_iter().zip(beam(nu)).zip(["force", "moment"])
        {
            println!("ν = {nu}, {load}: {:.5} of beam theory", found / theory);
            assert!((found / theory - 1.0).abs() < tolerance, "ν = {nu}, {load}: {found} {theory}");
        }
    }
}

/// At ν = 0.4999 first-order elements lock: they hardly bend at all. Second-order ones are a few per cent stiff
/// with two across the depth, and what they lack at least halves with twice as many, down to what the clamp takes
/// (some thousandths, above).
#[test]
fn second_order_elements_do_not_lock() {
    let nu = 0.4999;
    let lacking = |order, across| 1.0 - end(order, across, nu)[0] / beam(nu)[0];
    let (first, coarse, fine) = (lacking(Order::P1, 2), lacking(Order::P2, 2), lacking(Order::P2, 4));
    println!("lacking of the deflection: P1 {first:.4}; P2 {coarse:.4}, twice as fine {fine:.4}");
    assert!(first > 0.9, "P1 is expected to lock: {first}");
    assert!(coarse > 0.0 && coarse < 0.04, "{coarse}");
    assert!(fine > 0.0 && fine < 0.5 * coarse, "{coarse} {fine}");
}
