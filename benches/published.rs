//! Step one of the published method at the paper's physical size: assembly, factor, condensation, decoupling
//! and iteration, first-order elements.
//!
//! A slab of 100 mm × 150 mm × 25 mm with 1600 nodes and 6480 tetrahedra (paper: 1505 and 6415), 126 observed
//! points and 255 search nodes: 2.5 mm, 20 % of the underside held.

use phantom_rig::fem::{Functional, Model, Order, Spot, SpotKind};
use phantom_rig::geometry::Vec3;
use phantom_rig::inverse::Condensed;
use phantom_rig::inverse::published::{Regularisation, StepOne, StepOneRules};
use phantom_rig::mesh::{Block, TetMesh, block};

fn main() {
    divan::main();
}

struct Slab {
    mesh: TetMesh,
    search: Vec<Spot>,
    observed: Vec<Spot>,
    load: (Spot, Vec3),
}

fn node(mesh: &TetMesh, n: usize) -> Spot {
    let weights = [0, 1, 2].map(|i| -> Functional { vec![(3 * n as u32 + i, 1.0)] });
    Spot { weights, kind: SpotKind::Marker { foot: mesh.nodes[n], offset: Vec3::zeros() } }
}

fn slab() -> Slab {
    let mut mesh = block(&Block { size_m: [0.1, 0.15, 0.025], cells: [15, 24, 3] }).expect("a slab");
    let underside: Vec<usize> = (0..mesh.nodes.len()).filter(|&n| mesh.nodes[n].z == 0.0).collect();
    let top: Vec<usize> = (0..mesh.nodes.len()).filter(|&n| mesh.nodes[n].z == 0.025).collect();
    let search: Vec<usize> = underside[underside.len() - 255..].to_vec();
    let fixed = mesh.surface("z-").iter().filter(|t| t.iter().all(|n| !search.contains(&(*n as usize))));
    let fixed = fixed.copied().collect();
    mesh.surfaces.insert("fixed".to_owned(), fixed);
    Slab {
        search: search.iter().map(|&n| node(&mesh, n)).collect(),
        observed: top.iter().step_by(3).take(126).map(|&n| node(&mesh, n)).collect(),
        load: (node(&mesh, top[200]), Vec3::new(0.0, 0.0, -1.0)),
        mesh,
    }
}

#[divan::bench(sample_count = 5, sample_size = 1)]
fn step_one_at_the_papers_size(bencher: divan::Bencher) {
    let slab = slab();
    bencher.bench_local(|| {
        let model = Model::new(&slab.mesh, Order::P1, 0.47, "fixed").expect("factored");
        let load = [slab.load.clone()];
        let body = Condensed::new(&model, &slab.search, &slab.observed, &load).expect("condensed");
        let one = StepOne::new(&body, Regularisation::Energy).expect("prepared");
        // The body free at its search nodes, seen with an error of 2 %.
        let truth = &body.observed_load / 1.05e4;
        let observed = truth.map_with_location(|i, _, u| u + 0.02 * truth.amax() * (i as f64 * 1.7).sin());
        let error = (&observed - &truth).norm();
        one.fit(&observed, error, &StepOneRules::PHANTOM)
    });
}
