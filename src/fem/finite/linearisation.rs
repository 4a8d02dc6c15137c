//! How an equilibrium answers a small change of a parameter or load, exactly: one back-solve each.
//!
//! Implicit function theorem: R(u, λ, θ) = 0 along the branch, so K δu + B δλ = −∂R/∂θ with the tangent K at the
//! converged state, and the ties' conditions differentiated likewise. Verified by Taylor tests against
//! re-solved equilibria in `tests/verification/finite_sensitivities.rs`.

use super::border::Border;
use super::{Equilibrium, FiniteError, HeldBody, Solid, Tie, TieKind};
use crate::fem::Functional;
use crate::fem::material::Parameter;

/// A parameter θ by which an equilibrium can be differentiated.
#[derive(Debug, Clone, PartialEq)]
pub enum Sensitivity {
    /// A parameter of the material, everywhere.
    Material(Parameter),
    /// A factor on the modulus of the listed cells, at the value 1.
    ModulusOf(Vec<u32>),
    /// Stiffness k of a spring tie (N/m).
    TieStiffness(usize),
    /// Displacement d of the far end of a tie (m).
    TieDisplacement(usize),
    /// A factor on these dead forces, added to the loads, at the value 0.
    Force(Functional),
}

/// Derivatives of an equilibrium by one parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// ∂u/∂θ of every component (m per unit of θ).
    pub displacement: Vec<f64>,
    /// ∂(force of each tie on the body)/∂θ (N per unit of θ).
    pub tie_forces: Vec<f64>,
}

/// An equilibrium with its factored tangent.
pub struct Linearisation<'a> {
    body: &'a HeldBody,
    solid: &'a Solid,
    equilibrium: &'a Equilibrium,
    border: Border,
}

impl HeldBody {
    /// Factors the tangent at an equilibrium of this body made of `solid`.
    pub fn linearise<'a>(
        &'a self,
        solid: &'a Solid,
        equilibrium: &'a Equilibrium,
    ) -> Result<Linearisation<'a>, FiniteError> {
        solid.check(self.space().cells().len())?;
        let (expected, found) = (self.space().components(), equilibrium.displacement.len());
        if expected != found {
            return Err(FiniteError::Length { what: "displacement of the equilibrium", expected, found });
        }
        let linear = self.linear(solid, &equilibrium.displacement, &[])?;
        let border = Border::new(self, &equilibrium.ties, self.factor(&linear.tangent, 1.0)?)?;
        Ok(Linearisation { body: self, solid, equilibrium, border })
    }
}

impl Linearisation<'_> {
    /// The derivatives of the equilibrium by one parameter.
    ///
    /// # Errors
    /// [`FiniteError::Length`] for a tie, cell or component that does not exist; [`FiniteError::Value`] for the
    /// stiffness of a rigid tie.
    pub fn change(&self, by: &Sensitivity) -> Result<Change, FiniteError> {
        let ties = &self.equilibrium.ties;
        // −∂R/∂θ, the rows of the ties, and the part of ∂λ/∂θ at fixed u.
        let mut force = vec![0.0; self.body.space().components()];
        let mut gaps = vec![0.0; ties.len()];
        let mut direct = vec![0.0; ties.len()];
        match by {
            Sensitivity::Material(parameter) => self.add_material(&mut force, *parameter, 1.0, |_| true)?,
            Sensitivity::ModulusOf(cells) => {
                let mut counts = vec![false; self.body.space().cells().len()];
                for &cell in cells {
                    let (expected, found) = (counts.len(), cell as usize + 1);
                    let what = "cells of the body";
                    *counts.get_mut(cell as usize).ok_or(FiniteError::Length { what, expected, found })? =
                        true;
                }
                let young = self.solid.material().moduli().young();
                self.add_material(&mut force, Parameter::YoungModulus, young, |cell| counts[cell])?;
            }
            Sensitivity::TieStiffness(j) => {
                let (tie, stretch) = (self.tie(*j)?, self.stretch(*j)?);
                if tie.kind == TieKind::Rigid {
                    let (what, value) = ("stiffness of tie", f64::INFINITY);
                    return Err(FiniteError::Value { what, index: *j, value, expected: "a spring" });
                }
                add_scaled(&mut force, &tie.functional, -stretch);
                direct[*j] = stretch;
            }
            Sensitivity::TieDisplacement(j) => {
                let tie = self.tie(*j)?;
                match tie.kind {
                    TieKind::Rigid => gaps[*j] = -1.0,
                    TieKind::Spring { stiffness } => {
                        add_scaled(&mut force, &tie.functional, stiffness);
                        direct[*j] = -stiffness;
                    }
                }
            }
            Sensitivity::Force(functional) => {
                let expected = force.len();
                if let Some(&(c, _)) = functional.iter().find(|&&(c, _)| c as usize >= expected) {
                    let (what, found) = ("components of the loaded body", c as usize + 1);
                    return Err(FiniteError::Length { what, expected, found });
                }
                add_scaled(&mut force, functional, 1.0);
            }
        }
        let mut step: Vec<f64> = self.body.free().iter().map(|&c| force[c as usize]).collect();
        let pull = self.border.solve(&mut step, &gaps)?;
        let mut displacement = vec![0.0; force.len()];
        for (&c, &x) in self.body.free().iter().zip(&step) {
            displacement[c as usize] = x;
        }
        Ok(Change { displacement, tie_forces: pull.iter().zip(&direct).map(|(p, d)| -(p + d)).collect() })
    }

    fn tie(&self, index: usize) -> Result<&Tie, FiniteError> {
        let expected = self.equilibrium.ties.len();
        self.equilibrium.ties.get(index).ok_or(FiniteError::Length {
            what: "ties",
            expected,
            found: index + 1,
        })
    }

    /// b·u − d (m).
    fn stretch(&self, index: usize) -> Result<f64, FiniteError> {
        Ok(self.tie(index)?.of(&self.equilibrium.displacement) - self.equilibrium.level.targets[index])
    }

    fn add_material(
        &self,
        force: &mut [f64],
        parameter: Parameter,
        factor: f64,
        counts: impl Fn(usize) -> bool + Sync,
    ) -> Result<(), FiniteError> {
        let u = &self.equilibrium.displacement;
        let growth = self.body.force_sensitivity(self.solid, u, parameter, counts)?;
        for (f, g) in force.iter_mut().zip(growth) {
            *f -= factor * g;
        }
        Ok(())
    }
}

fn add_scaled(force: &mut [f64], functional: &Functional, factor: f64) {
    for &(component, weight) in functional {
        force[component as usize] += factor * weight;
    }
}
