//! How a large sparse symmetric positive definite system is solved: pattern, ordering, Cholesky, probe residual.
