//! Whether sparse systems of the size of a phantom are solved right: against dense algebra, against a closed
//! form, and with little fill.

#[path = "../benches/elastic_block/mod.rs"]
mod elastic_block;

use elastic_block::{ElasticBlock, elastic_block, stiffness};
use nalgebra::{DMatrix, DVector};
use phantom_rig::mesh::{Block, block};
use phantom_rig::sparse::{Analysis, Factor, Ordering, Pattern, SparseError, SymmetricMatrix};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::sync::Arc;

fn dense(matrix: &SymmetricMatrix) -> DMatrix<f64> {
    let n = matrix.pattern().dimension();
    let mut full = DMatrix::zeros(n, n);
    let mut unit = vec![0.0; n];
    for j in 0..n {
        unit[j] = 1.0;
        matrix.multiply(&unit, full.column_mut(j).as_mut_slice());
        unit[j] = 0.0;
    }
    full
}

fn dissected(problem: &ElasticBlock) -> Analysis {
    Analysis::new(problem.matrix.pattern(), Ordering::NestedDissection { position: &problem.position })
        .expect("a pattern that can be ordered")
}

fn factored(problem: &ElasticBlock) -> Factor {
    dissected(problem).factor(&problem.matrix).expect("a clamped body")
}

/// A random pattern, a random positive definite matrix on it, and a point for each unknown.
fn random_problem(seed: u64, n: usize, elements: usize) -> ElasticBlock {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let position: Vec<[f64; 3]> =
        (0..n).map(|_| [(); 3].map(|()| f64::from(random.random_range(0..4_u8)))).collect();
    let lists: Vec<Vec<u32>> = (0..elements)
        .map(|_| {
            let mut list: Vec<u32> = (0..6).map(|_| random.random_range(0..n as u32)).collect();
            list.sort_unstable();
            list.dedup();
            list
        })
        .collect();
    let pattern = Pattern::from_elements(n, lists.iter().map(Vec::as_slice));
    let mut matrix = SymmetricMatrix::zeros(Arc::new(pattern));
    for list in &lists {
        let root = DMatrix::from_fn(list.len(), list.len(), |_, _| random.random_range(-1.0..1.0));
        matrix.add_element(list, (&root * root.transpose()).as_slice());
    }
    for i in 0..n {
        matrix.add(i, i, 0.1).expect("the diagonal");
    }
    ElasticBlock { matrix, position }
}

proptest! {
    #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(3), ..ProptestConfig::with_cases(64) })]

    #[test]
    fn any_positive_definite_system_is_solved_as_the_dense_one(
        seed: u64, n in 1_usize..300, share in 0.0..1.5_f64, by_degree: bool,
    ) {
        let problem = random_problem(seed, n, (n as f64 * share) as usize);
        let ordering = if by_degree {
            Ordering::MinimumDegree
        } else {
            Ordering::NestedDissection { position: &problem.position }
        };
        let analysis = Analysis::new(problem.matrix.pattern(), ordering).expect("analysis");
        let mut steps = analysis.elimination_order().to_vec();
        steps.sort_unstable();
        prop_assert!(steps.into_iter().eq(0..n as u32), "each unknown is eliminated once");

        let factor = analysis.factor(&problem.matrix).expect("positive definite");
        let full = dense(&problem.matrix);
        let rhs = DMatrix::from_fn(n, 3, |i, j| ((i + 1) * (j + 2)) as f64 % 7.0 - 3.0);
        let expected = full.cholesky().expect("positive definite").solve(&rhs);
        let mut found = rhs.as_slice().to_vec();
        factor.solve_in_place(&mut found, 3).expect("a fitting length");
        let error = (DMatrix::from_vec(n, 3, found) - &expected).amax();
        prop_assert!(error <= 1e-10 * expected.amax(), "{error:e}");
        let mut rows = rhs.transpose().as_slice().to_vec();
        factor.solve_rows_in_place(&mut rows, 3).expect("a fitting length");
        let error = (DMatrix::from_vec(3, n, rows).transpose() - &expected).amax();
        prop_assert!(error <= 1e-10 * expected.amax(), "side by side: {error:e}");
        // Halves of it on every other unknown, written from behind.
        let halves = |j: usize, other: u32| -> Vec<(u32, f64)> {
            let some = (0..n as u32).filter(|u| u % 2 == other);
            some.flat_map(|u| [(u, 0.5 * rhs[(u as usize, j)]); 2]).collect()
        };
        let loads: Vec<Vec<(u32, f64)>> = (0..6).map(|c| halves(c / 2, c as u32 % 2)).collect();
        let place: Vec<u32> = (0..n as u32).rev().collect();
        let mut solutions = vec![vec![7.0; n + 1]; 6];
        let loads: Vec<&[(u32, f64)]> = loads.iter().map(Vec::as_slice).collect();
        factor.solve_loads(&loads, &place, &mut solutions).expect("fitting lengths");
        for (pair, expected) in solutions.chunks(2).zip(expected.column_iter()) {
            let off = (0..n).map(|u| (pair[0][n - 1 - u] + pair[1][n - 1 - u] - expected[u]).abs());
            prop_assert!(off.fold(0.0, f64::max) <= 1e-10 * expected.amax().max(1e-300));
            prop_assert_eq!((pair[0][n], pair[1][n]), (7.0, 7.0));
        }
    }
}

