//! How the lens and the pixels spread the light of a small piece of the picture.
//!
//! The lens blurs before the pixels gather. So a dot's edge has to be blurred where it is, not where its pixel is: else the centroid of a
//! dot of 3 px radius would be off by up to 0.006 px, which no real camera does. Pieces of a quarter of a pixel are fine enough.

use super::raster::Picture;

/// Pieces along each side of a pixel.
pub(super) const PIECES: usize = 4;
/// Points of the integrals over a piece and over a pixel.
const POINTS: usize = 48;

/// Shares of the light of a piece of a pixel that the pixels around gather, along one axis.
///
/// With the lens's Gaussian K of standard deviation σ (px) and the pixel's box B: share(a, k) = ∫ over piece a of (K∗B)(k − x) dx · 4.
#[derive(Debug, Clone)]
pub(super) struct Spread {
    /// By piece; pixels from −reach to reach.
    pieces: [Vec<f32>; PIECES],
    /// Of a pixel that shines evenly, from the middle outwards.
    even: Vec<f32>,
}

impl Spread {
    pub(super) fn new(sigma: f64) -> Self {
        let reach = if sigma > 0.0 { (4.0 * sigma + 0.5).ceil() as i32 } else { 0 };
        let points = |from: f64, length: f64| {
            (0..POINTS).map(move |i| from + length * (i as f64 + 0.5) / POINTS as f64)
        };
        let density = |x: f64| if sigma > 0.0 { (-0.5 * (x / sigma).powi(2)).exp() } else { 1.0 };
        let side = 1.0 / PIECES as f64;
        let pieces = std::array::from_fn(|a| {
            let share = |k: i32| {
                let from = points(a as f64 * side - 0.5, side);
                from.map(|x| points(f64::from(k) - 0.5, 1.0).map(|y| density(y - x)).sum::<f64>())
                    .sum::<f64>()
            };
            let shares: Vec<f64> = (-reach..=reach).map(share).collect();
            let sum: f64 = shares.iter().sum();
            shares.iter().map(|s| (s / sum) as f32).collect::<Vec<f32>>()
        });
        let reach = reach as usize;
        let even = (0..=reach).map(|k| {
            // Both sides, so that rounding leaves it symmetric.
            let both = pieces.iter().map(|p| p[reach + k] + p[reach - k]).sum::<f32>();
            0.5 * both / PIECES as f32
        });
        let even = even.collect();
        Self { pieces, even }
    }

    /// How many pixels it goes in each direction.
    pub(super) fn reach(&self) -> usize {
        self.even.len() - 1
    }

    /// Shares of a pixel that shines evenly, from the middle outwards.
    pub(super) fn even(&self) -> &[f32] {
        &self.even
    }

    /// Adds to the picture's fringe what it makes to the gathered light that the pieces of a pixel shine by `pieces` (row by row, radiance)
    /// and not all by their mean.
    pub(super) fn correct(
        &self,
        pieces: &[[f32; PIECES]; PIECES],
        [column, row]: [usize; 2],
        picture: &mut Picture,
    ) {
        let reach = self.reach();
        if reach == 0 {
            return;
        }
        let share = 1.0 / (PIECES * PIECES) as f32;
        let mean = share * pieces.iter().flatten().sum::<f32>();
        let span = 2 * reach + 1;
        let mut along = [[0.0_f32; 2 * MOST + 1]; PIECES];
        for (along, pieces) in along.iter_mut().zip(pieces) {
            for (piece, shares) in pieces.iter().zip(&self.pieces) {
                for (sum, weight) in along.iter_mut().zip(shares) {
                    *sum += share * (piece - mean) * weight;
                }
            }
        }
        for down in 0..span {
            // Beyond the picture's border light is lost.
            let Some(at) = (row + down).checked_sub(reach).filter(|&r| r < picture.height) else { continue };
            let first = reach.saturating_sub(column);
            let last = span.min(picture.width + reach - column);
            let start = at * picture.width + column + first - reach;
            let fringe = &mut picture.fringe[start..start + last - first];
            for (along, shares) in along.iter().zip(&self.pieces) {
                let weight = shares[down];
                for (sum, light) in fringe.iter_mut().zip(&along[first..last]) {
                    *sum += weight * light;
                }
            }
        }
    }
}

/// Largest reach that a blur of [`WIDEST_PX`] has.
const MOST: usize = 21;
/// Widest blur that is foreseen (px).
pub(super) const WIDEST_PX: f64 = 5.0;

#[cfg(test)]
mod tests {
    use super::*;

    /// Light is kept, and its centroid is the piece's middle.
    #[test]
    fn a_piece_keeps_its_light_and_its_place() {
        for sigma in [0.4, 0.75, 2.0] {
            let spread = Spread::new(sigma);
            for (a, shares) in spread.pieces.iter().enumerate() {
                let k = |i: usize| i as f64 - spread.reach() as f64;
                let sum: f64 = shares.iter().map(|&s| f64::from(s)).sum();
                let middle: f64 = shares.iter().enumerate().map(|(i, &s)| k(i) * f64::from(s)).sum();
                assert!((sum - 1.0).abs() < 1e-6);
                let wanted = (a as f64 + 0.5) / 4.0 - 0.5;
                // A Gaussian of 0.4 px is resolved by pixels to exp(−2π²σ²) of a pixel.
                assert!(
                    (middle - wanted).abs() < 0.02 * (-2.0 * (sigma - 0.4)).exp(),
                    "{sigma} {a}: {middle}"
                );
            }
        }
    }
}
