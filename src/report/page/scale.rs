//! By how much small displacements are drawn larger than they are.

/// The largest of 1, 2, 5, 10, 20, 50, … (or 0.5, 0.2, 0.1, …) by which `size` may be multiplied without
/// exceeding `room` (same unit). 1 when there is nothing to scale.
pub(super) fn factor(size: f64, room: f64) -> f64 {
    let ratio = room / size;
    if !(ratio.is_finite() && ratio > 0.0) {
        return 1.0;
    }
    let exponent = ratio.log10().floor() as i32;
    let times = |m: f64| if exponent < 0 { m / 10_f64.powi(-exponent) } else { m * 10_f64.powi(exponent) };
    [10.0, 5.0, 2.0, 1.0].into_iter().map(times).find(|&f| f <= ratio).unwrap_or_else(|| times(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_are_round_and_fit() {
        assert_eq!(factor(3.5, 11.0), 2.0);
        assert_eq!(factor(0.12, 7.3), 50.0);
        assert_eq!(factor(1.0, 1.0), 1.0);
        assert_eq!(factor(3.0, 1.0), 0.2);
        assert_eq!(factor(0.0, 1.0), 1.0);
        assert_eq!(factor(f64::NAN, 1.0), 1.0);
    }
}
