//! Whole bodies in homogeneous states: what a mesh of any order must reproduce to rounding.

use crate::bodies::{YOUNG, cuboid, held, solid, space};
use phantom_rig::fem::Order;
use phantom_rig::fem::finite::{Controls, Equilibrium, HeldBody, Loads};
use phantom_rig::fem::material::{Law, Moduli};
use phantom_rig::geometry::{Mat3, Vec3};

const SIZE: [f64; 3] = [0.04, 0.03, 0.02];
const LAWS: [Law; 3] = [Law::NeoHookean, Law::Yeoh { stiffening: 0.8 }, Law::Fung { stiffening: 0.6 }];

fn resultant(equilibrium: &Equilibrium, body: &HeldBody, surface: &str) -> Vec3 {
    let on = body.space().on_surface(surface);
    let mut sum = Vec3::zeros();
    for &(component, force) in equilibrium.reactions() {
        if on[component as usize / 3] {
            sum[component as usize % 3] += force;
        }
    }
    sum
}

/// A bar between frictionless plates with free sides. From the plane-free condition
/// ⅓ μ h′ J^(−5/3) (β² − λ²) + κ (J − 1) = 0, J = λβ², follow β and the force A₀ β² μ h′ J^(−5/3) (λ² − β²).
#[test]
fn a_stretched_bar_follows_the_closed_form_on_any_order() {
    let moduli = Moduli::new(YOUNG, 0.47).expect("a proper solid");
    let (mu, kappa) = (moduli.shear(), moduli.bulk());
    for order in [Order::P1, Order::P2] {
        let space = space(&cuboid(SIZE, [3, 2, 2]), order);
        let flags = held(&space, &[("x-", 0), ("x+", 0), ("y-", 1), ("z-", 2)]);
        let body = HeldBody::new(space, &flags).expect("held");
        let ends = body.space().on_surface("x+");
        for law in LAWS {
            let slope = |i: f64| match law {
                Law::Yeoh { stiffening } => 1.0 + 2.0 * stiffening * i,
                Law::Fung { stiffening } => (stiffening * i).exp(),
                _ => 1.0,
            };
            for lambda in [0.7_f64, 1.5] {
                let prescribed =
                    (0..ends.len()).filter(|&n| ends[n]).map(|n| (3 * n, (lambda - 1.0) * SIZE[0])).collect();
                let loads = Loads { prescribed, ..Loads::default() };
                let found = body
                    .equilibrium(&solid(0.47, law), &loads, None, &Controls::default())
                    .expect("equilibrium");
                let g = |beta: f64| {
                    let j = lambda * beta * beta;
                    mu * slope(j.powf(-2.0 / 3.0) * (lambda * lambda + 2.0 * beta * beta) - 3.0)
                        * j.powf(-5.0 / 3.0)
                };
                let (mut low, mut high) = (0.5 / lambda.sqrt(), 2.0 / lambda.sqrt());
                for _ in 0..100 {
                    let beta = 0.5 * (low + high);
                    let lateral = g(beta) * (beta * beta - lambda * lambda) / 3.0
                        + kappa * (lambda * beta * beta - 1.0);
                    if lateral > 0.0 { high = beta } else { low = beta }
                }
                let beta = 0.5 * (low + high);
                for (p, u) in body.space().nodes().iter().zip(found.displacement().chunks_exact(3)) {
                    let exact = Vec3::new((lambda - 1.0) * p.x, (beta - 1.0) * p.y, (beta - 1.0) * p.z);
                    assert!(
                        (exact - Vec3::from_column_slice(u)).norm() < 1e-9 * SIZE[0],
                        "{order:?} {law:?}"
                    );
                }
                let force = SIZE[1] * SIZE[2] * beta * beta * g(beta) * (lambda * lambda - beta * beta);
                let pulled = resultant(&found, &body, "x+").x;
                assert!((pulled / force - 1.0).abs() < 1e-8, "{order:?} {law:?} {lambda}: {pulled} {force}");
                let volume_ratio = lambda * beta * beta;
                assert!((found.least_volume_ratio() - volume_ratio).abs() < 1e-8);
            }
        }
    }
}

