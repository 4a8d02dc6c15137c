//! Equilibrium without a new factor: the limited-memory BFGS method, started from a tangent that is factored already.
//!
//! The two-loop recursion (Nocedal 1980; Nocedal & Wright 2006, algorithm 7.4) with the bordered system of another
//! state in the place of a scaled identity. That system maps every residual to a step that keeps what is prescribed,
//! and so do sums of such steps: all iterates stay on the plane b·u − λ/k = d, on which equilibrium is a minimum of Π
//! (see `newton`). An iteration costs one pass over the cells and one back-solve. It takes more of them than Newton's
//! method, the more the tangent has changed from the factored one.

use super::FiniteError;
use super::border::{Border, System};
use super::newton::{Search, State};
use rayon::prelude::*;
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

/// A search under way.
pub(super) struct Quasi<'a> {
    search: Search<'a>,
    /// The factored system of the same ties.
    border: &'a Border,
    at: State,
    /// Relative residuals on the way.
    residuals: Vec<f64>,
    memory: VecDeque<Pair>,
    /// Why it goes no farther.
    stopped: Option<FiniteError>,
}

/// What a search asks the factored system.
struct Asked<'a> {
    system: System<'a>,
    /// What the first loop of the recursion took off, the last pair first; none for a step to what is prescribed.
    shares: Option<Vec<f64>>,
}

/// Brings searches to their ends, in step: what reads a factor reads it for all of them.
pub(super) fn run_together(searches: &mut [&mut Quasi<'_>]) -> Result<(), FiniteError> {
    loop {
        let going = searches.par_iter_mut().filter_map(|search| search.asks().map(|asked| (search, asked)));
        let (going, asked): (Vec<_>, Vec<_>) = going.unzip();
        if going.is_empty() {
            return Ok(());
        }
        let (mut systems, shares): (Vec<_>, Vec<_>) =
            asked.into_iter().map(|asked| (asked.system, asked.shares)).unzip();
        let pulls = Border::solve_together(&mut systems)?;
        let steps = systems.into_par_iter().map(|system| system.r).zip(pulls).zip(shares);
        going.into_par_iter().zip(steps).for_each(|(search, ((step, pull), shares))| {
            if let Err(why) = search.goes_on(step, pull, shares) {
                search.stopped = Some(why);
            }
        });
    }
}

impl<'a> Quasi<'a> {
    /// From a displacement (m) with tie forces λ (N).
    pub(super) fn new(
        search: Search<'a>,
        border: &'a Border,
        u: Vec<f64>,
        pull: Vec<f64>,
    ) -> Result<Self, FiniteError> {
        let at = search.state(u, pull)?;
        let residuals = vec![at.relative_residual];
        Ok(Self { search, border, at, residuals, memory: VecDeque::with_capacity(MEMORY), stopped: None })
    }

    /// The equilibrium, and the relative residuals on the way, the last being its own.
    pub(super) fn ended(self) -> Result<(State, Vec<f64>), FiniteError> {
        match self.stopped {
            Some(why) => Err(why),
            None => Ok((self.at, self.residuals)),
        }
    }

    /// What it needs to know for its next step, if there is to be one.
    fn asks(&mut self) -> Option<Asked<'a>> {
        let Self { search, at, .. } = self;
        let tolerance = search.controls.tolerance;
        let at_rest = at.relative_residual <= tolerance && at.relative_gap <= tolerance;
        if self.stopped.is_some() || at_rest {
            return None;
        }
        let iterations = self.residuals.len() - 1;
        if iterations >= search.controls.iterations {
            let (fraction, residual) = (search.fraction, at.relative_residual);
            self.stopped = Some(FiniteError::OutOfIterations { iterations, fraction, residual, tolerance });
            return None;
        }
        let mut r: Vec<f64> = search.free(&at.residual).map(|r| -r).collect();
        if at.relative_gap > tolerance {
            self.memory.clear();
            let g = search.gaps(at).collect();
            return Some(Asked { system: System { border: self.border, r, g }, shares: None });
        }
        let mut shares = Vec::with_capacity(self.memory.len());
        for pair in self.memory.iter().rev() {
            let share = pair.rho * dot(&pair.step, &r);
            add(&mut r, -share, &pair.residual);
            shares.push(share);
        }
        let g = vec![0.0; search.ties.len()];
        Some(Asked { system: System { border: self.border, r, g }, shares: Some(shares) })
    }

    /// Goes on by what was answered.
    fn goes_on(
        &mut self,
        mut step: Vec<f64>,
        mut pull: Vec<f64>,
        shares: Option<Vec<f64>>,
    ) -> Result<(), FiniteError> {
        let next = match shares {
            None => self.search.moved(&self.at, &self.search.spread(&step), &pull, 1.0)?,
            Some(shares) => {
                // −H R, the step of free components and of λ.
                for (pair, share) in self.memory.iter().zip(shares.iter().rev()) {
                    let left = share - pair.rho * dot(&pair.residual, &step);
                    add(&mut step, left, &pair.step);
                    add(&mut pull, left, &pair.pull);
                }
                match self.search.line_search(&self.at, &self.search.spread(&step), &pull) {
                    Err(FiniteError::LineSearch { .. }) if !self.memory.is_empty() => {
                        // What was learned elsewhere may mislead here.
                        self.memory.clear();
                        return Ok(());
                    }
                    found => found?,
                }
            }
        };
        self.remember(&next);
        self.residuals.push(next.relative_residual);
        self.at = next;
        Ok(())
    }

    fn remember(&mut self, to: &State) {
        let (search, from) = (&self.search, &self.at);
        let difference = |a: &[f64], b: &[f64]| -> Vec<f64> {
            search.free(b).zip(search.free(a)).map(|(b, a)| b - a).collect()
        };
        let step = difference(&from.displacement, &to.displacement);
        let residual = difference(&from.residual, &to.residual);
        let pull = to.pull.iter().zip(&from.pull).map(|(b, a)| b - a).collect();
        let curvature = dot(&step, &residual);
        let largest = dot(&step, &step).sqrt() * dot(&residual, &residual).sqrt();
        // A step that changed what is prescribed is not one of those that are to come.
        if from.relative_gap <= search.controls.tolerance && curvature > SMALLEST_CURVATURE * largest {
            if self.memory.len() == MEMORY {
                self.memory.pop_front();
            }
            self.memory.push_back(Pair { step, pull, residual, rho: 1.0 / curvature });
        }
    }
}

impl Search<'_> {
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
