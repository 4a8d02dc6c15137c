//! The supernodal Cholesky of `faer`, in plain types: pattern and order → symbolic factor, values → factor → what
//! solves with it.

use super::branches::{Branches, Supernode};
use super::substitution::Substitution;
use super::{Pattern, SparseError, SymmetricMatrix};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::solvers::LltError;
use faer::perm::PermRef;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::supernodal::{SupernodalLltRef, SymbolicSupernodalCholesky};
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{FaerError, SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Par, Side};
use std::sync::{Mutex, PoisonError};

/// Parts that the dense blocks of a factor are split into: a fixed number, so that the result does not depend on the number of threads.
const SPLIT: usize = 2;

/// The structure of a factor.
#[derive(Debug)]
pub(super) struct Symbolic {
    cholesky: SymbolicCholesky<u32>,
    parts: Branches,
    /// Memory of a factor that nobody has any more: where one follows another, taking it anew each time costs more than filling it.
    spare: Mutex<Vec<f64>>,
}

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
            // Less than faer's own "always", 0, at which a matrix without anything to eliminate is kept otherwise.
            supernodal_flop_ratio_threshold: SupernodalThreshold(-1.0),
            ..CholeskySymbolicParams::default()
        };
        let symbolic = factorize_symbolic_cholesky(structure(pattern), Side::Lower, ordering, parameters);
        let cholesky = symbolic.map_err(|error| too_large(dimension, error))?;
        let parts = branches(supernodal(&cholesky));
        Ok(Self { cholesky, parts, spare: Mutex::default() })
    }

    /// Numbers that a factor stores.
    pub(super) fn entries(&self) -> usize {
        self.cholesky.len_val()
    }

    /// The unknown eliminated in each step.
    pub(super) fn order(&self) -> &[u32] {
        self.cholesky.perm().map_or(&[], |p| p.arrays().0)
    }

    /// The values of the factor of `matrix`.
    pub(super) fn factor(&self, matrix: &SymmetricMatrix) -> Result<Vec<f64>, SparseError> {
        let dimension = self.cholesky.nrows();
        let no_memory = |_| too_large(dimension, FaerError::OutOfMemory);
        let mut values = std::mem::take(&mut *self.spare.lock().unwrap_or_else(PoisonError::into_inner));
        let missing = self.entries().saturating_sub(values.len());
        values.try_reserve_exact(missing).map_err(|_| too_large(dimension, FaerError::OutOfMemory))?;
        values.resize(self.entries(), 0.0);
        let split = Par::rayon(SPLIT);
        let scratch = self.cholesky.factorize_numeric_llt_scratch::<f64>(split, Default::default());
        let mut memory = MemBuffer::try_new(scratch).map_err(no_memory)?;
        let lower = SparseColMatRef::new(structure(matrix.pattern()), matrix.values());
        let outcome = self.cholesky.factorize_numeric_llt(
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
                self.reuse(values);
                let unknown = self.order()[index] as usize;
                let diagonal = matrix.diagonal()[unknown];
                Err(SparseError::NotPositiveDefinite { unknown, diagonal, step: index, dimension })
            }
        }
    }

    /// Takes back the values of a factor, to make the next in their memory.
    pub(super) fn reuse(&self, values: Vec<f64>) {
        *self.spare.lock().unwrap_or_else(PoisonError::into_inner) = values;
    }

    /// A factor with these values, ready to solve.
    pub(super) fn substitution<'a>(&'a self, values: &'a [f64]) -> Substitution<'a> {
        let factor = SupernodalLltRef::new(supernodal(&self.cholesky), values);
        Substitution { factor, order: self.order(), parts: &self.parts }
    }
}

fn supernodal(cholesky: &SymbolicCholesky<u32>) -> &SymbolicSupernodalCholesky<u32> {
    match cholesky.raw() {
        SymbolicCholeskyRaw::Supernodal(supernodal) => supernodal,
        SymbolicCholeskyRaw::Simplicial(_) => unreachable!("supernodes were asked for"),
    }
}

fn branches(supernodal: &SymbolicSupernodalCholesky<u32>) -> Branches {
    let columns = supernodal.supernode_begin().iter().zip(supernodal.supernode_end());
    let node = |(s, (&begin, &end)): (usize, (&u32, &u32))| Supernode {
        columns: begin as usize..end as usize,
        below: supernodal.supernode(s).pattern(),
    };
    Branches::new(&columns.enumerate().map(node).collect::<Vec<_>>())
}

fn too_large(dimension: usize, error: FaerError) -> SparseError {
    let reason = match error {
        FaerError::IndexOverflow => "more than 2³¹ entries",
        _ => "out of memory",
    };
    SparseError::TooLarge { dimension, reason }
}
