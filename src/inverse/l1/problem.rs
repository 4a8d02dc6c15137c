//! The penalised least-squares problem, its optimality conditions and its solution.
//!
//! Columns are normalised on entry: with D = diag(‖aⱼ‖) and s = max |aⱼᵀb| / ‖aⱼ‖, the unknown is y = D x / s,
//! the Gram matrix D⁻¹AᵀAD⁻¹ has a unit diagonal, the moment D⁻¹Aᵀb / s has greatest modulus 1, and the
//! penalties are λⱼ / (‖aⱼ‖ s). What is called a residual below is therefore free of units, whatever they
//! were (compliances of 1e-6 m/N and forces of 1 N, say).

use crate::inverse::SolveError;
use nalgebra::{DMatrix, DVector};

/// Which signs the unknowns may have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sign {
    /// Any.
    Free,
    /// None below zero.
    NonNegative,
}

/// Minimise ½‖Ax − b‖² + Σⱼ λⱼ|xⱼ|.
#[derive(Debug, Clone)]
pub struct L1Problem {
    /// Normalised Gram matrix (n × n), unit diagonal.
    pub(super) gram: DMatrix<f64>,
    /// Normalised moment (n).
    pub(super) moment: DVector<f64>,
    /// Normalised penalties (n).
    pub(super) penalty: DVector<f64>,
    pub(super) sign: Sign,
    /// ‖aⱼ‖ (n); 1 where the column is zero.
    norms: DVector<f64>,
    /// s.
    scale: f64,
    /// ‖b‖².
    square: f64,
}

/// A minimiser.
#[derive(Debug, Clone, PartialEq)]
pub struct L1Solution {
    /// The unknowns (n).
    pub x: DVector<f64>,
    /// ½‖Ax − b‖² + Σⱼ λⱼ|xⱼ| at `x`.
    pub objective: f64,
    /// Violation of the optimality conditions at `x`: [`L1Problem::kkt_residual`].
    pub kkt_residual: f64,
    /// Sweeps, interior-point steps or changes of the active set.
    pub iterations: usize,
}

impl L1Problem {
    /// The problem with matrix `a` (m × n), right-hand side `b` (m) and penalties `lambda` (n, not negative).
    ///
    /// # Errors
    /// [`SolveError::Size`] and [`SolveError::BadValue`].
    pub fn new(
        a: &DMatrix<f64>,
        b: &DVector<f64>,
        lambda: &DVector<f64>,
        sign: Sign,
    ) -> Result<Self, SolveError> {
        if b.len() != a.nrows() {
            return Err(SolveError::Size {
                what: "the right-hand side",
                found: b.len(),
                expected: a.nrows(),
            });
        }
        finite("the matrix", a.as_slice())?;
        finite("the right-hand side", b.as_slice())?;
        Self::from_gram(a.tr_mul(a), a.tr_mul(b), b.norm_squared(), lambda, sign)
    }

    /// The problem with `gram` = AᵀA (n × n), `moment` = Aᵀb (n) and `square` = ‖b‖², which keeps what many
    /// problems over one matrix share.
    ///
    /// # Errors
    /// [`SolveError::Size`] and [`SolveError::BadValue`].
    pub fn from_gram(
        mut gram: DMatrix<f64>,
        mut moment: DVector<f64>,
        square: f64,
        lambda: &DVector<f64>,
        sign: Sign,
    ) -> Result<Self, SolveError> {
        let n = moment.len();
        for (what, found) in [
            ("the Gram matrix", gram.nrows()),
            ("the Gram matrix", gram.ncols()),
            ("the penalty", lambda.len()),
        ] {
            if found != n {
                return Err(SolveError::Size { what, found, expected: n });
            }
        }
        finite("the Gram matrix", gram.as_slice())?;
        finite("the moment", moment.as_slice())?;
        if let Some((index, &value)) = lambda.iter().enumerate().find(|(_, l)| !(l.is_finite() && **l >= 0.0))
        {
            let expected = "a finite number, not negative";
            return Err(SolveError::BadValue { what: "the penalty", index, value, expected });
        }
        let norms = DVector::from_fn(n, |j, _| match gram[(j, j)].max(0.0).sqrt() {
            norm if norm > 0.0 => norm,
            _ => 1.0,
        });
        moment.component_div_assign(&norms);
        let scale = match moment.amax() {
            greatest if greatest > 0.0 => greatest,
            _ => 1.0,
        };
        moment /= scale;
        for k in 0..n {
            for j in 0..n {
                gram[(j, k)] /= norms[j] * norms[k];
            }
            gram[(k, k)] = 1.0;
        }
        let penalty = lambda.component_div(&norms) / scale;
        Ok(Self { gram, moment, penalty, sign, norms, scale, square })
    }

