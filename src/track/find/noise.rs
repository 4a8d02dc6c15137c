//! How noisy a picture is, measured in the picture itself.
//!
//! Second differences along a row, p(x−1) − 2p(x) + p(x+1), vanish on an even slope and have the variance 6σ² of independent noise. Their
//! median absolute value ignores the edges of dots. Differences between two rows of even distance would see interlacing, these do not.

use crate::track::GreyView;

/// Standard deviation of rounding to whole grey levels (1/√12): less noise than this cannot be seen, nor excluded.
pub(super) const ROUNDING: f64 = 0.288_675_134_594_812_9;

/// About so many rows are looked at, over all of the picture.
const ROWS: usize = 64;

/// Median of |N(0, 1)|.
const MEDIAN: f64 = 0.674_489_750_196_081_7;

/// Standard deviation of the noise on dark background (grey levels).
///
/// The median of whole numbers is interpolated inside its bin, so that noise below one grey level is measured too. Saturated pixels
/// have no noise and are left out.
pub(super) fn noise(view: &GreyView<'_>) -> f64 {
    let [_, height] = view.size();
    let mut counts = [0_u32; 1024];
    for y in (0..height).step_by((height / ROWS).max(1)) {
        let row = view.row(y);
        for w in row.windows(3).step_by(3) {
            if w[1] > 0 && w[1] < 255 {
                let second = i32::from(w[0]) - 2 * i32::from(w[1]) + i32::from(w[2]);
                counts[second.unsigned_abs() as usize] += 1;
            }
        }
    }
    let total: u32 = counts.iter().sum();
    if total == 0 {
        return ROUNDING;
    }
    let half = 0.5 * f64::from(total);
    let mut below = 0.0;
    for (value, &count) in counts.iter().enumerate() {
        let here = f64::from(count);
        if below + here >= half && here > 0.0 {
            // |d| = v stands for v − ½ … v + ½, and 0 for 0 … ½.
            let (from, wide) = if value == 0 { (0.0, 0.5) } else { (value as f64 - 0.5, 1.0) };
            let median = from + wide * (half - below) / here;
            return (median / (MEDIAN * 6.0_f64.sqrt())).max(ROUNDING);
        }
        below += here;
    }
    ROUNDING
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::tests::random::Noise;

    #[test]
    fn white_noise_on_a_slope_is_measured() {
        for sigma in [0.5, 2.0, 5.0] {
            let mut random = Noise::seeded(3);
            let pixels: Vec<u8> = (0..640 * 480)
                .map(|i| {
                    let slope = 60.0 + 0.1 * f64::from(i % 640);
                    (slope + sigma * random.normal()).round().clamp(0.0, 255.0) as u8
                })
                .collect();
            let measured = noise(&GreyView::new(640, 480, 640, &pixels).expect("a picture"));
            let expected = (sigma * sigma + 1.0 / 12.0_f64).sqrt();
            // 14,700 differences: the median of |N| is known to about 1 %; rounding is not quite independent noise.
            assert!((measured / expected - 1.0).abs() < 0.06, "{measured} {expected}");
        }
    }

    #[test]
    fn a_constant_picture_has_the_noise_of_rounding() {
        assert_eq!(noise(&GreyView::new(64, 48, 64, &[7; 64 * 48]).expect("a picture")), ROUNDING);
        assert_eq!(noise(&GreyView::new(2, 2, 2, &[7; 4]).expect("a picture")), ROUNDING);
    }
}
