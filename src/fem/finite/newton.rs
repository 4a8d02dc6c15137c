//! Equilibrium under loads of a given size: Newton's method with the consistent tangent and a line search.
//!
//! What is prescribed comes first: displacements of held components, and b·u − λ/k = d of every tie (1/k = 0 for
//! rigid ones). All of it is linear in (u, λ), so one full step satisfies it, and from then on every direction
//! keeps it. Along such directions equilibrium is the minimum of Π = W(u) − f_ext·u + Σ ½ λ²/k, and K positive
//! definite makes Newton's direction one of descent. A step is accepted when Π falls enough (Armijo 1966) or, where rounding
//! hides that, when the residual falls; else it is halved (Nocedal & Wright 2006, algorithm 3.1).

use super::assembly::Internal;
use super::border::Border;
use super::loads::Level;
use super::{Controls, FiniteError, HeldBody, Solid, Tie};

/// Share of the promised decrease that a step must keep.
const ARMIJO: f64 = 1e-4;
/// Halvings of a step before the search is given up: 2⁻¹² of Newton's step.
const HALVINGS: i32 = 12;

/// Loads of one size on one body.
pub(super) struct Search<'a> {
    pub(super) body: &'a HeldBody,
    pub(super) solid: &'a Solid,
    pub(super) ties: &'a [Tie],
    pub(super) controls: &'a Controls,
    pub(super) level: &'a Level,
    /// Share of the full load, for messages.
    pub(super) fraction: f64,
}

/// A state and how far it is from equilibrium.
#[derive(Debug, Clone)]
pub(super) struct State {
    /// u, every component (m).
    pub(super) displacement: Vec<f64>,
    /// λ of every tie (N).
    pub(super) pull: Vec<f64>,
    pub(super) internal: Internal,
    /// R on every component (N); on held ones, the force by which they are held.
    pub(super) residual: Vec<f64>,
    /// Π (J).
    potential: f64,
    /// Norm of R over the free components over that of the forces that cancel in it.
    pub(super) relative_residual: f64,
    /// Largest violation of what is prescribed, over the largest displacement.
    pub(super) relative_gap: f64,
}

impl Search<'_> {
    /// The equilibrium near a displacement (m) with tie forces λ (N), and the relative residuals on the way,
    /// the last being the equilibrium's.
    pub(super) fn run(&self, u: Vec<f64>, pull: Vec<f64>) -> Result<(State, Vec<f64>), FiniteError> {
        let tolerance = self.controls.tolerance;
        let mut at = self.state(u, pull)?;
        let mut residuals = vec![at.relative_residual];
        while !(at.relative_residual <= tolerance && at.relative_gap <= tolerance) {
            let iterations = residuals.len() - 1;
            if iterations >= self.controls.iterations {
                let (fraction, residual) = (self.fraction, at.relative_residual);
                return Err(FiniteError::OutOfIterations { iterations, fraction, residual, tolerance });
            }
            at = self.iterate(&at)?;
            residuals.push(at.relative_residual);
        }
        Ok((at, residuals))
    }

    fn iterate(&self, at: &State) -> Result<State, FiniteError> {
        let (body, u) = (self.body, &at.displacement);
        let held_step: Vec<f64> = self.held_steps(at).collect();
        let linear = body.linear(self.solid, u, &held_step)?;
        let border = Border::new(body, self.ties, linear.tangent, self.fraction)?;

        let mut step = vec![0.0; u.len()];
        for (&c, &x) in body.held().iter().zip(&held_step) {
            step[c as usize] = x;
        }
        let gaps: Vec<f64> = self.gaps(at).zip(self.ties).map(|(gap, tie)| gap + tie.of(&step)).collect();
        let mut change: Vec<f64> =
            body.free().iter().zip(&linear.coupling).map(|(&c, k)| -at.residual[c as usize] - k).collect();
        let pull_step = border.solve(&mut change, &gaps)?;
        for (&c, &x) in body.free().iter().zip(&change) {
            step[c as usize] = x;
        }
        if at.relative_gap > self.controls.tolerance {
            return self.moved(at, &step, &pull_step, 1.0);
        }
        self.line_search(at, &step, &pull_step)
    }

    pub(super) fn line_search(
        &self,
        at: &State,
        step: &[f64],
        pull_step: &[f64],
    ) -> Result<State, FiniteError> {
        let slope: f64 = self.body.free().iter().map(|&c| at.residual[c as usize] * step[c as usize]).sum();
        let mut refused = None;
        for halvings in 0..=HALVINGS {
            let length = 0.5_f64.powi(halvings);
            match self.moved(at, step, pull_step, length) {
                Ok(next) => {
                    let lower = next.potential <= at.potential + ARMIJO * length * slope;
                    let nearer = next.relative_residual <= (1.0 - ARMIJO * length) * at.relative_residual;
                    if (lower && slope < 0.0) || nearer {
                        return Ok(next);
                    }
                    refused = None;
                }
                Err(cell @ FiniteError::Cell { .. }) => refused = Some(cell),
                Err(other) => return Err(other),
            }
        }
        Err(refused.unwrap_or(FiniteError::LineSearch {
            fraction: self.fraction,
            shortest: 0.5_f64.powi(HALVINGS),
            residual: at.relative_residual,
        }))
    }

    pub(super) fn moved(
        &self,
        at: &State,
        step: &[f64],
        pull_step: &[f64],
        length: f64,
    ) -> Result<State, FiniteError> {
        let along = |x: &[f64], dx: &[f64]| x.iter().zip(dx).map(|(x, dx)| x + length * dx).collect();
        self.state(along(&at.displacement, step), along(&at.pull, pull_step))
    }

    /// Measures a displacement with tie forces.
    pub(super) fn state(&self, displacement: Vec<f64>, pull: Vec<f64>) -> Result<State, FiniteError> {
        let (body, level) = (self.body, self.level);
        let internal = body.internal(self.solid, &displacement)?;
        let mut residual: Vec<f64> = internal.force.iter().zip(&level.external).map(|(i, e)| i - e).collect();
        let mut potential = internal.energy;
        potential -= level.external.iter().zip(&displacement).map(|(f, u)| f * u).sum::<f64>();
        for (tie, pull) in self.ties.iter().zip(&pull) {
            potential += 0.5 * tie.compliance().unwrap_or(0.0) * pull * pull;
            for &(c, w) in &tie.functional {
                residual[c as usize] += w * pull;
            }
        }
        let norm = |force: &[f64]| body.free().iter().map(|&c| force[c as usize].powi(2)).sum::<f64>().sqrt();
        let relative_residual = ratio(norm(&residual), internal.scale + norm(&level.external));
        let mut state =
            State { displacement, pull, internal, residual, potential, relative_residual, relative_gap: 0.0 };
        let gap = largest(self.gaps(&state)).max(largest(self.held_steps(&state)));
        let prescribed = level.held.iter().chain(&level.targets).chain(&state.displacement);
        state.relative_gap = ratio(gap, largest(prescribed.copied()));
        Ok(state)
    }

    /// b·u − λ/k − d of every tie (m); 0 for those that take no part.
    pub(super) fn gaps(&self, at: &State) -> impl Iterator<Item = f64> {
        self.ties.iter().zip(&at.pull).zip(&self.level.targets).map(|((tie, pull), target)| {
            tie.compliance().map_or(0.0, |c| tie.of(&at.displacement) - c * pull - target)
        })
    }

    /// What the held components still have to move (m).
    fn held_steps(&self, at: &State) -> impl Iterator<Item = f64> {
        self.body.held().iter().zip(&self.level.held).map(|(&c, d)| d - at.displacement[c as usize])
    }
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |most, x| x.abs().max(most))
}

