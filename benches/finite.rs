//! How long one Newton iteration at finite strain takes, and what it is spent on: `cargo bench --bench finite`.

use divan::Bencher;
use phantom_rig::fem::finite::{Controls, HeldBody, Loads, Solid, Tie};
use phantom_rig::fem::material::{Law, Material, Moduli};
use phantom_rig::fem::{Order, Space, Spot};
use phantom_rig::geometry::Vec3;
use phantom_rig::mesh::{Block, block};
use std::sync::Arc;

/// Boxes along the edges of a slab of 150 × 100 × 25 mm; on P2 14,025, 49,005 and 116,721 unknowns.
const CELLS: [[usize; 3]; 3] = [[16, 11, 3], [25, 18, 4], [34, 24, 6]];

fn main() {
    divan::main();
}

fn slab(size: usize) -> HeldBody {
    let mesh = block(&Block { size_m: [0.15, 0.1, 0.025], cells: CELLS[size] }).expect("a block");
    let space = Arc::new(Space::new(&mesh, Order::P2).expect("a space"));
    HeldBody::clamped(space, "z-").expect("held")
}

fn gel(law: Law) -> Solid {
    let moduli = Moduli::new(1e4, 0.47).expect("a proper solid");
    Solid::homogeneous(Material::new(moduli, law).expect("a proper law"))
}

fn pressed(body: &HeldBody, depth: f64) -> Loads {
    let space = body.space();
    let patch = Spot::disc(space, space.surface("z+"), &Vec3::new(0.07, 0.05, 0.025), 0.006).expect("on top");
    Loads { ties: Tie::pad(&patch.weights, &Vec3::new(0.0, 0.0, -depth)).to_vec(), ..Loads::default() }
}

/// Numbering and elimination order: once for a body.
#[divan::bench(args = [0, 1, 2], sample_count = 3, sample_size = 1)]
fn prepare(bencher: Bencher<'_, '_>, size: usize) {
    bencher.bench_local(|| slab(size));
}

/// A poke of a tenth of the thickness from rest: about five iterations.
#[divan::bench(args = [0, 1, 2], sample_count = 3, sample_size = 1)]
fn poke(bencher: Bencher<'_, '_>, size: usize) {
    let (body, gel) = (slab(size), gel(Law::Fung { stiffening: 1.0 }));
    let loads = pressed(&body, 0.0025);
    bencher.bench_local(|| {
        body.equilibrium(&gel, &loads, None, &Controls::default()).expect("equilibrium").iterations()
    });
}

/// The tangent at an equilibrium, assembled and factored: the larger part of an iteration.
#[divan::bench(args = [0, 1, 2], sample_count = 3, sample_size = 1)]
fn linearise(bencher: Bencher<'_, '_>, size: usize) {
    let (body, gel) = (slab(size), gel(Law::Fung { stiffening: 1.0 }));
    let at = body.equilibrium(&gel, &pressed(&body, 0.001), None, &Controls::default()).expect("equilibrium");
    bencher.bench_local(|| body.linearise(&gel, &at).expect("stable"));
}
