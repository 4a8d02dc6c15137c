//! Which cells of a tip touch, and how hard: `q ≥ 0`, `A q − h ≥ 0`, `q · (A q − h) = 0`, with `A` symmetric positive
//! definite, `h` how far the tip reaches into every cell, `A q − h` the gap that is left.
//!
//! Block principal pivoting (Portugal, Júdice & Vicente 1994): every cell that pulls is let go and every cell that
//! is pierced is taken in, all at once as long as their number falls; when it does not, one at a time (Murty 1974),
//! which ends for every positive definite matrix.

use super::error::FemError;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// The cells that touch.
pub(super) struct Touching {
    /// Their numbers, ascending.
    pub cells: Vec<usize>,
    /// Force of each of them, in the same order.
    pub force: DVector<f64>,
    factor: Option<Cholesky<f64, Dyn>>,
}

/// Blocks that may fail to lower the number of offending cells before single ones are exchanged.
const PATIENCE: usize = 10;

/// A gap counts as pierced below this share of the deepest reach.
const PIERCED: f64 = 1e-12;

impl Touching {
    /// Solves, starting from the guess `start`.
    ///
    /// # Errors
    /// [`FemError::Contact`] when `compliance` is not positive definite or the cells still change after
    /// `20 n + 100` exchanges.
    pub(super) fn find(
        compliance: &DMatrix<f64>,
        reach: &DVector<f64>,
        start: Vec<bool>,
    ) -> Result<Self, FemError> {
        let n = reach.len();
        let tolerance = PIERCED * reach.amax();
        let mut inside = start;
        let (mut fewest, mut patience) = (n + 1, PATIENCE);
        let most = 20 * n + 100;
        for _ in 0..most {
            let touching = Self::of(compliance, reach, &inside)?;
            let mut gap = -reach;
            for (&j, f) in touching.cells.iter().zip(&touching.force) {
                gap.axpy(*f, &compliance.column(j), 1.0);
            }
            let mut offending: Vec<usize> = (0..n).filter(|&i| !inside[i] && gap[i] < -tolerance).collect();
            offending.extend(
                touching.cells.iter().zip(&touching.force).filter(|(_, f)| **f < 0.0).map(|(&i, _)| i),
            );
            if offending.is_empty() {
                return Ok(touching);
            }
            if offending.len() < fewest {
                (fewest, patience) = (offending.len(), PATIENCE);
            } else if patience > 0 {
                patience -= 1;
            } else {
                let last = offending.iter().copied().max();
                offending.retain(|&i| Some(i) == last);
            }
            for i in offending {
                inside[i] = !inside[i];
            }
        }
        Err(FemError::Contact { why: "the cells in contact still change", cells: n, exchanges: most })
    }

    fn of(compliance: &DMatrix<f64>, reach: &DVector<f64>, inside: &[bool]) -> Result<Self, FemError> {
        let cells: Vec<usize> = (0..inside.len()).filter(|&i| inside[i]).collect();
        if cells.is_empty() {
            return Ok(Self { cells, force: DVector::zeros(0), factor: None });
        }
        let part = compliance.select_rows(&cells).select_columns(&cells);
        let factor = part.cholesky().ok_or(FemError::Contact {
            why: "the compliance under the tip is not positive definite",
            cells: cells.len(),
            exchanges: 0,
        })?;
        let force = factor.solve(&reach.select_rows(&cells));
        Ok(Self { cells, force, factor: Some(factor) })
    }

    /// Change of the cells' forces when their reach changes by `change` (rows: the cells that touch).
    pub(super) fn respond(&self, change: &DMatrix<f64>) -> DMatrix<f64> {
        self.factor.as_ref().map_or_else(|| change.clone(), |factor| factor.solve(change))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(2), ..ProptestConfig::default() })]

        /// The three conditions hold, from any start.
        #[test]
        fn the_conditions_hold(values in prop::collection::vec(-1.0..1.0_f64, 8 * 8 + 8), start in 0_usize..256) {
            let b = DMatrix::from_column_slice(8, 8, &values[..64]);
            let a = &b * b.transpose() + DMatrix::identity(8, 8) * 0.01;
            let h = DVector::from_column_slice(&values[64..]);
            let found = Touching::find(&a, &h, (0..8).map(|i| start >> i & 1 == 1).collect()).expect("ends");
            let mut q = DVector::zeros(8);
            for (&i, f) in found.cells.iter().zip(&found.force) {
                prop_assert!(*f >= 0.0);
                q[i] = *f;
            }
            let gap = &a * &q - &h;
            prop_assert!(gap.min() > -1e-9, "{gap}");
            prop_assert!(q.dot(&gap).abs() < 1e-8);
        }
    }

    #[test]
    fn a_tip_that_does_not_reach_presses_nothing() {
        let found = Touching::find(&DMatrix::identity(3, 3), &DVector::from_element(3, -1.0), vec![true; 3])
            .expect("ends");
        assert!(found.cells.is_empty());
        let flat = DMatrix::from_element(2, 2, 1.0) - DMatrix::identity(2, 2) * 2.0;
        assert!(Touching::find(&flat, &DVector::from_element(2, 1.0), vec![true; 2]).is_err());
    }
}