/// a / b, and 0 for 0 / 0.
fn ratio(a: f64, b: f64) -> f64 {
    if a == 0.0 { 0.0 } else { a / b }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::finite::{Loads, TieKind};
    use crate::fem::material::{Law, Material, Moduli};
    use crate::fem::{Order, Space};
    use crate::geometry::Vec3;
    use crate::mesh::{Block, block};
    use std::sync::Arc;

    /// Π + t R·d + O(t²) along a direction that keeps what is prescribed: b·δu = δλ/k for a spring. Π and R
    /// otherwise meet nowhere, and a wrong Π would only make the line search worse, not fail.
    #[test]
    fn the_residual_is_the_slope_of_the_potential() {
        let mesh = block(&Block { size_m: [0.02; 3], cells: [2; 3] }).expect("block");
        let space = Arc::new(Space::new(&mesh, Order::P1).expect("space"));
        let body = HeldBody::clamped(space, "z-").expect("held");
        let moduli = Moduli::new(1e4, 0.45).expect("a proper solid");
        let solid = Solid::homogeneous(Material::new(moduli, Law::NeoHookean).expect("a proper law"));
        let stiffness = 80.0;
        let functional = body.free()[..9].iter().map(|&c| (c, 0.1 + 0.02 * f64::from(c % 4))).collect();
        let spring = Tie { functional, displacement: 3e-4, kind: TieKind::Spring { stiffness } };
        let forces = body.free().iter().map(|&c| (c, 1e-3 * f64::from(c % 5))).collect();
        let loads =
            Loads { forces, body_force: Vec3::new(10.0, 0.0, -1e4), ties: vec![spring], ..Loads::default() };
        let level = Level::full(&body, &loads).expect("proper loads");
        let controls = Controls::default();
        let search = Search {
            body: &body,
            solid: &solid,
            ties: &loads.ties,
            controls: &controls,
            level: &level,
            fraction: 1.0,
        };
        let field = |size: f64, phase: f64| -> Vec<f64> {
            let mut u = vec![0.0; body.space().components()];
            body.free().iter().for_each(|&c| u[c as usize] = size * (phase + 1.7 * f64::from(c)).sin());
            u
        };
        let (u, d) = (field(5e-4, 0.3), field(1.0, 1.1));
        let state = |t: f64| {
            let moved: Vec<f64> = u.iter().zip(&d).map(|(u, d)| u + t * d).collect();
            let pull = stiffness * (loads.ties[0].of(&moved) - level.targets[0]);
            search.state(moved, vec![pull]).expect("not inverted")
        };
        let at = state(0.0);
        assert!(at.relative_gap < 1e-12);
        let slope: f64 = body.free().iter().map(|&c| at.residual[c as usize] * d[c as usize]).sum();
        let remainder = |t: f64| (state(t).potential - at.potential - t * slope).abs();
        let order = (remainder(2e-6) / remainder(1e-6)).log2();
        assert!((order - 2.0).abs() < 0.05, "order {order}");
    }
}
