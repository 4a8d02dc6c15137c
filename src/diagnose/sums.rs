//! Sums of squares over many rows at once: rows with their derivatives → normal equations.

use nalgebra::{DMatrix, DVector};

/// One poke's part of a fit.
#[derive(Debug, Clone)]
pub(super) struct PokeSums {
    /// Number of values in all rows.
    pub values: usize,
    /// Sum of squares over the stated noise of all rows: of the force, of the markers.
    pub chi2: [f64; 2],
    /// Sum of squares over the effective noise of the rows that count.
    pub cost: f64,
    /// `Jᵀ J` of the rows that count.
    pub normal: DMatrix<f64>,
    /// `Jᵀ r` of the rows that count.
    pub gradient: DVector<f64>,
}

impl PokeSums {
    /// No rows, for so many parameters.
    pub(super) fn empty(parameters: usize) -> Self {
        Self {
            values: 0,
            chi2: [0.0; 2],
            cost: 0.0,
            normal: DMatrix::zeros(parameters, parameters),
            gradient: DVector::zeros(parameters),
        }
    }

    /// Adds rows of a channel (0 force, 1 markers) given as columns `[J over fitted | share | residual]`, each over the
    /// stated noise. `share` is the index of the parameter that the share's column belongs to; `inflation` the factor by
    /// which correlation raises the variance of a mean. Rows that do not count only raise `chi2`.
    pub(super) fn add(
        &mut self,
        rows: &DMatrix<f64>,
        channel: usize,
        share: usize,
        inflation: f64,
        counts: bool,
    ) {
        let fitted = rows.ncols() - 2;
        let residual = rows.column(fitted + 1);
        self.values += rows.nrows();
        self.chi2[channel] += residual.norm_squared();
        if !counts || rows.nrows() == 0 {
            return;
        }
        let gram = gram(rows) / inflation;
        let place = |i: usize| if i < fitted { i } else { share };
        for i in 0..=fitted {
            for j in 0..=fitted {
                self.normal[(place(i), place(j))] += gram[(i, j)];
            }
            self.gradient[place(i)] += gram[(i, fitted + 1)];
        }
        self.cost += gram[(fitted + 1, fitted + 1)];
    }
}

/// `RᵀR`: columns lie in memory one after the other.
fn gram(rows: &DMatrix<f64>) -> DMatrix<f64> {
    let n = rows.ncols();
    let mut gram = DMatrix::zeros(n, n);
    for i in 0..n {
        for j in 0..=i {
            let product = rows.column(i).dot(&rows.column(j));
            gram[(i, j)] = product;
            gram[(j, i)] = product;
        }
    }
    gram
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two fitted parameters and the second of two shares, by hand.
    #[test]
    fn rows_add_up_by_hand() {
        let mut sums = PokeSums::empty(4);
        let rows = DMatrix::from_row_slice(2, 4, &[1.0, 2.0, 3.0, 4.0, 0.0, 1.0, -1.0, 2.0]);
        sums.add(&rows, 1, 3, 2.0, true);
        assert_eq!((sums.values, sums.chi2, sums.cost), (2, [0.0, 20.0], 10.0));
        assert_eq!(sums.normal[(0, 1)], 1.0);
        assert_eq!(sums.normal[(3, 1)], 2.5);
        assert_eq!(sums.normal[(2, 2)], 0.0);
        assert_eq!(sums.gradient.as_slice(), [2.0, 5.0, 0.0, 5.0]);
        sums.add(&rows, 0, 2, 1.0, false);
        assert_eq!((sums.values, sums.chi2, sums.cost), (4, [20.0, 20.0], 10.0));
    }
}