    /// The same problem with other penalties (n).
    ///
    /// # Errors
    /// [`SolveError::Size`] and [`SolveError::BadValue`].
    pub fn with_penalty(mut self, lambda: &DVector<f64>) -> Result<Self, SolveError> {
        if lambda.len() != self.unknowns() {
            let expected = self.unknowns();
            return Err(SolveError::Size { what: "the penalty", found: lambda.len(), expected });
        }
        if let Some((index, &value)) = lambda.iter().enumerate().find(|(_, l)| !(l.is_finite() && **l >= 0.0))
        {
            let expected = "a finite number, not negative";
            return Err(SolveError::BadValue { what: "the penalty", index, value, expected });
        }
        self.penalty = lambda.component_div(&self.norms) / self.scale;
        Ok(self)
    }

    /// Number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.moment.len()
    }

    /// The smallest factor on the penalties (n) above which zero is the solution: max |aⱼᵀb| / λⱼ over
    /// penalised unknowns, of the positive ones only when x ≥ 0.
    pub fn vanishing_factor(&self) -> f64 {
        (0..self.unknowns())
            .filter(|&j| self.penalty[j] > 0.0)
            .map(|j| match self.sign {
                Sign::Free => self.moment[j].abs() / self.penalty[j],
                Sign::NonNegative => self.moment[j] / self.penalty[j],
            })
            .fold(0.0, f64::max)
    }

    /// How far `x` is from optimal: maxⱼ |yⱼ − prox(yⱼ − gⱼ)| in normalised unknowns, with the gradient
    /// g = G y − m and prox the shrinkage by the penalty (and the cut at zero). Zero exactly at a minimiser; at
    /// an unknown other than zero it is the violation of gⱼ + λⱼ sign(yⱼ) = 0, at zero the excess of |gⱼ| over
    /// λⱼ, both relative to the greatest |aⱼᵀb| / ‖aⱼ‖.
    pub fn kkt_residual(&self, x: &DVector<f64>) -> f64 {
        let y = self.normalised(x);
        let gradient = &self.gram * &y - &self.moment;
        (0..y.len()).map(|j| (y[j] - self.shrink(j, y[j] - gradient[j])).abs()).fold(0.0, f64::max)
    }

    /// The minimiser over unknown `j` alone when the normalised least-squares optimum is at `at`.
    pub(super) fn shrink(&self, j: usize, at: f64) -> f64 {
        match self.sign {
            Sign::NonNegative => (at - self.penalty[j]).max(0.0),
            Sign::Free => at.signum() * (at.abs() - self.penalty[j]).max(0.0),
        }
    }

    pub(super) fn normalised(&self, x: &DVector<f64>) -> DVector<f64> {
        x.component_mul(&self.norms) / self.scale
    }

    /// Wraps the normalised answer `y` with its objective and its residual.
    pub(super) fn solution(&self, y: &DVector<f64>, iterations: usize) -> L1Solution {
        let x = y.component_div(&self.norms) * self.scale;
        let quadratic = 0.5 * y.dot(&(&self.gram * y)) - y.dot(&self.moment) + y.abs().dot(&self.penalty);
        L1Solution {
            objective: 0.5 * self.square + self.scale * self.scale * quadratic,
            kkt_residual: self.kkt_residual(&x),
            x,
            iterations,
        }
    }
}

fn finite(what: &'static str, values: &[f64]) -> Result<(), SolveError> {
    match values.iter().enumerate().find(|(_, v)| !v.is_finite()) {
        Some((index, &value)) => {
            Err(SolveError::BadValue { what, index, value, expected: "a finite number" })
        }
        None => Ok(()),
    }
}
