//! A symmetric matrix, filled element by element.

use super::zeros::zeros;
use super::{Pattern, SparseError};
use std::sync::Arc;

/// A symmetric matrix with a shared [`Pattern`]; the lower triangle is stored.
#[derive(Debug, Clone, PartialEq)]
pub struct SymmetricMatrix {
    pattern: Arc<Pattern>,
    /// One number for each entry of the pattern, in its order.
    values: Vec<f64>,
}

impl SymmetricMatrix {
    /// The zero matrix.
    pub fn zeros(pattern: Arc<Pattern>) -> Self {
        let values = zeros(pattern.entries());
        Self { pattern, values }
    }

    /// Adds a dense symmetric element matrix: row-major, its side is `unknowns.len()`. `unknowns` names each
    /// unknown once, in any order. Only the entries that fall in the lower triangle are read and stored.
    ///
    /// # Panics
    /// When `values` does not hold `unknowns.len()²` numbers, or the pattern does not couple the unknowns.
    pub fn add_element(&mut self, unknowns: &[u32], values: &[f64]) {
        let side = unknowns.len();
        assert_eq!(values.len(), side * side, "an element matrix of side {side}");
        let mut order: Vec<usize> = (0..side).collect();
        order.sort_unstable_by_key(|&local| unknowns[local]);
        for (rank, &local_column) in order.iter().enumerate() {
            let column = unknowns[local_column] as usize;
            let range = self.pattern.column(column);
            let (first, rows) = (range.start, &self.pattern.rows()[range]);
            // The rows of one node follow each other: the next entry is tried before it is searched.
            let mut at = 0;
            for &local_row in &order[rank..] {
                let row = unknowns[local_row];
                if rows.get(at) != Some(&row) {
                    at += rows[at..].partition_point(|&r| r < row);
                    assert!(
                        rows.get(at) == Some(&row),
                        "entry ({row}, {column}) of an element is not in the pattern"
                    );
                }
                self.values[first + at] += values[local_row * side + local_column];
                at += 1;
            }
        }
    }

    /// Adds `value` to the entries (`i`, `j`) and (`j`, `i`), which are one.
    ///
    /// # Errors
    /// [`SparseError::NotInPattern`].
    pub fn add(&mut self, i: usize, j: usize, value: f64) -> Result<(), SparseError> {
        let (row, column, dimension) = (i.max(j), i.min(j), self.pattern.dimension());
        let place = if row < dimension { self.pattern.place(row, column) } else { None };
        let place = place.ok_or(SparseError::NotInPattern { row, column, dimension })?;
        self.values[place] += value;
        Ok(())
    }

    /// Replaces rows and columns of the unknowns that are `pinned` by those of the identity.
    ///
    /// # Panics
    /// When `pinned` does not have one flag for each unknown.
    pub fn pin(&mut self, pinned: &[bool]) {
        assert_eq!(pinned.len(), self.pattern.dimension(), "one flag for each unknown");
        for (column, &gone) in pinned.iter().enumerate() {
            for place in self.pattern.column(column) {
                let row = self.pattern.rows()[place] as usize;
                if gone || pinned[row] {
                    self.values[place] = if row == column { 1.0 } else { 0.0 };
                }
            }
        }
    }

    /// `y = A x` with the full symmetric matrix.
    ///
    /// # Panics
    /// When `x` or `y` does not have one number for each unknown.
    pub fn multiply(&self, x: &[f64], y: &mut [f64]) {
        let n = self.pattern.dimension();
        assert_eq!((x.len(), y.len()), (n, n), "vectors of {n} unknowns");
        y.fill(0.0);
        for column in 0..n {
            let range = self.pattern.column(column);
            let (rows, values) = (&self.pattern.rows()[range.clone()], &self.values[range]);
            let mut sum = values[0] * x[column];
            for (&row, &value) in rows[1..].iter().zip(&values[1..]) {
                sum += value * x[row as usize];
                y[row as usize] += value * x[column];
            }
            y[column] += sum;
        }
    }

    /// The diagonal.
    pub fn diagonal(&self) -> Vec<f64> {
        (0..self.pattern.dimension()).map(|column| self.values[self.pattern.column(column).start]).collect()
    }