/// The patch test at finite strain: with x ↦ F x on the boundary the inside follows, and the faces carry P n.
/// The first F is a simple shear, P₁₂ = μ h′ γ, P₂₂ = −⅓ μ h′ γ² on the face y+.
#[test]
fn an_affine_boundary_makes_an_affine_body() {
    let gamma = 0.6;
    let mut shear = Mat3::zeros();
    shear[(0, 1)] = gamma;
    let general = Mat3::new(0.2, -0.3, 0.1, 0.25, -0.1, 0.2, -0.15, 0.3, 0.05);
    let mesh = cuboid(SIZE, [3, 2, 3]);
    for order in [Order::P1, Order::P2] {
        let space = space(&mesh, order);
        let mut flags = vec![false; space.components()];
        for surface in ["x-", "x+", "y-", "y+", "z-", "z+"] {
            let add = held(&space, &[(surface, 0), (surface, 1), (surface, 2)]);
            flags.iter_mut().zip(add).for_each(|(f, a)| *f |= a);
        }
        let body = HeldBody::new(space, &flags).expect("held");
        for law in LAWS {
            for h in [shear, general] {
                let exact: Vec<f64> =
                    body.space().nodes().iter().flat_map(|p| <[f64; 3]>::from(h * p)).collect();
                let prescribed = body.held().iter().map(|&c| (c as usize, exact[c as usize])).collect();
                let loads = Loads { prescribed, ..Loads::default() };
                let solid = solid(0.47, law);
                let found =
                    body.equilibrium(&solid, &loads, None, &Controls::default()).expect("equilibrium");
                for (u, exact) in found.displacement().iter().zip(&exact) {
                    assert!((u - exact).abs() < 1e-9 * SIZE[0], "{order:?} {law:?}");
                }
                let energy =
                    solid.material().energy(&h).expect("not inverted") * SIZE.iter().product::<f64>();
                assert!((found.energy() / energy - 1.0).abs() < 1e-9);
                if h == shear {
                    // Reactions of nodes inside the face; those on its edges also belong to other faces.
                    let mu = Moduli::new(YOUNG, 0.47).expect("a proper solid").shear();
                    let slope = match law {
                        Law::Yeoh { stiffening } => 1.0 + 2.0 * stiffening * gamma * gamma,
                        Law::Fung { stiffening } => (stiffening * gamma * gamma).exp(),
                        _ => 1.0,
                    };
                    let (_, p) = solid.material().stress(&h).expect("not inverted");
                    assert!((p[(0, 1)] / (mu * slope * gamma) - 1.0).abs() < 1e-12);
                    // The moment of the boundary forces about the origin, ∫ x ⊗ P n dA = V Pᵀ.
                    let mut moment = Mat3::zeros();
                    for &(c, force) in found.reactions() {
                        let (node, axis) = (c as usize / 3, c as usize % 3);
                        for i in 0..3 {
                            moment[(axis, i)] += force * body.space().nodes()[node][i];
                        }
                    }
                    let mean = moment / SIZE.iter().product::<f64>();
                    assert!((mean - p).norm() < 1e-8 * p.norm(), "{order:?} {law:?}: {mean} {p}");
                    assert!((mean[(1, 1)] + mu * slope * gamma * gamma / 3.0).abs() < 1e-8 * p.norm());
                }
            }
        }
    }
}

/// Held at one corner without strain, a body that is turned as a whole carries no force.
#[test]
fn a_rigid_turn_is_free_of_force() {
    let space = space(&cuboid(SIZE, [2, 2, 2]), Order::P2);
    let flags = held(&space, &[("x-", 0), ("x-", 1), ("x-", 2)]);
    let body = HeldBody::new(space, &flags).expect("held");
    let turn = nalgebra::Rotation3::new(Vec3::new(0.3, -0.9, 0.5)).into_inner() - Mat3::identity();
    let exact: Vec<f64> = body.space().nodes().iter().flat_map(|p| <[f64; 3]>::from(turn * p)).collect();
    let prescribed = body.held().iter().map(|&c| (c as usize, exact[c as usize])).collect();
    let loads = Loads { prescribed, ..Loads::default() };
    let controls = Controls { first_step: 0.25, ..Controls::default() };
    let found =
        body.equilibrium(&solid(0.47, Law::NeoHookean), &loads, None, &controls).expect("equilibrium");
    for (u, exact) in found.displacement().iter().zip(&exact) {
        assert!((u - exact).abs() < 1e-8 * SIZE[0], "{u} {exact}");
    }
    assert!(found.energy() < 1e-12 * YOUNG * SIZE.iter().product::<f64>(), "{}", found.energy());
}
