//! The way from a known equilibrium to the full loads: load steps that adapt to how Newton's method fares.

use super::equilibrium::LoadStep;
use super::loads::Level;
use super::newton::{Search, State};
use super::{Equilibrium, FiniteError, HeldBody, Loads, Solid, Tie, TieKind};

/// A load step that took no more iterations than this may grow.
const EASY: usize = 8;
/// By how much it grows.
const GROWTH: f64 = 2.0;

/// How hard equilibrium is looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Controls {
    /// Equilibrium: the norm of the residual over that of the forces that cancel in it, and the violation of
    /// what is prescribed over the largest displacement (–).
    pub tolerance: f64,
    /// Newton iterations that a load step may take. Why few: a step that needs many has lost its branch and may
    /// end on another one; a shorter step follows it.
    pub iterations: usize,
    /// Newton iterations that all load steps together may take, failed ones included.
    pub total_iterations: usize,
    /// The first load step tried, as a share of the load (–, at most 1).
    pub first_step: f64,
    /// The smallest load step tried (–).
    pub smallest_step: f64,
}

impl Default for Controls {
    /// The whole load at once, to 1e-10; a hundredth of it at least.
    fn default() -> Self {
        Self { tolerance: 1e-10, iterations: 20, total_iterations: 200, first_step: 1.0, smallest_step: 1e-3 }
    }
}

impl HeldBody {
    /// The equilibrium under `loads`, reached from rest or from a `start` on the same body (under whatever
    /// loads and material). Between the two, prescribed displacements, dead forces and far ends of ties move in
    /// proportion; a failed step is halved, an easy one doubled.
    ///
    /// # Errors
    /// [`FiniteError`]; an unconverged state is never returned.
    pub fn equilibrium(
        &self,
        solid: &Solid,
        loads: &Loads,
        start: Option<&Equilibrium>,
        controls: &Controls,
    ) -> Result<Equilibrium, FiniteError> {
        solid.check(self.space().cells().len())?;
        let full = Level::full(self, loads)?;
        let (first, mut u, mut pull) = self.departure(loads, start)?;
        let (mut reached, mut step) = (0.0, controls.first_step.min(1.0));
        let (mut steps, mut spent) = (Vec::new(), 0);
        loop {
            let fraction = if reached + step > 1.0 - 1e-9 { 1.0 } else { reached + step };
            let level = first.towards(&full, fraction);
            let within = Controls {
                iterations: controls.iterations.min(controls.total_iterations.saturating_sub(spent)),
                ..*controls
            };
            let search =
                Search { body: self, solid, ties: &loads.ties, controls: &within, level: &level, fraction };
            match search.run(u.clone(), pull.clone()) {
                Ok((state, residuals)) => {
                    let iterations = residuals.len() - 1;
                    spent += iterations;
                    steps.push(LoadStep { fraction, residuals });
                    if fraction == 1.0 {
                        return self.found(solid, &loads.ties, full, state, steps);
                    }
                    (u, pull) = (state.displacement, state.pull);
                    reached = fraction;
                    if iterations <= EASY {
                        step *= GROWTH;
                    }
                }
                Err(failed) if failed.yields_to_smaller_steps() => {
                    // A failure without a count has cost at most what a step may cost.
                    spent += match failed {
                        FiniteError::OutOfIterations { iterations, .. } => iterations,
                        _ => 1,
                    };
                    if spent >= controls.total_iterations {
                        return Err(failed);
                    }
                    step = 0.5 * (fraction - reached);
                    if step < controls.smallest_step {
                        let (smallest, because) = (controls.smallest_step, Box::new(failed));
                        return Err(FiniteError::LoadStepTooSmall { reached, step, smallest, because });
                    }
                }
                Err(failed) => return Err(failed),
            }
        }
    }

    /// The level, displacement and tie forces at which the way begins.
    fn departure(
        &self,
        loads: &Loads,
        start: Option<&Equilibrium>,
    ) -> Result<(Level, Vec<f64>, Vec<f64>), FiniteError> {
        let (components, ties) = (self.space().components(), loads.ties.len());
        let Some(start) = start else {
            let rest = Level {
                held: vec![0.0; self.held().len()],
                external: vec![0.0; components],
                targets: vec![0.0; ties],
            };
            return Ok((rest, vec![0.0; components], vec![0.0; ties]));
        };
        let u = start.displacement();
        if u.len() != components {
            let what = "displacement of the starting equilibrium";
            return Err(FiniteError::Length { what, expected: components, found: u.len() });
        }
        let targets = loads
            .ties
            .iter()
            .enumerate()
            .map(|(j, tie)| match tie.kind {
                TieKind::Rigid => tie.of(u),
                TieKind::Spring { .. } => start.level().targets.get(j).copied().unwrap_or(0.0),
            })
            .collect();
        let held = self.held().iter().map(|&c| u[c as usize]).collect();
        let carried =
            |j: usize| loads.ties[j].compliance().and(start.tie_forces().get(j)).map_or(0.0, |f| -f);
        let pull = (0..ties).map(carried).collect();
        Ok((Level { held, external: start.level().external.clone(), targets }, u.to_vec(), pull))
    }

    pub(super) fn found(
        &self,
        solid: &Solid,
        ties: &[Tie],
        level: Level,
        state: State,
        steps: Vec<LoadStep>,
    ) -> Result<Equilibrium, FiniteError> {
        let (_, least_volume_ratio) = self.least_volume_ratio(solid, &state.displacement)?;
        Ok(Equilibrium {
            tie_forces: state.pull.iter().map(|pull| -pull).collect(),
            tie_displacements: ties.iter().map(|tie| tie.of(&state.displacement)).collect(),
            reactions: self.held().iter().map(|&c| (c, state.residual[c as usize])).collect(),
            energy: state.internal.energy,
            relative_residual: state.relative_residual,
            displacement: state.displacement,
            least_volume_ratio,
            ties: ties.to_vec(),
            level,
            steps,
        })
    }
}
