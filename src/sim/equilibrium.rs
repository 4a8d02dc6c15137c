//! Equilibrium of the block under large strain as one tip goes in, step by step.
//!
//! At a depth d the unknowns u and the forces λ of the supports on the phantom obey
//!
//!   f(u) = Bᵀ λ,   B u + D λ = g(d),
//!
//! with the rows of the supports in B, the springs' compliance in D and the tip's displacement in g. A pad's
//! traction and the springs' are dead loads spread uniformly over the undeformed disc, so B stays as it is.
//! Newton's step: K δu = Bᵀ λ⁺ − f, B (u + δu) + D λ⁺ = g. Every trial starts on the tangent of the last
//! equilibrium, which satisfies the constraints exactly (they are linear), and a line search on the potential
//! Π + Σ |B u|²/2D over the springs keeps it downhill; so an accepted state is a state of equilibrium, or there is
//! none and the depth step is halved.

use super::SimError;
use super::large_strain::LargeStrain;
use super::linear::{seen, unit_loads};
use super::load_path::{Knot, State};
use super::supports::Support;
use super::unknowns::Row;
use nalgebra::{DMatrix, DVector, Vector3};

/// Largest imbalance of an accepted state, in the force of the tip.
const TOLERANCE: f64 = 1e-9;
/// Newton iterations before a depth step is halved.
const ITERATIONS: usize = 15;
/// A depth step is halved at most this often.
const HALVINGS: i32 = 8;
/// Share of the promised decrease that a step must bring (Nocedal & Wright 2006, equation 3.6a).
const ARMIJO: f64 = 1e-4;
/// Changes of the potential below this share are rounding.
const ROUNDING: f64 = 1e-11;
/// Shortest part of a Newton step that is tried.
const SHORTEST: f64 = 1e-3;

/// One tip and the restraints, on one mesh; the tip is the first support.
pub(super) struct Loading<'a> {
    pub(super) block: &'a LargeStrain<'a>,
    pub(super) supports: &'a [Support],
    pub(super) watched: &'a [Row],
    /// Along which the tip moves, unit.
    pub(super) direction: Vector3<f64>,
}

/// A state of equilibrium with its derivative with respect to the depth.
#[derive(Clone)]
struct Equilibrium {
    depth_m: f64,
    u: DVector<f64>,
    force: DVector<f64>,
    u_slope: DVector<f64>,
    force_slope: DVector<f64>,
}

/// Why a trial was given up.
struct GivenUp {
    residual: f64,
    iterations: usize,
}

/// K⁻¹ Bᵀ and (B K⁻¹ Bᵀ + D)⁻¹ at one state.
struct Tangent {
    fields: DMatrix<f64>,
    condensed: nalgebra::LU<f64, nalgebra::Dyn, nalgebra::Dyn>,
}

