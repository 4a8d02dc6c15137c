//! How a factored system is solved, and whether the factor can be trusted.

use super::cholesky::Symbolic;
use super::{SparseError, SymmetricMatrix};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::sync::Arc;

/// Right-hand sides that are solved together, at most: 96 gain no more. The number of threads has no say, so that the result does
/// not depend on it.
const BLOCK: usize = 64;

/// Largest accepted probe residual. A sound factor leaves some 10⁻¹⁶; a damaged one far more than this.
const PROBE_LIMIT: f64 = 1e-12;

/// Seed of the probe system.
const PROBE_SEED: u64 = 0x70_72_6f_62_65;

/// A Cholesky factor that has passed its probe.
#[derive(Debug, Clone)]
pub struct Factor {
    symbolic: Arc<Symbolic>,
    values: Vec<f64>,
    dimension: usize,
    probe_residual: f64,
}

impl Factor {
    /// A factor whose values solve a probe system of `matrix` to rounding.
    pub(super) fn probed(
        symbolic: Arc<Symbolic>,
        values: Vec<f64>,
        matrix: &SymmetricMatrix,
    ) -> Result<Self, SparseError> {
        let dimension = matrix.pattern().dimension();
        let mut factor = Self { symbolic, values, dimension, probe_residual: f64::NAN };
        let residual = factor.probe(matrix)?;
        if residual <= PROBE_LIMIT {
            factor.probe_residual = residual;
            Ok(factor)
        } else {
            Err(SparseError::ProbeResidual { residual, limit: PROBE_LIMIT })
        }
    }

    /// Number of unknowns.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// Solves `A X = B` in place. `rhs` is column-major, dimension × columns: `B` on entry, `X` on return.
    /// Blocks of columns and branches of the elimination tree are solved in parallel; the result does not depend on the number of threads.
    ///
    /// Memory, some 64 columns a thread, is taken for granted, unlike a factor's.
    ///
    /// # Errors
    /// [`SparseError::Length`] when `rhs` does not hold dimension × columns numbers.
    pub fn solve_in_place(&self, rhs: &mut [f64], columns: usize) -> Result<(), SparseError> {
        check_length(RIGHT_HAND_SIDES, rhs.len(), self.dimension * columns)?;
        let substitution = self.symbolic.substitution(&self.values);
        rhs.par_chunks_mut(self.dimension * block_width(columns)).for_each(|block| {
            substitution.solve(block, block.len() / self.dimension);
        });
        Ok(())
    }

    /// As [`Factor::solve_in_place`], `rhs` row-major: the numbers of one unknown side by side.
    ///
    /// # Errors
    /// As [`Factor::solve_in_place`].
    pub fn solve_rows_in_place(&self, rhs: &mut [f64], columns: usize) -> Result<(), SparseError> {
        check_length(RIGHT_HAND_SIDES, rhs.len(), self.dimension * columns)?;
        let width = block_width(columns);
        let blocks = (0..columns).step_by(width).map(|first| first..(first + width).min(columns));
        let substitution = self.symbolic.substitution(&self.values);
        substitution.solve_rows(rhs, columns, &blocks.collect::<Vec<_>>());
        Ok(())
    }

    /// As [`Factor::solve_in_place`], right-hand sides given as numbers on some unknowns, in any order, those on one unknown added up.
    /// Unknown `u` of a column is written to `place[u]` of its solution; nothing else there is touched.
    ///
    /// # Errors
    /// [`SparseError::Length`] when `place` does not have one entry for each unknown, or there are not as many solutions as loads.
    ///
    /// # Panics
    /// When an unknown or a place is beyond the end.
    pub fn solve_loads(
        &self,
        loads: &[&[(u32, f64)]],
        place: &[u32],
        solutions: &mut [Vec<f64>],
    ) -> Result<(), SparseError> {
        check_length("places", place.len(), self.dimension)?;
        check_length("solutions", solutions.len(), loads.len())?;
        let substitution = self.symbolic.substitution(&self.values);
        let width = block_width(loads.len());
        loads.par_chunks(width).zip(solutions.par_chunks_mut(width)).for_each(|(loads, solutions)| {
            substitution.solve_loads(loads, place, solutions);
        });
        Ok(())
    }

    /// The relative residual `‖A x − b‖ / (‖A‖ ‖x‖ + ‖b‖)`, in maximum norms, that the factor left for a seeded
    /// random `b`: its backward error (Rigal & Gaches 1967).
    pub fn probe_residual(&self) -> f64 {
        self.probe_residual
    }

