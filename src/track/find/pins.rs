//! White pins on black skin, between lamps, reflections of lamps and dirt: photographs of an optical tactile sensor, as they are and at other
//! scales, cuts, turns, exposures, sharpness and noise. Nothing is told to the finder but the picture.
//!
//! Where the pins are tells their colour, which the finder does not see: pins are blue, lamps and their reflections are white or yellow.

use super::pictures::{dots, pictures};
use crate::track::tests::random::Noise;
use image::imageops::{self, FilterType};
use image::{Rgb, RgbImage};

/// A picture and the pins in it.
struct Pinned {
    picture: RgbImage,
    pins: Vec<[f64; 2]>,
    /// Usual distance of a pin to the nearest other one (px).
    spacing: f64,
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Distance of each point to the nearest other one.
fn spacings(points: &[[f64; 2]]) -> Vec<f64> {
    let others = |i: usize| points.iter().enumerate().filter(move |(j, _)| *j != i).map(|(_, p)| *p);
    let nearest =
        |(i, p): (usize, &[f64; 2])| others(i).map(|o| distance(*p, o)).fold(f64::INFINITY, f64::min);
    points.iter().enumerate().map(nearest).collect()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Smoothing of blue (px), over which a peak is the highest, and the least height of a pin's over the usual.
const SMOOTH: f32 = 2.5;
const REACH: i32 = 5;
const HEIGHT: f64 = 0.65;

impl Pinned {
    /// Peaks of what is more blue than red, as high as most and with another one near: the rim of the skin has a blue fringe in one place.
    fn of(picture: RgbImage) -> Self {
        let blue = image::GrayImage::from_fn(picture.width(), picture.height(), |x, y| {
            let Rgb([red, _, blue]) = *picture.get_pixel(x, y);
            image::Luma([blue.saturating_sub(red)])
        });
        let smooth = imageops::blur(&blue, SMOOTH);
        let (width, height) = (picture.width() as i32, picture.height() as i32);
        let at = |x: i32, y: i32| f64::from(smooth.get_pixel(x as u32, y as u32)[0]);
        let mut peaks = Vec::new();
        for y in REACH..height - REACH {
            for x in REACH..width - REACH {
                let around = (-REACH..=REACH).flat_map(|j| (-REACH..=REACH).map(move |i| (i, j)));
                let here = at(x, y);
                // Of two that are as high as one another, the later one.
                let highest = here > 0.0
                    && around
                        .filter(|(i, j)| i * i + j * j <= REACH * REACH + REACH && (*i, *j) != (0, 0))
                        .all(|(i, j)| {
                            let other = at(x + i, y + j);
                            other < here || (other == here && (j, i) < (0, 0))
                        });
                if highest {
                    peaks.push(([f64::from(x), f64::from(y)], here));
                }
            }
        }
        let most = peaks.iter().map(|p| p.1).fold(0.0, f64::max);
        let usual = median(peaks.iter().map(|p| p.1).filter(|h| *h > 0.3 * most).collect());
        let mut pins: Vec<[f64; 2]> = peaks.iter().filter(|p| p.1 > HEIGHT * usual).map(|p| p.0).collect();
        let alone = spacings(&pins);
        let spacing = median(alone.clone());
        let mut near = alone.iter().map(|s| *s < 1.5 * spacing);
        pins.retain(|_| near.next().expect("as many"));
        Self { picture, pins, spacing }
    }

    fn with(&self, picture: RgbImage, to: impl Fn([f64; 2]) -> [f64; 2], scale: f64) -> Self {
        Self { picture, pins: self.pins.iter().map(|p| to(*p)).collect(), spacing: self.spacing * scale }
    }

    fn scaled(&self, scale: f64) -> Self {
        let size = |n: u32| (f64::from(n) * scale).round() as u32;
        let (width, height) = (size(self.picture.width()), size(self.picture.height()));
        let filter = if scale < 1.0 { FilterType::Lanczos3 } else { FilterType::CatmullRom };
        let picture = imageops::resize(&self.picture, width, height, filter);
        self.with(picture, |p| p.map(|x| (x + 0.5) * scale - 0.5), scale)
    }

    fn cut(&self, [x, y, width, height]: [u32; 4]) -> Self {
        let picture = imageops::crop_imm(&self.picture, x, y, width, height).to_image();
        self.with(picture, |p| [p[0] - f64::from(x), p[1] - f64::from(y)], 1.0)
    }

    /// Turned about the middle of the picture; black where nothing was.
    fn turned(&self, degrees: f64) -> Self {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let (width, height) = (self.picture.width(), self.picture.height());
        let middle = [0.5 * f64::from(width - 1), 0.5 * f64::from(height - 1)];
        let about = |p: [f64; 2], sin: f64| {
            let [x, y] = [p[0] - middle[0], p[1] - middle[1]];
            [middle[0] + cos * x - sin * y, middle[1] + sin * x + cos * y]
        };
        let picture = RgbImage::from_fn(width, height, |x, y| {
            let [x, y] = about([f64::from(x), f64::from(y)], -sin).map(|x| x as f32);
            imageops::interpolate_bilinear(&self.picture, x, y).unwrap_or(Rgb([0; 3]))
        });
        self.with(picture, |p| about(p, sin), 1.0)
    }

    fn toned(&self, mut tone: impl FnMut(f64) -> f64) -> Self {
        let mut picture = self.picture.clone();
        picture.iter_mut().for_each(|level| *level = tone(f64::from(*level)).round().clamp(0.0, 255.0) as u8);
        self.with(picture, |p| p, 1.0)
    }

    /// Pins, how many of them are missed, and how many dots are none. What the border cuts or nearly does counts for neither.
    fn found(&self) -> [usize; 3] {
        let size = [self.picture.width(), self.picture.height()].map(f64::from);
        let margin = 0.6 * self.spacing;
        let inside = |p: [f64; 2]| (0..2).all(|k| p[k] > margin && p[k] < size[k] - 1.0 - margin);
        let mut free: Vec<[f64; 2]> = dots(&self.picture).iter().map(|d| d.centre_px).collect();
        let [mut expected, mut missed] = [0, 0];
        for pin in &self.pins {
            let nearest =
                (0..free.len()).min_by(|a, b| distance(free[*a], *pin).total_cmp(&distance(free[*b], *pin)));
            let seen = nearest
                .filter(|i| distance(free[*i], *pin) < 0.35 * self.spacing)
                .map(|i| free.swap_remove(i));
            if inside(*pin) {
                expected += 1;
                missed += usize::from(seen.is_none());
            }
        }
        [expected, missed, free.into_iter().filter(|p| inside(*p)).count()]
    }
}

fn check(name: &str, views: &[(String, Pinned)]) {
    let mut sum = [0; 3];
    for (view, pinned) in views {
        let found = pinned.found();
        println!("{name} {view}: {} pins, {} missed, {} others", found[0], found[1], found[2]);
        (0..3).for_each(|k| sum[k] += found[k]);
        assert!(found[0] > 50 && 50 * found[1] <= found[0].max(100), "{view}");
    }
    let [pins, missed, others] = sum;
    println!("{name}: {pins} pins, {missed} missed, {others} others");
    assert!(50 * missed <= pins && 100 * others <= pins, "{name}: {sum:?}");
}

#[test]
fn pins_of_a_tactile_sensor_are_found_however_they_are_seen() {
    for (number, path) in pictures("tactip", "image").iter().enumerate() {
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        let given = Pinned::of(image::open(path).expect("a picture").to_rgb8());
        // Counted on the pictures: the colour finds all of them, and in every picture.
        assert_eq!(given.pins.len(), 331, "{name}");
        check(&name, &[("as it is".to_owned(), given.with(given.picture.clone(), |p| p, 1.0))]);
        if number % 3 > 0 {
            continue;
        }
        let scales = [0.5, 0.7, 1.4, 2.0].map(|s| (format!("{s} times as large"), given.scaled(s)));
        check(&name, &scales);
        let cuts = [[150, 90, 300, 310], [300, 240, 340, 240], [0, 0, 330, 260], [220, 150, 180, 180]];
        check(&name, &cuts.map(|c| (format!("cut to {c:?}"), given.cut(c))));
        let turns = [30.0, 90.0, 137.0].map(|t| (format!("turned by {t}°"), given.turned(t)));
        check(&name, &turns);
        let gammas = [0.5, 0.7, 1.5, 2.2];
        let gammas = gammas.map(|g| (format!("gamma {g}"), given.toned(|v| 255.0 * (v / 255.0).powf(g))));
        check(&name, &gammas);
        let exposures = [0.12, 0.3, 0.6, 1.6, 2.5];
        check(&name, &exposures.map(|e| (format!("exposed by {e}"), given.toned(|v| e * v))));
        let blurs = [0.7_f32, 1.2, 1.8];
        let blurred = |b: f32| given.with(imageops::blur(&given.picture, b), |p| p, 1.0);
        check(&name, &blurs.map(|b| (format!("blurred by {b} px"), blurred(b))));
        let mut random = Noise::seeded(number as u64);
        let noises = [3.0, 8.0, 15.0];
        check(&name, &noises.map(|n| (format!("noise of {n}"), given.toned(|v| v + n * random.normal()))));
    }
}
