//! The default nodal estimate: which nodes are restrained, how stiffly, and Young's modulus.
//!
//! 1. The likelihood's maximum over springs on all search nodes, 0 ≤ k ≤ ∞. Non-negativity makes it sparse;
//!    it fits best and is where the search begins, but its few springs stand for many.
//! 2. Among the distributions of springs that fit as well as the true one would be expected to, the one
//!    with the lowest peak. The springs that the first fit uses cost it as much χ² as there are of them.
//! 3. From the nodes near the peaks of both (several thresholds), restraints that are all alike: [`super::alike`].
//! 4. From the nodes of the first fit, and from those of the best restraint that is all alike with their
//!    neighbours, restraints whose springs are free: nodes are dropped, the least useful first, as long as the
//!    criterion falls, and the rest refitted.
//! 5. Of all these the one with the least `χ² + ln m · (number of different springs + length of the outline)` is
//!    kept. No step shrinks what is reported.
//!
//! What this takes for granted, and the Cramér–Rao bound does not know: that a restraint with a short outline is
//! the likelier one, and that springs are equal until the data deny it. Where that is so, errors are far below the
//! bound; where it is not, above. Both rest on the same count of what has to be said. Standard deviations take the
//! nodes, and that springs are alike, as known.
//!
//! Why not the likelihood alone: on the block at 40 dB the bound of a single spring is 220 to 1060 N/m, and they are of
//! 500. So far from the linear, uneven springs must be stiffer in sum to do the same, and the likelihood's maximum
//! reads the total too high by more than its bound even when it is told the nodes.

use super::support::fit_capped;
use super::{
    NodalData, NodalProblem, Outline, SupportFit, alike::AlikeSearch, bound::bound_of_groups, fit_support,
};
use crate::inverse::{Estimate, SolveError};

/// Which description of the restraint the data support.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Springs {
    /// All restrained nodes have the same spring.
    Alike,
    /// Each has its own.
    Free,
}

/// The estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct NodalFit {
    /// Young's modulus (Pa).
    pub young_modulus_pa: Estimate,
    /// One stiffness a search node (N/m): zero where free, infinite where held (glued).
    pub stiffness_n_per_m: Vec<f64>,
    /// Sum of the springs (N/m); nothing when there is none or a node is held.
    pub total_n_per_m: Option<Estimate>,
    /// How the restraint is described.
    pub springs: Springs,
    /// Sum of squared residuals over the error's variance.
    pub chi2: f64,
    /// The same with free springs on all nodes.
    pub chi2_free: f64,
}

/// Halvings of the interval that holds the lowest peak: 1/256 of the saturation is finer than any data tell.
const HALVINGS: usize = 8;
/// Nodes above these shares of the peak start the search for a restraint that is all alike.
const SHARES: [f64; 4] = [0.1, 0.3, 0.6, 0.9];
/// A spring above this saturation starts a search as held.
const NEARLY_HELD: f64 = 0.9;

/// Estimates modulus and springs from `data`; `outline` says which search nodes are neighbours.
///
/// # Errors
/// [`SolveError::NotConverged`]; what [`NodalProblem`] reports.
pub fn fit(problem: &NodalProblem, outline: &Outline, data: &NodalData) -> Result<NodalFit, SolveError> {
    let all: Vec<usize> = (0..problem.nodes()).collect();
    let free = fit_support(problem, data, &all, &vec![0.05; all.len()])?;
    let used: Vec<usize> = all.iter().copied().filter(|&j| free.saturation[j] > 0.0).collect();
    if used.is_empty() {
        return report(problem, data, &free, Springs::Alike, free.chi2);
    }
    let low = lowest_peak(problem, data, &free, used.len() as f64);
    let search = AlikeSearch { problem, data, outline };
    let alike = search
        .run(&starts(problem, &[&low, &free]))
        .into_iter()
        .min_by(|a, b| a.score.total_cmp(&b.score))
        .map(|found| {
            let fitted = SupportFit {
                young_modulus_pa: found.young_modulus_pa,
                saturation: vec![problem.saturation(1.0, found.kappa); found.nodes.len()],
                support: found.nodes,
                chi2: found.chi2,
                slope: 0.0,
                steps: 0,
            };
            (found.score + data.price(), fitted)
        });
    let mut begin = vec![(used.clone(), used.iter().map(|&j| free.saturation[j]).collect())];
    if let Some((_, fitted)) = &alike {
        let nodes = grown(outline, &fitted.support);
        let s = vec![fitted.saturation[0].min(NEARLY_HELD); nodes.len()];
        begin.push((nodes, s));
    }
    let mut best = alike.map(|(score, fitted)| (score, fitted, Springs::Alike));
    for (nodes, s) in begin {
        let pruned = match prune(problem, outline, data, &nodes, &s) {
            Ok(pruned) => pruned,
            // A start from which nothing settles is one start less.
            Err(SolveError::NotConverged { .. }) => continue,
            Err(e) => return Err(e),
        };
        let score = criterion(outline, data, &pruned);
        if best.as_ref().is_none_or(|(least, ..)| score < *least) {
            best = Some((score, pruned, Springs::Free));
        }
    }
    let (_, fitted, springs) = best.unwrap_or((free.chi2, free.clone(), Springs::Free));
    report(problem, data, &fitted, springs, free.chi2)
}

