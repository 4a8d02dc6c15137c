//! The depth picture: distance along the optical axis at every pixel, with what structured light gets wrong.
//!
//! Registered to the grey picture pixel by pixel. A pixel is 0 where there is no depth.

use super::error::{PixelError, within};
use super::noise::Normal;
use super::raster::{GLARE, Picture, SHADOWED};
use crate::geometry::Vec3;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// How depth is measured. [`DepthSetup::exact`] has no faults; every fault is a figure of its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthSetup {
    /// Worth of one count (m).
    pub unit_m: f64,
    /// Where the projector stands in the camera frame (m); its direction in the picture is the baseline's.
    pub projector_m: Vec3,
    /// Whether what the tip hides from the projector is a hole.
    pub shadow: bool,
    /// Distance at which the next two are stated (m); both grow with the square of the distance.
    pub reference_m: f64,
    /// Standard deviation of the noise (m).
    pub noise_m: f64,
    /// Depth that one step of disparity is worth (m); 0 for none.
    pub step_m: f64,
    /// Share of the noise's variance that is the same in every frame.
    pub fixed_share: f64,
    /// Mirror images brighter than so many grey levels are holes.
    pub glare_grey: Option<f64>,
    /// Pixels darker than this grey level are holes.
    pub dark_grey: Option<f64>,
    /// Share of the saturated pixels that are holes.
    pub saturated_share: f64,
    /// A pixel whose depth differs by more than this (m) from that of a neighbour in row or column is a hole.
    pub jump_m: Option<f64>,
    /// Where the picture gets brighter by 100 grey levels a pixel towards the projector, depth reads so much too large (m), and too small
    /// where it gets darker: the two rims of a dot are pulled opposite ways.
    pub edge_bias_m: f64,
    /// Where brightness changes by 100 grey levels a pixel in any direction, depth reads so much too small (m).
    pub edge_pull_m: f64,
}

impl DepthSetup {
    /// Depth without faults, in steps of 0.1 mm.
    pub fn exact() -> Self {
        Self {
            unit_m: 1e-4,
            projector_m: Vec3::new(0.10, 0.0, 0.0),
            shadow: false,
            reference_m: 0.5,
            noise_m: 0.0,
            step_m: 0.0,
            fixed_share: 0.0,
            glare_grey: None,
            dark_grey: None,
            saturated_share: 0.0,
            jump_m: None,
            edge_bias_m: 0.0,
            edge_pull_m: 0.0,
        }
    }

    pub(super) fn check(&self) -> Result<(), PixelError> {
        within("the worth of a count of depth (m)", self.unit_m, 1e-7, 0.1, "0.1 µm to 0.1 m")?;
        within("the depth's reference distance (m)", self.reference_m, 1e-3, 1e3, "more than 0")?;
        for (what, value) in [
            ("the depth's noise (m)", self.noise_m),
            ("the depth's step (m)", self.step_m),
            ("the share of fixed noise", self.fixed_share),
            ("the share of holes in saturated pixels", self.saturated_share),
        ] {
            within(what, value, 0.0, 1.0, "0 to 1")?;
        }
        within("the bias at edges (m)", self.edge_bias_m, -0.1, 0.1, "at most 0.1 m")?;
        within("the pull at edges (m)", self.edge_pull_m, -0.1, 0.1, "at most 0.1 m")
    }
}

impl Default for DepthSetup {
    /// A short-range structured-light camera above a wet black gel.
    fn default() -> Self {
        Self {
            shadow: true,
            noise_m: 1.2e-4,
            step_m: 5e-5,
            fixed_share: 0.2,
            glare_grey: Some(60.0),
            dark_grey: Some(6.0),
            saturated_share: 0.5,
            jump_m: Some(0.004),
            edge_bias_m: 3e-4,
            edge_pull_m: 1e-4,
            ..Self::exact()
        }
    }
}

/// The randomness of one frame's depth.
pub(super) struct DepthNoise<'a> {
    pub(super) normal: &'a mut Normal,
    pub(super) fresh: ChaCha8Rng,
    /// What is the same in every frame, row by row, with variance one; may be empty where none is asked for.
    pub(super) fixed: &'a [f32],
    pub(super) holes: ChaCha8Rng,
}

