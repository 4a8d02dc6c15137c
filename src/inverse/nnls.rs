//! Non-negative least squares by an active set (Lawson & Hanson 1974, chapter 23) in Gram form: minimise
//! ½xᵀGx − mᵀx over x ≥ 0, with G = AᵀA (n × n) and m = Aᵀb (n).
//!
//! The answer is exact for the support it ends with: on the support (the passive set) the normal equations
//! hold, off it the gradient points outward. An l1 penalty λ on x ≥ 0 is the same problem with m − λ.

use super::SolveError;
use nalgebra::{DMatrix, DVector};

/// Accepted slope of an unknown kept at zero, relative to the greatest |mⱼ|/√Gⱼⱼ.
const TOLERANCE: f64 = 1e-11;

/// A minimiser over x ≥ 0.
#[derive(Debug, Clone, PartialEq)]
pub struct NonNegative {
    /// The unknowns (n).
    pub x: DVector<f64>,
    /// Indices of the unknowns above zero, ascending.
    pub support: Vec<usize>,
    /// Greatest slope mⱼ − (Gx)ⱼ over √Gⱼⱼ by which an unknown at zero would still lower the objective, or
    /// by which one above zero misses its normal equation, relative to the greatest |mⱼ|/√Gⱼⱼ.
    pub kkt_residual: f64,
    /// How often the active set changed.
    pub changes: usize,
}

/// Solves, starting from the support `start` (empty: from zero; a good guess saves most of the work).
///
/// A column that depends on those of the support, to rounding, stays out.
///
/// # Errors
/// [`SolveError::NotConverged`] when the active set still changes after 10 n + 50 changes;
/// [`SolveError::Size`] for sizes that differ.
pub fn nnls(gram: &DMatrix<f64>, moment: &DVector<f64>, start: &[usize]) -> Result<NonNegative, SolveError> {
    let n = moment.len();
    for found in [gram.nrows(), gram.ncols()] {
        if found != n {
            return Err(SolveError::Size { what: "the Gram matrix", found, expected: n });
        }
    }
    let norm = |j: usize| gram[(j, j)].max(f64::MIN_POSITIVE).sqrt();
    let scale = (0..n).map(|j| moment[j].abs() / norm(j)).fold(f64::MIN_POSITIVE, f64::max);
    let slopes = |x: &DVector<f64>| moment - gram * x;

    let mut x = DVector::zeros(n);
    let mut passive: Vec<usize> = Vec::new();
    for &j in start.iter().filter(|&&j| j < n && gram[(j, j)] > 0.0) {
        if !passive.contains(&j) {
            passive.push(j);
        }
    }
    if solve_on(gram, moment, &passive).is_none() {
        passive.clear();
    }
    let limit = 10 * n + 50;
    let mut barred = vec![false; n];
    for change in 0..limit {
        while let Some(z) = solve_on(gram, moment, &passive) {
            // How far towards z each unknown can go before it reaches zero.
            let reach = |j: usize, to: f64| match to {
                to if to > 0.0 => 1.0,
                _ if x[j] > 0.0 => x[j] / (x[j] - to),
                _ => 0.0,
            };
            let reaches: Vec<f64> = passive.iter().zip(&z).map(|(&j, &to)| reach(j, to)).collect();
            let step = reaches.iter().fold(1.0, |a: f64, &b| a.min(b));
            for ((&j, &to), &reach) in passive.iter().zip(&z).zip(&reaches) {
                x[j] = if to <= 0.0 && reach <= step { 0.0 } else { x[j] + step * (to - x[j]) };
            }
            if step == 1.0 {
                break;
            }
            passive.retain(|&j| x[j] > 0.0);
        }
        let slope = slopes(&x);
        let entering = (0..n)
            .filter(|&j| !barred[j] && x[j] == 0.0 && slope[j] > TOLERANCE * scale * norm(j))
            .max_by(|&a, &b| (slope[a] / norm(a)).total_cmp(&(slope[b] / norm(b))));
        let Some(j) = entering else {
            let kkt_residual = (0..n)
                .filter(|&j| !barred[j])
                .map(|j| if x[j] > 0.0 { slope[j].abs() } else { slope[j].max(0.0) } / (norm(j) * scale))
                .fold(0.0, f64::max);
            let support: Vec<usize> = (0..n).filter(|&j| x[j] > 0.0).collect();
            return Ok(NonNegative { x, support, kkt_residual, changes: change });
        };
        passive.push(j);
        // The new unknown must come out positive; if it does not, its column depends on the others.
        match solve_on(gram, moment, &passive) {
            Some(z) if z[z.len() - 1] > 0.0 => barred.fill(false),
            _ => {
                passive.pop();
                barred[j] = true;
            }
        }
    }
    let residual = (0..n).map(|j| slopes(&x)[j].max(0.0) / (norm(j) * scale)).fold(0.0, f64::max);
    Err(SolveError::NotConverged {
        method: "the active-set method",
        iterations: limit,
        residual,
        tolerance: TOLERANCE,
    })
}

