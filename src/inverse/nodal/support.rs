//! The maximum of the likelihood over the modulus and the springs of given nodes: Gauss–Newton with
//! Levenberg's damping inside the bounds 0 ≤ s ≤ 1, by exact derivatives.
//!
//! Unknowns are β = 1/E, in which the prediction is linear, and s. A spring on a bound towards which the
//! misfit falls is left there for the step; steps are cut to the box.

use super::{NodalData, NodalProblem};
use crate::inverse::SolveError;
use nalgebra::{DMatrix, DVector};

/// The likelihood's maximum on given nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct SupportFit {
    /// Young's modulus (Pa).
    pub young_modulus_pa: f64,
    /// The nodes, as indices among the search nodes.
    pub support: Vec<usize>,
    /// Saturation s of each spring, 0 to 1.
    pub saturation: Vec<f64>,
    /// Sum of squared residuals over the error's variance.
    pub chi2: f64,
    /// Greatest cosine between the residual and a direction in which the unknowns may still move.
    pub slope: f64,
    /// Steps taken.
    pub steps: usize,
}

/// Accepted slope: a cosine that no data can show.
const SLOPE: f64 = 1e-7;
/// After so many steps in a row that lower χ² by less than this, nothing that χ² decides changes any more.
const SETTLED: f64 = 1e-6;
const IDLE: usize = 3;
/// A χ² below this leaves nothing to explain.
const NOTHING: f64 = 1e-4;
const STEPS: usize = 500;

/// Fits `data` with springs on `support`, from saturations `start` (one a node).
///
/// # Errors
/// [`SolveError::NotConverged`]; [`SolveError::Size`]; what [`NodalProblem`] reports.
pub fn fit_support(
    problem: &NodalProblem,
    data: &NodalData,
    support: &[usize],
    start: &[f64],
) -> Result<SupportFit, SolveError> {
    fit_capped(problem, data, support, start, 1.0)
}

/// As [`fit_support`], with no saturation above `cap`.
pub(super) fn fit_capped(
    problem: &NodalProblem,
    data: &NodalData,
    support: &[usize],
    start: &[f64],
    cap: f64,
) -> Result<SupportFit, SolveError> {
    if start.len() != support.len() {
        return Err(SolveError::Size { what: "the start", found: start.len(), expected: support.len() });
    }
    let mut s: Vec<f64> = start.iter().map(|v| v.clamp(0.0, cap)).collect();
    let mut state = problem.state(support, &s)?;
    // The best modulus for a shape: β = shapeᵀ d / |shape|².
    let mut beta = state.shape.dot(&data.reduced) / state.shape.norm_squared();
    let misfit = |shape: &DVector<f64>, beta: f64| (&data.reduced - shape * beta).norm_squared();
    let mut cost = misfit(&state.shape, beta);
    // Below this no difference of squares means anything: rounding of the data itself.
    let rounding = (1e-14 * data.reduced.norm()).powi(2);
    let mut damping = 1e-6;
    let mut idle = 0;
    let mut slope = f64::INFINITY;
    for step in 0..STEPS {
        let residual = &data.reduced - &state.shape * beta;
        let jacobian = problem.derivatives(&state) * beta;
        let of_residual = residual.norm().max(f64::MIN_POSITIVE);
        let gradient = jacobian.tr_mul(&residual);
        let norms: Vec<f64> = jacobian.column_iter().map(|c| c.norm().max(f64::MIN_POSITIVE)).collect();
        let free: Vec<usize> = (0..s.len())
            .filter(|&j| {
                s[j] > 0.0 && s[j] < cap
                    || s[j] <= 0.0 && gradient[j] > 0.0
                    || s[j] >= cap && gradient[j] < 0.0
            })
            .collect();
        let along_beta = state.shape.dot(&residual) / state.shape.norm();
        let steepest = free.iter().map(|&j| (gradient[j] / norms[j]).abs()).fold(along_beta.abs(), f64::max);
        slope = steepest / of_residual;
        let done = |slope: f64| SupportFit {
            young_modulus_pa: 1.0 / beta,
            support: support.to_vec(),
            saturation: s.clone(),
            chi2: (cost + data.unreachable_m2) / (data.sigma_m * data.sigma_m),
            slope,
            steps: step,
        };
        // Converged in the geometry of the residual, or against the noise.
        if idle >= IDLE
            || slope <= SLOPE
            || steepest <= 1e-4 * data.sigma_m
            || cost <= rounding.max(NOTHING * data.sigma_m * data.sigma_m)
        {
            return Ok(done(slope));
        }
        // Normalised columns: β first, then the springs.
        let mut columns = vec![state.shape.normalize()];
        columns.extend((0..s.len()).map(|j| jacobian.column(j) / norms[j]));
        let a = DMatrix::from_columns(&columns);
        let (normal, right) = (a.tr_mul(&a), a.tr_mul(&residual));
        let room = |j: usize| match j {
            0 => (f64::NEG_INFINITY, f64::INFINITY),
            j => (-s[j - 1] * norms[j - 1], (cap - s[j - 1]) * norms[j - 1]),
        };
        let room: Vec<(f64, f64)> = (0..=s.len()).map(room).collect();
        let accepted = loop {
            let d = in_box(&normal, damping, &right, &room);
            // What the step takes to a bound lies on it exactly: rounding must leave no spring of 1e-20.
            let to: Vec<f64> = (0..s.len())
                .map(|j| match d[j + 1] {
                    step if step <= room[j + 1].0 => 0.0,
                    step if step >= room[j + 1].1 => cap,
                    step => (s[j] + step / norms[j]).clamp(0.0, cap),
                })
                .collect();
            let next = problem.state(support, &to)?;
            let next_beta = next.shape.dot(&data.reduced) / next.shape.norm_squared();
            let next_cost = misfit(&next.shape, next_beta);
            if next_cost < cost && next_beta > 0.0 {
                damping = (damping / 10.0).max(1e-12);
                break Some((to, next, next_beta, next_cost));
            }
            damping = 10.0 * damping.max(1e-9);
            if damping > 1e8 {
                break None;
            }
        };
        let Some((to, next, next_beta, next_cost)) = accepted else {
            // No step of any length lowers the misfit: rounding decides, if the slope is small.
            if steepest <= 1e-2 * data.sigma_m || slope <= 1e-4 {
                return Ok(done(slope));
            }
            break;
        };
        let gain = cost - next_cost;
        (s, state, beta, cost) = (to, next, next_beta, next_cost);
        idle = if gain <= SETTLED * data.sigma_m * data.sigma_m { idle + 1 } else { 0 };
    }
    Err(SolveError::NotConverged {
        method: "the nodal fit",
        iterations: STEPS,
        residual: slope,
        tolerance: SLOPE,
    })
}