/// The depth picture, every pixel of it. `grey`: grey levels before noise and rounding, row by row.
pub(super) fn measure(
    setup: &DepthSetup,
    picture: &Picture,
    grey: &[f32],
    noise: DepthNoise,
    counts: &mut [u16],
) {
    let (width, height) = (picture.width, picture.height);
    let mut errors = Errors::new(setup, width, noise);
    let mut rows = [vec![0.0; width], vec![0.0; width], vec![0.0; width]];
    distances(picture, 0, &mut rows[0]);
    distances(picture, 0, &mut rows[1]);
    for (row, counts) in counts.chunks_exact_mut(width).enumerate() {
        if row + 1 < height {
            distances(picture, row + 1, &mut rows[2]);
        } else {
            let [_, last, next] = &mut rows;
            next.copy_from_slice(last);
        }
        errors.measure(&rows[1], row, grey);
        let levels = &grey[row * width..(row + 1) * width];
        let marks = &picture.marks[row * width..(row + 1) * width];
        let seen = errors.row.iter().zip(levels).zip(marks);
        for (count, ((&measured, &level), &marks)) in counts.iter_mut().zip(seen) {
            // No number at all passes neither test.
            let valid =
                (0.5..65_535.5).contains(&measured) && level >= errors.dark && marks & errors.lost == 0;
            *count = if valid { rounded(measured) as u16 } else { 0 };
        }
        if setup.saturated_share > 0.0 {
            for (count, _) in counts.iter_mut().zip(levels).filter(|(_, level)| **level >= SATURATED) {
                if errors.noise.holes.random_bool(setup.saturated_share) {
                    *count = 0;
                }
            }
        }
        if let Some(jump) = setup.jump_m {
            cut_jumps(jump as f32, &rows, counts);
        }
        rows.rotate_left(1);
    }
}

/// Grey level that eight bits can't tell from white.
const SATURATED: f32 = 254.5;

/// Makes holes in the middle row where it is farther from a neighbour than `jump` (m).
fn cut_jumps(jump: f32, [above, here, below]: &[Vec<f32>; 3], counts: &mut [u16]) {
    // Nothing at all, at infinity, is beyond every jump.
    let cut = |z: f32, other: f32| (other - z).abs() > jump || other == 0.0;
    let beside = counts.iter_mut().zip(here).zip(above.iter().zip(below));
    for ((count, &z), (&above, &below)) in beside {
        *count = if cut(z, above) | cut(z, below) { 0 } else { *count };
    }
    for (column, pair) in here.windows(2).enumerate() {
        if cut(pair[0], pair[1]) | cut(pair[1], pair[0]) {
            counts[column..column + 2].fill(0);
        }
    }
}

fn distances(picture: &Picture, row: usize, out: &mut [f32]) {
    let nearness = &picture.nearness[row * picture.width..(row + 1) * picture.width];
    for (z, near) in out.iter_mut().zip(nearness) {
        *z = if *near > 0.0 { 1.0 / near } else { 0.0 };
    }
}

/// What is added to the true distance.
struct Errors<'a> {
    setup: &'a DepthSetup,
    noise: DepthNoise<'a>,
    /// What is measured in one row, in counts, not yet rounded.
    row: Vec<f32>,
    /// Noise of one row (of variance one).
    fresh: Vec<f32>,
    baseline: [f32; 2],
    /// Darkest level that is measured.
    dark: f32,
    /// Marks of pixels that are not.
    lost: u8,
}

impl<'a> Errors<'a> {
    fn new(setup: &'a DepthSetup, width: usize, noise: DepthNoise<'a>) -> Self {
        let length = setup.projector_m.x.hypot(setup.projector_m.y);
        let baseline = [setup.projector_m.x, setup.projector_m.y]
            .map(|b| if length > 0.0 { (b / length) as f32 } else { 0.0 });
        let (row, fresh) = (vec![0.0; width], vec![0.0; width]);
        let dark = setup.dark_grey.unwrap_or(f64::NEG_INFINITY) as f32;
        let glare = if setup.glare_grey.is_some() { GLARE } else { 0 };
        let lost = glare | if setup.shadow { SHADOWED } else { 0 };
        Self { setup, noise, row, fresh, baseline, dark, lost }
    }