/// Nodes near the peaks of `fits`, and the mean κ there.
fn starts(problem: &NodalProblem, fits: &[&SupportFit]) -> Vec<(Vec<usize>, f64)> {
    let mut starts = Vec::new();
    for fitted in fits {
        let peak = fitted.saturation.iter().copied().fold(0.0, f64::max);
        for share in SHARES {
            let near: Vec<usize> =
                (0..fitted.support.len()).filter(|&i| fitted.saturation[i] >= share * peak).collect();
            let mean = near.iter().map(|&i| fitted.saturation[i]).sum::<f64>() / near.len() as f64;
            let s = if mean > NEARLY_HELD { 1.0 } else { mean };
            starts.push((near.iter().map(|&i| fitted.support[i]).collect(), problem.stiffness(1.0, s)));
        }
    }
    starts.dedup();
    starts
}

/// `nodes` and all their neighbours, ascending.
fn grown(outline: &Outline, nodes: &[usize]) -> Vec<usize> {
    let touching = outline.pairs.iter().filter(|pair| pair.iter().any(|j| nodes.contains(j)));
    let mut all: Vec<usize> = touching.flatten().chain(nodes).copied().collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// χ² and the price of free springs and of the outline of what is restrained.
fn criterion(outline: &Outline, data: &NodalData, fitted: &SupportFit) -> f64 {
    let kept: Vec<usize> = (0..fitted.support.len())
        .filter(|&i| fitted.saturation[i] > 0.0)
        .map(|i| fitted.support[i])
        .collect();
    fitted.chi2 + data.price() * (kept.len() + outline.length(&kept)) as f64
}

/// The fit with the lowest peak among those whose χ² exceeds that of `free` by at most `spend`.
fn lowest_peak(problem: &NodalProblem, data: &NodalData, free: &SupportFit, spend: f64) -> SupportFit {
    let mut best = free.clone();
    let (mut low, mut high) = (0.0, free.saturation.iter().copied().fold(0.0, f64::max));
    for _ in 0..HALVINGS {
        let cap = 0.5 * (low + high);
        match fit_capped(problem, data, &best.support, &best.saturation, cap) {
            Ok(fitted) if fitted.chi2 <= free.chi2 + spend => (high, best) = (cap, fitted),
            // A fit that does not settle under a cap is no better than one that fails under it.
            _ => low = cap,
        }
    }
    best
}

/// Springs on `nodes` from saturations `start`, then without the least useful of them as long as the criterion falls.
/// A node whose removal leaves a fit that does not settle stays.
fn prune(
    problem: &NodalProblem,
    outline: &Outline,
    data: &NodalData,
    nodes: &[usize],
    start: &[f64],
) -> Result<SupportFit, SolveError> {
    let mut best = fit_support(problem, data, nodes, start)?;
    loop {
        let mut next: Option<(f64, SupportFit)> = None;
        for out in 0..best.support.len() {
            let kept: Vec<usize> =
                (0..best.support.len()).filter(|&i| i != out && best.saturation[i] > 0.0).collect();
            let support: Vec<usize> = kept.iter().map(|&i| best.support[i]).collect();
            let from: Vec<f64> = kept.iter().map(|&i| best.saturation[i]).collect();
            let fitted = match fit_support(problem, data, &support, &from) {
                Ok(fitted) => fitted,
                Err(SolveError::NotConverged { .. }) => continue,
                Err(e) => return Err(e),
            };
            let score = criterion(outline, data, &fitted);
            if next.as_ref().is_none_or(|(least, _)| score < *least) {
                next = Some((score, fitted));
            }
        }
        match next {
            Some((score, fitted)) if score <= criterion(outline, data, &best) => best = fitted,
            _ => return Ok(best),
        }
    }
}

fn report(
    problem: &NodalProblem,
    data: &NodalData,
    fitted: &SupportFit,
    springs: Springs,
    chi2_free: f64,
) -> Result<NodalFit, SolveError> {
    let modulus = fitted.young_modulus_pa;
    let kept: Vec<usize> = (0..fitted.support.len()).filter(|&i| fitted.saturation[i] > 0.0).collect();
    let support: Vec<usize> = kept.iter().map(|&i| fitted.support[i]).collect();
    let each: Vec<f64> = kept.iter().map(|&i| problem.stiffness(modulus, fitted.saturation[i])).collect();
    let groups: Vec<Vec<usize>> = match springs {
        Springs::Alike if !each.is_empty() => vec![(0..each.len()).collect()],
        _ => (0..each.len()).map(|i| vec![i]).collect(),
    };
    let sd = bound_of_groups(problem, modulus, &support, &each, &groups, data.sigma_m)?;
    let mut stiffness = vec![0.0; problem.nodes()];
    for (&j, &k) in support.iter().zip(&each) {
        stiffness[j] = k;
    }
    Ok(NodalFit {
        young_modulus_pa: Estimate { value: modulus, sd: sd.young_modulus_pa },
        total_n_per_m: sd.total_n_per_m.map(|sd| Estimate { value: each.iter().sum(), sd }),
        stiffness_n_per_m: stiffness,
        springs,
        chi2: fitted.chi2,
        chi2_free,
    })
}
