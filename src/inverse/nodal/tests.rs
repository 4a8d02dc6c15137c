//! The nodal estimator against derivatives, limits, its bound, and restraints of several makes.

use super::*;
use crate::inverse::experiment::{BlockExperiment, Restraint};
use nalgebra::DVector;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

fn block() -> (BlockExperiment, NodalProblem) {
    let experiment = BlockExperiment::new().expect("a block");
    let problem = NodalProblem::new(&experiment.condense().expect("condensed")).expect("ready");
    (experiment, problem)
}

fn outline(experiment: &BlockExperiment) -> Outline {
    Outline::new(&experiment.search_places())
}

fn noisy(truth: &DVector<f64>, sigma_m: f64, seed: u64) -> DVector<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    truth.map(|u| {
        let z: f64 = StandardNormal.sample(&mut rng);
        u + sigma_m * z
    })
}

/// At a decibel figure: the error's standard deviation for a signal.
fn sigma(truth: &DVector<f64>, decibel: f64) -> f64 {
    truth.norm() / (truth.len() as f64).sqrt() * 10_f64.powf(-decibel / 20.0)
}

#[test]
fn derivatives_match_central_differences_up_to_the_held_end() {
    let (_, problem) = block();
    let support = [3, 17, 30];
    for s in [[0.2, 0.5, 0.0], [0.9, 0.97, 0.3]] {
        let state = problem.state(&support, &s).expect("state");
        let derivatives = problem.derivatives(&state);
        for j in 0..3 {
            let shifted = |by: f64| {
                let mut to = s;
                to[j] += by;
                problem.state(&support, &to).expect("state").shape
            };
            let difference = (shifted(1e-5) - shifted(-1e-5)) / 2e-5;
            let error = (derivatives.column(j) - &difference).norm() / difference.norm();
            assert!(error < 1e-7, "node {j}: {error:e}");
        }
    }
}

#[test]
fn a_held_node_stands_still_and_a_very_stiff_spring_nearly_so() {
    let (_, problem) = block();
    let with = |k: f64| {
        let mut springs = vec![0.0; problem.nodes()];
        springs[12] = k;
        problem.displace(1e4, &springs).expect("displaced")
    };
    let (held, held_observed) = with(f64::INFINITY);
    assert!(held.rows(36, 3).norm() < 1e-13 * held.norm());
    let (stiff, stiff_observed) = with(1e9);
    assert!(stiff.rows(36, 3).norm() < 1e-4 * stiff.norm());
    assert!((held_observed - stiff_observed).norm() < 1e-4 * stiff.norm());
}

/// Dividing modulus and springs by two doubles every displacement.
#[test]
fn displacement_scales_with_the_inverse_of_all_stiffness() {
    let (experiment, problem) = block();
    let springs = experiment.stiffness(Restraint::Springs(500.0));
    let halved: Vec<f64> = springs.iter().map(|k| 0.5 * k).collect();
    let (_, once) = problem.displace(1e4, &springs).expect("displaced");
    let (_, twice) = problem.displace(5e3, &halved).expect("displaced");
    assert!((twice - 2.0 * &once).norm() < 1e-12 * once.norm());
}

#[test]
fn the_bound_is_what_a_fit_on_the_known_nodes_reaches() {
    let (experiment, problem) = block();
    let springs = experiment.stiffness(Restraint::Springs(500.0));
    let (_, truth) = problem.displace(1e4, &springs).expect("displaced");
    let sigma_m = sigma(&truth, 70.0);
    let support = &experiment.restrained;
    let stated = bound(&problem, 1e4, support, &[500.0; 10], sigma_m).expect("determined");
    let total_bound = stated.total_n_per_m.expect("springs");
    let s = problem.saturation(1e4, 400.0);
    let (mut modulus, mut total) = (0.0, 0.0);
    let seeds = 60;
    for seed in 0..seeds {
        let data = problem.reduce(&noisy(&truth, sigma_m, seed), sigma_m).expect("data");
        let found = fit_support(&problem, &data, support, &[s; 10]).expect("converges");
        let sum: f64 = found.saturation.iter().map(|&s| problem.stiffness(found.young_modulus_pa, s)).sum();
        modulus += (found.young_modulus_pa - 1e4).powi(2) / seeds as f64;
        total += (sum - 5000.0).powi(2) / seeds as f64;
    }
    // The standard deviation of 60 normal values scatters by 9 %: three times that.
    assert!((modulus.sqrt() / stated.young_modulus_pa - 1.0).abs() < 0.28);
    assert!((total.sqrt() / total_bound - 1.0).abs() < 0.28);
}

