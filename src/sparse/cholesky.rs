//! The supernodal Cholesky of `faer`, in plain types: pattern and order → symbolic factor, values → factor,
//! right-hand sides → solutions. The only file that knows faer's generics.

use super::{Pattern, SparseError, SymmetricMatrix};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::solvers::LltError;
use faer::perm::PermRef;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{FaerError, SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};

/// Parts that the dense blocks of a factor are split into: a fixed number, so that the result does not depend on the number of threads.
const SPLIT: usize = 2;

/// The structure of a factor.
#[derive(Debug)]
pub(super) struct Symbolic(SymbolicCholesky<u32>);

fn structure(pattern: &Pattern) -> SymbolicSparseColMatRef<'_, u32> {
    let n = pattern.dimension();
    SymbolicSparseColMatRef::new_checked(n, n, pattern.column_starts(), None, pattern.rows())
}

impl Symbolic {
    /// The structure for unknowns eliminated in this `order` (a postorder of its elimination tree), or by
    /// approximate minimum degree.
    pub(super) fn new(pattern: &Pattern, order: Option<&[u32]>) -> Result<Self, SparseError> {
        let dimension = pattern.dimension();
        let mut inverse = vec![0; order.map_or(0, <[u32]>::len)];
        for (step, &unknown) in order.into_iter().flatten().enumerate() {
            inverse[unknown as usize] = step as u32;
        }
        let ordering = match order {
            Some(order) => SymmetricOrdering::Custom(PermRef::new_checked(order, &inverse, dimension)),
            None => SymmetricOrdering::Amd,
        };
        let parameters = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..CholeskySymbolicParams::default()
        };
        let symbolic = factorize_symbolic_cholesky(structure(pattern), Side::Lower, ordering, parameters);
        symbolic.map(Self).map_err(|error| too_large(dimension, error))
    }

    /// Numbers that a factor stores.
    pub(super) fn entries(&self) -> usize {
        self.0.len_val()
    }

    /// The unknown eliminated in each step.
    pub(super) fn order(&self) -> &[u32] {
        self.0.perm().map_or(&[], |p| p.arrays().0)
    }

    /// The values of the factor of `matrix`.
    pub(super) fn factor(&self, matrix: &SymmetricMatrix) -> Result<Vec<f64>, SparseError> {
        let dimension = self.0.nrows();
        let no_memory = |_| too_large(dimension, FaerError::OutOfMemory);
        let mut values = Vec::new();
        values.try_reserve_exact(self.entries()).map_err(|_| too_large(dimension, FaerError::OutOfMemory))?;
        values.resize(self.entries(), 0.0);
        let split = Par::rayon(SPLIT);
        let scratch = self.0.factorize_numeric_llt_scratch::<f64>(split, Default::default());
        let mut memory = MemBuffer::try_new(scratch).map_err(no_memory)?;
        let lower = SparseColMatRef::new(structure(matrix.pattern()), matrix.values());
        let outcome = self.0.factorize_numeric_llt(
            &mut values,
            lower,
            Side::Lower,
            Default::default(),
            split,
            MemStack::new(&mut memory),
            Default::default(),
        );
        match outcome {
            Ok(_) => Ok(values),
            Err(LltError::NonPositivePivot { index }) => {
                let unknown = self.order()[index] as usize;
                let diagonal = matrix.diagonal()[unknown];
                Err(SparseError::NotPositiveDefinite { unknown, diagonal, step: index, dimension })
            }
        }
    }

    /// Solves for `columns` right-hand sides (column-major) in place, on this thread.
    pub(super) fn solve(&self, values: &[f64], rhs: &mut [f64], columns: usize) -> Result<(), SparseError> {
        let dimension = self.0.nrows();
        let scratch = self.0.solve_in_place_scratch::<f64>(columns, Par::Seq);
        let mut memory =
            MemBuffer::try_new(scratch).map_err(|_| too_large(dimension, FaerError::OutOfMemory))?;
        let rhs = MatMut::from_column_major_slice_mut(rhs, dimension, columns);
        LltRef::new(&self.0, values).solve_in_place_with_conj(
            Conj::No,
            rhs,
            Par::Seq,
            MemStack::new(&mut memory),
        );
        Ok(())
    }
}

fn too_large(dimension: usize, error: FaerError) -> SparseError {
    let reason = match error {
        FaerError::IndexOverflow => "more than 2³¹ entries",
        _ => "out of memory",
    };
    SparseError::TooLarge { dimension, reason }
}
