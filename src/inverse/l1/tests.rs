//! The three solvers against closed forms, the optimality conditions, and each other.

use super::*;
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

fn normal(rng: &mut ChaCha8Rng, rows: usize, columns: usize) -> DMatrix<f64> {
    DMatrix::from_fn(rows, columns, |_, _| StandardNormal.sample(rng))
}

/// Optimality written out from the definition, in the caller's units: |aⱼᵀr| ≤ λⱼ, with equality and the
/// sign of xⱼ where xⱼ ≠ 0. Relative to the greatest |aⱼᵀb|.
fn violation(a: &DMatrix<f64>, b: &DVector<f64>, lambda: &DVector<f64>, sign: Sign, x: &DVector<f64>) -> f64 {
    let correlation = a.tr_mul(&(b - a * x));
    let worst = (0..x.len())
        .map(|j| match sign {
            _ if x[j] != 0.0 => (correlation[j] - lambda[j] * x[j].signum()).abs(),
            Sign::Free => (correlation[j].abs() - lambda[j]).max(0.0),
            Sign::NonNegative => (correlation[j] - lambda[j]).max(0.0),
        })
        .fold(0.0, f64::max);
    worst / a.tr_mul(b).amax()
}

#[test]
fn orthonormal_columns_give_the_soft_threshold() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let a = normal(&mut rng, 12, 7).qr().q();
    let b = DVector::from_fn(12, |_, _| StandardNormal.sample(&mut rng));
    let lambda = DVector::from_fn(7, |j, _| 0.1 * (j + 1) as f64);
    let projection = a.tr_mul(&b);
    for sign in [Sign::Free, Sign::NonNegative] {
        let expected = DVector::from_fn(7, |j, _| match sign {
            Sign::Free => projection[j].signum() * (projection[j].abs() - lambda[j]).max(0.0),
            Sign::NonNegative => (projection[j] - lambda[j]).max(0.0),
        });
        let problem = L1Problem::new(&a, &b, &lambda, sign).expect("sizes agree");
        let descent = coordinate_descent(&problem, None, &Descent::default()).expect("converges");
        assert!((&descent.x - &expected).amax() < 1e-9);
        assert!((&active_set(&problem, None).expect("converges").x - &expected).amax() < 1e-12);
        assert!((&interior_point(&problem).expect("solved").x - &expected).amax() < 1e-6);
        let objective = 0.5 * (&a * &expected - &b).norm_squared() + lambda.dot(&expected.abs());
        assert!((descent.objective / objective - 1.0).abs() < 1e-9);
    }
}

#[test]
fn the_solvers_agree_and_meet_the_optimality_conditions() {
    for (seed, rows, columns) in [(2, 40, 25), (3, 20, 45), (4, 30, 30)] {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let a = normal(&mut rng, rows, columns);
        let sparse = DVector::from_fn(columns, |j, _| if j % 7 == 0 { 1.0 + j as f64 / 10.0 } else { 0.0 });
        let noise = normal(&mut rng, rows, 1).column(0).into_owned();
        let b = &a * sparse + 0.1 * noise;
        let lambda = DVector::from_fn(columns, |j, _| 0.5 + 0.1 * (j % 3) as f64);
        for sign in [Sign::Free, Sign::NonNegative] {
            let problem = L1Problem::new(&a, &b, &lambda, sign).expect("sizes agree");
            let descent = coordinate_descent(&problem, None, &Descent::default()).expect("converges");
            let reference = interior_point(&problem).expect("solved");
            let polished = active_set(&problem, Some(&reference.x)).expect("converges");
            assert!(violation(&a, &b, &lambda, sign, &descent.x) < 1e-8);
            assert!(violation(&a, &b, &lambda, sign, &polished.x) < 1e-10);
            assert!((&descent.x - &polished.x).amax() < 1e-7);
            assert!((reference.objective / polished.objective - 1.0).abs() < 1e-7);
            assert!(polished.objective <= reference.objective * (1.0 + 1e-12));
            let warm =
                coordinate_descent(&problem, Some(&polished.x), &Descent::default()).expect("converges");
            assert!(warm.iterations <= 3 && descent.iterations > warm.iterations);
        }
    }
}

