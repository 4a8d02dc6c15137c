//! The published method against its own equations and against what must come out without noise.

use super::*;
use crate::inverse::experiment::{BlockExperiment, Restraint};
use crate::inverse::nodal::NodalProblem;
use crate::inverse::{Condensed, SolveError};
use nalgebra::{DMatrix, DVector};

struct Case {
    experiment: BlockExperiment,
    body: Condensed,
    springs: Vec<f64>,
    search: DVector<f64>,
    observed: DVector<f64>,
}

fn case(restraint: Restraint) -> Case {
    let experiment = BlockExperiment::new().expect("a block");
    let body = experiment.condense().expect("condensed");
    let springs = experiment.stiffness(restraint);
    let problem = NodalProblem::new(&body).expect("ready");
    let (search, observed) = problem.displace(1e4, &springs).expect("displaced");
    Case { experiment, body, springs, search, observed }
}

#[test]
fn without_noise_modulus_and_displacements_come_back() {
    let case = case(Restraint::Springs(500.0));
    for regularisation in [Regularisation::Energy, Regularisation::UnitScaled, Regularisation::None] {
        let fit = StepOne::new(&case.body, regularisation)
            .expect("prepared")
            .fit(&case.observed, 0.0, &StepOneRules::BLOCK)
            .expect("converges");
        assert!((fit.young_modulus_pa / 1e4 - 1.0).abs() < 1e-6, "{regularisation:?}");
        assert!((fit.search_m - &case.search).amax() < 1e-4 * case.search.amax(), "{regularisation:?}");
    }
}

/// One step of the arrow-shaped system against equation 3 written out with dense matrices.
#[test]
fn a_step_is_equation_three() {
    let case = case(Restraint::Springs(500.0));
    let observed = case.observed.map(|u| u + 0.003 * (1e4 * u).sin());
    let error = (&observed - &case.observed).norm();
    let rules = StepOneRules { steps: 1, ..StepOneRules::BLOCK };
    let (modulus, n) = (rules.start.young_modulus_pa, case.search.len());
    let inverse = case.body.search_search.clone().try_inverse().expect("regular");
    let jacobian_s = &case.body.observed_search * &inverse;
    let load = &case.body.observed_load - &jacobian_s * &case.body.search_load;
    let mut jacobian = DMatrix::zeros(observed.len(), n + 1);
    jacobian.set_column(0, &(&load / -modulus.powi(2)));
    jacobian.columns_mut(1, n).copy_from(&jacobian_s);
    let held_work = case.body.load_load - case.body.search_load.dot(&(&inverse * &case.body.search_load));
    let start = DVector::from_element(n, rules.start.displacement_m);
    let residual = &observed - (&load / modulus + &jacobian_s * &start);
    for regularisation in [Regularisation::Energy, Regularisation::Unit] {
        let mut matrix = DMatrix::identity(n + 1, n + 1);
        if regularisation == Regularisation::Energy {
            matrix[(0, 0)] = held_work / modulus.powi(3);
            matrix.view_mut((1, 1), (n, n)).copy_from(&(&inverse * modulus));
        }
        let norm = |m: &DMatrix<f64>| m.clone().singular_values()[0];
        let alpha = norm(&jacobian).powi(2) * error / ((observed.norm() - error) * norm(&matrix));
        let normal = jacobian.tr_mul(&jacobian) + &matrix * alpha;
        let step = normal.lu().solve(&jacobian.tr_mul(&residual)).expect("regular");
        let one = StepOne::new(&case.body, regularisation).expect("prepared");
        let Err(SolveError::StepOne { last, .. }) = one.fit(&observed, error, &rules) else {
            panic!("one step cannot meet the second rule");
        };
        assert!((last.alpha / alpha - 1.0).abs() < 1e-5);
        assert!((last.young_modulus_pa - modulus - step[0]).abs() < 1e-4 * step[0].abs().max(1e-6));
        let search = (start.clone() + step.rows(1, n)).map(|s| s.clamp(-rules.bound_m, rules.bound_m));
        assert!((last.search_m - &search).amax() < 1e-5, "{regularisation:?}");
    }
}

#[test]
fn the_reactions_are_the_springs_pull() {
    let case = case(Restraint::Springs(500.0));
    let forces = reactions(&case.body, 1e4, &case.search).expect("solved");
    for j in 0..case.springs.len() {
        let pull = case.search.rows(3 * j, 3) * -case.springs[j];
        assert!((forces.rows(3 * j, 3) - pull).norm() < 1e-6 * 500.0 * case.search.amax());
    }
    for (found, truth) in equivalent_stiffness(&forces, &case.search).iter().zip(&case.springs) {
        assert!((found - truth).abs() < 1e-3);
    }
}

#[test]
fn without_noise_step_two_finds_the_springs_sum() {
    let case = case(Restraint::Springs(500.0));
    let found = search_forces(&case.body, 1e4, &case.observed, 0.0).expect("solved");
    let stiffness = equivalent_stiffness(&found.x, &case.search);
    let total: f64 = case.experiment.restrained.iter().map(|&j| stiffness[j]).sum();
    assert!((total / 5000.0 - 1.0).abs() < 0.02, "{total}");
}

#[test]
fn step_one_refuses_what_it_cannot_use() {
    let case = case(Restraint::Fixed);
    let one = StepOne::new(&case.body, Regularisation::Energy).expect("prepared");
    assert!(matches!(one.fit(&DVector::zeros(3), 0.0, &StepOneRules::BLOCK), Err(SolveError::Size { .. })));
    let norm = case.observed.norm();
    assert!(matches!(one.fit(&case.observed, norm, &StepOneRules::BLOCK), Err(SolveError::BadValue { .. })));
}
