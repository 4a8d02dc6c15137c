//! What pixels on outlines show: the share of each thing that they see, from sixteen places within each of them.

use super::raster::{GEL, OUTLINE, PLATE, Picture, SOLID, View};
use super::surface::NONE;
use crate::geometry::Vec3;

/// Places along each side of a pixel.
const ALONG: usize = 4;
/// Pixels that are looked at together.
const CHUNK: usize = 32;

/// A place in square (i, j) of n × n in a pixel, from the pixel's centre (px). No two squares in a row or column have it at the same height:
/// an outline along either is resolved to 1/n² px.
pub(super) fn staggered([i, j]: [usize; 2], n: usize) -> [f64; 2] {
    let within = |k: usize| (k as f64 + 0.5) / n as f64;
    [(i as f64 + within(j)) / n as f64 - 0.5, (j as f64 + within(i)) / n as f64 - 0.5]
}

/// Triangles that may be seen from within a pixel.
struct Candidates {
    of: [u32; 9],
    count: usize,
}

impl View<'_> {
    /// Which thing a place in the picture sees, given by its ray and the triangles and solids that may be there; solids from the camera's
    /// eye (m).
    fn class_at(&self, ray: [f64; 2], candidates: &Candidates, solids: u16, eye: &Vec3) -> u8 {
        let (mut class, mut nearness) = (PLATE, 0.0);
        for &triangle in &candidates.of[..candidates.count] {
            let weights = self.placed.weights(triangle, ray);
            if weights.iter().all(|&w| w >= 0.0) {
                (class, nearness) = (GEL, weights.iter().sum::<f64>().max(nearness));
            }
        }
        if solids != 0
            && let Some((near, solid)) = self.solid_at(ray, eye, solids)
            && near > nearness
        {
            class = SOLID + solid;
        }
        class
    }

    /// The nearest along a ray of those solids whose bit is set: 1/z (1/m) and its index.
    pub(super) fn solid_at(&self, ray: [f64; 2], eye: &Vec3, among: u16) -> Option<(f64, u8)> {
        let along = self.camera.pose.rotation.inverse() * Vec3::new(ray[0], ray[1], 1.0);
        let hits = self.placed.solids.iter().zip(0_u8..).filter(|(_, index)| among >> index & 1 == 1);
        let hits = hits.filter_map(|(solid, index)| solid.hit(eye, &along).map(|(z, _)| (1.0 / z, index)));
        hits.max_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// Marks the pixels on both sides of every outline and gives them the mean of what they see.
    pub(super) fn smooth_outlines(&self, picture: &mut Picture) {
        let pixels = outlines(picture);
        let eye = self.camera.eye();
        let mixed: Vec<f32> = pixels.iter().map(|&p| self.mixed(p, picture, &eye)).collect();
        for (&pixel, value) in pixels.iter().zip(mixed) {
            picture.radiance[pixel] = value;
            picture.marks[pixel] |= OUTLINE;
        }
    }

    fn mixed(&self, pixel: usize, picture: &Picture, eye: &Vec3) -> f32 {
        let (row, column) = (pixel / picture.width, pixel % picture.width);
        let mut candidates = Candidates { of: [NONE; 9], count: 0 };
        // Sum of radiances and number of pixels around, by class.
        let mut around = [(0.0_f32, 0_u8); 16];
        for r in row.saturating_sub(1)..(row + 2).min(picture.height) {
            for c in column.saturating_sub(1)..(column + 2).min(picture.width) {
                let at = r * picture.width + c;
                let known = &mut around[usize::from(picture.class[at] & 15)];
                *known = (known.0 + picture.radiance[at], known.1 + 1);
                let triangle = picture.triangle[at];
                if triangle != NONE && !candidates.of[..candidates.count].contains(&triangle) {
                    candidates.of[candidates.count] = triangle;
                    candidates.count += 1;
                }
            }
        }
        // Only solids that are around are looked for.
        let known = around[usize::from(SOLID)..].iter().zip(0..);
        let solids = known.map(|(seen, index)| u16::from(seen.1 > 0) << index).sum();
        let centre = [f64::from(self.rays.x[pixel]), f64::from(self.rays.y[pixel])];
        let Some(slope) = self.camera.lens.ray_slope(centre) else {
            return picture.radiance[pixel];
        };
        let mut sum = 0.0;
        for j in 0..ALONG {
            for i in 0..ALONG {
                let off = staggered([i, j], ALONG);
                let ray = [0, 1].map(|a| centre[a] + slope[a][0] * off[0] + slope[a][1] * off[1]);
                let seen = around[usize::from(self.class_at(ray, &candidates, solids, eye) & 15)];
                // A gap between triangles that no centre around sees counts as the pixel's own.
                sum += if seen.1 == 0 { picture.radiance[pixel] } else { seen.0 / f32::from(seen.1) };
            }
        }
        sum / (ALONG * ALONG) as f32
    }
}

/// Pixels with a neighbour in row or column of another class, ascending.
fn outlines(picture: &Picture) -> Vec<usize> {
    let (width, height, class) = (picture.width, picture.height, &picture.class);
    let mut found = Vec::new();
    for row in 0..height {
        let start = row * width;
        let here = &class[start..start + width];
        let above = if row > 0 { &class[start - width..start] } else { here };
        let below = if row + 1 < height { &class[start + width..start + 2 * width] } else { here };
        for from in (0..width).step_by(CHUNK) {
            let to = (from + CHUNK).min(width);
            let (wide_from, wide_to) = (from.saturating_sub(1), (to + 1).min(width));
            let even = here[wide_from..wide_to].iter().all(|&k| k == here[from]);
            if even && here[from..to] == above[from..to] && here[from..to] == below[from..to] {
                continue;
            }
            for column in from..to {
                let k = here[column];
                let beside = [column.saturating_sub(1), (column + 1).min(width - 1)].map(|c| here[c]);
                if [above[column], below[column], beside[0], beside[1]].iter().any(|&other| other != k) {
                    found.push(start + column);
                }
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outlines_are_found_everywhere() {
        let mut picture = Picture::default();
        picture.clear(100, 20);
        for row in 5..9 {
            picture.class[row * 100 + 31..row * 100 + 70].fill(GEL);
        }
        let brute: Vec<usize> = (0..2000)
            .filter(|&p| {
                let (r, c) = (p / 100, p % 100);
                let other = |r: usize, c: usize| picture.class[r * 100 + c] != picture.class[p];
                (r > 0 && other(r - 1, c))
                    || (r < 19 && other(r + 1, c))
                    || (c > 0 && other(r, c - 1))
                    || (c < 99 && other(r, c + 1))
            })
            .collect();
        assert_eq!(outlines(&picture), brute);
    }
}
