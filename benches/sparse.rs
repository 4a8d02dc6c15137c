//! How long it takes to order, factor and solve an elastic block: `cargo bench --bench sparse`.

mod elastic_block;

use divan::Bencher;
use elastic_block::{ElasticBlock, elastic_block};
use phantom_rig::sparse::{Analysis, Ordering};

/// Boxes along the edges of a slab of 150 × 100 × 25 mm: 1,275, 9,840 and 50,807 nodes.
const CELLS: [[usize; 3]; 3] = [[16, 14, 4], [40, 29, 7], [76, 50, 12]];

fn main() {
    divan::main();
}

fn slab(cells: [usize; 3]) -> ElasticBlock {
    elastic_block([0.15, 0.1, 0.025], cells, 0.1)
}

fn analysis(slab: &ElasticBlock) -> Analysis {
    Analysis::new(slab.matrix.pattern(), Ordering::NestedDissection { position: &slab.position })
        .expect("a pattern that can be ordered")
}

#[divan::bench(args = [0, 1, 2], sample_count = 5, sample_size = 1)]
fn analyse(bencher: Bencher<'_, '_>, size: usize) {
    let slab = slab(CELLS[size]);
    bencher.bench_local(|| analysis(&slab));
}

#[divan::bench(args = [0, 1, 2], sample_count = 5, sample_size = 1)]
fn factor(bencher: Bencher<'_, '_>, size: usize) {
    let slab = slab(CELLS[size]);
    let analysis = analysis(&slab);
    bencher.bench_local(|| analysis.factor(&slab.matrix).expect("a clamped slab"));
}

#[divan::bench(args = [0, 1, 2], sample_count = 5, sample_size = 1)]
fn solve_32_columns(bencher: Bencher<'_, '_>, size: usize) {
    let slab = slab(CELLS[size]);
    let factor = analysis(&slab).factor(&slab.matrix).expect("a clamped slab");
    let mut rhs = vec![1.0; slab.position.len() * 32];
    bencher.bench_local(|| factor.solve_in_place(&mut rhs, 32).expect("a fitting length"));
}