#[test]
fn equal_springs_are_found_at_their_nodes() {
    let (experiment, problem) = block();
    let (_, truth) =
        problem.displace(1e4, &experiment.stiffness(Restraint::Springs(500.0))).expect("displaced");
    let sigma_m = sigma(&truth, 60.0);
    let data = problem.reduce(&noisy(&truth, sigma_m, 3), sigma_m).expect("data");
    let found = fit(&problem, &outline(&experiment), &data).expect("fitted");
    assert_eq!(found.springs, Springs::Alike);
    let nodes: Vec<usize> = (0..problem.nodes()).filter(|&j| found.stiffness_n_per_m[j] > 0.0).collect();
    assert_eq!(nodes, experiment.restrained);
    let total = found.total_n_per_m.expect("springs");
    assert!((total.value - 5000.0).abs() < 4.0 * total.sd);
    assert!((found.young_modulus_pa.value - 1e4).abs() < 4.0 * found.young_modulus_pa.sd);
}

#[test]
fn held_nodes_are_reported_as_held() {
    let (experiment, problem) = block();
    let (_, truth) = problem.displace(1e4, &experiment.stiffness(Restraint::Fixed)).expect("displaced");
    let sigma_m = sigma(&truth, 50.0);
    let data = problem.reduce(&noisy(&truth, sigma_m, 1), sigma_m).expect("data");
    let found = fit(&problem, &outline(&experiment), &data).expect("fitted");
    for (j, k) in found.stiffness_n_per_m.iter().enumerate() {
        assert_eq!(k.is_infinite(), experiment.restrained.contains(&j), "node {j}: {k}");
    }
    assert!(found.total_n_per_m.is_none());
}

/// Springs far apart and of very different stiffness: data reject springs that are alike.
#[test]
fn unequal_springs_are_not_forced_to_be_alike() {
    let (experiment, problem) = block();
    let mut springs = vec![0.0; problem.nodes()];
    (springs[2], springs[32]) = (3000.0, 200.0);
    let (_, truth) = problem.displace(1e4, &springs).expect("displaced");
    let sigma_m = sigma(&truth, 60.0);
    let data = problem.reduce(&noisy(&truth, sigma_m, 5), sigma_m).expect("data");
    let found = fit(&problem, &outline(&experiment), &data).expect("fitted");
    assert_eq!(found.springs, Springs::Free);
    assert!((found.stiffness_n_per_m[2] / 3000.0 - 1.0).abs() < 0.05, "{:?}", found.stiffness_n_per_m);
    assert!((found.stiffness_n_per_m[32] / 200.0 - 1.0).abs() < 0.05);
}

#[test]
fn a_free_body_gets_no_springs() {
    let (experiment, problem) = block();
    let (_, truth) = problem.displace(1e4, &vec![0.0; problem.nodes()]).expect("displaced");
    let sigma_m = sigma(&truth, 60.0);
    let data = problem.reduce(&noisy(&truth, sigma_m, 2), sigma_m).expect("data");
    let found = fit(&problem, &outline(&experiment), &data).expect("fitted");
    // A lone bogus spring may be left by chance: it must weigh next to nothing.
    assert!(found.stiffness_n_per_m.iter().sum::<f64>() < 5.0, "{:?}", found.stiffness_n_per_m);
    assert!((found.young_modulus_pa.value / 1e4 - 1.0).abs() < 1e-3);
}
