//! Derivatives of a function without writing them: the same function, called with dual numbers p_j + ε.

use nalgebra::DMatrix;
use num_dual::Dual64;

/// Derivatives ∂f_i/∂p_j (n × p) of `function`, exact to rounding. One call a parameter.
pub fn derivatives(parameters: &[f64], function: impl Fn(&[Dual64]) -> Vec<Dual64>) -> DMatrix<f64> {
    let columns: Vec<Vec<f64>> = (0..parameters.len())
        .map(|j| {
            let seeded: Vec<Dual64> = (0..parameters.len())
                .map(|k| Dual64::new(parameters[k], if k == j { 1.0 } else { 0.0 }))
                .collect();
            function(&seeded).into_iter().map(|value| value.eps).collect()
        })
        .collect();
    let rows = columns.first().map_or(0, Vec::len);
    DMatrix::from_fn(rows, parameters.len(), |i, j| columns[j][i])
}
