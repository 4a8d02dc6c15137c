//! Equilibria of the block as one tip goes in, and out again where softening makes the way out another one.
//!
//! At depth d: f(u) = Bᵀ λ, B u + D λ = g(d), with the rows of tip and holds in B, the springs' compliance in D and the tip's
//! displacement in g; loads are dead ones on the undeformed discs. Newton's step is K δu = Bᵀ λ⁺ − f,
//! B (u + δu) + D λ⁺ = g, from the tangent of the last equilibrium. Where it does not converge the step of depth is halved.

use super::solid::Solid;
use crate::geometry::Vec3;
use crate::sim::SimError;
use crate::sim::linear::{seen, unit_loads};
use crate::sim::load_path::{Knot, LoadPath, State};
use crate::sim::supports::Support;
use crate::sim::unknowns::Row;
use crate::sparse::SparseError;
use nalgebra::{DMatrix, DVector, Dyn, LU};

/// Largest imbalance of an accepted state, relative to the force of the tip.
const TOLERANCE: f64 = 1e-6;
/// Newton iterations before a step of depth is halved.
const ITERATIONS: usize = 8;
/// A step of depth is halved at most this often.
const HALVINGS: i32 = 6;
/// Where a point is as far as it ever was, its tangent depends on the side: by this share of its energy.
const SIDE: f64 = 1e-9;
/// Shares of the largest depth at which a way back is computed. Where m is small beside the energy under the tip most of the damage
/// shows within a few per cent of the turn: a cubic that leaves the turn as steeply and has nothing to hold on to until halfway back
/// would lose twice what r allows.
const BACK: [f64; 6] = [1.0 / 2.0, 3.0 / 4.0, 7.0 / 8.0, 15.0 / 16.0, 31.0 / 32.0, 63.0 / 64.0];

/// The way in for the first time, and ways back.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Ways {
    pub(super) first: LoadPath,
    /// From a largest depth (m) back to the surface, and in again as far.
    pub(super) again: Vec<(f64, LoadPath)>,
}

/// One tip and the holds on one mesh; the tip is the first support.
pub(super) struct Descent<'a> {
    solid: Solid<'a>,
    supports: Vec<Support>,
    watched: Vec<Row>,
    direction: Vec3,
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

/// K⁻¹ Bᵀ, K⁻¹ f and (B K⁻¹ Bᵀ + D)⁻¹ at one state.
struct Tangent {
    fields: DMatrix<f64>,
    correction: DVector<f64>,
    condensed: LU<f64, Dyn, Dyn>,
}

impl<'a> Descent<'a> {
    pub(super) fn new(solid: Solid<'a>, supports: Vec<Support>, watched: Vec<Row>, direction: Vec3) -> Self {
        Self { solid, supports, watched, direction }
    }

    /// In through the ascending depths `turns` (m), with the ways back from each of them when the material softens.
    pub(super) fn ways(mut self, turns: &[f64], softens: bool) -> Result<Ways, SimError> {
        self.solid.side = 1.0 - SIDE;
        let mut state = self.at_rest()?;
        let mut first = vec![self.knot(&state)];
        let mut again = Vec::new();
        for &turn in turns {
            let start = state.depth_m;
            // Half a turn is as long a step as Newton's method takes, and as the path between its ends bears.
            for depth in [0.5 * (start + turn), turn] {
                state = self.advance(state, depth, turn)?;
                first.push(self.knot(&state));
            }
            if softens {
                self.solid.remember(state.u.as_slice()).ok_or_else(|| self.lost(&state, turn))?;
                self.solid.side = 1.0 + SIDE;
                // From the surface on, where the damage is done everywhere: at the turn it begins too suddenly for Newton's method.
                let mut back = self.at_rest()?;
                let mut knots = vec![self.knot(&back)];
                for share in BACK {
                    back = self.advance(back, share * turn, turn)?;
                    knots.push(self.knot(&back));
                }
                let turned = self.with_slope(state.depth_m, state.u.clone(), state.force.clone())?;
                knots.push(self.knot(&turned));
                again.push((turn, LoadPath::new(knots)));
                self.solid.side = 1.0 - SIDE;
            }
        }
        Ok(Ways { first: LoadPath::new(first), again })
    }

    fn at_rest(&self) -> Result<Equilibrium, SimError> {
        let n = self.solid.unknowns.dimension();
        self.with_slope(0.0, DVector::zeros(n), DVector::zeros(3 * self.supports.len()))
    }

    fn lost(&self, state: &Equilibrium, wanted_m: f64) -> SimError {
        SimError::NoEquilibrium {
            reached_m: state.depth_m,
            wanted_m,
            step_m: 0.0,
            residual: f64::INFINITY,
            iterations: 0,
        }
    }

