//! Which coefficients β minimise Σ (y − X β)²?
//!
//! X (n × p) is reduced to an upper triangle R by Householder reflections (Golub and Van Loan, Matrix Computations, 5.3.2), the same are
//! applied to y, and R β = Qᵀy is solved backwards. Columns are scaled to length one beforehand. All of it in twofold doubles.
//! Covariance s² (RᵀR)⁻¹ with s² = Σ residual² / (n − p). Units are those of X and y.

use super::RegressionError;
use super::twofold::Twofold;

/// What is new in a column must be more than this share of it: powers of 1e15 of condition pass, an exact copy does not.
const LEAST_SHARE: f64 = 1e-24;

/// A linear fit.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearFit {
    /// One for each column.
    pub coefficients: Vec<f64>,
    /// Their standard deviations, from the scatter of what is left; zero where no value is to spare.
    pub sd: Vec<f64>,
    /// Their covariance (p × p), by rows.
    pub covariance: Vec<Vec<f64>>,
    /// Σ (y − X β)².
    pub squares: f64,
}

/// Fits the columns of `rows` to `values`.
///
/// # Errors
/// [`RegressionError`]: too few values, rows of different lengths, numbers that are none, columns that depend on each other.
pub fn fit_linear(rows: &[Vec<f64>], values: &[f64]) -> Result<LinearFit, RegressionError> {
    let parameters = rows.first().map_or(0, Vec::len);
    for row in rows {
        if row.len() != parameters {
            return Err(RegressionError::Length {
                what: "a row of the design",
                found: row.len(),
                expected: parameters,
            });
        }
        finite("entry of the design", row)?;
    }
    solve(rows.iter().map(|r| r.iter().map(|x| Twofold::from(*x)).collect()).collect(), values, parameters)
}

/// Fits Σ β_k xᵏ, k = 0 … `degree`. The powers have twice the digits, too.
///
/// # Errors
/// As [`fit_linear`].
pub fn fit_polynomial(xs: &[f64], values: &[f64], degree: usize) -> Result<LinearFit, RegressionError> {
    finite("place", xs)?;
    let powers = |x: &f64| {
        let mut row = vec![Twofold::ONE];
        for k in 0..degree {
            row.push(row[k] * Twofold::from(*x));
        }
        row
    };
    solve(xs.iter().map(powers).collect(), values, degree + 1)
}

fn finite(what: &'static str, values: &[f64]) -> Result<(), RegressionError> {
    match values.iter().position(|v| !v.is_finite()) {
        Some(index) => Err(RegressionError::NotFinite { what, index, value: values[index] }),
        None => Ok(()),
    }
}

fn dot(a: impl Iterator<Item = (Twofold, Twofold)>) -> Twofold {
    a.fold(Twofold::ZERO, |sum, (a, b)| sum + a * b)
}

fn solve(rows: Vec<Vec<Twofold>>, values: &[f64], p: usize) -> Result<LinearFit, RegressionError> {
    let n = rows.len();
    if values.len() != n {
        return Err(RegressionError::Length { what: "the response", found: values.len(), expected: n });
    }
    if p == 0 || n < p {
        return Err(RegressionError::TooFew { values: n, parameters: p });
    }
    finite("value", values)?;
    let mut columns: Vec<Vec<Twofold>> = (0..p).map(|j| rows.iter().map(|r| r[j]).collect()).collect();
    let mut scales = Vec::with_capacity(p);
    for (column, entries) in columns.iter_mut().enumerate() {
        let length = dot(entries.iter().map(|x| (*x, *x))).square_root();
        if length.rounded() == 0.0 {
            return Err(RegressionError::Dependent { column, share: 0.0 });
        }
        entries.iter_mut().for_each(|x| *x = *x / length);
        scales.push(length);
    }
    let mut y: Vec<Twofold> = values.iter().map(|v| Twofold::from(*v)).collect();
    let mut diagonal = Vec::with_capacity(p);
    for j in 0..p {
        let length = dot(columns[j][j..].iter().map(|x| (*x, *x))).square_root();
        if length.rounded() < LEAST_SHARE {
            return Err(RegressionError::Dependent { column: j, share: length.rounded() });
        }
        let turned = if columns[j][j].rounded() > 0.0 { -length } else { length };
        // The reflector v = x − r e₁, kept where the column was.
        columns[j][j] = columns[j][j] - turned;
        diagonal.push(turned);
        let reflector = columns[j][j..].to_vec();
        let half = dot(reflector.iter().map(|v| (*v, *v))) / Twofold::from(2.0);
        let reflect = |target: &mut [Twofold]| {
            let share = dot(reflector.iter().copied().zip(target.iter().copied())) / half;
            target.iter_mut().zip(&reflector).for_each(|(t, v)| *t = *t - share * *v);
        };
        columns[j + 1..].iter_mut().for_each(|column| reflect(&mut column[j..]));
        reflect(&mut y[j..]);
    }
    // Columns of R⁻¹, then β and the covariance in the columns' own scale.
    let mut inverse = vec![vec![Twofold::ZERO; p]; p];
    for k in 0..p {
        let mut column = vec![Twofold::ZERO; p];
        for i in (0..=k).rev() {
            let known = dot((i + 1..=k).map(|j| (columns[j][i], column[j])));
            let right = if i == k { Twofold::ONE } else { Twofold::ZERO };
            column[i] = (right - known) / diagonal[i];
        }
        inverse.iter_mut().zip(column).for_each(|(row, entry)| row[k] = entry);
    }
    let coefficients: Vec<f64> =
        (0..p).map(|i| (dot((i..p).map(|k| (inverse[i][k], y[k]))) / scales[i]).rounded()).collect();
    let squares = dot(y[p..].iter().map(|r| (*r, *r))).rounded();
    let variance = if n > p { squares / (n - p) as f64 } else { 0.0 };
    let entry = |i: usize, j: usize| {
        let sum = dot((0..p).map(|k| (inverse[i][k], inverse[j][k])));
        variance * (sum / (scales[i] * scales[j])).rounded()
    };
    let covariance: Vec<Vec<f64>> = (0..p).map(|i| (0..p).map(|j| entry(i, j)).collect()).collect();
    let sd = (0..p).map(|i| covariance[i][i].sqrt()).collect();
    Ok(LinearFit { coefficients, sd, covariance, squares })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Through (0, 1), (1, 3), (2, 5), (3, 8) by hand: slope 2.3, start 0.8, squares 0.3.
    #[test]
    fn a_line_by_hand() {
        let fit = fit_polynomial(&[0.0, 1.0, 2.0, 3.0], &[1.0, 3.0, 5.0, 8.0], 1).expect("a line");
        assert!((fit.coefficients[0] - 0.8).abs() < 1e-14 && (fit.coefficients[1] - 2.3).abs() < 1e-14);
        assert!((fit.squares - 0.3).abs() < 1e-13 && (fit.sd[1] - (0.15_f64 / 5.0).sqrt()).abs() < 1e-14);
    }

    #[test]
    fn a_copy_of_a_column_is_named() {
        let rows: Vec<Vec<f64>> = (0..5).map(|i| vec![1.0, f64::from(i), 2.0 * f64::from(i)]).collect();
        let error = fit_linear(&rows, &[1.0; 5]).expect_err("dependent");
        assert!(matches!(error, RegressionError::Dependent { column: 2, .. }), "{error}");
        assert!(matches!(fit_linear(&rows[..2], &[1.0; 2]), Err(RegressionError::TooFew { .. })));
    }
}
