//! Numbers that carry their derivatives by everything that is fitted: exact sensitivities of a march in time.

use nalgebra::{Const, DMatrix, DVector, Dyn, LU, SVector, U1};
use num_dual::{Derivative, DualSVec64};

/// Most parameters that a march is differentiated by: the modulus, some ten for patches, a dozen for effects.
pub(super) const MOST: usize = 24;

/// A value with its derivatives by the first `N` parameters.
pub(super) type Dual<const N: usize = MOST> = DualSVec64<N>;

/// The parameter of this index.
pub(super) fn variable(value: f64, index: usize) -> Dual {
    Dual::from_re(value).derivative(index)
}

/// The same with derivatives by the first `M` parameters: less of them cost less to carry along. Those beyond are 0.
pub(super) fn resized<const N: usize, const M: usize>(value: &Dual<N>) -> Dual<M> {
    let first = |all: SVector<f64, N>| SVector::from_fn(|i, _| if i < N { all[i] } else { 0.0 });
    Dual::new(value.re, Derivative::new(value.eps.0.map(first)))
}

/// Derivatives by the first `count` parameters.
pub(super) fn gradient<const N: usize>(value: &Dual<N>, count: usize) -> DVector<f64> {
    let all = all(value);
    DVector::from_fn(count, |i, _| all[i])
}

/// Values, then their derivatives by the first `count` parameters.
pub(super) fn columns<const N: usize>(values: &DVector<Dual<N>>, count: usize) -> DMatrix<f64> {
    let mut columns = DMatrix::zeros(values.len(), 1 + count);
    for (i, value) in values.iter().enumerate() {
        columns[(i, 0)] = value.re;
        let slopes = gradient(value, count);
        (0..count).for_each(|p| columns[(i, 1 + p)] = slopes[p]);
    }
    columns
}

/// A value with these derivatives.
pub(super) fn with_gradient<const N: usize>(value: f64, derivatives: &[(usize, f64)]) -> Dual<N> {
    let mut all = SVector::<f64, N>::zeros();
    for &(index, by) in derivatives {
        all[index] += by;
    }
    Dual::new(value, Derivative::some(all))
}

/// A system whose matrix and right-hand side carry derivatives: `A₀` is factored alone, and the derivatives of
/// `A x = b` follow from `A₀ x' = b' − A' x₀`.
pub(super) struct DualSolver {
    /// Derivative of the matrix by each parameter that it depends on.
    by: Vec<(usize, DMatrix<f64>)>,
    factor: LU<f64, Dyn, Dyn>,
}

impl DualSolver {
    /// `None` when the matrix is singular.
    pub(super) fn new<const N: usize>(matrix: &DMatrix<Dual<N>>) -> Option<Self> {
        let factor = matrix.map(|x| x.re).lu();
        let by = |p: usize| matrix.map(|x| x.eps.0.map_or(0.0, |slopes| slopes[p]));
        let depends = |(_, slopes): &(usize, DMatrix<f64>)| slopes.iter().any(|s| *s != 0.0);
        let by = (0..N).map(|p| (p, by(p))).filter(depends).collect();
        factor.is_invertible().then_some(Self { by, factor })
    }

    /// The solution; `None` when it is not finite.
    pub(super) fn solve<const N: usize>(&self, right: &DVector<Dual<N>>) -> Option<DVector<Dual<N>>> {
        if right.is_empty() {
            return Some(right.clone());
        }
        let value = self.factor.solve(&right.map(|x| x.re))?;
        let n = value.len();
        let mut slopes = DMatrix::<f64>::zeros(n, N);
        for (i, right) in right.iter().enumerate() {
            slopes.row_mut(i).copy_from(&all(right).transpose());
        }
        for (p, by) in &self.by {
            slopes.column_mut(*p).gemv(-1.0, by, &value, 1.0);
        }
        self.factor.solve_mut(&mut slopes).then_some(())?;
        value.iter().all(|x| x.is_finite()).then(|| {
            DVector::from_fn(n, |i, _| {
                let slopes = slopes.row(i).transpose().fixed_rows::<N>(0).into_owned();
                Dual::new(value[i], Derivative::some(slopes))
            })
        })
    }
}

/// All derivatives.
fn all<const N: usize>(value: &Dual<N>) -> SVector<f64, N> {
    value.eps.unwrap_generic(Const::<N>, U1)
}

/// A matrix that depends on parameters: values, and the derivative by each of some parameters, which count from 0.
#[derive(Debug, Clone)]
pub struct Field {
    /// Values where these parameters are 0.
    pub value: DMatrix<f64>,
    /// Parameter's index, derivative.
    pub by: Vec<(usize, DMatrix<f64>)>,
}

impl Field {
    /// The matrix where the parameters have these values.
    pub(super) fn at(&self, parameters: &[f64]) -> Self {
        let moved = |sum: DMatrix<f64>, (p, d): &(usize, DMatrix<f64>)| sum + d * parameters[*p];
        Self { value: self.by.iter().fold(self.value.clone(), moved), by: self.by.clone() }
    }

    /// As dual numbers.
    pub(super) fn dual<const N: usize>(&self) -> DMatrix<Dual<N>> {
        DMatrix::from_fn(self.value.nrows(), self.value.ncols(), |i, j| {
            if self.by.is_empty() {
                return Dual::from_re(self.value[(i, j)]);
            }
            let derivatives: Vec<(usize, f64)> = self.by.iter().map(|(p, d)| (*p, d[(i, j)])).collect();
            with_gradient(self.value[(i, j)], &derivatives)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `[[p, 1], [1, q]] x = (1, p q)` at p = 2, q = 3, against Cramer's rule differentiated by hand.
    #[test]
    fn a_system_is_solved_with_its_derivatives() {
        let (p, q) = (variable(2.0, 0), variable(3.0, 1));
        let one = Dual::from(1.0);
        let solver = DualSolver::new(&DMatrix::from_row_slice(2, 2, &[p, one, one, q])).expect("regular");
        let x = solver.solve(&DVector::from_vec(vec![one, p * q])).expect("finite");
        let determinant = p * q - one;
        let expected = [(q - p * q) / determinant, (p * p * q - one) / determinant];
        for (x, expected) in x.iter().zip(expected) {
            assert!((x.re - expected.re).abs() < 1e-14);
            assert!((gradient(x, 2) - gradient(&expected, 2)).norm() < 1e-14);
        }
        assert!(DualSolver::new(&DMatrix::from_element(2, 2, one)).is_none());
        // Nothing touches a phantom without restraint.
        let nothing = DualSolver::new(&DMatrix::from_element(0, 0, one)).expect("regular");
        assert!(nothing.solve(&DVector::from_element(0, one)).expect("finite").is_empty());
    }
}
