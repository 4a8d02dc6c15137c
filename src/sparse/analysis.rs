//! In which order the unknowns of a pattern are eliminated, and what the factor will look like.

use super::cholesky::Symbolic;
use super::dissection::nested_dissection;
use super::graph::Blocks;
use super::tree::postordered;
use super::{Factor, Pattern, SparseError, SymmetricMatrix};
use std::sync::Arc;

/// How the elimination order is found.
#[derive(Debug, Clone, Copy)]
pub enum Ordering<'a> {
    /// Nested dissection guided by where the unknowns are: the choice for meshes, of far less fill in 3-D.
    NestedDissection {
        /// One point (m) per unknown. Unknowns at the same point with the same neighbours form one block.
        /// Points that say nothing (all equal, say) cost fill but are not wrong.
        position: &'a [[f64; 3]],
    },
    /// Approximate minimum degree (Amestoy, Davis & Duff 1996): for small systems and unknowns without a place.
    MinimumDegree,
}

/// Elimination order and structure of the factor, for every matrix of one pattern. It keeps the memory of the last factor that was
/// dropped for the next one.
#[derive(Debug, Clone)]
pub struct Analysis {
    pattern: Arc<Pattern>,
    symbolic: Arc<Symbolic>,
}

impl Analysis {
    /// Orders the unknowns of `pattern` and lays out the factor.
    ///
    /// # Errors
    /// [`SparseError::Empty`]; [`SparseError::Length`] when there is not one position per unknown;
    /// [`SparseError::TooLarge`].
    pub fn new(pattern: &Arc<Pattern>, ordering: Ordering<'_>) -> Result<Self, SparseError> {
        let expected = pattern.dimension();
        if expected == 0 {
            return Err(SparseError::Empty);
        }
        let symbolic = match ordering {
            Ordering::MinimumDegree => Symbolic::new(pattern, None)?,
            Ordering::NestedDissection { position } if position.len() != expected => {
                return Err(SparseError::Length {
                    what: "positions of the unknowns",
                    expected,
                    found: position.len(),
                });
            }
            Ordering::NestedDissection { position } => {
                Symbolic::new(pattern, Some(&elimination_order(pattern, position)))?
            }
        };
        Ok(Self { pattern: Arc::clone(pattern), symbolic: Arc::new(symbolic) })
    }

    /// Numbers that a factor stores (8 bytes each), the zeros inside its dense blocks included.
    pub fn factor_entries(&self) -> usize {
        self.symbolic.entries()
    }

    /// The unknown that is eliminated in each step.
    pub fn elimination_order(&self) -> &[u32] {
        self.symbolic.order()
    }

    /// Factors a matrix of the analysed pattern, and solves a probe system with the factor.
    ///
    /// # Errors
    /// [`SparseError::OtherPattern`], [`SparseError::NonFinite`], [`SparseError::NotPositiveDefinite`],
    /// [`SparseError::ProbeResidual`], [`SparseError::TooLarge`].
    pub fn factor(&self, matrix: &SymmetricMatrix) -> Result<Factor, SparseError> {
        if !Arc::ptr_eq(&self.pattern, matrix.pattern()) && self.pattern != *matrix.pattern() {
            return Err(SparseError::OtherPattern {
                expected: self.pattern.entries(),
                found: matrix.pattern().entries(),
            });
        }
        if let Some((entry, &value)) = matrix.values().iter().enumerate().find(|(_, v)| !v.is_finite()) {
            return Err(SparseError::NonFinite { entry, value });
        }
        Factor::probed(Arc::clone(&self.symbolic), self.symbolic.factor(matrix)?, matrix)
    }
}

fn elimination_order(pattern: &Pattern, position: &[[f64; 3]]) -> Vec<u32> {
    let blocks = Blocks::new(pattern, position);
    let order = nested_dissection(&blocks.graph, &blocks.points);
    let order = postordered(&blocks.graph, &order);
    order.iter().flat_map(|&block| &blocks.unknowns[block as usize]).copied().collect()
}
