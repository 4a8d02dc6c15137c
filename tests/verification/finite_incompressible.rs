//! Near the incompressible limit: second-order elements keep their answer, first-order ones lock.

use crate::bodies::{YOUNG, cuboid, disc_on_top, solid, space};
use phantom_rig::fem::Order;
use phantom_rig::fem::finite::{Controls, HeldBody, Loads};
use phantom_rig::fem::material::Law;
use phantom_rig::geometry::Vec3;

/// How far a disc sinks under a given pressure on a clamped block (m), at finite strain.
fn indentation(order: Order, poisson: f64) -> f64 {
    let space = space(&cuboid([0.04, 0.04, 0.02], [6, 6, 4]), order);
    let patch = disc_on_top(&space, 0.02, 0.02, 0.008);
    let body = HeldBody::clamped(space, "z-").expect("held");
    let mut loads = Loads::default();
    // A pressure of E/5 over the disc.
    loads.push_force(&patch, &Vec3::new(0.0, 0.0, -0.2 * YOUNG * std::f64::consts::PI * 0.008 * 0.008));
    let found = body.equilibrium(&solid(poisson, Law::NeoHookean), &loads, None, &Controls::default());
    let u = found.expect("equilibrium");
    -crate::bodies::read(&patch[2], u.displacement())
}

/// Compliance is smooth in the compressibility 1 − 2ν ∝ E/κ, so that from ν = 0.49 to 0.499 to 0.4999 it settles in
/// steps of ten to one. Locking makes it collapse instead.
#[test]
fn second_order_elements_do_not_lock() {
    let depths = [0.49, 0.499, 0.4999].map(|poisson| indentation(Order::P2, poisson));
    let steps = [depths[0] - depths[1], depths[1] - depths[2]];
    let ratio = steps[0] / steps[1];
    assert!(depths[2] > 0.85 * depths[0], "{depths:?}");
    assert!(steps[0] > 0.0 && ratio > 4.0 && ratio < 14.0, "{depths:?}: steps {steps:?}");
    // The reason for second order: the same mesh of first order is far stiffer.
    let locked = indentation(Order::P1, 0.4999);
    assert!(locked < 0.5 * depths[2], "{locked} {depths:?}");
}
