//! Normally distributed numbers for every pixel, fast, and the same for the same seed, frame and use.

use rand::{Rng, RngExt};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// Quantiles kept, as many as a 16-bit number tells apart. The largest is 4.3 standard deviations.
const QUANTILES: usize = 1 << 16;
/// Steps of the integral from −6 to 6.
const STEPS: usize = 24_000;

/// What a stream of numbers is for: adding a use must not change the numbers of another.
#[derive(Debug, Clone, Copy)]
pub(super) enum Use {
    Sensor = 0,
    Depth = 1,
    FixedDepth = 2,
    Holes = 3,
    Time = 4,
}

/// The stream of one frame for one use.
pub(super) fn stream(seed: u64, frame: u32, purpose: Use) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(u64::from(frame) << 3 | purpose as u64);
    rng
}

/// Quantiles of the normal distribution, scaled to variance one.
#[derive(Debug, Clone)]
pub(super) struct Normal {
    quantiles: Vec<f32>,
    bytes: Vec<u8>,
}

impl Normal {
    /// The quantiles (i + ½)/2¹⁶, from the integral of the density by the trapezoidal rule.
    pub(super) fn new() -> Self {
        let step = 12.0 / STEPS as f64;
        let density = |x: f64| (-0.5 * x * x).exp() / std::f64::consts::TAU.sqrt();
        let mut quantiles = Vec::with_capacity(QUANTILES);
        let (mut x, mut share) = (-6.0, 0.0);
        while quantiles.len() < QUANTILES {
            let more = 0.5 * step * (density(x) + density(x + step));
            let wanted = |n: usize| (n as f64 + 0.5) / QUANTILES as f64;
            while quantiles.len() < QUANTILES && (wanted(quantiles.len()) <= share + more || x > 6.0) {
                quantiles.push((x + step * (wanted(quantiles.len()) - share) / more) as f32);
            }
            (x, share) = (x + step, share + more);
        }
        let variance = quantiles.iter().map(|&q| f64::from(q).powi(2)).sum::<f64>() / QUANTILES as f64;
        let scale = (1.0 / variance.sqrt()) as f32;
        quantiles.iter_mut().for_each(|q| *q *= scale);
        Self { quantiles, bytes: Vec::new() }
    }

    /// The next numbers of a stream.
    pub(super) fn fill(&mut self, rng: &mut ChaCha8Rng, numbers: &mut [f32]) {
        self.bytes.resize(2 * numbers.len(), 0);
        rng.fill_bytes(&mut self.bytes);
        for (number, pair) in numbers.iter_mut().zip(self.bytes.chunks_exact(2)) {
            *number = self.quantiles[usize::from(u16::from_le_bytes([pair[0], pair[1]]))];
        }
    }

    /// One number.
    pub(super) fn one(&self, rng: &mut ChaCha8Rng) -> f64 {
        f64::from(self.quantiles[usize::from(rng.random::<u16>())])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Moments of the quantiles themselves: mean 0, variance 1, kurtosis 3 but for the tails that are cut off.
    #[test]
    fn the_numbers_are_normal() {
        let normal = Normal::new();
        let moment =
            |k: i32| normal.quantiles.iter().map(|&q| f64::from(q).powi(k)).sum::<f64>() / QUANTILES as f64;
        assert!(moment(1).abs() < 1e-5 && (moment(2) - 1.0).abs() < 1e-6);
        assert!((moment(4) - 3.0).abs() < 0.01, "{}", moment(4));
        // Φ(1) = 0.841345
        let below = normal.quantiles.iter().filter(|&&q| q < 1.0).count() as f64 / QUANTILES as f64;
        assert!((below - 0.841_345).abs() < 1e-4);
    }

    #[test]
    fn streams_are_their_own_and_repeat() {
        let mut normal = Normal::new();
        let mut numbers = |seed, frame, purpose| {
            let mut numbers = [0.0; 16];
            normal.fill(&mut stream(seed, frame, purpose), &mut numbers);
            numbers
        };
        assert_eq!(numbers(1, 2, Use::Depth), numbers(1, 2, Use::Depth));
        assert_ne!(numbers(1, 2, Use::Depth), numbers(1, 3, Use::Depth));
        assert_ne!(numbers(1, 2, Use::Depth), numbers(2, 2, Use::Depth));
        assert_ne!(numbers(1, 2, Use::Depth), numbers(1, 2, Use::Sensor));
    }
}
