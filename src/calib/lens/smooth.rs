//! A grey picture in floating point, smoothed with a Gaussian, and how noisy it was before.

use crate::track::GreyView;

/// A smoothed picture.
pub(super) struct Smooth {
    /// Width and height (px).
    pub(super) size: [usize; 2],
    values: Vec<f64>,
}

/// How far a kernel reaches, in standard deviations.
const REACH: f64 = 3.5;

/// A sampled Gaussian with the sum 1; its middle is the middle element.
pub(super) fn gaussian(sd_px: f64) -> Vec<f64> {
    let reach = (REACH * sd_px).ceil() as i32;
    let raw: Vec<f64> = (-reach..=reach).map(|k| (-0.5 * (f64::from(k) / sd_px).powi(2)).exp()).collect();
    let sum: f64 = raw.iter().sum();
    raw.iter().map(|g| g / sum).collect()
}

impl Smooth {
    /// Smooths a picture; beyond its border it goes on like the pixel at the border.
    pub(super) fn of(view: &GreyView<'_>, sd_px: f64) -> Self {
        let size @ [width, height] = view.size();
        let kernel = gaussian(sd_px);
        let reach = kernel.len() / 2;
        let mut across = vec![0.0; width * height];
        for (y, line) in across.chunks_exact_mut(width).enumerate() {
            let row = view.row(y);
            let mut padded = vec![f64::from(row[0]); reach];
            padded.extend(row.iter().map(|&p| f64::from(p)));
            padded.resize(width + 2 * reach, f64::from(row[width - 1]));
            for (x, value) in line.iter_mut().enumerate() {
                *value = kernel.iter().zip(&padded[x..]).map(|(k, p)| k * p).sum();
            }
        }
        let mut values = vec![0.0; width * height];
        for (y, line) in values.chunks_exact_mut(width).enumerate() {
            for (k, weight) in kernel.iter().enumerate() {
                let from = (y + k).saturating_sub(reach).min(height - 1);
                for (value, a) in line.iter_mut().zip(&across[from * width..]) {
                    *value += weight * a;
                }
            }
        }
        Self { size, values }
    }

    /// The grey level of a pixel.
    pub(super) fn at(&self, x: usize, y: usize) -> f64 {
        self.values[y * self.size[0] + x]
    }

    /// The grey level between pixels, bilinear; none outside the picture.
    pub(super) fn between(&self, x: f64, y: f64) -> Option<f64> {
        let [width, height] = self.size.map(|s| s as f64);
        if !(x >= 0.0 && y >= 0.0 && x < width - 1.0 && y < height - 1.0) {
            return None;
        }
        let (i, j, s, t) = (x as usize, y as usize, x.fract(), y.fract());
        let row = |j: usize| (1.0 - s) * self.at(i, j) + s * self.at(i + 1, j);
        Some((1.0 - t) * row(j) + t * row(j + 1))
    }
}

/// Median of |N(0, 1)|.
const MEDIAN: f64 = 0.674_489_750_196_081_7;
/// Standard deviation of rounding to whole grey levels, 1/√12: less noise than that cannot be seen.
const ROUNDING: f64 = 0.288_675_134_594_812_9;

/// Standard deviation of a picture's noise (grey levels), rounding included.
///
/// Second differences along rows, p(x−1) − 2p(x) + p(x+1), have the variance 6σ² and vanish on even slopes; their median absolute value
/// passes over the edges. White and black pixels have lost their noise and are left out. Whole numbers |d| = v stand for v − ½ … v + ½.
pub(super) fn noise(view: &GreyView<'_>) -> f64 {
    let mut counts = [0_u32; 1024];
    for y in (0..view.size()[1]).step_by(2) {
        for w in view.row(y).windows(3).step_by(3).filter(|w| w.iter().all(|&p| p > 0 && p < 255)) {
            let second = i32::from(w[0]) - 2 * i32::from(w[1]) + i32::from(w[2]);
            counts[second.unsigned_abs() as usize] += 1;
        }
    }
    let half = 0.5 * f64::from(counts.iter().sum::<u32>());
    let mut below = 0.0;
    for (value, &count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
        let here = f64::from(count);
        if below + here >= half {
            let (from, wide) = if value == 0 { (0.0, 0.5) } else { (value as f64 - 0.5, 1.0) };
            return ((from + wide * (half - below) / here) / (MEDIAN * 6.0_f64.sqrt())).max(ROUNDING);
        }
        below += here;
    }
    ROUNDING
}

#[cfg(test)]
mod tests {
    use super::super::tests::scene::Random;
    use super::*;

    #[test]
    fn smoothing_keeps_slopes_and_takes_noise_away() {
        let mut random = Random::seeded(1);
        let level = |i: usize| 40.0 + 0.5 * (i % 200) as f64;
        let pixels: Vec<u8> =
            (0..200 * 160).map(|i| (level(i) + 2.0 * random.normal()).round() as u8).collect();
        let view = GreyView::new(200, 160, 200, &pixels).expect("a picture");
        // The median of 5,280 differences is known to 1.6 %.
        assert!((noise(&view) / (4.0_f64 + 1.0 / 12.0).sqrt() - 1.0).abs() < 0.06, "{}", noise(&view));
        let smooth = Smooth::of(&view, 1.5);
        let errors: Vec<f64> = (20..140)
            .flat_map(|y| (20..180).map(move |x| (x, y)))
            .map(|(x, y)| smooth.at(x, y) - level(x))
            .collect();
        let count = errors.len() as f64;
        let variance = errors.iter().map(|e| e * e).sum::<f64>() / count;
        // A Gaussian of standard deviation s leaves 1/(4πs²) of the variance.
        let expected = (4.0 + 1.0 / 12.0) / (4.0 * std::f64::consts::PI * 1.5 * 1.5);
        assert!((variance / expected - 1.0).abs() < 0.1, "{variance} {expected}");
        let between = smooth.between(50.25, 70.5).expect("inside");
        assert!((between - 65.125).abs() < 2.0 && smooth.between(199.2, 70.0).is_none());
    }
}