/// `−Δu` on a unit cube by second differences: `sin(aπx) sin(bπy) sin(cπz)` is an eigenvector with the
/// eigenvalue `Σ (2 − 2 cos(kπh)) / h²`.
#[test]
fn the_discrete_laplacian_has_its_known_eigenvectors() {
    let side = 23_usize;
    let h = 1.0 / (side as f64 + 1.0);
    let id = |i: [usize; 3]| (i[0] + side * (i[1] + side * i[2])) as u32;
    let cells: Vec<[usize; 3]> =
        (0..side.pow(3)).map(|c| [c % side, c / side % side, c / side / side]).collect();
    let pairs: Vec<[u32; 2]> = cells
        .iter()
        .flat_map(|&c| (0..3).filter(move |&a| c[a] + 1 < side).map(move |a| (c, a)))
        .map(|(c, a)| {
            let mut next = c;
            next[a] += 1;
            [id(c), id(next)]
        })
        .collect();
    let pattern = Pattern::from_elements(cells.len(), pairs.iter().map(<[u32; 2]>::as_slice));
    let mut matrix = SymmetricMatrix::zeros(Arc::new(pattern));
    for pair in &pairs {
        matrix.add(pair[0] as usize, pair[1] as usize, -1.0 / (h * h)).expect("neighbours");
    }
    for i in 0..cells.len() {
        matrix.add(i, i, 6.0 / (h * h)).expect("the diagonal");
    }
    let position: Vec<[f64; 3]> = cells.iter().map(|c| c.map(|i| (i + 1) as f64 * h)).collect();
    let analysis = Analysis::new(matrix.pattern(), Ordering::NestedDissection { position: &position })
        .expect("analysis");
    let factor = analysis.factor(&matrix).expect("positive definite");
    for waves in [[1.0, 1.0, 1.0], [1.0, 2.0, 5.0], [20.0, 3.0, 23.0]] {
        let eigenvalue: f64 =
            waves.iter().map(|k| (2.0 - 2.0 * (k * std::f64::consts::PI * h).cos()) / (h * h)).sum();
        let mode: Vec<f64> = position
            .iter()
            .map(|p| (0..3).map(|a| (waves[a] * std::f64::consts::PI * p[a]).sin()).product())
            .collect();
        let mut found = mode.clone();
        factor.solve_in_place(&mut found, 1).expect("a fitting length");
        let error = found.iter().zip(&mode).map(|(x, m)| (x * eigenvalue - m).abs()).fold(0.0, f64::max);
        assert!(error < 1e-11, "waves {waves:?}: {error:e}");
    }
}

