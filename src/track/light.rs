//! Light that changes on a dot: the edge of a shadow, a glint that wanders.
//!
//! A disc of even brightness is fitted to a dot. Where the light falls off across it the fitted centre is too far on the bright side, by
//! up to a tenth of a pixel. As long as the light stays as it is that does not matter, for it is in the dot's place at rest as well; so each
//! dot's usual shift is kept, and only a change that cannot be noise is taken off: freeing the light in every frame would make every centre
//! noisier by half.

use super::Dot;
use nalgebra::Vector2;

/// A change of the shift whose square is this many times its variance is none of noise: 1 of 3000 (χ² with two degrees of freedom).
const CHANGED: f64 = 16.0;
/// Share of a frame in what is usual.
const SHARE: f64 = 0.05;

/// What shifts the centres of all dots usually have.
#[derive(Debug, Clone)]
pub(super) struct UsualLight {
    /// For each dot of the reference, once it was seen (px).
    shift_px: Vec<Option<Vector2<f64>>>,
}

impl UsualLight {
    pub(super) fn new(dots: usize) -> Self {
        Self { shift_px: vec![None; dots] }
    }

    /// Dot `number` as it would be in its usual light.
    pub(super) fn corrected(&mut self, number: usize, dot: Dot) -> Dot {
        let Some(light) = dot.light else { return dot };
        let shift = Vector2::from(light.shift_px);
        let usual = self.shift_px[number].get_or_insert(shift);
        let change = shift - *usual;
        let Some(weight) = light.covariance_px2.try_inverse() else { return dot };
        if change.dot(&(weight * change)) <= CHANGED {
            *usual += change * SHARE;
            return dot;
        }
        let [x, y] = dot.centre_px;
        Dot {
            centre_px: [x + change.x, y + change.y],
            covariance_px2: dot.covariance_px2 + light.covariance_px2,
            ..dot
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::tests::random::Noise;
    use crate::track::tests::render::{Brush, Canvas, ellipse};
    use crate::track::{DotSettings, Finder, GreyView};

    const SIZE: [usize; 2] = [640, 200];
    const CENTRES: usize = 24;

    fn centre(i: usize, random: &mut Noise) -> [f64; 2] {
        let place = |k: usize| 40.0 + 50.0 * k as f64;
        [place(i % 12) + random.uniform(), place(i / 12) + random.uniform()]
    }

    /// Dots in even light, or in light that falls by `slope` of itself from pixel to pixel at each dot; pairs of what was found and what is true.
    fn dots(seed: u64, slope: f64) -> Vec<(Dot, [f64; 2])> {
        let mut random = Noise::seeded(seed);
        let mut canvas = Canvas::new(SIZE[0], SIZE[1], |_, _| 20.0);
        let centres: Vec<_> = (0..CENTRES).map(|i| centre(i, &mut random)).collect();
        let brush = Brush::new(0.8);
        for at in &centres {
            canvas.add(&ellipse(*at, [4.5, 4.2], 0.3), &brush, 140.0);
        }
        for (i, level) in canvas.light.iter_mut().enumerate() {
            let at = [(i % SIZE[0]) as f64, (i / SIZE[0]) as f64];
            let far = |c: &[f64; 2]| (c[0] - at[0]).hypot(c[1] - at[1]);
            if let Some(near) = centres.iter().find(|c| far(c) < 12.0) {
                *level *= 1.0 - slope * (at[0] - near[0]);
            }
        }
        let pixels = canvas.expose(1.0, &mut random);
        let view = GreyView::new(SIZE[0], SIZE[1], SIZE[0], &pixels).expect("a picture");
        let found = Finder::default().find(&view, &DotSettings::default()).dots;
        let near = |at: &[f64; 2]| {
            let off = |d: &&Dot| (d.centre_px[0] - at[0]).hypot(d.centre_px[1] - at[1]);
            *found.iter().find(|d| off(d) < 2.0).expect("every dot is found")
        };
        centres.iter().map(|at| (near(at), *at)).collect()
    }

    fn error_px(pair: &(Dot, [f64; 2])) -> Vector2<f64> {
        Vector2::from(pair.0.centre_px) - Vector2::from(pair.1)
    }

    /// Shifts of dots in even light are noise of the size that they state.
    #[test]
    fn even_light_shifts_no_more_than_is_stated() {
        let (mut squares, mut count) = (0.0, 0.0);
        for seed in 0..20 {
            for (dot, _) in dots(seed, 0.0) {
                let light = dot.light.expect("a disc fits");
                let (shift, weight) = (Vector2::from(light.shift_px), light.covariance_px2.try_inverse());
                squares += shift.dot(&(weight.expect("a covariance") * shift));
                count += 2.0;
            }
        }
        // 960 numbers: standard deviation of the mean 0.046. Rounding to whole levels adds to the noise of 1.
        let mean = squares / count;
        assert!((0.8..1.2).contains(&mean), "{mean}");
    }

    #[test]
    fn a_change_of_light_moves_no_dot_and_noise_no_light() {
        let mut light = UsualLight::new(CENTRES);
        let [mut even, mut changed, mut raw] = [0.0; 3];
        for seed in 0..10 {
            for (i, pair) in dots(seed, 0.0).into_iter().enumerate() {
                let kept = light.corrected(i, pair.0);
                even += error_px(&(kept, pair.1)).norm_squared();
                // 1 of 3000 may be taken for a change.
                assert!(kept == pair.0 || seed > 0, "the first frame is usual");
            }
        }
        for (i, pair) in dots(99, 0.04).into_iter().enumerate() {
            raw += error_px(&pair).norm_squared();
            let kept = light.corrected(i, pair.0);
            assert!(kept != pair.0, "4 % a pixel is no noise");
            changed += error_px(&(kept, pair.1)).norm_squared();
        }
        let [even, changed, raw] = [(even, 10.0), (changed, 1.0), (raw, 1.0)]
            .map(|(sum, frames)| f64::sqrt(sum / (2.0 * frames * CENTRES as f64)));
        println!("even light {even:.4} px; sloping by 4 % a pixel: {raw:.4} px, corrected {changed:.4} px");
        assert!(raw > 0.05 && changed < 2.5 * even, "{even} {raw} {changed}");
    }
}
