//! Is a place a minimum?
//!
//! Relative offset (Bates and Watts 1981, Technometrics 23, 179–183): √(|Qᵀr|²/p) over √(Σ r²/(n − p)), the distance to the minimum in
//! standard deviations of the parameters. It says nothing where the model is exact; there the whole step must be small beside the
//! parameters. A stalled search is never taken for a minimum by the search's own smallness.

/// Whole step over the parameter, in every parameter, at rounding.
const STEP: f64 = 1e-9;

/// Whether the relative offset is at most `offset`: at 1e-8 no figure of the answer changes any more, at 1e-3 none that its deviation leaves
/// (Bates and Watts' own limit).
pub(super) fn is_minimum(reached: f64, squares: f64, values: usize, parameters: usize, offset: f64) -> bool {
    if values <= parameters || squares <= 0.0 {
        return squares == 0.0;
    }
    let rest = (squares - reached).max(0.0) / (values - parameters) as f64;
    (reached / parameters as f64).sqrt() <= offset * rest.sqrt()
}

pub(super) fn is_rounding(step: &[f64], parameters: &[f64]) -> bool {
    step.iter().zip(parameters).all(|(s, p)| s.abs() <= STEP * p.abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_standstill_far_from_the_minimum_is_none() {
        assert!(!is_minimum(0.5, 1.0, 12, 2, 1e-8) && is_minimum(1e-18, 1.0, 12, 2, 1e-8));
        assert!(is_minimum(1e-9, 1.0, 12, 2, 1e-3) && !is_minimum(1e-9, 1.0, 12, 2, 1e-8));
        assert!(!is_rounding(&[1e-3], &[1.0]) && is_rounding(&[1e-12], &[1.0]));
    }
}