    /// Measures a row whose true distances are `z` (m; 0 where there is none, which stays less than half a count).
    fn measure(&mut self, z: &[f32], row: usize, grey: &[f32]) {
        let setup = self.setup;
        self.row.copy_from_slice(z);
        if setup.edge_bias_m != 0.0 || setup.edge_pull_m != 0.0 {
            self.add_edges(row, grey);
        }
        let nearer = 1.0 / setup.reference_m as f32;
        if setup.noise_m > 0.0 {
            self.add_noise(z, row, nearer);
        }
        if setup.step_m > 0.0 {
            for (measured, z) in self.row.iter_mut().zip(z) {
                // Where there is nothing, the step is 0 and what is measured no number.
                let step = setup.step_m as f32 * (z * nearer) * (z * nearer);
                *measured = rounded(*measured / step) * step;
            }
        }
        let per_metre = (1.0 / setup.unit_m) as f32;
        for (measured, z) in self.row.iter_mut().zip(z) {
            *measured = if *z > 0.0 { *measured * per_metre } else { 0.0 };
        }
    }

    fn add_edges(&mut self, row: usize, grey: &[f32]) {
        let width = self.row.len();
        let line = |row: usize| &grey[row * width..(row + 1) * width];
        let last = grey.len() / width - 1;
        let (above, here, below) = (line(row.saturating_sub(1)), line(row), line((row + 1).min(last)));
        let (bias, pull) = (self.setup.edge_bias_m as f32, self.setup.edge_pull_m as f32);
        let [bx, by] = self.baseline;
        // Differences over two pixels, per 100 grey levels; the first and last column have none along the row.
        let error = |left: f32, right: f32, above: f32, below: f32| {
            let along = 0.005 * (right.min(255.0) - left.min(255.0));
            let down = 0.005 * (below.min(255.0) - above.min(255.0));
            bias * (along * bx + down * by) - pull * (along * along + down * down).sqrt()
        };
        let sides = here[..width - 2].iter().zip(&here[2..]);
        let levels = sides.zip(above[1..].iter().zip(&below[1..]));
        for (measured, ((&left, &right), (&above, &below))) in self.row[1..].iter_mut().zip(levels) {
            *measured += error(left, right, above, below);
        }
        for column in [0, width - 1] {
            self.row[column] += error(here[column], here[column], above[column], below[column]);
        }
    }

    fn add_noise(&mut self, z: &[f32], row: usize, nearer: f32) {
        let (setup, width) = (self.setup, z.len());
        let [own, common] =
            [1.0 - setup.fixed_share, setup.fixed_share].map(|s| (s.sqrt() * setup.noise_m) as f32);
        self.noise.normal.fill(&mut self.noise.fresh, &mut self.fresh);
        for ((measured, z), noise) in self.row.iter_mut().zip(z).zip(&self.fresh) {
            *measured += own * noise * (z * nearer) * (z * nearer);
        }
        if let Some(fixed) = self.noise.fixed.get(row * width..(row + 1) * width) {
            for ((measured, z), noise) in self.row.iter_mut().zip(z).zip(fixed) {
                *measured += common * noise * (z * nearer) * (z * nearer);
            }
        }
    }
}

/// To the nearest whole number, for magnitudes below 2²².
fn rounded(x: f32) -> f32 {
    (x + 12_582_912.0) - 12_582_912.0
}

#[cfg(test)]
mod tests {
    use super::super::noise::{Use, stream};
    use super::*;

    fn flat(z: f32, side: usize) -> Picture {
        let mut picture = Picture::default();
        picture.clear(side, side);
        picture.nearness.fill(1.0 / z);
        picture
    }

