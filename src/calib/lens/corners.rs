//! Where four squares of a checkerboard meet in a grey picture.
//!
//! Such a corner is a saddle of grey levels. In a picture smoothed with a Gaussian the determinant of the Hessian is strongly negative there
//! and nearly nothing along edges and in squares. For squares that differ by A and a total blur σ it is −(A/(πσ²))² at the corner, which
//! gives a threshold in terms of the noise: light may be uneven as long as each corner stands out by itself. Around a corner the levels
//! then have to change four times and look the same from the opposite side, which the outer corners of a board and writing do not.
//!
//! Squares must be wider than 12 px, and corners nearer than 5 px to the border of the picture are not found.

use super::crossing::{Corner, Crossing, corner};
use super::smooth::{Smooth, noise};
use crate::track::GreyView;
use nalgebra::Vector2;

/// Smoothing before second derivatives are taken (px).
const SMOOTHING_PX: f64 = 1.5;
/// Blur that a sharp picture has of itself, with that of the pixel (px).
const OWN_BLUR_PX: f64 = 0.8;
/// Least difference of the squares, in standard deviations of the noise.
const LEAST_CONTRAST: f64 = 8.0;
/// The strongest saddle within so many pixels each way is the corner (px).
const APART: usize = 4;
/// Radius of the circle on which the four squares are looked at (px), and places on it.
const RING_PX: f64 = 4.5;
const RING: usize = 32;
/// Most difference between opposite places, over the difference of the squares.
const LEAST_ALIKE: f64 = 0.4;
/// Window of the exact place: as a share of the distance to the next corner, and its bounds (px).
const WINDOW: f64 = 0.4;
const WINDOW_PX: [f64; 2] = [4.5, 8.0];
/// More corners than that are a texture.
const MOST: usize = 4000;

/// All corners of squares.
pub(super) fn corners(view: &GreyView<'_>) -> Vec<Corner> {
    let noise = noise(view);
    let smooth = Smooth::of(view, SMOOTHING_PX);
    let least = LEAST_CONTRAST * noise;
    let mut rough: Vec<Corner> = Vec::new();
    for start in saddles(&smooth, least) {
        let Some(found) = corner(view, &start, WINDOW_PX[0], noise) else { continue };
        let known = rough.iter().any(|other| (other.at - found.at).norm() < 0.5 * APART as f64);
        if !known && four_squares(&smooth, found.at, least) {
            rough.push(found);
        }
    }
    let window = |here: &Corner| {
        let others = rough.iter().map(|other| (other.at - here.at).norm()).filter(|&d| d > 0.0);
        (WINDOW * others.fold(f64::INFINITY, f64::min)).clamp(WINDOW_PX[0], WINDOW_PX[1])
    };
    rough.iter().map(|here| corner(view, &here.crossing, window(here), noise).unwrap_or(*here)).collect()
}

/// Crossings at the pixels where the determinant of the Hessian is most negative, the strongest first.
fn saddles(smooth: &Smooth, least_contrast: f64) -> Vec<Crossing> {
    let [width, height] = smooth.size;
    if width < 3 || height < 3 {
        return Vec::new();
    }
    let strength_of = |[xx, xy, yy]: [f64; 3]| xy * xy - xx * yy;
    let mut strength = vec![0.0; width * height];
    for y in 1..height - 1 {
        for x in 1..width - 1 {
            strength[y * width + x] = strength_of(hessian(smooth, x, y));
        }
    }
    let blur = SMOOTHING_PX.hypot(OWN_BLUR_PX);
    let least = (least_contrast / (std::f64::consts::PI * blur * blur)).powi(2);
    let strongest = |x: usize, y: usize| {
        let here = strength[y * width + x];
        (y.saturating_sub(APART)..(y + APART + 1).min(height)).all(|j| {
            let row = &strength[j * width..][x.saturating_sub(APART)..(x + APART + 1).min(width)];
            row.iter().all(|&other| other <= here)
        })
    };
    let mut found: Vec<(f64, [usize; 2])> = Vec::new();
    for (k, &here) in strength.iter().enumerate().filter(|(_, here)| **here >= least) {
        if strongest(k % width, k / width) {
            found.push((here, [k % width, k / width]));
        }
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.truncate(MOST);
    let crossing = |(_, [x, y]): (f64, [usize; 2])| {
        let at = Vector2::new(x as f64, y as f64);
        Crossing::at_saddle(at, smooth.at(x, y), hessian(smooth, x, y), blur)
    };
    found.into_iter().filter_map(crossing).collect()
}

/// Second derivatives xx, xy and yy at a pixel that is not at the border.
fn hessian(smooth: &Smooth, x: usize, y: usize) -> [f64; 3] {
    let twice = 2.0 * smooth.at(x, y);
    let xx = smooth.at(x - 1, y) - twice + smooth.at(x + 1, y);
    let yy = smooth.at(x, y - 1) - twice + smooth.at(x, y + 1);
    let diagonal = smooth.at(x + 1, y + 1) + smooth.at(x - 1, y - 1);
    let other = smooth.at(x - 1, y + 1) + smooth.at(x + 1, y - 1);
    [xx, 0.25 * (diagonal - other), yy]
}

/// Whether a circle about a place crosses four squares, opposite ones alike and neighbouring ones different.
fn four_squares(smooth: &Smooth, at: Vector2<f64>, least_contrast: f64) -> bool {
    let mut ring = [0.0; RING];
    for (k, level) in ring.iter_mut().enumerate() {
        let (sin, cos) = (std::f64::consts::TAU * k as f64 / RING as f64).sin_cos();
        let Some(here) = smooth.between(at.x + RING_PX * cos, at.y + RING_PX * sin) else { return false };
        *level = here;
    }
    let (low, high) = ring.iter().fold((f64::MAX, f64::MIN), |(low, high), &l| (low.min(l), high.max(l)));
    let (middle, contrast) = (0.5 * (low + high), high - low);
    let changes = (0..RING).filter(|&k| (ring[k] > middle) != (ring[(k + 1) % RING] > middle)).count();
    let alike = (0..RING / 2).all(|k| (ring[k] - ring[k + RING / 2]).abs() < LEAST_ALIKE * contrast);
    contrast >= least_contrast && changes == 4 && alike
}
