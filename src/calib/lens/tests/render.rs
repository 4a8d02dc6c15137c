//! Pictures of boards by rays: 16 of them a pixel through the lens, a Gaussian blur between them, then the mean over each pixel, uneven
//! light, noise and rounding. A blur of whole pixels would be none of a lens: edges would be off by up to 0.02 px, by their place in a pixel.

use super::super::smooth::gaussian;
use super::super::{Board, BoardKind, Pose};
use super::scene::{Random, TRUTH};
use crate::geometry::{Mat3, Vec3};
use nalgebra::Vector2;
use std::sync::LazyLock;

/// Rays along the edge of a pixel.
const FINE: usize = 4;
/// Blur (px).
const BLUR_PX: f64 = 0.8;
/// Noise (grey levels).
const NOISE: f64 = 2.0;
/// Grey levels of black and of white in full light, and of what is behind the board.
const LEVELS: [f64; 3] = [35.0, 205.0, 80.0];

/// The camera of the tests, which takes pictures of boards.
#[derive(Default)]
pub(super) struct Studio {
    /// Darker dots on a lighter board.
    pub(super) dark_dots: bool,
}

/// All rays of the camera, row by row.
static RAYS: LazyLock<Vec<Vector2<f64>>> = LazyLock::new(|| {
    let [width, height] = TRUTH.size_px;
    let fine = |k: usize| (k as f64 + 0.5) / FINE as f64 - 0.5;
    (0..height * FINE)
        .flat_map(|j| (0..width * FINE).map(move |i| [fine(i), fine(j)]))
        .map(|pixel| TRUTH.undistort(pixel).expect("a mild lens"))
        .collect()
});

impl Studio {
    /// The picture of a board, or of none, as rows of grey levels.
    pub(super) fn picture(&self, board: Option<(&Board, &Pose)>, random: &mut Random) -> Vec<u8> {
        Self::expose(&self.light(board), random)
    }

    /// The light that falls on each pixel.
    pub(super) fn light(&self, board: Option<(&Board, &Pose)>) -> Vec<f64> {
        let [width, height] = TRUTH.size_px;
        let fine: Vec<f32> = RAYS
            .iter()
            .map(|ray| board.map_or(LEVELS[2], |(board, pose)| self.level(board, pose, ray)) as f32)
            .collect();
        let blurred = blurred(&fine, [width * FINE, height * FINE]);
        let mut light = vec![0.0; width * height];
        for (y, line) in blurred.chunks_exact(width * FINE).enumerate() {
            for (x, cells) in line.chunks_exact(FINE).enumerate() {
                let sum: f32 = cells.iter().sum();
                // The light falls from one corner to the other by two thirds.
                let place = 0.5 * (x as f64 / width as f64 + (y / FINE) as f64 / height as f64);
                light[(y / FINE) * width + x] += f64::from(sum) / (FINE * FINE) as f64 * (1.1 - 0.73 * place);
            }
        }
        light
    }

    /// Grey levels with noise.
    pub(super) fn expose(light: &[f64], random: &mut Random) -> Vec<u8> {
        light.iter().map(|level| (level + NOISE * random.normal()).round().clamp(0.0, 255.0) as u8).collect()
    }

    /// What a ray sees. Edges are as wide on the board as the rays' square cells are across them, so that their steps do not show.
    fn level(&self, board: &Board, pose: &Pose, ray: &Vector2<f64>) -> f64 {
        let ray = ray.push(1.0);
        let normal = pose.normal();
        let depth = normal.dot(&pose.shift_m) / normal.dot(&ray);
        let to_board = pose.rotation.transpose();
        let on_board: Vec3 = to_board * (ray * depth - pose.shift_m);
        let slide = (Mat3::identity() - ray * normal.transpose() / normal.dot(&ray)) * depth;
        let cell = (to_board * slide) / (TRUTH.focal_px[0] * FINE as f64);
        let wide = |x: f64, y: f64| {
            (x * cell[(0, 0)] + y * cell[(1, 0)]).abs() + (x * cell[(0, 1)] + y * cell[(1, 1)]).abs()
        };
        let grid = [on_board.x / board.pitch_m, on_board.y / board.pitch_m];
        let last = [board.columns as f64 - 1.0, board.rows as f64 - 1.0];
        let out = (0..2).map(|k| (-grid[k]).max(grid[k] - last[k])).fold(f64::MIN, f64::max);
        if out > 1.4 {
            return LEVELS[2];
        }
        let white = match board.kind {
            BoardKind::Checkerboard if out > 1.0 => 1.0,
            BoardKind::Checkerboard => {
                let side = |g: f64, wide: f64| {
                    let sign = if g.floor().rem_euclid(2.0) == 0.0 { 1.0 } else { -1.0 };
                    let edge = (g - g.round()).abs() * board.pitch_m;
                    sign * (2.0 * edge / wide).min(1.0)
                };
                0.5 + 0.5 * side(grid[0], wide(1.0, 0.0)) * side(grid[1], wide(0.0, 1.0))
            }
            BoardKind::Dots { radius_m } => {
                let nearest = [0, 1].map(|k: usize| grid[k].round().clamp(0.0, last[k]));
                let from = Vector2::from([0, 1].map(|k| (grid[k] - nearest[k]) * board.pitch_m));
                let distance = from.norm().max(1e-9);
                let wide = wide(from.x / distance, from.y / distance);
                let dot = (0.5 + (radius_m - distance) / wide).clamp(0.0, 1.0);
                if self.dark_dots { 1.0 - dot } else { dot }
            }
        };
        LEVELS[0] + (LEVELS[1] - LEVELS[0]) * white
    }
}

/// A picture of rays after the blur of the lens; beyond the border it goes on like the ray at the border.
fn blurred(fine: &[f32], [width, height]: [usize; 2]) -> Vec<f32> {
    let kernel: Vec<f32> = gaussian(BLUR_PX * FINE as f64).iter().map(|&k| k as f32).collect();
    let reach = kernel.len() / 2;
    let mut across = vec![0.0; fine.len()];
    for (from, to) in fine.chunks_exact(width).zip(across.chunks_exact_mut(width)) {
        let mut padded = vec![from[0]; reach];
        padded.extend_from_slice(from);
        padded.resize(width + 2 * reach, from[width - 1]);
        for (x, value) in to.iter_mut().enumerate() {
            *value = kernel.iter().zip(&padded[x..]).map(|(k, p)| k * p).sum();
        }
    }
    let mut down = vec![0.0; fine.len()];
    for (y, to) in down.chunks_exact_mut(width).enumerate() {
        for (k, weight) in kernel.iter().enumerate() {
            let from = (y + k).saturating_sub(reach).min(height - 1);
            for (value, a) in to.iter_mut().zip(&across[from * width..]) {
                *value += weight * a;
            }
        }
    }
    down
}
