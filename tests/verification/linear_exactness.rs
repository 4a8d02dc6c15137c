//! What the linear elements must reproduce exactly, and how fast they must converge to the rest.

use crate::bodies::{cuboid, difference, norm};
use crate::linear_fields::{Field, Quadratic, Waves, at_nodes, distance};
use crate::linear_system::{body_force, jittered, moved, on_boundary, solve, traction};
use phantom_rig::fem::{Order, Space};
use phantom_rig::geometry::{Mat3, Vec3};

const SIZE: [f64; 3] = [1.2, 0.9, 0.7];
const CELLS: [usize; 3] = [4, 3, 3];

fn irregular(order: Order) -> Space {
    let mut mesh = cuboid(SIZE, CELLS);
    jittered(&mut mesh, SIZE, CELLS, 0.2, 5);
    Space::new(&mesh, order).expect("a proper mesh")
}

fn quadratic(bend: f64) -> Quadratic {
    let h = |a: f64, b: f64, c: f64| Mat3::new(a, b, c, b, -c, 0.4, c, 0.4, b) * bend;
    Quadratic {
        shift: Vec3::new(0.3, -0.1, 0.2),
        slope: Mat3::new(0.2, 0.1, -0.3, 0.4, -0.1, 0.2, 0.1, 0.3, 0.15),
        curvature: [h(0.3, -0.2, 0.1), h(-0.5, 0.1, 0.6), h(0.2, 0.7, -0.4)],
    }
}

fn solution(space: &Space, field: &impl Field, nu: f64) -> Vec<f64> {
    solve(space, nu, &on_boundary(space, field), &body_force(space, field, nu))
}

fn error(space: &Space, field: &impl Field, nu: f64) -> f64 {
    let exact = at_nodes(space, field);
    difference(&solution(space, field, nu), &exact) / norm(&exact)
}

/// The patch test (Irons 1966): a uniform strain is in equilibrium on any mesh, at any Poisson's ratio.
#[test]
fn uniform_strain_is_exact_on_any_mesh() {
    for order in [Order::P1, Order::P2] {
        for nu in [0.0, 0.3, 0.4999] {
            let gap = error(&irregular(order), &quadratic(0.0), nu);
            assert!(gap < 1e-10, "{order:?}, ν = {nu}: {gap:.1e}");
        }
    }
}

/// Quadratic displacement lies in the space of second-order elements, so that with its body force it is the
/// solution; first-order elements cannot follow it.
#[test]
fn quadratic_displacement_is_exact_for_second_order() {
    let field = quadratic(1.0);
    let gap = error(&irregular(Order::P2), &field, 0.47);
    assert!(gap < 1e-10, "P2: {gap:.1e}");
    assert!(error(&irregular(Order::P1), &field, 0.47) > 1e-3);
}

/// Ends of two halvings against theory: order `p + 1` in L², `p` in energy (Ciarlet 1978, theorem 3.2.5).
#[test]
fn convergence_has_the_orders_of_theory() {
    let field = Waves {
        wave: [Vec3::new(2.0, 1.0, -1.5), Vec3::new(-1.0, 2.5, 0.5), Vec3::new(1.5, -1.0, 2.0)],
        phase: [0.3, 1.1, -0.4],
    };
    let nu = 0.3;
    for (order, coarsest, expected) in [(Order::P1, 5, [2.0, 1.0]), (Order::P2, 3, [3.0, 2.0])] {
        let errors = [1, 2, 4].map(|times| {
            let n = coarsest * times;
            let mut mesh = cuboid([1.0; 3], [n; 3]);
            // One smooth map of the regular mesh: cells of all shapes, yet each mesh halves the one before.
            moved(&mut mesh, [1.0; 3], |p| {
                let wave = |x: f64, y: f64| 0.03 * (std::f64::consts::TAU * x).sin() * (3.0 * y).cos();
                Vec3::new(wave(p.x, p.y), wave(p.y, p.z), wave(p.z, p.x))
            });
            let space = Space::new(&mesh, order).expect("a proper mesh");
            distance(&space, &solution(&space, &field, nu), &field, nu)
        });
        for (norm, name) in ["L²", "energy"].into_iter().enumerate() {
            for pair in errors.windows(2) {
                let rate = (pair[0][norm] / pair[1][norm]).log2();
                println!("{order:?} {name}: rate {rate:.3} (theory {})", expected[norm]);
                assert!((rate - expected[norm]).abs() < 0.15, "{order:?}, {name}: rate {rate:.3}");
            }
        }
    }
}

/// Compression of a nearly incompressible block between rollers: strain `p (1 + ν)(1 − 2ν) / ((1 − ν) E)`, uniform
/// and therefore exact for both orders on any mesh.
#[test]
fn confined_compression_near_incompressibility() {
    let nu = 0.4999;
    for order in [Order::P1, Order::P2] {
        let space = irregular(order);
        let mut prescribed = vec![None; space.components()];
        for (surface, axis) in [("x-", 0), ("x+", 0), ("y-", 1), ("y+", 1), ("z-", 2)] {
            for (node, on) in space.on_surface(surface).into_iter().enumerate() {
                if on {
                    prescribed[3 * node + axis] = Some(0.0);
                }
            }
        }
        let u = solve(&space, nu, &prescribed, &traction(&space, "z+", -Vec3::z()));
        let strain = (1.0 + nu) * (1.0 - 2.0 * nu) / (1.0 - nu);
        for (p, u) in space.nodes().iter().zip(u.chunks_exact(3)) {
            let gap = (u[2] + strain * p.z).abs() / (strain * SIZE[2]);
            assert!(gap < 1e-8 && u[0].abs().max(u[1].abs()) < 1e-8 * strain, "{order:?} at {p}: {gap:.1e}");
        }
    }
}
