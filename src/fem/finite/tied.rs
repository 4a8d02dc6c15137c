//! Many equilibria of one body from one factor: the tangent at rest serves every place where the body is tied, every
//! material of the same moduli and every load.
//!
//! Worth it when equilibria are many and strains moderate: a tip pressed to several depths at several places. The
//! state found is as exact as with Newton's method; only the way to it is another (see `quasi`). At
//! rest there are no braces: ties must leave the body stable (they always do where it is held).

use super::border::Border;
use super::loads::Level;
use super::newton::Search;
use super::quasi::{Quasi, run_together};
use super::{Change, Controls, Equilibrium, FiniteError, HeldBody, LoadStep, Solid, Tie};
use crate::fem::material::{Law, Material, Moduli};
use crate::sparse::Factor;
use rayon::prelude::*;
use std::sync::Arc;

/// The factored tangent of a body without strain.
pub struct AtRest {
    factor: Arc<Factor>,
}

/// The same with ties.
pub struct Tied {
    border: Border,
    ties: Vec<Tie>,
}

/// An equilibrium that is looked for.
pub struct Sought<'a> {
    /// How the body is tied.
    pub tied: &'a Tied,
    /// What it is made of.
    pub solid: &'a Solid,
    /// Where the far end of every tie has been moved to (m).
    pub ends: &'a [f64],
    /// Displacement and tie forces to begin with.
    pub start: &'a Change,
}

impl HeldBody {
    /// Factors the tangent at rest, where only the moduli matter, whatever the law.
    ///
    /// # Errors
    /// [`FiniteError`] of the factorisation.
    pub fn at_rest(&self, moduli: Moduli) -> Result<AtRest, FiniteError> {
        let material =
            Material::new(moduli, Law::Linear).map_err(|source| FiniteError::Cell { cell: 0, source })?;
        let rest = vec![0.0; self.space().components()];
        let tangent = self.linear(&Solid::homogeneous(material), &rest, &[])?.tangent;
        Ok(AtRest { factor: Arc::new(self.factor(&tangent, 0.0)?) })
    }

    /// Many equilibria, in their order; held components stay where they are. Loads are not cut into steps: a start that is too far away is
    /// an error. Those over one factor are looked for in step, as reading that is most of the work.
    ///
    /// # Errors
    /// What the linear solver reports. Of each, [`FiniteError`]: an unconverged state is never returned.
    pub fn equilibria(
        &self,
        sought: &[Sought<'_>],
        controls: &Controls,
    ) -> Result<Vec<Result<Equilibrium, FiniteError>>, FiniteError> {
        let level = |one: &Sought<'_>| Level {
            held: vec![0.0; self.held().len()],
            external: vec![0.0; self.space().components()],
            targets: one.ends.to_vec(),
        };
        let levels: Vec<Level> = sought.iter().map(level).collect();
        let begin = |(&Sought { tied, solid, ends, start }, level)| {
            tied.check(self, &start.displacement, ends)?;
            let search = Search { body: self, solid, ties: &tied.ties, controls, level, fraction: 1.0 };
            let pull = start.tie_forces.iter().map(|f| -f).collect();
            Quasi::new(search, &tied.border, start.displacement.clone(), pull)
        };
        let mut searches: Vec<Result<_, _>> = sought.par_iter().zip(&levels).map(begin).collect();
        let mut begun: Vec<_> = searches.iter_mut().filter_map(|search| search.as_mut().ok()).collect();
        run_together(&mut begun)?;
        let ended: Vec<_> = searches.into_iter().map(|search| search.and_then(Quasi::ended)).collect();
        let found = |((ended, one), level): ((Result<_, _>, &Sought<'_>), Level)| {
            let (state, residuals) = ended?;
            self.found(one.solid, &one.tied.ties, level, state, vec![LoadStep { fraction: 1.0, residuals }])
        };
        Ok(ended.into_par_iter().zip(sought).zip(levels).map(found).collect())
    }
}

impl AtRest {
    /// Ties the body; `body` is the one that was factored. Three back-solves for a patch.
    ///
    /// # Errors
    /// [`FiniteError::TiesDependent`]; [`FiniteError::Length`].
    pub fn tied(&self, body: &HeldBody, ties: Vec<Tie>) -> Result<Tied, FiniteError> {
        let (expected, found) = (self.factor.dimension(), body.free().len());
        if expected != found {
            return Err(FiniteError::Length { what: "free components of the body", expected, found });
        }
        Ok(Tied { border: Border::over(Arc::clone(&self.factor), body, &ties)?, ties })
    }
}

impl Tied {
    /// The ties.
    pub fn ties(&self) -> &[Tie] {
        &self.ties
    }

    /// The linear answer to dead `forces` (N, one a component, `3 n + i`) while the far end of every tie is moved to
    /// `ends` (m): displacement, and forces of the ties on the body.
    ///
    /// # Errors
    /// [`FiniteError::Length`]; what the linear solver reports.
    pub fn linear(&self, body: &HeldBody, forces: &[f64], ends: &[f64]) -> Result<Change, FiniteError> {
        self.check(body, forces, ends)?;
        let mut step: Vec<f64> = body.free().iter().map(|&c| forces[c as usize]).collect();
        let gaps: Vec<f64> = ends.iter().map(|d| -d).collect();
        let pull = self.border.solve(&mut step, &gaps)?;
        let mut displacement = vec![0.0; forces.len()];
        body.free().iter().zip(&step).for_each(|(&c, &x)| displacement[c as usize] = x);
        Ok(Change { displacement, tie_forces: pull.iter().map(|p| -p).collect() })
    }

