//! How a large sparse symmetric positive definite system `A x = b` is solved.
//!
//! The path: a [`Pattern`] says which entries may be non-zero; a [`SymmetricMatrix`] is filled element by
//! element; an [`Analysis`] finds an elimination order of little fill (nested dissection of the mesh) and is
//! made once per pattern; [`Analysis::factor`] makes the Cholesky [`Factor`] of one matrix, which solves for
//! any number of right-hand sides. Every factor has solved a seeded probe system before anybody gets it.
//!
//! Deliberately absent: indefinite matrices (no pivoting), unsymmetric matrices, iterative solvers. The only
//! room that names `faer`, and inside it only `cholesky.rs` and `substitution.rs` do.
//!
//! Symbols: `A = L Lᵀ` after the rows and columns were permuted, `n` unknowns.

mod analysis;
mod branches;
mod cholesky;
mod coarse;
mod dissection;
mod error;
mod factor;
mod graph;
mod leaf;
mod matrix;
mod pattern;
mod refinement;
mod separator;
mod substitution;
mod tree;
mod zeros;

pub use analysis::{Analysis, Ordering};
pub use error::SparseError;
pub use factor::Factor;
pub use matrix::SymmetricMatrix;
pub use pattern::Pattern;
