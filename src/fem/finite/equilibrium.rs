//! A converged state of a loaded body, with the evidence that it is one.

use super::Tie;
use super::loads::Level;

/// A load step on the way to an equilibrium.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadStep {
    /// Share of the load reached (–).
    pub fraction: f64,
    /// Relative residual before the first Newton iteration and after each (–).
    pub residuals: Vec<f64>,
}

/// A state in which all forces balance. Only [`super::HeldBody::equilibrium`] makes one.
#[derive(Debug, Clone, PartialEq)]
pub struct Equilibrium {
    pub(super) displacement: Vec<f64>,
    pub(super) tie_forces: Vec<f64>,
    pub(super) tie_displacements: Vec<f64>,
    pub(super) reactions: Vec<(u32, f64)>,
    pub(super) energy: f64,
    pub(super) relative_residual: f64,
    pub(super) least_volume_ratio: f64,
    pub(super) ties: Vec<Tie>,
    pub(super) level: Level,
    pub(super) steps: Vec<LoadStep>,
}

impl Equilibrium {
    /// u of every component, `3 n + i` (m).
    pub fn displacement(&self) -> &[f64] {
        &self.displacement
    }

    /// Force of each tie on the body along its functional (N): −k (b·u − d) for a spring, what it takes for a
    /// rigid tie. For the three ties of a pad, the force of the tip on the phantom.
    pub fn tie_forces(&self) -> &[f64] {
        &self.tie_forces
    }

    /// b·u of each tie (m).
    pub fn tie_displacements(&self) -> &[f64] {
        &self.tie_displacements
    }

    /// Force on the body at each held component (component `3 n + i`, N).
    pub fn reactions(&self) -> &[(u32, f64)] {
        &self.reactions
    }

    /// Energy stored in the body (J), springs not included.
    pub fn energy(&self) -> f64 {
        self.energy
    }

    /// Norm of the forces that do not balance over the norm of those that do (–).
    pub fn relative_residual(&self) -> f64 {
        self.relative_residual
    }

    /// Smallest volume ratio J at the corners of the cells (–). Quadrature points all have J > 0; a corner at or
    /// below 0 says that the mesh is too coarse there for the deformation.
    pub fn least_volume_ratio(&self) -> f64 {
        self.least_volume_ratio
    }

    /// The load steps, in order; the last has fraction 1.
    pub fn steps(&self) -> &[LoadStep] {
        &self.steps
    }

    /// Newton iterations of all successful load steps.
    pub fn iterations(&self) -> usize {
        self.steps.iter().map(|s| s.residuals.len() - 1).sum()
    }

    pub(super) fn level(&self) -> &Level {
        &self.level
    }
}
