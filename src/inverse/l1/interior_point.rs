//! The penalised problem as a quadratic programme for Clarabel (Goulart & Chen 2024): the reference that
//! comes with a certificate.
//!
//! Non-negative unknowns: minimise ½yᵀGy − (m − λ)ᵀy with y ≥ 0. Free signs: moduli t are added, −t ≤ y ≤ t,
//! and λᵀt is the penalty. Clarabel's tolerance is on residuals and gap, so unknowns off the support come out
//! small, not zero; [`super::active_set`] started from its answer makes them zero and proves the support.

use super::{L1Problem, L1Solution, Sign};
use crate::inverse::SolveError;
use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus};
use nalgebra::DVector;

/// Minimises by an interior-point method, to a relative gap of 1e-10.
///
/// # Errors
/// [`SolveError::NoCertificate`] when Clarabel stops with anything but `Solved`.
pub fn interior_point(problem: &L1Problem) -> Result<L1Solution, SolveError> {
    let n = problem.unknowns();
    let (moduli, cone) = match problem.sign {
        Sign::NonNegative => (0, n),
        Sign::Free => (n, 2 * n),
    };
    let quadratic = upper_triangle(problem, moduli);
    let (linear, constraints) = match problem.sign {
        Sign::NonNegative => {
            let minus = CscMatrix::new(n, n, (0..=n).collect(), (0..n).collect(), vec![-1.0; n]);
            ((&problem.penalty - &problem.moment).as_slice().to_vec(), minus)
        }
        Sign::Free => {
            let mut linear = (-&problem.moment).as_slice().to_vec();
            linear.extend_from_slice(problem.penalty.as_slice());
            // Rows 0..n: y − t ≤ 0; rows n..2n: −y − t ≤ 0.
            let columns = (0..=2 * n).map(|j| 2 * j).collect();
            let rows = (0..2 * n).flat_map(|j| [j % n, j % n + n]).collect();
            let values = (0..2 * n).flat_map(|j| if j < n { [1.0, -1.0] } else { [-1.0, -1.0] }).collect();
            (linear, CscMatrix::new(2 * n, 2 * n, columns, rows, values))
        }
    };
    let settings = DefaultSettings {
        verbose: false,
        tol_gap_abs: 1e-12,
        tol_gap_rel: 1e-10,
        tol_feas: 1e-10,
        ..DefaultSettings::default()
    };
    let refused = |status: String| SolveError::NoCertificate {
        status,
        iterations: 0,
        primal: f64::NAN,
        dual: f64::NAN,
        gap: f64::NAN,
    };
    let bound = vec![0.0; cone];
    let mut solver =
        DefaultSolver::new(&quadratic, &linear, &constraints, &bound, &[NonnegativeConeT(cone)], settings)
            .map_err(|e| refused(e.to_string()))?;
    solver.solve();
    let found = &solver.solution;
    if found.status != SolverStatus::Solved {
        return Err(SolveError::NoCertificate {
            status: format!("{:?}", found.status),
            iterations: found.iterations as usize,
            primal: found.r_prim,
            dual: found.r_dual,
            gap: (found.obj_val - found.obj_val_dual).abs() / found.obj_val.abs().max(1e-300),
        });
    }
    let mut y = DVector::from_column_slice(&found.x[..n]);
    if problem.sign == Sign::NonNegative {
        y.apply(|v| *v = v.max(0.0));
    }
    Ok(problem.solution(&y, found.iterations as usize))
}

/// The upper triangle of diag(G, 0), `moduli` zero rows below.
fn upper_triangle(problem: &L1Problem, moduli: usize) -> CscMatrix<f64> {
    let n = problem.unknowns();
    let mut columns = vec![0];
    let mut rows = Vec::with_capacity(n * (n + 1) / 2);
    let mut values = Vec::with_capacity(n * (n + 1) / 2);
    for k in 0..n {
        rows.extend(0..=k);
        values.extend((0..=k).map(|j| problem.gram[(j, k)]));
        columns.push(rows.len());
    }
    columns.extend(std::iter::repeat_n(rows.len(), moduli));
    CscMatrix::new(n + moduli, n + moduli, columns, rows, values)
}