impl Loading<'_> {
    /// States at `steps` equal steps down to `depth_m`, rest first.
    pub(super) fn path(&self, depth_m: f64, steps: usize) -> Result<Vec<Knot>, SimError> {
        let n = self.block.unknowns.dimension();
        let m = 3 * self.supports.len();
        let rest = (DVector::zeros(n), DVector::zeros(m));
        let mut state = self.with_slope(0.0, rest.0, rest.1)?;
        let mut knots = vec![self.knot(&state)];
        for step in 1..=steps {
            state = self.advance(state, depth_m * step as f64 / steps as f64, depth_m)?;
            knots.push(self.knot(&state));
        }
        Ok(knots)
    }

    /// The equilibrium at `target_m`, reached in one step or, if need be, in shorter ones.
    fn advance(&self, mut state: Equilibrium, target_m: f64, wanted_m: f64) -> Result<Equilibrium, SimError> {
        let whole = target_m - state.depth_m;
        let mut step = whole;
        while state.depth_m < target_m {
            let remaining = target_m - state.depth_m;
            let depth = if step >= remaining * (1.0 - 1e-9) { target_m } else { state.depth_m + step };
            match self.correct(&state, depth)? {
                Ok(next) => state = next,
                Err(given_up) if step > whole * 0.5_f64.powi(HALVINGS) => {
                    // The reason is kept only in the last failure: earlier ones are overcome by a shorter step.
                    let GivenUp { .. } = given_up;
                    step *= 0.5;
                }
                Err(GivenUp { residual, iterations }) => {
                    let reached_m = state.depth_m;
                    let step_m = step;
                    return Err(SimError::NoEquilibrium {
                        reached_m,
                        wanted_m,
                        step_m,
                        residual,
                        iterations,
                    });
                }
            }
        }
        Ok(state)
    }

    /// Newton's iteration from the tangent of `from`.
    fn correct(&self, from: &Equilibrium, depth_m: f64) -> Result<Result<Equilibrium, GivenUp>, SimError> {
        let ahead = depth_m - from.depth_m;
        let mut u = &from.u + ahead * &from.u_slope;
        let mut force = &from.force + ahead * &from.force_slope;
        let mut residual = f64::INFINITY;
        for iterations in 0..=ITERATIONS {
            let Some(internal) = self.block.force(u.as_slice()).map(DVector::from_vec) else {
                return Ok(Err(GivenUp { residual, iterations }));
            };
            residual = (&internal - self.push(&force)).norm() / self.push(&self.tip_only(&force)).norm();
            if residual < TOLERANCE {
                return self.with_slope(depth_m, u, force).map(Ok);
            }
            let (Some((tangent, correction)), true) =
                (self.tangent(&u, Some(&internal))?, iterations < ITERATIONS)
            else {
                return Ok(Err(GivenUp { residual, iterations }));
            };
            let gap = self.target(depth_m) - self.seen(&u) + self.seen(&correction);
            let Some(new_force) = tangent.condensed.solve(&gap) else {
                return Ok(Err(GivenUp { residual, iterations }));
            };
            let newton = &tangent.fields * &new_force - correction;
            let Some(share) = self.line_search(&u, &newton, &internal) else {
                return Ok(Err(GivenUp { residual, iterations }));
            };
            u += share * newton;
            force += share * (new_force - &force);
        }
        Ok(Err(GivenUp { residual, iterations: ITERATIONS }))
    }

    /// Factors the stiffness at `u`; with it, K⁻¹ of one more load. `None` where the block is inverted or has lost
    /// its stability.
    fn tangent(
        &self,
        u: &DVector<f64>,
        load: Option<&DVector<f64>>,
    ) -> Result<Option<(Tangent, DVector<f64>)>, SimError> {
        let n = self.block.unknowns.dimension();
        let Some(stiffness) = self.block.stiffness(u.as_slice()) else { return Ok(None) };
        let factor = match self.block.analysis.factor(&stiffness) {
            Err(crate::sparse::SparseError::NotPositiveDefinite { .. }) => return Ok(None),
            other => other?,
        };
        let mut fields = unit_loads(&self.rows(), n);
        fields.extend(load.map_or(vec![0.0; n], |l| l.as_slice().to_vec()));
        let columns = fields.len() / n;
        factor.solve_in_place(&mut fields, columns)?;
        let correction = DVector::from_vec(fields.split_off(n * (columns - 1)));
        let mut condensed = seen(&self.rows(), &fields, n);
        for (i, support) in self.supports.iter().enumerate() {
            for c in 3 * i..3 * i + 3 {
                condensed[(c, c)] += support.compliance;
            }
        }
        let fields = DMatrix::from_vec(n, columns - 1, fields);
        Ok(Some((Tangent { fields, condensed: condensed.lu() }, correction)))
    }

    /// Completes an equilibrium by its derivative: (B K⁻¹ Bᵀ + D) λ′ = g′, u′ = K⁻¹ Bᵀ λ′.
    fn with_slope(
        &self,
        depth_m: f64,
        u: DVector<f64>,
        force: DVector<f64>,
    ) -> Result<Equilibrium, SimError> {
        let unstable = SimError::SingularSupports { supports: self.supports.len() };
        let Some((tangent, _)) = self.tangent(&u, None)? else { return Err(unstable) };
        let Some(force_slope) = tangent.condensed.solve(&self.target(1.0)) else { return Err(unstable) };
        let u_slope = tangent.fields * &force_slope;
        Ok(Equilibrium { depth_m, u, force, u_slope, force_slope })
    }

    /// The longest share of a Newton step, halved from one, that lowers the potential enough.
    fn line_search(&self, u: &DVector<f64>, newton: &DVector<f64>, internal: &DVector<f64>) -> Option<f64> {
        let springs = |u: &DVector<f64>| {
            let mut pull = self.seen(u);
            for (i, support) in self.supports.iter().enumerate() {
                let stiffness = if support.compliance > 0.0 { 1.0 / support.compliance } else { 0.0 };
                pull.rows_mut(3 * i, 3).scale_mut(stiffness);
            }
            pull
        };
        let potential = |u: &DVector<f64>| {
            let strain = self.block.energy(u.as_slice())?;
            Some(strain + 0.5 * springs(u).dot(&self.seen(u)))
        };
        let slope = (internal + self.push(&springs(u))).dot(newton);
        let start = potential(u)?;
        let mut share = 1.0;
        while share >= SHORTEST {
            let enough = start + ARMIJO * share * slope + ROUNDING * start.abs();
            if potential(&(u + share * newton)).is_some_and(|p| p <= enough) {
                return Some(share);
            }
            share *= 0.5;
        }
        None
    }

    fn rows(&self) -> Vec<&Row> {
        self.supports.iter().map(|s| &s.row).collect()
    }

    /// g: the tip's displacement (m), zero for the restraints.
    fn target(&self, depth_m: f64) -> DVector<f64> {
        let mut g = DVector::zeros(3 * self.supports.len());
        g.rows_mut(0, 3).copy_from(&(depth_m * self.direction));
        g
    }

    /// B u.
    fn seen(&self, u: &DVector<f64>) -> DVector<f64> {
        seen(&self.rows(), u.as_slice(), u.len()).column(0).into_owned()
    }

    /// Bᵀ λ.
    fn push(&self, force: &DVector<f64>) -> DVector<f64> {
        let mut load = DVector::zeros(self.block.unknowns.dimension());
        for (i, support) in self.supports.iter().enumerate() {
            for &(node, weight) in &support.row {
                for c in 0..3 {
                    load[3 * node as usize + c] += weight * force[3 * i + c];
                }
            }
        }
        load
    }

    fn tip_only(&self, force: &DVector<f64>) -> DVector<f64> {
        let mut tip = DVector::zeros(force.len());
        tip.rows_mut(0, 3).copy_from(&force.rows(0, 3));
        tip
    }

    fn knot(&self, at: &Equilibrium) -> Knot {
        let watched: Vec<&Row> = self.watched.iter().collect();
        let state = |u: &DVector<f64>, force: &DVector<f64>| State {
            force: [force[0], force[1], force[2]],
            watched: seen(&watched, u.as_slice(), u.len())
                .as_slice()
                .chunks_exact(3)
                .map(|u| [u[0], u[1], u[2]])
                .collect(),
        };
        Knot {
            depth_m: at.depth_m,
            state: state(&at.u, &at.force),
            slope: state(&at.u_slope, &at.force_slope),
        }
    }
}