    /// Which entries are stored.
    pub fn pattern(&self) -> &Arc<Pattern> {
        &self.pattern
    }

    /// The stored entries, in the order of the pattern.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The stored entries, in the order of the pattern.
    pub fn values_mut(&mut self) -> &mut [f64] {
        &mut self.values
    }

    /// The largest absolute row sum `‖A‖∞`.
    pub fn norm(&self) -> f64 {
        let mut sums = vec![0.0_f64; self.pattern.dimension()];
        for column in 0..sums.len() {
            for place in self.pattern.column(column) {
                let (row, size) = (self.pattern.rows()[place] as usize, self.values[place].abs());
                sums[row] += size;
                if row != column {
                    sums[column] += size;
                }
            }
        }
        sums.into_iter().fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    fn dense(matrix: &SymmetricMatrix) -> DMatrix<f64> {
        let n = matrix.pattern().dimension();
        let mut full = DMatrix::zeros(n, n);
        for column in 0..n {
            for place in matrix.pattern().column(column) {
                let row = matrix.pattern().rows()[place] as usize;
                full[(row, column)] = matrix.values()[place];
                full[(column, row)] = matrix.values()[place];
            }
        }
        full
    }

    #[test]
    fn a_pinned_unknown_answers_for_itself_alone() {
        let pattern = Arc::new(Pattern::from_elements(3, [[0_u32, 1, 2].as_slice()].into_iter()));
        let mut matrix = SymmetricMatrix::zeros(pattern);
        matrix.add_element(&[0, 1, 2], &[4.0, 1.0, 2.0, 1.0, 5.0, 3.0, 2.0, 3.0, 6.0]);
        matrix.pin(&[false, true, false]);
        let expected = DMatrix::from_row_slice(3, 3, &[4.0, 0.0, 2.0, 0.0, 1.0, 0.0, 2.0, 0.0, 6.0]);
        assert_eq!(dense(&matrix), expected);
    }

    #[test]
    fn elements_in_any_order_add_up_to_the_dense_sum() {
        let lists: [&[u32]; 3] = [&[5, 0, 3], &[1, 3, 2, 0], &[4]];
        let pattern = Arc::new(Pattern::from_elements(6, lists.into_iter()));
        let mut matrix = SymmetricMatrix::zeros(pattern);
        let mut expected = DMatrix::zeros(6, 6);
        for (which, list) in lists.iter().enumerate() {
            let side = list.len();
            let value = |i: usize, j: usize| (1 + which) as f64 + (i * j) as f64 + (i + j) as f64 / 8.0;
            let values: Vec<f64> = (0..side * side).map(|at| value(at / side, at % side)).collect();
            matrix.add_element(list, &values);
            for i in 0..side {
                for j in 0..side {
                    expected[(list[i] as usize, list[j] as usize)] += value(i, j);
                }
            }
        }
        matrix.add(0, 5, 0.5).expect("a coupled pair");
        expected[(0, 5)] += 0.5;
        expected[(5, 0)] += 0.5;
        assert_eq!(dense(&matrix), expected);
        assert_eq!(matrix.diagonal(), expected.diagonal().as_slice());

        let x = DVector::from_fn(6, |i, _| 1.0 + i as f64);
        let mut y = vec![f64::NAN; 6];
        matrix.multiply(x.as_slice(), &mut y);
        assert!((DVector::from_vec(y) - &expected * x).amax() < 1e-13);
        let row_sums = expected.abs().column_sum();
        assert!((matrix.norm() - row_sums.amax()).abs() < 1e-13);
    }

    #[test]
    fn an_entry_outside_the_pattern_is_refused() {
        let lists: [&[u32]; 1] = [&[0, 1]];
        let mut matrix = SymmetricMatrix::zeros(Arc::new(Pattern::from_elements(3, lists.into_iter())));
        assert_eq!(matrix.add(0, 2, 1.0), Err(SparseError::NotInPattern { row: 2, column: 0, dimension: 3 }));
        assert!(matrix.add(7, 0, 1.0).is_err());
        assert!(matrix.add(2, 2, 1.0).is_ok());
    }
}