    /// The equilibrium at `target_m`, further in or further out, in one step or, if need be, in shorter ones.
    fn advance(&self, mut state: Equilibrium, target_m: f64, wanted_m: f64) -> Result<Equilibrium, SimError> {
        let whole = target_m - state.depth_m;
        let mut share = 1.0;
        while state.depth_m != target_m {
            let step = share * whole;
            let remaining = target_m - state.depth_m;
            let depth =
                if step.abs() >= remaining.abs() * (1.0 - 1e-9) { target_m } else { state.depth_m + step };
            match self.correct(&state, depth)? {
                Ok(next) => state = next,
                Err(_) if share > 0.5_f64.powi(HALVINGS) => share *= 0.5,
                Err((residual, iterations)) => {
                    return Err(SimError::NoEquilibrium {
                        reached_m: state.depth_m,
                        wanted_m,
                        step_m: step.abs(),
                        residual,
                        iterations,
                    });
                }
            }
        }
        Ok(state)
    }

    /// Newton's iteration from the tangent of `from`; residual and iterations where it is given up.
    fn correct(
        &self,
        from: &Equilibrium,
        depth_m: f64,
    ) -> Result<Result<Equilibrium, (f64, usize)>, SimError> {
        let ahead = depth_m - from.depth_m;
        let mut u = &from.u + ahead * &from.u_slope;
        let mut force = &from.force + ahead * &from.force_slope;
        let mut residual = f64::INFINITY;
        let mut done = 0;
        for iterations in 0..=ITERATIONS {
            done = iterations;
            let Some((tangent, internal)) = self.tangent(&u)? else { break };
            let before = residual;
            let tip = self.push(&force, 1).norm();
            residual = (&internal - self.push(&force, self.supports.len())).norm() / tip;
            if residual < TOLERANCE {
                return self.completed(depth_m, u, force, &tangent).map(Ok);
            }
            if residual.is_nan() || iterations == ITERATIONS || (iterations > 2 && residual > before) {
                break;
            }
            let gap = self.target(depth_m) - self.moved(&u) + self.moved(&tangent.correction);
            let Some(new_force) = tangent.condensed.solve(&gap) else { break };
            u += &tangent.fields * &new_force - &tangent.correction;
            force = new_force;
        }
        Ok(Err((residual, done)))
    }

    /// Factors the stiffness at `u`; also the internal forces. `None` where the block is inside out or unstable.
    fn tangent(&self, u: &DVector<f64>) -> Result<Option<(Tangent, DVector<f64>)>, SimError> {
        let n = u.len();
        let Some((internal, stiffness)) = self.solid.respond(u.as_slice()) else { return Ok(None) };
        let factor = match self.solid.analysis.factor(&stiffness) {
            Err(SparseError::NotPositiveDefinite { .. }) => return Ok(None),
            other => other?,
        };
        let rows: Vec<&Row> = self.supports.iter().map(|s| &s.row).collect();
        let mut fields = unit_loads(&rows, n);
        fields.extend(&internal);
        let columns = fields.len() / n;
        factor.solve_in_place(&mut fields, columns)?;
        let correction = DVector::from_vec(fields.split_off(n * (columns - 1)));
        let mut condensed = seen(&rows, &fields, n);
        for (i, support) in self.supports.iter().enumerate() {
            for c in 3 * i..3 * i + 3 {
                condensed[(c, c)] += support.compliance;
            }
        }
        let fields = DMatrix::from_vec(n, columns - 1, fields);
        let tangent = Tangent { fields, correction, condensed: condensed.lu() };
        Ok(Some((tangent, DVector::from_vec(internal))))
    }

    fn with_slope(
        &self,
        depth_m: f64,
        u: DVector<f64>,
        force: DVector<f64>,
    ) -> Result<Equilibrium, SimError> {
        match self.tangent(&u)? {
            Some((tangent, _)) => self.completed(depth_m, u, force, &tangent),
            None => Err(SimError::SingularSupports { supports: self.supports.len() }),
        }
    }

    /// Completes an equilibrium by its derivative: (B K⁻¹ Bᵀ + D) λ′ = g′, u′ = K⁻¹ Bᵀ λ′.
    fn completed(
        &self,
        depth_m: f64,
        u: DVector<f64>,
        force: DVector<f64>,
        tangent: &Tangent,
    ) -> Result<Equilibrium, SimError> {
        let unstable = SimError::SingularSupports { supports: self.supports.len() };
        let force_slope = tangent.condensed.solve(&self.target(1.0)).ok_or(unstable)?;
        let u_slope = &tangent.fields * &force_slope;
        Ok(Equilibrium { depth_m, u, force, u_slope, force_slope })
    }

    /// g: the tip's displacement (m), zero for the holds.
    fn target(&self, depth_m: f64) -> DVector<f64> {
        let mut g = DVector::zeros(3 * self.supports.len());
        g.rows_mut(0, 3).copy_from(&(depth_m * self.direction));
        g
    }

    /// B u.
    fn moved(&self, u: &DVector<f64>) -> DVector<f64> {
        let rows: Vec<&Row> = self.supports.iter().map(|s| &s.row).collect();
        seen(&rows, u.as_slice(), u.len()).column(0).into_owned()
    }

    /// Bᵀ λ of the first `count` supports.
    fn push(&self, force: &DVector<f64>, count: usize) -> DVector<f64> {
        let mut load = DVector::zeros(self.solid.unknowns.dimension());
        for (i, support) in self.supports.iter().take(count).enumerate() {
            for &(node, weight) in &support.row {
                for c in 0..3 {
                    load[3 * node as usize + c] += weight * force[3 * i + c];
                }
            }
        }
        load
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