    /// The same ties over the tangent at one of their equilibria, from which others are found in fewer iterations.
    ///
    /// # Errors
    /// [`FiniteError::TangentNotPositiveDefinite`] where the body is not stable, also with the pads braced that it was
    /// announced ([`HeldBody::with_pads`]); the ties as they are still serve.
    pub fn refreshed(&self, body: &HeldBody, solid: &Solid, at: &Equilibrium) -> Result<Self, FiniteError> {
        let linear = body.linear(solid, at.displacement(), &[])?;
        Ok(Self { border: Border::new(body, &self.ties, linear.tangent, 1.0)?, ties: self.ties.clone() })
    }

    fn check(&self, body: &HeldBody, components: &[f64], ends: &[f64]) -> Result<(), FiniteError> {
        let lengths = [
            ("components of the body", body.space().components(), components.len()),
            ("far ends of the ties", self.ties.len(), ends.len()),
        ];
        match lengths.into_iter().find(|(_, expected, found)| expected != found) {
            Some((what, expected, found)) => Err(FiniteError::Length { what, expected, found }),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::finite::{Loads, TieKind};
    use crate::fem::{Order, Space};
    use crate::mesh::{Block, block};

    /// The same state as by Newton's method, tie forces included; from a new tangent in fewer iterations; and a body
    /// on another factor is refused.
    #[test]
    fn one_factor_finds_what_newtons_method_finds() {
        let mesh = block(&Block { size_m: [0.03, 0.02, 0.02], cells: [3, 2, 2] }).expect("a block");
        let space = Arc::new(Space::new(&mesh, Order::P2).expect("a space"));
        let body = HeldBody::clamped(Arc::clone(&space), "z-").expect("held");
        let on_top: Vec<u32> =
            (0..).zip(space.on_surface("z+")).filter(|(_, on)| *on).map(|(n, _)| n).collect();
        let mean = |axis: u32| on_top.iter().map(|n| (3 * n + axis, 1.0 / on_top.len() as f64)).collect();
        let (down, aside) = (mean(2), mean(0));
        let spring = TieKind::Spring { stiffness: 40.0 };
        let ties = vec![
            Tie { functional: down, displacement: -0.004, kind: TieKind::Rigid },
            Tie { functional: aside, displacement: 0.001, kind: spring },
        ];
        let moduli = Moduli::new(1e4, 0.45).expect("a proper solid");
        let law = Law::Fung { stiffening: 1.0 };
        let solid = Solid::homogeneous(Material::new(moduli, law).expect("a proper law"));
        let controls = Controls { tolerance: 1e-8, iterations: 200, ..Controls::default() };
        let loads = Loads { ties: ties.clone(), ..Loads::default() };
        let newton = body.equilibrium(&solid, &loads, None, &controls).expect("equilibrium");

        let tied = body.at_rest(moduli).and_then(|rest| rest.tied(&body, ties)).expect("independent ties");
        let (ends, still) = ([-0.004, 0.001], vec![0.0; space.components()]);
        let linear = tied.linear(&body, &still, &ends).expect("solvable");
        let equilibrium = |tied: &Tied| -> Equilibrium {
            let sought = [Sought { tied, solid: &solid, ends: &ends, start: &linear }];
            body.equilibria(&sought, &controls).expect("solvable").remove(0).expect("equilibrium")
        };
        let found = equilibrium(&tied);
        let largest = newton.displacement().iter().fold(0.0_f64, |m, u| m.max(u.abs()));
        for (a, b) in found.displacement().iter().zip(newton.displacement()) {
            assert!((a - b).abs() < 1e-5 * largest, "{a} {b}");
        }
        for (a, b) in found.tie_forces().iter().zip(newton.tie_forces()) {
            assert!((a / b - 1.0).abs() < 1e-5, "{a} {b}");
        }
        assert!(
            (linear.tie_forces[0] / newton.tie_forces()[0] - 1.0).abs() > 0.02,
            "nothing nonlinear in it"
        );
        let again = tied.refreshed(&body, &solid, &found).expect("stable");
        let from_new = equilibrium(&again);
        assert!(from_new.iterations() < found.iterations());

        // Beside others each is what it is alone, and one that fails leaves the others alone.
        let half = ends.map(|end| 0.5 * end);
        let short = Change { displacement: still[1..].to_vec(), ..linear.clone() };
        let far = Change { displacement: vec![0.01; still.len()], ..linear.clone() };
        let seek = |tied, ends, start| Sought { tied, solid: &solid, ends, start };
        let together = [
            seek(&tied, &half, &linear),
            seek(&tied, &ends, &short),
            seek(&again, &ends, &linear),
            seek(&tied, &ends, &far),
            seek(&tied, &ends, &linear),
        ];
        let together = body.equilibria(&together, &controls).expect("solvable");
        let [Ok(halfway), Err(FiniteError::Length { .. }), Ok(new), Err(far), Ok(old)] = &together[..] else {
            panic!("{together:?}");
        };
        assert!(matches!(far, FiniteError::OutOfIterations { .. } | FiniteError::Cell { .. }), "{far}");
        for (one, alone) in [(new, &from_new), (old, &found)] {
            assert!(one.iterations().abs_diff(alone.iterations()) <= 2, "in {} steps", one.iterations());
            for (a, b) in one.displacement().iter().zip(alone.displacement()) {
                assert!((a - b).abs() < 1e-6 * largest, "{a} {b}");
            }
        }
        assert!((halfway.tie_displacements()[0] - half[0]).abs() < 1e-6 * largest);
        assert!(halfway.tie_forces()[0].abs() < 0.6 * old.tie_forces()[0].abs());
        let other = HeldBody::clamped(space, "x-").expect("held");
        assert!(matches!(tied.linear(&other, &still[1..], &ends), Err(FiniteError::Length { .. })));
    }
}