/// The least-squares answer on `support`; `None` when its columns are dependent.
fn solve_on(gram: &DMatrix<f64>, moment: &DVector<f64>, support: &[usize]) -> Option<DVector<f64>> {
    let part = DMatrix::from_fn(support.len(), support.len(), |r, c| gram[(support[r], support[c])]);
    let right = DVector::from_fn(support.len(), |r, _| moment[support[r]]);
    let factor = part.clone().cholesky()?;
    let dependent =
        (0..support.len()).any(|r| factor.l_dirty()[(r, r)].powi(2) <= 16.0 * f64::EPSILON * part[(r, r)]);
    if dependent {
        return None;
    }
    let mut z = factor.solve(&right);
    // One step of refinement: the slopes that decide about the support are differences of large numbers.
    let left_over = &right - &part * &z;
    z += factor.solve(&left_over);
    Some(z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    fn problem(m: usize, n: usize, values: &[f64]) -> (DMatrix<f64>, DVector<f64>) {
        (
            DMatrix::from_column_slice(m, n, &values[..m * n]),
            DVector::from_column_slice(&values[m * n..m * n + m]),
        )
    }

    /// Every support of a small problem, tried in turn: the best feasible one is the answer.
    fn by_enumeration(a: &DMatrix<f64>, b: &DVector<f64>) -> f64 {
        let n = a.ncols();
        (0..1_usize << n)
            .filter_map(|mask| {
                let support: Vec<usize> = (0..n).filter(|j| mask >> j & 1 == 1).collect();
                let x = solve_on(&a.tr_mul(a), &a.tr_mul(b), &support)?;
                x.iter().all(|&v| v >= 0.0).then(|| {
                    let fitted = support.iter().zip(&x).fold(b.clone(), |r, (&j, &v)| r - a.column(j) * v);
                    0.5 * fitted.norm_squared()
                })
            })
            .fold(f64::INFINITY, f64::min)
    }

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

        #[test]
        fn agrees_with_trying_every_support(values in prop::collection::vec(-1.0..1.0_f64, 8 * 6 + 8)) {
            let (a, b) = problem(8, 6, &values);
            let found = nnls(&a.tr_mul(&a), &a.tr_mul(&b), &[]).expect("converges");
            let objective = 0.5 * (&a * &found.x - &b).norm_squared();
            prop_assert!(found.x.iter().all(|&v| v >= 0.0));
            prop_assert!((objective - by_enumeration(&a, &b)).abs() <= 1e-9 * b.norm_squared());
            prop_assert!(found.kkt_residual < 1e-10);
        }

        #[test]
        fn a_warm_start_from_any_support_ends_at_the_same_point(
            values in prop::collection::vec(-1.0..1.0_f64, 9 * 6 + 9), mask in 0_usize..64
        ) {
            let (a, b) = problem(9, 6, &values);
            let (gram, moment) = (a.tr_mul(&a), a.tr_mul(&b));
            let start: Vec<usize> = (0..6).filter(|j| mask >> j & 1 == 1).collect();
            let cold = nnls(&gram, &moment, &[]).expect("converges");
            let warm = nnls(&gram, &moment, &start).expect("converges");
            prop_assert!((cold.x - warm.x).amax() < 1e-7);
        }
    }

    #[test]
    fn a_twin_column_shares_or_yields_but_does_not_break_the_answer() {
        let a = DMatrix::from_row_slice(3, 3, &[1.0, 1.0, 0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 1.0]);
        let b = DVector::from_column_slice(&[2.0, 2.0, 0.0]);
        let found = nnls(&a.tr_mul(&a), &a.tr_mul(&b), &[]).expect("converges");
        assert!((found.x[0] + found.x[1] - 2.0).abs() < 1e-12 && found.x[2].abs() < 1e-12, "{}", found.x);
    }

    #[test]
    fn nothing_is_gained_from_columns_that_point_away() {
        let found = nnls(&DMatrix::identity(2, 2), &DVector::from_column_slice(&[-1.0, -2.0]), &[])
            .expect("converges");
        assert_eq!(found.x, DVector::zeros(2));
        assert!(nnls(&DMatrix::identity(3, 3), &DVector::zeros(2), &[]).is_err());
    }
}
