//! Light that changes on a dot: the edge of a shadow, a glint that wanders.
//!
//! A disc of even brightness is fitted to a dot. Where the light falls off across it the fitted centre is too far on the bright side, by
//! up to a tenth of a pixel. As long as the light stays as it is that does not matter, for it is in the dot's place at rest as well; so only
//! a change of each dot's shift is taken off, and only one that is no noise: freeing the light in every frame would make every centre
//! noisier by half.

use super::Dot;
use super::slow::Slow;
use nalgebra::Vector2;

/// The light on one dot.
#[derive(Debug, Clone)]
pub(super) struct LightOnDot(Slow<2>);

impl LightOnDot {
    pub(super) fn new() -> Self {
        Self(Slow::new())
    }

    /// The dot as it would be in its usual light.
    pub(super) fn corrected(&mut self, dot: Dot) -> Dot {
        let Some(light) = dot.light else { return dot };
        let change = self.0.change(Vector2::from(light.shift_px), &light.covariance_px2);
        let Some((change, weight)) = change else { return dot };
        let [x, y] = dot.centre_px;
        Dot {
            centre_px: [x + change.x, y + change.y],
            covariance_px2: dot.covariance_px2 + light.covariance_px2 * weight,
            ..dot
        }
    }

    /// The dot is not seen.
    pub(super) fn interrupt(&mut self) {
        self.0.interrupt();
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
        let mut lights: Vec<LightOnDot> = (0..CENTRES).map(|_| LightOnDot::new()).collect();
        let mut corrected = |dots: Vec<(Dot, [f64; 2])>| -> Vec<(Dot, [f64; 2])> {
            lights.iter_mut().zip(dots).map(|(light, (dot, at))| (light.corrected(dot), at)).collect()
        };
        let rms = |pairs: &[(Dot, [f64; 2])]| {
            let sum: f64 = pairs.iter().map(|pair| error_px(pair).norm_squared()).sum();
            (sum / (2 * pairs.len()) as f64).sqrt()
        };
        let mut even = Vec::new();
        let mut moved = 0;
        for seed in 0..30 {
            let raw = dots(seed, 0.0);
            let kept = corrected(raw.clone());
            moved += kept.iter().zip(&raw).filter(|(k, r)| k != r).count();
            even.extend(kept);
        }
        // 4 % a pixel is no noise in one frame, 1 % in some.
        let (mut strong, mut weak) = (Vec::new(), Vec::new());
        let raw = [dots(99, 0.04), dots(150, 0.01)].map(|d| rms(&d));
        (0..4).for_each(|seed| strong.extend(corrected(dots(100 + seed, 0.04))));
        (0..20).for_each(|seed| weak = corrected(dots(120 + seed, 0.01)));
        let [even, strong, weak] = [even, strong, weak].map(|pairs| rms(&pairs));
        println!(
            "even light {even:.4} px; sloping by 4 % and 1 % a pixel: {raw:.4?} px, corrected {strong:.4} and {weak:.4} px"
        );
        assert!(moved < 10, "{moved}");
        assert!(raw[0] > 0.05 && strong < 0.1 * raw[0], "{even} {raw:?} {strong}");
        assert!(raw[1] > 1.5 * even && weak < 1.3 * even, "{even} {raw:?} {weak}");
    }
}