/// A 3-D mesh dissected by planes needs `O(n^{4/3})` numbers; minimum degree needs more.
#[test]
fn dissection_fills_much_less_than_minimum_degree() {
    let problem = elastic_block([1.0; 3], [19, 19, 20], 0.2);
    let by_degree = Analysis::new(problem.matrix.pattern(), Ordering::MinimumDegree).expect("analysis");
    let (dissected, by_degree) = (dissected(&problem).factor_entries(), by_degree.factor_entries());
    assert!((dissected as f64) < 0.75 * by_degree as f64, "{dissected} against {by_degree}");
}

/// Without positions the mesh graph alone must do: worse than with them, still no dense matrix.
#[test]
fn points_that_say_nothing_cost_some_fill_and_nothing_else() {
    let mut problem = elastic_block([1.0; 3], [9, 9, 10], 0.2);
    let with_points = dissected(&problem).factor_entries();
    for useless in [[0.0; 3], [f64::NAN; 3]] {
        problem.position.fill(useless);
        let without = dissected(&problem).factor_entries();
        assert!((without as f64) < 1.5 * with_points as f64, "{without} against {with_points}");
        assert!(factored(&problem).probe_residual() < 1e-14);
    }
}

/// Loads on one end of a body, or on nothing, leave branches at rest; a factor made in the memory of another is not touched by it.
#[test]
fn what_is_at_rest_and_what_was_there_before_do_not_show() {
    let problem = elastic_block([1.5, 1.0, 0.25], [18, 12, 3], 0.2);
    let n = problem.position.len();
    let analysis = dissected(&problem);
    let mut stiffer = problem.matrix.clone();
    stiffer.values_mut().iter_mut().for_each(|value| *value *= 3.0);
    drop(analysis.factor(&stiffer).expect("a clamped body"));
    let factor = analysis.factor(&problem.matrix).expect("a clamped body");
    let mut x = vec![0.0; 3 * n];
    x[0] = 1.0;
    x[2 * n + n - 1] = -2.0;
    let rhs = x.clone();
    factor.solve_in_place(&mut x, 3).expect("a fitting length");
    let mut anew = rhs.clone();
    factored(&problem).solve_in_place(&mut anew, 3).expect("a fitting length");
    assert!(x == anew, "the memory of another factor shows");
    assert!(x[n..2 * n].iter().all(|&u| u == 0.0));
    for (x, rhs) in x.chunks(n).zip(rhs.chunks(n)) {
        let mut product = vec![0.0; n];
        problem.matrix.multiply(x, &mut product);
        let error = product.iter().zip(rhs).map(|(p, b)| (p - b).abs()).fold(0.0, f64::max);
        assert!(error < 1e-9, "{error:e}");
    }
}

/// Nothing is to be eliminated of it, and no operation counted.
#[test]
fn a_diagonal_matrix_is_solved_by_either_order() {
    let lists: Vec<[u32; 1]> = (0..9).map(|i| [i]).collect();
    let mut matrix =
        SymmetricMatrix::zeros(Arc::new(Pattern::from_elements(9, lists.iter().map(<[u32; 1]>::as_slice))));
    (0..9).for_each(|i| matrix.add(i, i, (i + 1) as f64).expect("the diagonal"));
    let position = [[0.0; 3]; 9];
    for ordering in [Ordering::MinimumDegree, Ordering::NestedDissection { position: &position }] {
        let analysis = Analysis::new(matrix.pattern(), ordering).expect("analysis");
        let mut x = vec![1.0; 9];
        analysis.factor(&matrix).expect("positive").solve_in_place(&mut x, 1).expect("a fitting length");
        assert!((0..9).all(|i| (x[i] - 1.0 / (i + 1) as f64).abs() < 1e-15), "{x:?}");
    }
}

