//! Restraints that are all alike: which nodes, and how stiff, when every restrained node has the same spring.
//!
//! Neighbouring nodes can hardly be told apart by what happens on the far side of the body, so that the
//! likelihood's maximum over free springs puts all stiffness on a few of them, and too much of it: a lone
//! spring also bears on the body's own compliance around its node. Often, though, the restraint is one thing.
//! Under that hypothesis the unknowns are the set A of nodes, one κ (which may be infinite: held) and β, in
//! which the prediction is linear. What is lowered over them is `χ² + ln m · (outline of A)`: without the
//! outline's price ([`Outline`]) some of the many sets of scattered nodes fits the noise better than the true
//! one. The descent goes to the best of all sets that differ by one node entering, leaving or changing places,
//! or by two neighbours entering or leaving together, each with κ as it is and with κ making up for the other
//! number of nodes, until none is better.

use super::{NodalData, NodalProblem, Outline};

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
    /// χ² and the price of the outline.
    pub(super) score: f64,
}

/// The search: problem, data, and which nodes are neighbours.
#[derive(Clone, Copy)]
pub(super) struct AlikeSearch<'a> {
    pub(super) problem: &'a NodalProblem,
    pub(super) data: &'a NodalData,
    pub(super) outline: &'a Outline,
}

/// Most moves of the descent: a restraint is rarely built up from more than its nodes.
const MOVES: usize = 200;
/// Sets whose κ is refined before the best of them is taken.
const REFINED: usize = 8;
/// Greatest finite κ / κ₀: beyond it a node is held as far as any observation can tell.
const HELD: f64 = 1e4;
/// A spring stiffer than this (κ / κ₀) is called held when that costs less χ² than the stiffness, one parameter more,
/// is charged.
const STIFF: f64 = 10.0;
/// Accuracy of ln κ.
const LOG_KAPPA: f64 = 1e-5;

impl AlikeSearch<'_> {
    /// Descends from each of the `starts` (nodes and κ); starts without a node are passed over.
    pub(super) fn run(&self, starts: &[(Vec<usize>, f64)]) -> Vec<Alike> {
        starts.iter().filter_map(|(nodes, kappa)| self.descend(self.place(nodes.clone(), *kappa)?)).collect()
    }

    fn descend(&self, start: Alike) -> Option<Alike> {
        let mut best = self.with_best_kappa(start);
        for _ in 0..MOVES {
            let mut tried: Vec<Alike> = self
                .moves(&best.nodes)
                .into_iter()
                .filter_map(|nodes| {
                    let scaled = best.kappa * best.nodes.len() as f64 / nodes.len() as f64;
                    let kappas: &[f64] = if scaled == best.kappa { &[scaled] } else { &[best.kappa, scaled] };
                    kappas
                        .iter()
                        .filter_map(|&kappa| self.place(nodes.clone(), kappa))
                        .min_by(|a, b| a.score.total_cmp(&b.score))
                })
                .collect();
            tried.sort_by(|a, b| a.score.total_cmp(&b.score));
            let next = tried
                .into_iter()
                .take(REFINED)
                .map(|t| self.with_best_kappa(t))
                .min_by(|a, b| a.score.total_cmp(&b.score))?;
            if next.score >= best.score - 1e-9 {
                break;
            }
            best = next;
        }
        best.nodes.sort_unstable();
        if best.kappa > STIFF * self.problem.kappa0
            && let Some(held) = self.place(best.nodes.clone(), f64::INFINITY)
            && held.chi2 <= best.chi2 + self.data.price()
        {
            return Some(held);
        }
        Some(best)
    }

    /// All sets, not empty, that differ by one node entering, leaving or changing places, or by two neighbours
    /// entering or leaving.
    fn moves(&self, nodes: &[usize]) -> Vec<Vec<usize>> {
        let mut sets = Vec::new();
        let without =
            |out: &[usize]| -> Vec<usize> { nodes.iter().copied().filter(|i| !out.contains(i)).collect() };
        let with = |mut base: Vec<usize>, new: &[usize]| {
            base.extend(new);
            base
        };
        for j in 0..self.problem.nodes() {
            if nodes.contains(&j) {
                sets.push(without(&[j]));
            } else {
                sets.push(with(nodes.to_vec(), &[j]));
                sets.extend(nodes.iter().map(|&out| with(without(&[out]), &[j])));
            }
        }
        for pair in &self.outline.pairs {
            match pair.map(|j| nodes.contains(&j)) {
                [true, true] => sets.push(without(pair)),
                [false, false] => sets.push(with(nodes.to_vec(), pair)),
                _ => (),
            }
        }
        sets.retain(|s: &Vec<usize>| !s.is_empty());
        sets
    }

    fn place(&self, nodes: Vec<usize>, kappa: f64) -> Option<Alike> {
        if nodes.is_empty() {
            return None;
        }
        let data = self.data;
        let shape = self.problem.shape_of(&nodes, kappa)?;
        let beta = shape.dot(&data.reduced) / shape.norm_squared();
        let squares = (&data.reduced - &shape * beta).norm_squared() + data.unreachable_m2;
        let chi2 = squares / (data.sigma_m * data.sigma_m);
        let score = chi2 + data.price() * self.outline.length(&nodes) as f64;
        (beta > 0.0).then(|| Alike { nodes, kappa, young_modulus_pa: 1.0 / beta, chi2, score })
    }

    /// Compass search over ln κ, and the held case for itself.
    fn with_best_kappa(&self, from: Alike) -> Alike {
        let limit = HELD * self.problem.kappa0;
        let try_kappa =
            |best: &Alike, kappa: f64| self.place(best.nodes.clone(), kappa).filter(|p| p.chi2 < best.chi2);
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
}
