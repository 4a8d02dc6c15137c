//! What a law adds to the baseline, as a function of the depth.

use crate::fem::finite::FiniteError;
use nalgebra::{DMatrix, DVector};
use std::sync::Arc;

/// The curves of all pokes of a lab, in its order.
#[derive(Debug, Clone)]
pub struct Curves {
    /// One a poke.
    pub pokes: Vec<Curve>,
}

/// Force and markers of one poke against depth: zero with zero slope at depth 0.
///
/// Rows: the force of the tip on the phantom for a unit modulus (N/Pa), three components in the phantom frame; then the
/// displacement of every marker (m), three components each. Law nonlinear less linear.
#[derive(Debug, Clone)]
pub struct Curve {
    /// Depth (m) up to which it was computed; beyond, it is continued by its tangent.
    pub holds_to_m: f64,
    /// Why no farther, if it was asked to.
    pub stopped: Option<Arc<FiniteError>>,
    /// Coefficients of `(x / holds_to)²`, `³`, …: one column each.
    pub(super) powers: DMatrix<f64>,
}

impl Curve {
    /// The polynomial `Σ c_k t^(k+2)` through `values` (one column each) at the shares `t` of the depth `holds_to_m`.
    pub(super) fn through(
        holds_to_m: f64,
        shares: &[f64],
        values: &[DVector<f64>],
        stopped: Option<Arc<FiniteError>>,
    ) -> Option<Self> {
        let n = values.len();
        let rows = values.first()?.len();
        let vandermonde = DMatrix::from_fn(n, n, |i, k| shares[i].powi(k as i32 + 2));
        let inverse = vandermonde.try_inverse()?;
        let all = DMatrix::from_fn(rows, n, |row, i| values[i][row]);
        Some(Self { holds_to_m, stopped, powers: all * inverse.transpose() })
    }

    /// A curve that is zero everywhere: nothing could be computed.
    pub(super) fn nothing(rows: usize, stopped: Option<Arc<FiniteError>>) -> Self {
        Self { holds_to_m: 0.0, stopped, powers: DMatrix::zeros(rows, 0) }
    }

    /// Σ weight · curve, as far as all of them hold.
    pub(super) fn mixed(parts: &[(f64, &Self)]) -> Self {
        let shortest = parts.iter().map(|(_, c)| c).min_by(|a, b| a.holds_to_m.total_cmp(&b.holds_to_m));
        let (holds_to_m, stopped) = shortest.map_or((0.0, None), |c| (c.holds_to_m, c.stopped.clone()));
        let rows = parts.iter().map(|(_, c)| c.powers.nrows()).max().unwrap_or(0);
        let columns = parts.iter().map(|(_, c)| c.powers.ncols()).max().unwrap_or(0);
        let mut powers = DMatrix::zeros(rows, columns);
        for (weight, curve) in parts.iter().filter(|_| holds_to_m > 0.0) {
            let shrink = holds_to_m / curve.holds_to_m;
            for (k, column) in curve.powers.column_iter().enumerate() {
                let mut sum = powers.column_mut(k);
                sum += column * (weight * shrink.powi(k as i32 + 2));
            }
        }
        Self { holds_to_m, stopped, powers }
    }

    /// Values at a depth (m); zero where the tip is not in.
    pub fn at(&self, depth_m: f64) -> DVector<f64> {
        let (t, beyond) = self.share(depth_m);
        let weights = DVector::from_fn(self.powers.ncols(), |k, _| {
            let power = k as i32 + 2;
            t.powi(power) + f64::from(power) * t.powi(power - 1) * beyond
        });
        &self.powers * weights
    }

    /// Derivatives by the depth (per m).
    pub fn slope(&self, depth_m: f64) -> DVector<f64> {
        let (t, _) = self.share(depth_m);
        let weights = DVector::from_fn(self.powers.ncols(), |k, _| {
            let power = k as i32 + 2;
            f64::from(power) * t.powi(power - 1) / self.holds_to_m
        });
        &self.powers * weights
    }

    /// Share of the depth, within 0 and 1, and what it lies beyond 1.
    fn share(&self, depth_m: f64) -> (f64, f64) {
        if depth_m <= 0.0 || self.holds_to_m <= 0.0 {
            return (0.0, 0.0);
        }
        let t = depth_m / self.holds_to_m;
        (t.min(1.0), (t - 1.0).max(0.0))
    }
}