#[test]
fn a_body_that_can_move_or_gives_energy_is_refused() {
    let mut problem = elastic_block([1.0, 1.0, 0.5], [4, 4, 2], 0.0);
    let last = problem.position.len() - 1;
    let before = problem.matrix.diagonal()[last];
    problem.matrix.add(last, last, -1.01 * before).expect("the diagonal");
    match dissected(&problem).factor(&problem.matrix) {
        Err(SparseError::NotPositiveDefinite { diagonal, dimension, .. }) => {
            assert!(diagonal.is_finite());
            assert_eq!(dimension, last + 1);
        }
        other => panic!("{other:?}"),
    }
    let mut mesh = block(&Block { size_m: [1.0; 3], cells: [2, 2, 2] }).expect("block");
    mesh.nodes.iter_mut().for_each(|p| p.z += 1.0);
    let free = stiffness(&mesh);
    assert!(dissected(&free).factor(&free.matrix).is_err(), "six rigid motions");
    free_of_numbers(problem);
}

fn free_of_numbers(mut problem: ElasticBlock) {
    problem.matrix.values_mut()[3] = f64::NAN;
    let refused = dissected(&problem).factor(&problem.matrix);
    assert!(matches!(refused, Err(SparseError::NonFinite { entry: 3, .. })), "{refused:?}");
}

#[test]
fn another_pattern_and_missing_points_are_refused() {
    let (small, large) = (elastic_block([1.0; 3], [2, 2, 2], 0.0), elastic_block([1.0; 3], [2, 2, 3], 0.0));
    let refused = dissected(&small).factor(&large.matrix);
    assert!(matches!(refused, Err(SparseError::OtherPattern { .. })), "{refused:?}");
    let ordering = Ordering::NestedDissection { position: &small.position };
    assert!(matches!(Analysis::new(large.matrix.pattern(), ordering), Err(SparseError::Length { .. })));
    let empty = Arc::new(Pattern::from_elements(0, std::iter::empty()));
    assert!(matches!(Analysis::new(&empty, Ordering::MinimumDegree), Err(SparseError::Empty)));
}

#[test]
fn the_answer_does_not_depend_on_the_number_of_threads() {
    let problem = elastic_block([1.0, 1.5, 0.5], [12, 14, 8], 0.2);
    // Three blocks.
    let columns = 150;
    let rhs = DVector::from_fn(problem.position.len() * columns, |i, _| ((i * 7919) % 1013) as f64 - 500.0);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool");
        pool.install(|| {
            let mut x = rhs.as_slice().to_vec();
            factored(&problem).solve_in_place(&mut x, columns).expect("a fitting length");
            x
        })
    };
    let one = run(1);
    assert!(one == run(2), "one and two threads differ");
    let mut rows = DMatrix::from_column_slice(problem.position.len(), columns, rhs.as_slice()).transpose();
    factored(&problem).solve_rows_in_place(rows.as_mut_slice(), columns).expect("a fitting length");
    assert!(rows.transpose().as_slice() == one, "side by side and one after the other differ");
    let n = problem.position.len();
    let loads: Vec<Vec<(u32, f64)>> =
        rhs.as_slice().chunks(n).map(|column| (0..).zip(column.iter().copied()).collect()).collect();
    let loads: Vec<&[(u32, f64)]> = loads.iter().map(Vec::as_slice).collect();
    let mut solutions = vec![vec![0.0; n]; columns];
    let place: Vec<u32> = (0..n as u32).collect();
    factored(&problem).solve_loads(&loads, &place, &mut solutions).expect("fitting lengths");
    assert!(solutions.concat() == one, "given by unknown and one after the other differ");
    let mut product = vec![0.0; problem.position.len()];
    let last = &one[problem.position.len() * (columns - 1)..];
    problem.matrix.multiply(last, &mut product);
    let wanted = &rhs.as_slice()[problem.position.len() * (columns - 1)..];
    let error = product.iter().zip(wanted).map(|(p, w)| (p - w).abs()).fold(0.0, f64::max);
    assert!(error < 1e-9 * 500.0, "{error:e}");
}