    fn measured(setup: &DepthSetup, picture: &Picture, grey: &[f32], frame: u32) -> Vec<u16> {
        let mut normal = Normal::new();
        let mut fixed = vec![0.0; grey.len()];
        normal.fill(&mut stream(5, 0, Use::FixedDepth), &mut fixed);
        let noise = DepthNoise {
            normal: &mut normal,
            fresh: stream(5, frame, Use::Depth),
            fixed: &fixed,
            holes: stream(5, frame, Use::Holes),
        };
        let mut counts = vec![1; grey.len()];
        measure(setup, picture, grey, noise, &mut counts);
        counts
    }

    /// Standard deviation at twice the reference distance: four times that at the reference. Estimates from 40,000 pixels: 0.35 %.
    #[test]
    fn noise_grows_with_the_square_of_the_distance() {
        let side = 200;
        let setup = DepthSetup { unit_m: 1e-6, noise_m: 2e-4, fixed_share: 0.25, ..DepthSetup::exact() };
        let grey = vec![100.0; side * side];
        let mut near: Vec<Vec<f64>> = Vec::new();
        for (z, frame, expected) in [(0.05, 0, 2e-6), (0.5e-1, 1, 2e-6), (0.06, 2, 2.88e-6)] {
            let error: Vec<f64> = measured(&setup, &flat(z, side), &grey, frame)
                .iter()
                .map(|&c| f64::from(c) * 1e-6 - f64::from(z))
                .collect();
            let variance = error.iter().map(|e| e * e).sum::<f64>() / error.len() as f64;
            let expected: f64 = expected * expected + 1e-12 / 12.0;
            assert!((variance / expected - 1.0).abs() < 0.03, "{variance} for {expected}");
            near.push(error);
        }
        let common: f64 = near[0].iter().zip(&near[1]).map(|(a, b)| a * b).sum::<f64>() / 40_000.0;
        // A quarter of the variance is common to frames 0 and 1; its estimate has a standard deviation of 0.5 %.
        assert!((common / 4e-12 - 0.25).abs() < 0.03, "{common}");
    }

    #[test]
    fn faults_do_what_they_say() {
        let side = 100;
        let mut picture = flat(0.5, side);
        let ramp: Vec<f32> = (0..side * side).map(|p| 10.0 + 2.0 * (p % side) as f32).collect();
        let exact = measured(&DepthSetup::exact(), &picture, &ramp, 0);
        assert!(exact.iter().all(|&c| c == 5000));
        let biased = DepthSetup { edge_bias_m: 0.05, edge_pull_m: 0.02, ..DepthSetup::exact() };
        // 2 grey levels a pixel: (0.05 − 0.02) · 0.02 m = 0.6 mm.
        assert_eq!(measured(&biased, &picture, &ramp, 0)[50 * side + 50], 5006);
        let stepped = DepthSetup { step_m: 7e-4, ..DepthSetup::exact() };
        // 0.5 m are 714.3 steps.
        assert_eq!(measured(&stepped, &picture, &ramp, 0)[0], 4998);
        let dark = DepthSetup { dark_grey: Some(30.0), ..DepthSetup::exact() };
        assert_eq!(measured(&dark, &picture, &ramp, 0)[..12], [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 5000, 5000]);
        let white = vec![255.0; side * side];
        let saturated = DepthSetup { saturated_share: 0.3, ..DepthSetup::exact() };
        let holes = measured(&saturated, &picture, &white, 0).iter().filter(|&&c| c == 0).count();
        assert!((2800..3200).contains(&holes), "{holes}");
        picture.marks[7] = SHADOWED;
        picture.marks[8] = GLARE;
        picture.nearness[20 * side + 20] = 1.0 / 0.45;
        assert_eq!(measured(&DepthSetup::exact(), &picture, &ramp, 0)[7], 5000);
        let holes =
            DepthSetup { shadow: true, glare_grey: Some(60.0), jump_m: Some(0.01), ..DepthSetup::exact() };
        let counts = measured(&holes, &picture, &ramp, 0);
        let empty: Vec<usize> = (0..counts.len()).filter(|&p| counts[p] == 0).collect();
        let at = 20 * side + 20;
        assert_eq!(empty, [7, 8, at - side, at - 1, at, at + 1, at + side]);
    }
}