/// Minimises ½ dᵀ(N + μ I)d − rᵀd in a box that holds 0, by active sets: the unknowns between their bounds are
/// solved for; one that would leave its room stops at the bound; one whose slope points inwards is let go again.
fn in_box(normal: &DMatrix<f64>, damping: f64, right: &DVector<f64>, room: &[(f64, f64)]) -> DVector<f64> {
    let n = right.len();
    let mut d = DVector::<f64>::zeros(n);
    let slope_at = |d: &DVector<f64>| right - normal * d - d * damping;
    let outwards = |d: &DVector<f64>, slope: &DVector<f64>, j: usize| {
        d[j] <= room[j].0 && slope[j] <= 0.0 || d[j] >= room[j].1 && slope[j] >= 0.0
    };
    let mut free: Vec<usize> = (0..n).filter(|&j| !outwards(&d, right, j)).collect();
    // Every round takes one unknown to or from a bound; few come back.
    for _ in 0..10 * n {
        let slope = slope_at(&d);
        let part = DMatrix::from_fn(free.len(), free.len(), |r, c| {
            normal[(free[r], free[c])] + if r == c { damping } else { 0.0 }
        });
        let Some(factor) = part.cholesky() else { return d };
        let step = factor.solve(&DVector::from_fn(free.len(), |r, _| slope[free[r]]));
        let reach = |i: usize| match step[i] {
            s if s < 0.0 => (room[free[i]].0 - d[free[i]]) / s,
            s if s > 0.0 => (room[free[i]].1 - d[free[i]]) / s,
            _ => f64::INFINITY,
        };
        let stop = (0..free.len()).min_by(|&a, &b| reach(a).total_cmp(&reach(b)));
        match stop.filter(|&i| reach(i) < 1.0) {
            Some(i) => {
                let share = reach(i);
                free.iter().zip(&step).for_each(|(&j, s)| d[j] += share * s);
                let j = free.remove(i);
                d[j] = if step[i] < 0.0 { room[j].0 } else { room[j].1 };
            }
            None => {
                free.iter().zip(&step).for_each(|(&j, s)| d[j] += s);
                let slope = slope_at(&d);
                let back = (0..n)
                    .filter(|j| !free.contains(j) && !outwards(&d, &slope, *j))
                    .max_by(|&a, &b| slope[a].abs().total_cmp(&slope[b].abs()));
                match back.filter(|&j| slope[j].abs() > 1e-12 * right.amax()) {
                    Some(j) => free.push(j),
                    None => break,
                }
            }
        }
    }
    d
}
