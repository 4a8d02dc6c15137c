//! What the grey sensor makes of the light: blur, vignetting, exposure, noise and eight bits.

use super::error::{PixelError, within};
use super::noise::Normal;
use super::raster::Picture;
use super::spread::{Spread, WIDEST_PX};
use rand_chacha::ChaCha8Rng;

/// A grey sensor behind its lens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensor {
    /// Exposure and gain: grey levels for radiance 1.
    pub grey_per_radiance: f64,
    /// Grey level without light.
    pub black_grey: f64,
    /// Standard deviation of the lens's blur (px); 0 for none. The pixels' own extent comes on top.
    pub blur_px: f64,
    /// Share of the light that the corners of the picture lose; towards the middle it falls off as the square of the distance.
    pub falloff: f64,
    /// Standard deviation of what reading adds (grey levels).
    pub read_grey: f64,
    /// Variance of the shot noise for each grey level above black (grey levels).
    pub shot_grey: f64,
}

impl Default for Sensor {
    /// An industrial camera whose white dots are just short of saturation under [`super::Lighting::default`].
    fn default() -> Self {
        Self {
            grey_per_radiance: 300.0,
            black_grey: 4.0,
            blur_px: 0.75,
            falloff: 0.18,
            read_grey: 0.8,
            shot_grey: 0.025,
        }
    }
}

impl Sensor {
    /// The same without blur, vignetting and noise.
    #[must_use]
    pub fn perfect(self) -> Self {
        Self { blur_px: 0.0, falloff: 0.0, read_grey: 0.0, shot_grey: 0.0, ..self }
    }

    pub(super) fn check(&self) -> Result<(), PixelError> {
        within("the exposure (grey levels)", self.grey_per_radiance, 0.0, 1e6, "0 or more")?;
        within("the black level (grey levels)", self.black_grey, 0.0, 255.0, "0 to 255")?;
        within("the blur (px)", self.blur_px, 0.0, WIDEST_PX, "0 to 5 px")?;
        within("the falloff", self.falloff, 0.0, 1.0, "0 to 1")?;
        within("the read noise (grey levels)", self.read_grey, 0.0, 255.0, "0 to 255")?;
        within("the shot noise (grey levels)", self.shot_grey, 0.0, 255.0, "0 to 255")
    }

    /// Develops a picture: grey levels as the lens delivers them, row by row, are handed to `row` with their number, and noise and
    /// rounding make `grey` of them.
    pub(super) fn develop(
        &self,
        picture: &Picture,
        spread: &Spread,
        middle_px: [f64; 2],
        (normal, rng): (&mut Normal, &mut ChaCha8Rng),
        grey: &mut [u8],
        mut row: impl FnMut(usize, &[f32]),
    ) {
        let width = picture.width;
        let mut blur = Blur::new(spread, width);
        let corner = 0.25 * ((width * width + picture.height * picture.height) as f64);
        let falloff = (self.falloff / corner) as f32;
        let (gain, black) = (self.grey_per_radiance as f32, self.black_grey as f32);
        let (read, shot) = ((self.read_grey * self.read_grey) as f32, self.shot_grey as f32);
        let noisy = read > 0.0 || shot > 0.0;
        let across: Vec<f32> = (0..width).map(|c| (c as f64 - middle_px[0]).powi(2) as f32).collect();
        let (mut light, mut noise) = (vec![0.0; width], vec![0.0; width]);
        for (number, grey) in grey.chunks_exact_mut(width).enumerate() {
            blur.row(picture, number, &mut light);
            let fringe = &picture.fringe[number * width..(number + 1) * width];
            let down = (number as f64 - middle_px[1]).powi(2) as f32;
            for ((light, fringe), across) in light.iter_mut().zip(fringe).zip(&across) {
                *light = black + gain * (*light + fringe) * (1.0 - falloff * (across + down));
            }
            row(number, &light);
            if noisy {
                normal.fill(rng, &mut noise);
                for (light, noise) in light.iter_mut().zip(&noise) {
                    *light += noise * (read + shot * (*light - black).max(0.0)).sqrt();
                }
            }
            for (grey, light) in grey.iter_mut().zip(&light) {
                // Beyond 2²³ single precision holds whole numbers only: the sum is rounded, its last byte the grey level.
                *grey = (light.clamp(0.0, 255.0) + 8_388_608.0).to_bits() as u8;
            }
        }
    }
}

/// A blur that goes down a picture.
struct Blur<'a> {
    spread: &'a Spread,
    /// Rows that have been blurred along their length, each at its number modulo their count.
    rows: Vec<Vec<f32>>,
    /// Number of the next row to come.
    next: usize,
    padded: Vec<f32>,
}

impl<'a> Blur<'a> {
    fn new(spread: &'a Spread, width: usize) -> Self {
        let reach = spread.reach();
        let rows = vec![vec![0.0; width]; 2 * reach + 1];
        Self { spread, rows, next: 0, padded: vec![0.0; width + 2 * reach] }
    }