    fn probe(&self, matrix: &SymmetricMatrix) -> Result<f64, SparseError> {
        let mut random = ChaCha8Rng::seed_from_u64(PROBE_SEED);
        let b: Vec<f64> = (0..self.dimension).map(|_| random.random_range(-1.0..1.0)).collect();
        let mut x = b.clone();
        self.solve_in_place(&mut x, 1)?;
        let mut product = vec![0.0; self.dimension];
        matrix.multiply(&x, &mut product);
        let residual = product.iter().zip(&b).map(|(p, b)| p - b);
        Ok(largest(residual) / (matrix.norm() * largest(x.iter().copied()) + largest(b.iter().copied())))
    }
}

impl Drop for Factor {
    fn drop(&mut self) {
        self.symbolic.reuse(std::mem::take(&mut self.values));
    }
}

const RIGHT_HAND_SIDES: &str = "right-hand sides";

fn check_length(what: &'static str, found: usize, expected: usize) -> Result<(), SparseError> {
    if found == expected { Ok(()) } else { Err(SparseError::Length { what, expected, found }) }
}

/// Columns of a block, of blocks that are about equal.
fn block_width(columns: usize) -> usize {
    columns.div_ceil(columns.div_ceil(BLOCK).max(1)).max(1)
}

/// The maximum norm; NaN when a number is NaN.
fn largest(numbers: impl Iterator<Item = f64>) -> f64 {
    numbers.fold(0.0, |max, x| if x.abs() <= max || max.is_nan() { max } else { x.abs() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparse::{Analysis, Ordering, Pattern};

    /// The second difference on a path, fixed at both ends, scaled so that the diagonal is 2.
    fn chain(n: usize) -> SymmetricMatrix {
        let pairs: Vec<[u32; 2]> = (1..n as u32).map(|i| [i - 1, i]).collect();
        let pattern = Pattern::from_elements(n, pairs.iter().map(<[u32; 2]>::as_slice));
        let mut matrix = SymmetricMatrix::zeros(Arc::new(pattern));
        for i in 0..n {
            matrix.add(i, i, 2.0).expect("the diagonal");
            if i > 0 {
                matrix.add(i, i - 1, -1.0).expect("a neighbour");
            }
        }
        matrix
    }

    #[test]
    fn the_probe_catches_a_single_wrong_number() {
        let matrix = chain(300);
        let analysis = Analysis::new(matrix.pattern(), Ordering::MinimumDegree).expect("analysis");
        let sound = analysis.factor(&matrix).expect("positive definite");
        assert!(sound.probe_residual() < 1e-15);
        let b: Vec<f64> = (0..300).map(|i| f64::from(i % 7) - 3.0).collect();
        let solved = |values: &[f64]| {
            let mut x = b.clone();
            sound.symbolic.substitution(values).solve(&mut x, 1);
            x
        };
        let expected = solved(&sound.values);
        let mut checked = 0;
        for place in (0..sound.values.len()).step_by(17) {
            let mut values = sound.values.clone();
            values[place] += 1e-6;
            // The upper halves of the diagonal blocks are stored and never read.
            if solved(&values) == expected {
                continue;
            }
            checked += 1;
            let refused = Factor::probed(Arc::clone(&sound.symbolic), values, &matrix);
            assert!(matches!(refused, Err(SparseError::ProbeResidual { .. })), "place {place}: {refused:?}");
        }
        assert!(checked > 10);
        let lost = vec![f64::NAN; sound.values.len()];
        assert!(Factor::probed(Arc::clone(&sound.symbolic), lost, &matrix).is_err());
    }

    #[test]
    fn right_hand_sides_of_the_wrong_length_are_refused() {
        let matrix = chain(4);
        let analysis = Analysis::new(matrix.pattern(), Ordering::MinimumDegree).expect("analysis");
        let factor = analysis.factor(&matrix).expect("positive definite");
        let refused = factor.solve_in_place(&mut [0.0; 9], 2);
        assert_eq!(refused, Err(SparseError::Length { what: "right-hand sides", expected: 8, found: 9 }));
        assert_eq!(factor.solve_rows_in_place(&mut [0.0; 9], 2), refused);
        assert_eq!(factor.solve_in_place(&mut [], 0), Ok(()));
        assert_eq!(factor.solve_rows_in_place(&mut [], 0), Ok(()));
        let lacking = |what| Err(SparseError::Length { what, expected: 4, found: 3 });
        assert_eq!(factor.solve_loads(&[], &[0; 3], &mut []), lacking("places"));
        let four: [&[(u32, f64)]; 4] = [&[]; 4];
        assert_eq!(factor.solve_loads(&four, &[0; 4], &mut vec![vec![]; 3]), lacking("solutions"));
        assert_eq!(factor.solve_loads(&[], &[0; 4], &mut []), Ok(()));
    }

    #[test]
    fn the_largest_number_is_not_lost_to_nan() {
        assert_eq!(largest([1.0, -3.0, 2.0].into_iter()), 3.0);
        assert!(largest([1.0, f64::NAN, 2.0].into_iter()).is_nan());
    }
}
