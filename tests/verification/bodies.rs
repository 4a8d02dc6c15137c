//! The bodies that the finite-strain tests deform: blocks, their held components, discs on their top.

use phantom_rig::fem::finite::{HeldBody, Solid};
use phantom_rig::fem::material::{Law, Material, Moduli};
use phantom_rig::fem::{Functional, Order, Space, Spot};
use phantom_rig::geometry::Vec3;
use phantom_rig::mesh::{Block, TetMesh, block};
use std::sync::Arc;

pub(crate) const YOUNG: f64 = 1.0e4;

pub(crate) fn material(poisson: f64, law: Law) -> Material {
    Material::new(Moduli::new(YOUNG, poisson).expect("a proper solid"), law).expect("a proper law")
}

pub(crate) fn solid(poisson: f64, law: Law) -> Solid {
    Solid::homogeneous(material(poisson, law))
}

pub(crate) fn cuboid(size_m: [f64; 3], cells: [usize; 3]) -> TetMesh {
    block(&Block { size_m, cells }).expect("a proper block")
}

pub(crate) fn space(mesh: &TetMesh, order: Order) -> Arc<Space> {
    Arc::new(Space::new(mesh, order).expect("a proper mesh"))
}

/// A slab of 60 × 50 × 20 mm glued at its base.
pub(crate) fn slab(order: Order, cells: [usize; 3]) -> HeldBody {
    HeldBody::clamped(space(&cuboid([0.06, 0.05, 0.02], cells), order), "z-").expect("held")
}

/// Flags of the components along `axis` of the nodes on each listed surface.
pub(crate) fn held(space: &Space, surfaces: &[(&str, usize)]) -> Vec<bool> {
    let mut held = vec![false; space.components()];
    for &(surface, axis) in surfaces {
        for (node, on) in space.on_surface(surface).into_iter().enumerate() {
            held[3 * node + axis] |= on;
        }
    }
    held
}

/// Mean displacement of a disc on the top (`z+`) of a body, by axis.
pub(crate) fn disc_on_top(space: &Space, x: f64, y: f64, radius: f64) -> [Functional; 3] {
    let top = space.nodes().iter().map(|p| p.z).fold(f64::NEG_INFINITY, f64::max);
    let centre = Vec3::new(x, y, top);
    Spot::disc(space, space.surface("z+"), &centre, radius).expect("on the top").weights
}

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub(crate) fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

pub(crate) fn difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

/// b·u.
pub(crate) fn read(functional: &Functional, u: &[f64]) -> f64 {
    functional.iter().map(|&(c, w)| w * u[c as usize]).sum()
}
