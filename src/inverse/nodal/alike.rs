//! Restraints that are all alike: which nodes, and how stiff, when every restrained node has the same spring.
//!
//! Neighbouring nodes can hardly be told apart by what happens on the far side of the body, so that the
//! likelihood's maximum over free springs puts all stiffness on a few of them, and too much of it: a lone
//! spring also bears on the body's own compliance around its node. Often, though, the restraint is one thing.
//! Under that hypothesis the unknowns are the set A of nodes, one κ (which may be infinite: held) and β, in
//! which the prediction is linear. χ² is lowered over them by descent: to the best of all sets that differ by
//! one node entering, leaving or changing places, each with κ as it is and with κ making up for the other
//! number of nodes, until none is better.

use super::{NodalData, NodalProblem};

/// Restrained nodes with one spring each.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Alike {
    /// The nodes, as indices among the search nodes, ascending.
    pub(super) nodes: Vec<usize>,
    /// κ = k / E of each (m); infinite when held.
    pub(super) kappa: f64,
    /// Young's modulus (Pa).
    pub(super) young_modulus_pa: f64,
    /// Sum of squared residuals over the error's variance.
    pub(super) chi2: f64,
}

/// Most moves of the descent: a restraint is rarely built up from more than its nodes.
const MOVES: usize = 200;
/// Sets whose κ is refined before the best of them is taken.
const REFINED: usize = 3;
/// Greatest finite κ / κ₀: beyond it a node is held as far as any observation can tell.
const HELD: f64 = 1e4;
/// A spring stiffer than this (κ / κ₀) is called held when the data do not tell it from that, χ² rising by less
/// than the 95 % one-sided limit of one unknown.
const STIFF: f64 = 10.0;
const INDISTINCT: f64 = 2.706;
/// Accuracy of ln κ.
const LOG_KAPPA: f64 = 1e-5;

/// Descends from each of the `starts` (nodes and κ); starts without a node are passed over.
pub(super) fn alike(problem: &NodalProblem, data: &NodalData, starts: &[(Vec<usize>, f64)]) -> Vec<Alike> {
    starts
        .iter()
        .filter_map(|(nodes, kappa)| descend(problem, data, place(problem, data, nodes.clone(), *kappa)?))
        .collect()
}

fn descend(problem: &NodalProblem, data: &NodalData, start: Alike) -> Option<Alike> {
    let mut best = with_best_kappa(problem, data, start);
    for _ in 0..MOVES {
        let mut tried: Vec<Alike> = neighbours(&best.nodes, problem.nodes())
            .into_iter()
            .filter_map(|nodes| {
                let scaled = best.kappa * best.nodes.len() as f64 / nodes.len() as f64;
                let kappas: &[f64] = if scaled == best.kappa { &[scaled] } else { &[best.kappa, scaled] };
                kappas
                    .iter()
                    .filter_map(|&kappa| place(problem, data, nodes.clone(), kappa))
                    .min_by(|a, b| a.chi2.total_cmp(&b.chi2))
            })
            .collect();
        tried.sort_by(|a, b| a.chi2.total_cmp(&b.chi2));
        let next = tried
            .into_iter()
            .take(REFINED)
            .map(|t| with_best_kappa(problem, data, t))
            .min_by(|a, b| a.chi2.total_cmp(&b.chi2))?;
        if next.chi2 >= best.chi2 - 1e-9 {
            break;
        }
        best = next;
    }
    best.nodes.sort_unstable();
    if best.kappa > STIFF * problem.kappa0
        && let Some(held) = place(problem, data, best.nodes.clone(), f64::INFINITY)
        && held.chi2 <= best.chi2 + INDISTINCT
    {
        return Some(held);
    }
    Some(best)
}

/// All sets, not empty, that differ by one node entering, leaving, or changing places.
fn neighbours(nodes: &[usize], count: usize) -> Vec<Vec<usize>> {
    let mut sets = Vec::new();
    for j in 0..count {
        if nodes.contains(&j) {
            sets.push(nodes.iter().copied().filter(|&i| i != j).collect());
        } else {
            sets.push(nodes.iter().copied().chain([j]).collect());
            sets.extend(
                nodes.iter().map(|&out| nodes.iter().map(|&i| if i == out { j } else { i }).collect()),
            );
        }
    }
    sets.retain(|s: &Vec<usize>| !s.is_empty());
    sets
}

fn place(problem: &NodalProblem, data: &NodalData, nodes: Vec<usize>, kappa: f64) -> Option<Alike> {
    if nodes.is_empty() {
        return None;
    }
    let shape = problem.shape_of(&nodes, kappa)?;
    let beta = shape.dot(&data.reduced) / shape.norm_squared();
    let squares = (&data.reduced - &shape * beta).norm_squared() + data.unreachable_m2;
    let chi2 = squares / (data.sigma_m * data.sigma_m);
    (beta > 0.0).then(|| Alike { nodes, kappa, young_modulus_pa: 1.0 / beta, chi2 })
}

/// Compass search over ln κ, and the held case for itself.
fn with_best_kappa(problem: &NodalProblem, data: &NodalData, from: Alike) -> Alike {
    let limit = HELD * problem.kappa0;
    let try_kappa = |best: &Alike, kappa: f64| {
        place(problem, data, best.nodes.clone(), kappa).filter(|p| p.chi2 < best.chi2)
    };
    let mut best = from;
    if best.kappa.is_infinite() {
        best = try_kappa(&best, limit).unwrap_or(best);
    }
    let mut width = 0.7_f64;
    while best.kappa.is_finite() && width > LOG_KAPPA {
        let better = [width, -width]
            .into_iter()
            .map(|w| best.kappa * w.exp())
            .filter(|&kappa| kappa <= limit)
            .find_map(|kappa| try_kappa(&best, kappa));
        match better {
            Some(p) => best = p,
            None => width *= 0.5,
        }
    }
    try_kappa(&best, f64::INFINITY).unwrap_or(best)
}
