//! How wide is an interval, and which deviation has an error of known width?

use statrs::distribution::{ContinuousCDF, StudentsT};

/// 95 % quantile of the standard normal distribution: half of a 90 % interval over the standard deviation.
pub(super) const Z95: f64 = 1.644_853_626_951_472_7;

/// The same for a deviation that was itself found with so many degrees of freedom (Student's distribution).
pub(super) fn half_90(freedom: f64) -> f64 {
    // Beyond, the two are one in seven digits.
    if freedom >= 1e6 {
        return Z95;
    }
    StudentsT::new(0.0, 1.0, freedom.max(1.0)).map_or(f64::INFINITY, |t| t.inverse_cdf(0.95))
}

/// Standard deviation of an error that is anywhere within so much to either side with the same chance (JCGM 100:2008, 4.3.7).
pub(super) fn uniform(half: f64) -> f64 {
    half / 3_f64.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tables of Student's distribution: t 0.95 with 10 and 120 degrees of freedom, and without end.
    #[test]
    fn quantiles_are_those_of_the_tables() {
        for (freedom, expected) in [(1.0, 6.3138), (10.0, 1.8125), (120.0, 1.6577), (1e9, 1.6449)] {
            assert!((half_90(freedom) - expected).abs() < 1e-4, "{freedom}: {}", half_90(freedom));
        }
    }
}