/// Columns that are samples of one smooth kernel, as the compliances of neighbouring nodes are, in units that
/// make the entries tiny: condition number above 1e6.
#[test]
fn nearly_parallel_columns_in_awkward_units_still_come_out_right() {
    let kernel = |i: usize, j: usize| 1e-6 / (0.05 + (i as f64 / 59.0 - j as f64 / 39.0).powi(2));
    let a = DMatrix::from_fn(60, 40, kernel);
    let singular = a.clone().singular_values();
    assert!(singular[0] / singular[39] > 1e6);
    let truth = DVector::from_fn(40, |j, _| if (10..14).contains(&j) { 500.0 } else { 0.0 });
    let b = &a * &truth;
    let lambda = DVector::from_element(40, 1e-3 * a.tr_mul(&b).amax());
    for sign in [Sign::Free, Sign::NonNegative] {
        let problem = L1Problem::new(&a, &b, &lambda, sign).expect("sizes agree");
        let reference = interior_point(&problem).expect("solved");
        let polished = active_set(&problem, Some(&reference.x)).expect("converges");
        assert!(violation(&a, &b, &lambda, sign, &polished.x) < 1e-9);
        // Coordinate descent crawls here: it brings the objective close, and the active set does the rest.
        let coarse = Descent { tolerance: 1e-6, sweeps: 200_000 };
        let descent = coordinate_descent(&problem, None, &coarse).expect("converges");
        assert!((descent.objective / polished.objective - 1.0).abs() < 1e-3);
        let finished = active_set(&problem, Some(&descent.x)).expect("converges");
        assert!((finished.objective / polished.objective - 1.0).abs() < 1e-9);
        assert!((&finished.x - &polished.x).amax() < 1e-3 * polished.x.amax());
        assert!((polished.x.sum() / 2000.0 - 1.0).abs() < 0.02, "{}", polished.x.sum());
    }
}

#[test]
fn above_the_vanishing_factor_nothing_is_left_and_just_below_one_unknown_is() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let a = normal(&mut rng, 15, 10);
    let b = DVector::from_fn(15, |_, _| StandardNormal.sample(&mut rng));
    for sign in [Sign::Free, Sign::NonNegative] {
        let problem = L1Problem::new(&a, &b, &DVector::from_element(10, 1.0), sign).expect("sizes agree");
        let edge = problem.vanishing_factor();
        for (factor, left) in [(1.001, 0), (0.999, 1)] {
            let at =
                problem.clone().with_penalty(&DVector::from_element(10, factor * edge)).expect("sizes agree");
            let found = coordinate_descent(&at, None, &Descent::default()).expect("converges");
            assert_eq!(found.x.iter().filter(|v| **v != 0.0).count(), left);
        }
    }
}

#[test]
fn running_out_of_sweeps_is_an_error_with_evidence() {
    let a = DMatrix::from_fn(30, 20, |i, j| 1.0 / (1.0 + (i as f64 - 1.5 * j as f64).powi(2) / 30.0));
    let b = DVector::from_fn(30, |i, _| (i as f64 / 3.0).sin());
    let problem = L1Problem::new(&a, &b, &DVector::from_element(20, 1e-6), Sign::Free).expect("sizes agree");
    let stopped = coordinate_descent(&problem, None, &Descent { tolerance: 1e-10, sweeps: 5 });
    let Err(crate::inverse::SolveError::NotConverged { iterations: 5, residual, .. }) = stopped else {
        panic!("five sweeps cannot suffice: {stopped:?}");
    };
    assert!(residual > 1e-10);
}

#[test]
fn bad_arguments_are_named() {
    let a = DMatrix::<f64>::identity(3, 3);
    let b = DVector::zeros(3);
    assert!(L1Problem::new(&a, &DVector::zeros(2), &b, Sign::Free).is_err());
    assert!(L1Problem::new(&a, &b, &DVector::from_element(3, -1.0), Sign::Free).is_err());
    assert!(L1Problem::new(&a, &DVector::from_element(3, f64::NAN), &b, Sign::Free).is_err());
}
