//! Equilibrium without a new factor: the limited-memory BFGS method, started from a tangent that is factored already.
//!
//! The two-loop recursion (Nocedal 1980; Nocedal & Wright 2006, algorithm 7.4) with the bordered system of another
//! state in the place of a scaled identity. That system maps every residual to a step that keeps what is prescribed,
//! and so do sums of such steps: all iterates stay on the plane b·u − λ/k = d, on which equilibrium is a minimum of Π
//! (see `newton`). An iteration costs one pass over the cells and one back-solve. It takes more of them than Newton's
//! method, the more the tangent has changed from the factored one.

use super::FiniteError;
use super::border::Border;
use super::newton::{Search, State};
use std::collections::VecDeque;

/// Steps that are remembered.
const MEMORY: usize = 12;

/// Curvature below this share of |s| |y| is rounding, not stiffness.
const SMALLEST_CURVATURE: f64 = 1e-10;

/// A step, and what it did to the residual.
struct Pair {
    /// Change of the free components (m), and of λ (N).
    step: Vec<f64>,
    pull: Vec<f64>,
    /// Change of the residual there (N).
    residual: Vec<f64>,
    /// 1/(y·s).
    rho: f64,
}

impl Search<'_> {
    /// As [`Search::run`], with the factored system `border` of the same ties.
    pub(super) fn run_without_factor(
        &self,
        border: &Border,
        u: Vec<f64>,
        pull: Vec<f64>,
    ) -> Result<(State, Vec<f64>), FiniteError> {
        let tolerance = self.controls.tolerance;
        let mut at = self.state(u, pull)?;
        let mut residuals = vec![at.relative_residual];
        let mut memory: VecDeque<Pair> = VecDeque::with_capacity(MEMORY);
        while !(at.relative_residual <= tolerance && at.relative_gap <= tolerance) {
            let iterations = residuals.len() - 1;
            if iterations >= self.controls.iterations {
                let (fraction, residual) = (self.fraction, at.relative_residual);
                return Err(FiniteError::OutOfIterations { iterations, fraction, residual, tolerance });
            }
            let next = if at.relative_gap > tolerance {
                memory.clear();
                let gaps: Vec<f64> = self.gaps(&at).collect();
                let mut step: Vec<f64> = self.free(&at.residual).map(|r| -r).collect();
                let pull = border.solve(&mut step, &gaps)?;
                self.moved(&at, &self.spread(&step), &pull, 1.0)?
            } else {
                let (step, pull) = self.direction(border, &memory, &at)?;
                match self.line_search(&at, &self.spread(&step), &pull) {
                    Err(FiniteError::LineSearch { .. }) if !memory.is_empty() => {
                        // What was learned elsewhere may mislead here.
                        memory.clear();
                        let (step, pull) = self.direction(border, &memory, &at)?;
                        self.line_search(&at, &self.spread(&step), &pull)?
                    }
                    found => found?,
                }
            };
            self.remember(&mut memory, &at, &next);
            residuals.push(next.relative_residual);
            at = next;
        }
        Ok((at, residuals))
    }

    /// −H R, the step of free components and of λ.
    fn direction(
        &self,
        border: &Border,
        memory: &VecDeque<Pair>,
        at: &State,
    ) -> Result<(Vec<f64>, Vec<f64>), FiniteError> {
        let mut step: Vec<f64> = self.free(&at.residual).map(|r| -r).collect();
        let mut shares = Vec::with_capacity(memory.len());
        for pair in memory.iter().rev() {
            let share = pair.rho * dot(&pair.step, &step);
            add(&mut step, -share, &pair.residual);
            shares.push(share);
        }
        let mut pull = border.solve(&mut step, &vec![0.0; self.ties.len()])?;
        for (pair, share) in memory.iter().zip(shares.iter().rev()) {
            let left = share - pair.rho * dot(&pair.residual, &step);
            add(&mut step, left, &pair.step);
            add(&mut pull, left, &pair.pull);
        }
        Ok((step, pull))
    }

    fn remember(&self, memory: &mut VecDeque<Pair>, from: &State, to: &State) {
        let difference = |a: &[f64], b: &[f64]| -> Vec<f64> {
            self.free(b).zip(self.free(a)).map(|(b, a)| b - a).collect()
        };
        let step = difference(&from.displacement, &to.displacement);
        let residual = difference(&from.residual, &to.residual);
        let pull = to.pull.iter().zip(&from.pull).map(|(b, a)| b - a).collect();
        let curvature = dot(&step, &residual);
        let largest = dot(&step, &step).sqrt() * dot(&residual, &residual).sqrt();
        // A step that changed what is prescribed is not one of those that are to come.
        if from.relative_gap <= self.controls.tolerance && curvature > SMALLEST_CURVATURE * largest {
            if memory.len() == MEMORY {
                memory.pop_front();
            }
            memory.push_back(Pair { step, pull, residual, rho: 1.0 / curvature });
        }
    }

    fn free<'a>(&'a self, all: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
        self.body.free().iter().map(|&c| all[c as usize])
    }

    /// Free components among all.
    fn spread(&self, free: &[f64]) -> Vec<f64> {
        let mut all = vec![0.0; self.body.space().components()];
        self.body.free().iter().zip(free).for_each(|(&c, &x)| all[c as usize] = x);
        all
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn add(to: &mut [f64], factor: f64, what: &[f64]) {
    to.iter_mut().zip(what).for_each(|(to, x)| *to += factor * x);
}
