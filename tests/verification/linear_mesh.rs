//! The force of a poke must not depend on the mesh that the user happened to bring.

use crate::bodies::cuboid;
use crate::linear_system::moved;
use phantom_rig::fem::{Discretisation, Model, Order, Space, Spot};
use phantom_rig::geometry::{Mat3, Vec3};
use phantom_rig::mesh::TetMesh;

const SIZE: [f64; 3] = [0.15, 0.1, 0.025];
/// The base is glued up to this x (m).
const GLUE_END: f64 = 0.06;
const RADIUS: f64 = 0.008;

/// Places of the tip: over the glue, over the free part, and on the side that ends with the glue.
const SITES: [(f64, f64, f64); 3] = [(0.03, 0.05, 0.025), (0.1, 0.05, 0.025), (0.0, 0.05, 0.016)];

/// The slab with cells of about `cell` (m), none across the end of the glue. `shift` moves every node that is not
/// held in place by a side or by the end of the glue, in units of half a cell.
fn slab(cell: f64, shift: f64) -> TetMesh {
    let count = |length: f64| (length / cell).round().max(1.0) as usize;
    let (glued, free) = (count(GLUE_END), count(SIZE[0] - GLUE_END));
    let mut mesh = cuboid(SIZE, [glued + free, count(SIZE[1]), count(SIZE[2])]);
    let regular = SIZE[0] / (glued + free) as f64;
    for p in &mut mesh.nodes {
        let column = (p.x / regular).round();
        let glued = glued as f64;
        p.x = if column <= glued {
            GLUE_END * column / glued
        } else {
            GLUE_END + (SIZE[0] - GLUE_END) * (column - glued) / free as f64
        };
    }
    // Half a cell cannot be taken off the last cell before a side without flattening it: the shift fades out there.
    moved(&mut mesh, SIZE, |p| {
        let fade = |x: f64, from: f64, to: f64| ((x - from).min(to - x) / (1.5 * cell)).clamp(0.0, 1.0);
        let along = if p.x < GLUE_END { fade(p.x, 0.0, GLUE_END) } else { fade(p.x, GLUE_END, SIZE[0]) };
        let by = Vec3::new(along, fade(p.y, 0.0, SIZE[1]), 0.5 * fade(p.z, 0.0, SIZE[2]));
        by * (0.5 * shift * cell)
    });
    let fixed = mesh
        .surface("z-")
        .iter()
        .copied()
        .filter(|t| t.iter().all(|&n| mesh.nodes[n as usize].x < GLUE_END + 1e-9))
        .collect();
    mesh.surfaces.insert("fixed".to_owned(), fixed);
    mesh
}

fn tips(space: &Space) -> Vec<Spot> {
    let all: Vec<usize> = (0..space.faces().len()).collect();
    SITES
        .iter()
        .map(|&(x, y, z)| Spot::disc(space, &all, &Vec3::new(x, y, z), RADIUS).expect("on the surface"))
        .collect()
}

/// Compliance of every tip under itself, and the number of unknowns.
fn compliance(mesh: &TetMesh) -> (Vec<Mat3>, usize) {
    let model = Model::new(mesh, Order::P2, 0.47, "fixed").expect("held");
    let tips = tips(model.space());
    let responses = model.respond(&tips.iter().collect::<Vec<_>>()).expect("solved");
    (responses.iter().zip(&tips).map(|(r, t)| r.at(t)).collect(), model.unknowns())
}

/// Stiffness of every tip along its poke for a unit modulus (m): what the force is when the stage moves the tip by 1
/// and keeps it from sliding.
fn stiffness(mesh: &TetMesh, level: u32) -> ([f64; 3], usize) {
    let given = Space::new(mesh, Order::P1).expect("a proper mesh");
    let tips = tips(&given);
    let discs: Vec<&Spot> = tips.iter().collect();
    let pair = Discretisation::pair(mesh, "fixed", &discs, level).expect("sound");
    let ((coarse, _), (fine, unknowns)) = (compliance(&pair.coarse), compliance(&pair.fine));
    let found = std::array::from_fn(|site| {
        let limit = coarse[site].zip_map(&fine[site], Discretisation::extrapolate);
        let along = if site == 2 { 0 } else { 2 };
        limit.try_inverse().expect("positive definite")[(along, along)]
    });
    (found, unknowns)
}

/// Stiffness at every site on meshes of 10, 7 and 5 mm cells, as they are and shifted by up to half a cell, through the pair of
/// discretisations of a level; with the reference through the next level's first. Prints how far each is from the reference.
fn on_all_meshes(level: u32) -> Vec<[f64; 3]> {
    let (reference, _) = stiffness(&slab(0.01, 0.0), level + 1);
    let mut found = vec![reference];
    let (mut each, mut common) = (0.0, 0.0);
    for cell in [0.01, 0.007, 0.005] {
        for shift in [0.0, 1.0] {
            let (here, unknowns) = stiffness(&slab(cell, shift), level);
            let off: [f64; 3] = std::array::from_fn(|site| 100.0 * (here[site] / reference[site] - 1.0));
            each += off.iter().map(|o| o * o).sum::<f64>() / 3.0;
            common += (off.iter().sum::<f64>() / 3.0).powi(2);
            println!("cells of {} mm, shift {shift}: {off:+.3?} %, {unknowns} unknowns", 1e3 * cell);
            found.push(here);
        }
    }
    let meshes = (found.len() - 1) as f64;
    println!(
        "root mean square: a site {:.3} %, the mean of the three {:.3} %",
        (each / meshes).sqrt(),
        (common / meshes).sqrt()
    );
    found
}

/// Through the coarsest pair of discretisations; a fit uses the next finer one. That, the reference, itself differs from the
/// one after it (levels 2 and 3, 210 000 unknowns) by 0.01 %.
#[test]
fn the_force_does_not_depend_on_the_mesh() {
    let found = on_all_meshes(0);
    for site in 0..SITES.len() {
        let at = || found.iter().map(|k| k[site]);
        let spread = at().fold(f64::MIN, f64::max) / at().fold(f64::MAX, f64::min) - 1.0;
        assert!(spread < 5e-3, "site {:?}: forces differ by {:.2} %", SITES[site], 100.0 * spread);
    }
}

/// What the pair that a fit uses leaves: the source of its allowance for elements (`inverse/outcome.rs`). Some minutes.
#[test]
#[ignore = "minutes; run by hand"]
fn what_the_pair_of_a_fit_leaves() {
    on_all_meshes(1);
}