    /// Row `number` of the blurred picture; numbers ascend from 0. Beyond its border the picture goes on as it ends there.
    fn row(&mut self, picture: &Picture, number: usize, out: &mut [f32]) {
        let (kernel, width, last) = (self.spread.even(), picture.width, picture.height - 1);
        let reach = kernel.len() - 1;
        while self.next <= (number + reach).min(last) {
            let source = &picture.radiance[self.next * width..(self.next + 1) * width];
            let count = self.rows.len();
            let target = &mut self.rows[self.next % count];
            if reach == 0 {
                target.copy_from_slice(source);
            } else {
                self.padded[..reach].fill(source[0]);
                self.padded[reach..reach + width].copy_from_slice(source);
                self.padded[reach + width..].fill(source[width - 1]);
                combine(kernel, target, |k| (&self.padded[reach - k..], &self.padded[reach + k..]));
            }
            self.next += 1;
        }
        let at = |row: usize| &self.rows[row.min(last) % self.rows.len()][..];
        combine(kernel, out, |k| (at(number.saturating_sub(k)), at(number + k)));
    }
}

/// Weighted sum of pairs of rows, from the middle outwards.
fn combine<'a>(kernel: &[f32], out: &mut [f32], pair: impl Fn(usize) -> (&'a [f32], &'a [f32])) {
    for (out, middle) in out.iter_mut().zip(pair(0).0) {
        *out = kernel[0] * middle;
    }
    for (k, weight) in kernel.iter().enumerate().skip(1) {
        let (one, other) = pair(k);
        for (out, (a, b)) in out.iter_mut().zip(one.iter().zip(other)) {
            *out += weight * (a + b);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::noise::{Use, stream};
    use super::*;

    fn even(radiance: f32, width: usize, height: usize) -> Picture {
        let mut picture = Picture::default();
        picture.clear(width, height);
        picture.radiance.fill(radiance);
        picture
    }

    fn developed(sensor: &Sensor, picture: &Picture) -> Vec<u8> {
        let mut grey = vec![0; picture.width * picture.height];
        let middle = [0.5 * (picture.width as f64 - 1.0), 0.5 * (picture.height as f64 - 1.0)];
        sensor.develop(
            picture,
            &Spread::new(sensor.blur_px),
            middle,
            (&mut Normal::new(), &mut stream(3, 0, Use::Sensor)),
            &mut grey,
            |_, _| {},
        );
        grey
    }

    /// Variance read² + shot · g + 1/12 of rounding; over 250,000 pixels its estimate has a standard deviation of 0.3 %.
    #[test]
    fn noise_has_the_variance_that_was_asked_for() {
        for (radiance, read, shot) in [(0.4, 2.0, 0.0), (0.6, 1.0, 0.05), (0.2, 0.0, 0.1)] {
            let sensor = Sensor { read_grey: read, shot_grey: shot, ..Sensor::default().perfect() };
            let grey = developed(&sensor, &even(radiance, 500, 500));
            let n = grey.len() as f64;
            let mean = grey.iter().map(|&g| f64::from(g)).sum::<f64>() / n;
            let variance = grey.iter().map(|&g| (f64::from(g) - mean).powi(2)).sum::<f64>() / n;
            let level = f64::from(radiance) * sensor.grey_per_radiance;
            let expected = read * read + shot * level + 1.0 / 12.0;
            assert!((mean - level - sensor.black_grey).abs() < 4.0 * (expected / n).sqrt(), "{mean}");
            assert!((variance / expected - 1.0).abs() < 0.015, "{variance} for {expected}");
        }
    }

    /// The picture of an evenly bright pixel: its light is kept and its variance is σ² along both axes, and 1/12 from the pixel that
    /// shines and 1/12 from those that receive.
    #[test]
    fn blur_keeps_the_light_and_has_its_width() {
        let mut picture = even(0.0, 41, 41);
        picture.radiance[20 * 41 + 20] = 1.0;
        let spread = Spread::new(1.2);
        let mut blur = Blur::new(&spread, 41);
        let (mut sum, mut second, mut row) = (0.0, [0.0; 2], vec![0.0; 41]);
        for v in 0..41 {
            blur.row(&picture, v, &mut row);
            for (u, &light) in row.iter().enumerate() {
                sum += f64::from(light);
                second[0] += f64::from(light) * (u as f64 - 20.0).powi(2);
                second[1] += f64::from(light) * (v as f64 - 20.0).powi(2);
            }
        }
        assert!((sum - 1.0).abs() < 1e-5);
        // Cutting it off behind 4 σ takes some thousandths of the variance.
        assert!(second.iter().all(|s| (s / (1.44 + 1.0 / 6.0) - 1.0).abs() < 0.005), "{second:?}");
    }

    #[test]
    fn corners_lose_their_share_and_bright_is_at_most_white() {
        let sensor = Sensor { falloff: 0.2, black_grey: 0.0, ..Sensor::default().perfect() };
        let grey = developed(&sensor, &even(100.0 / 300.0, 201, 151));
        assert_eq!((grey[75 * 201 + 100], grey[0]), (100, 80));
        let white = developed(&sensor, &even(3.0, 16, 16));
        assert!(white.iter().all(|&g| g == 255));
    }
}
